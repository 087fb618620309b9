"""Runs of the workflow that are killed at random moments and resumed, over and over."""

import os
import random
import shutil
import signal
import subprocess
import time
from collections import Counter
from pathlib import Path

import psutil
from runs import digests, snakemake, start

VICTIMS = ("run", "run", "snakemake", "server", "job")  # all processes at once twice as often


def reference(folder: Path, config: dict, patience: float = 280) -> tuple[dict[str, str], float]:
    """The results of an undisturbed run, and its seconds."""
    begin = time.monotonic()
    run = snakemake(folder, config=config, timeout=patience)
    assert run.returncode == 0, run.stdout + run.stderr
    return digests(folder / config["results"]), time.monotonic() - begin


def disturb(
    folder: Path,
    config: dict,
    expected: dict[str, str],
    seconds: float,
    kills: int,
    seed: int = 0,
    patience: float = 600,
):
    """Kill and resume until so many kills are done, and let the last run end.

    After each kill every result that has its name must be whole, and every process of the run be gone.
    Whenever a run gets to its end, all results must be those expected; they are then removed, to begin again.

    Returns
    -------
    Counter
        Kills by victim, ``finished`` runs, and ``forgotten``: kills after which .snakemake was removed, too.
    """
    chance, counts, done = random.Random(seed), Counter(), 0
    results, partial = folder / config["results"], False
    while True:
        shutil.rmtree(folder / ".snakemake/locks", ignore_errors=True)  # what --unlock does, in less time
        whole, begin = not results.exists(), time.monotonic()
        process = start(folder, config=config)
        victim = None
        if done < kills:
            try:
                process.wait(chance.uniform(0, seconds))
            except subprocess.TimeoutExpired:
                victim = kill(process, chance)
        status = process.wait(patience)
        if victim:
            done += 1
            counts[victim] += 1
            # a run that got to its end without some meshes has a summary of the others
            partial = partial or victim in ("server", "job")
            if victim in ("run", "snakemake"):
                gone(process.pid)
            for name, digest in digests(results).items():
                if partial and name.startswith("evaluation/"):
                    continue
                assert digest == expected[name], f"{name} is wrong after a kill of {victim}"
            if chance.random() < 0.1:
                shutil.rmtree(folder / ".snakemake", ignore_errors=True)  # the kill may have come before it
                counts["forgotten"] += 1
        elif status != 0:
            raise AssertionError((folder / "run.log").read_text()[-3000:])
        else:
            counts["finished"] += 1
            if whole:  # a machine that is less busy than it was gets to the end before most kills
                seconds = min(seconds, time.monotonic() - begin)
            assert digests(results) == expected
            assert not list(results.rglob("*.part"))
            if done == kills:
                return counts
            shutil.rmtree(results)
            partial = False
            print(f"{done} of {kills} kills: {dict(counts)}", flush=True)


def kill(process: subprocess.Popen, chance: random.Random) -> str | None:
    """Kill -9 a victim; None if there is none, since the run has just ended or not yet begun its jobs."""
    victim = chance.choice(VICTIMS)
    try:
        servers = psutil.Process(process.pid).children()
        jobs = [job for server in servers for job in server.children()]
        if victim == "run":
            os.killpg(process.pid, signal.SIGKILL)
        elif victim == "snakemake" or not servers or (victim == "job" and not jobs):
            victim = "snakemake"
            process.kill()
        elif victim == "server":
            chance.choice(servers).kill()
        else:
            chance.choice(jobs).kill()
    except (psutil.NoSuchProcess, ProcessLookupError):
        return None if process.poll() == 0 else victim
    return victim


def gone(session: int, patience: float = 10) -> None:
    """Wait until no process of a session is left; fail if that does not come soon."""
    end = time.monotonic() + patience
    while left := [p.info for p in psutil.process_iter(["pid", "cmdline"]) if _session(p.pid) == session]:
        assert time.monotonic() < end, f"processes outlive their run: {left}"
        time.sleep(0.05)


def _session(pid: int) -> int | None:
    try:
        return None if psutil.Process(pid).status() == psutil.STATUS_ZOMBIE else os.getsid(pid)
    except (psutil.NoSuchProcess, ProcessLookupError):
        return None
