"""The workflow through a real SLURM of one node, made here and taken down again; needs root.

apt-get install slurm-wlm munge
pip install snakemake-executor-plugin-slurm
python tests/long/slurm.py
"""

import argparse
import os
import pwd
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "workflow"))
sys.path.insert(0, str(Path(__file__).parents[1]))

import yaml
from runs import digests, project, small_meshes, snakemake

PLACE = Path("/etc/slurm/slurm.conf")
CONFIGURATION = """
ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
AuthInfo=socket={folder}/munge/socket
AuthType=auth/munge
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
ReturnToService=2
SlurmdParameters=config_overrides
SlurmctldPort={port}
SlurmdPort={slurmd_port}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
SchedulerParameters=sched_interval=1,batch_sched_delay=1
NodeName=one NodeHostname={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory={memory} State=UNKNOWN
PartitionName=main Nodes=one Default=YES MaxTime=INFINITE State=UP
"""


@contextmanager
def cluster(folder: Path, cores: int):
    """A SLURM of one node; its daemons end with the block."""
    for name in ("state", "spool", "munge"):
        (folder / name).mkdir()
    user = pwd.getpwnam("munge")
    folder.chmod(0o755)
    os.chown(folder / "munge", user.pw_uid, user.pw_gid)
    key = folder / "munge/key"
    key.write_bytes(os.urandom(128))
    key.chmod(0o400)
    os.chown(key, user.pw_uid, user.pw_gid)
    (folder / "munge").chmod(0o755)
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2**20 - 500
    with socket.socket() as a, socket.socket() as b:  # two free ports
        a.bind(("127.0.0.1", 0))
        b.bind(("127.0.0.1", 0))
        ports = {"port": a.getsockname()[1], "slurmd_port": b.getsockname()[1]}
    host = socket.gethostname().split(".")[0]
    conf = folder / "slurm.conf"
    conf.write_text(CONFIGURATION.format(folder=folder, host=host, cores=cores, memory=memory, **ports))
    PLACE.symlink_to(conf)  # jobs of the plugin are told of no other place
    munge = [f"--socket={folder}/munge/socket", f"--key-file={key}"]
    munge += [f"--{kind}-file={folder}/munge/{kind}" for kind in ("pid", "seed", "log")]
    daemons = []
    try:
        for command, options in (
            (["munged", "--foreground", *munge], {"user": "munge", "group": user.pw_gid}),
            (["slurmctld", "-D", "-f", str(conf)], {}),
            (["slurmd", "-D", "-N", "one", "-f", str(conf)], {}),
        ):
            with (folder / f"{command[0]}.words").open("w") as words:
                daemons.append(subprocess.Popen(command, stdout=words, stderr=words, **options))
            time.sleep(2)
        for _ in range(60):
            state = subprocess.run(["sinfo", "-h", "-o", "%T"], capture_output=True, text=True).stdout.strip()
            if state in ("idle", "mixed"):
                break
            time.sleep(1)
        else:
            for words in sorted(folder.glob("*.words")):
                print(words.name, words.read_text()[-2000:], file=sys.stderr)
            raise SystemExit(f"the node is {state or 'not there'}, not idle")
        yield
    finally:
        PLACE.unlink()
        for daemon in reversed(daemons):
            daemon.send_signal(signal.SIGTERM)
            daemon.wait(30)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--meshes", type=int, default=2)
    parser.add_argument("--node-cores", type=int, default=8, help="that SLURM is told the node has")
    parser.add_argument("--starved", action="store_true", help="jobs ask for too little memory at first")
    parser.add_argument("--ungrouped", action="store_true", help="each stage a job of its own")
    arguments = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended by SIGTERM"))  # the daemons end, too
    missing = [name for name in ("munged", "slurmctld", "slurmd", "sbatch") if not shutil.which(name)]
    if missing or os.geteuid() != 0:
        raise SystemExit(f"needs root and slurm-wlm and munge of Debian; missing: {', '.join(missing)}")
    if PLACE.exists() or PLACE.is_symlink():
        raise SystemExit(f"{PLACE} exists: this machine has a SLURM, which this test leaves alone")
    with tempfile.TemporaryDirectory() as scratch:
        Path(scratch).chmod(0o755)  # munged is another user
        (Path(scratch) / "project").mkdir()
        folder = project(Path(scratch) / "project")
        names = tuple(f"mesh{i}" for i in range(arguments.meshes))
        small_meshes(folder, names, level=3)
        config = {"meshes": "set.tsv", "results": "here", "spectrum": {"k": 60}, "figures": {"pixels": 300}}
        assert snakemake(folder, config=config).returncode == 0
        if arguments.starved:  # 60 eigenpairs of 642 vertices need more than twice as much
            requirements = folder / "config/resources.yaml"
            rows = yaml.safe_load(requirements.read_text())
            rows["stages"] = {stage: row | {"mb": 1, "bytes": 0} for stage, row in rows["stages"].items()}
            requirements.write_text(yaml.safe_dump(rows))
        profile = folder / "profiles/slurm/config.yaml"
        settings = yaml.safe_load(profile.read_text())
        if arguments.ungrouped:
            del settings["groups"], settings["group-components"]
        # a cluster without accounting: ask the queue how jobs are
        settings |= {"slurm-status-command": "squeue", "slurm-no-account": True, "latency-wait": 10}
        settings |= {"slurm-init-seconds-before-status-checks": 2, "seconds-between-status-checks": 2}
        settings["default-resources"]["slurm_partition"] = "main"
        if arguments.starved:
            settings["default-resources"]["mem_mb"] = 1
            settings["slurm-disable-memory-fudge"] = True
        profile.write_text(yaml.safe_dump(settings))
        (Path(scratch) / "slurm").mkdir()
        overlay = folder / "cluster.yaml"
        overlay.write_text(yaml.safe_dump({**config, "results": "there"}))
        with cluster(Path(scratch) / "slurm", arguments.node_cores):
            begin = time.monotonic()
            command = [sys.executable, "-m", "snakemake", "--workflow-profile", "profiles/slurm"]
            command += ["--configfile", str(overlay)]
            run = subprocess.run(command, cwd=folder, capture_output=True, text=True)
            text = run.stdout + run.stderr
        if run.returncode:
            raise SystemExit(text[-6000:])
        submitted = text.count("has been submitted with SLURM jobid")
        for line in sorted({line for line in text.splitlines() if line.startswith("Trying to restart")}):
            print(line)
        print(f"{submitted} jobs of SLURM, {time.monotonic() - begin:.0f} s")
        here, there = digests(folder / "here"), digests(folder / "there")
        assert here == there, [name for name in here if here[name] != there.get(name)]
        print(f"{len(there)} files, the same bytes as without SLURM")
