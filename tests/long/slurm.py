"""The workflow through a real SLURM, made here and taken down again; needs root.

apt-get install slurm-wlm munge
pip install snakemake-executor-plugin-slurm
python tests/long/slurm.py                                       two meshes, each a job
python tests/long/slurm.py --tori 100 --a-job 50                 those of benchmarks/thousand.py
python tests/long/slurm.py --tori 100 --a-job 25 --nodes 2 --kill   and the second node dies
"""

import argparse
import os
import pwd
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "workflow"))
sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

import thousand
import yaml
from runs import digests, project, small_meshes, snakemake

PLACE = Path("/etc/slurm/slurm.conf")
CONFIGURATION = """
ClusterName=here
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
JobAcctGatherType=jobacct_gather/linux
JobAcctGatherParams=UsePss,OverMemoryKill
JobAcctGatherFrequency=2
MpiDefault=none
ReturnToService=2
SlurmdTimeout=15
SlurmdParameters=config_overrides
SlurmctldPort={port}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool.%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.%n.log
SchedulerParameters=sched_interval=1,batch_sched_delay=1
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""
NODE = "NodeName={name} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs={cores} RealMemory={memory}\n"


@contextmanager
def processor_time():
    """Yields what tells the seconds of processor of all that this process has started, also of daemons."""
    places = ("/sys/fs/cgroup/cpuacct", "/sys/fs/cgroup")  # of the first and of the second version
    place = next(Path(place) for place in places if Path(place, "cgroup.procs").exists())
    group = place / f"test-slurm-{os.getpid()}"
    group.mkdir()
    (group / "cgroup.procs").write_text(str(os.getpid()))

    def seconds() -> float:
        if place.name == "cpuacct":
            return int((group / "cpuacct.usage").read_text()) / 1e9
        return int(re.findall(r"usage_usec (\d+)", (group / "cpu.stat").read_text())[0]) / 1e6

    try:
        yield seconds
    finally:
        (place / "cgroup.procs").write_text(str(os.getpid()))
        with suppress(OSError):  # something is still in it
            group.rmdir()


def free_ports(number: int) -> list[int]:
    """Ports that nothing listens at."""
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(number)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]


@contextmanager
def cluster(folder: Path, nodes: int, cores: int):
    """A SLURM on this machine; its daemons end with the block.

    Each node is a namespace of processes: when its first one is killed, all that ran there is gone.

    Yields
    ------
    list of subprocess.Popen
        The nodes.
    """
    for name in ("state", "munge"):
        (folder / name).mkdir()
    user = pwd.getpwnam("munge")
    folder.chmod(0o755)
    os.chown(folder / "munge", user.pw_uid, user.pw_gid)
    key = folder / "munge/key"
    key.write_bytes(os.urandom(128))
    key.chmod(0o400)
    os.chown(key, user.pw_uid, user.pw_gid)
    (folder / "munge").chmod(0o755)
    memory = (os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2**20 - 500) // nodes
    port, *ports = free_ports(nodes + 1)
    host = socket.gethostname().split(".")[0]
    names = [f"node{number}" for number in range(1, nodes + 1)]
    lines = [
        NODE.format(name=name, host=host, port=port, cores=cores, memory=memory)
        for name, port in zip(names, ports, strict=True)
    ]
    conf = folder / "slurm.conf"
    conf.write_text(CONFIGURATION.format(folder=folder, host=host, port=port) + "".join(lines))
    PLACE.parent.mkdir(exist_ok=True)
    PLACE.symlink_to(conf)  # jobs of the plugin are told of no other place
    munge = [f"--socket={folder}/munge/socket", f"--key-file={key}"]
    munge += [f"--{kind}-file={folder}/munge/{kind}" for kind in ("pid", "seed", "log")]
    apart = ["unshare", "--pid", "--fork", "--kill-child", "--mount-proc"]
    daemons = []

    def start(name, command, **options):
        with (folder / f"{name}.words").open("w") as words:
            daemons.append(subprocess.Popen(command, stdout=words, stderr=words, **options))

    def idle():
        words = subprocess.run(["sinfo", "-h", "-N", "-o", "%T"], capture_output=True, text=True).stdout
        return words.split() == ["idle"] * nodes

    try:
        start("munged", ["munged", "--foreground", *munge], user="munge", group=user.pw_gid)
        time.sleep(2)
        start("slurmctld", ["slurmctld", "-D", "-f", str(conf)])
        time.sleep(2)
        for name in names:
            start(name, [*apart, "slurmd", "-D", "-N", name, "-f", str(conf)])
        for _ in range(60):
            if idle():
                break
            time.sleep(1)
        else:
            for words in sorted(folder.glob("*.words")):
                print(words.name, words.read_text()[-2000:], file=sys.stderr)
            raise SystemExit("the nodes do not become idle")
        yield daemons[2:]
    finally:
        PLACE.unlink()
        for daemon in reversed(daemons):
            if daemon.poll() is None:
                daemon.send_signal(signal.SIGKILL if daemon in daemons[2:] else signal.SIGTERM)
                daemon.wait(30)


def kill_in_the_middle(node: subprocess.Popen, results: Path, after: int, run: subprocess.Popen) -> None:
    """Kill a node when so many results are there and it works."""
    while run.poll() is None:
        work = subprocess.run(
            ["squeue", "-h", "-w", "node2", "-t", "RUNNING"], capture_output=True, text=True
        )
        if work.stdout.strip() and len(list(results.glob("*/irregularity.csv"))) >= after:
            node.kill()
            print(f"node2 killed, {len(list(results.glob('*/points/*.csv')))} tables of points done")
            return
        time.sleep(0.2)
    raise SystemExit("the run was over before a node could be killed")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--meshes", type=int, default=2, help="small ones, all stages")
    parser.add_argument("--tori", type=int, default=0, help="those of benchmarks/thousand.py, points alone")
    parser.add_argument(
        "--k", type=int, default=300, help="eigenpairs of the tori; fewer leave less work beside the rest"
    )
    parser.add_argument("--a-job", type=int, default=1, help="meshes that are one job")
    parser.add_argument("--cores", type=int, default=2, help="that a job may ask for")
    parser.add_argument("--nodes", type=int, default=1)
    parser.add_argument("--node-cores", type=int, default=2, help="that SLURM is told a node has")
    parser.add_argument("--kill", action="store_true", help="the second node, in the middle")
    parser.add_argument("--broken", action="store_true", help="one of the meshes is none")
    parser.add_argument("--starved", action="store_true", help="jobs ask for too little memory at first")
    parser.add_argument("--ungrouped", action="store_true", help="each stage a job of its own")
    parser.add_argument("--plain", action="store_true", help="by the executor slurm, as Snakemake comes")
    parser.add_argument("--words", type=Path, help="file for all that Snakemake says")
    arguments = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended by SIGTERM"))  # the daemons end, too
    missing = [name for name in ("munged", "slurmctld", "slurmd", "sbatch") if not shutil.which(name)]
    if missing or os.geteuid() != 0:
        raise SystemExit(f"needs root and slurm-wlm and munge of Debian; missing: {', '.join(missing)}")
    if PLACE.exists() or PLACE.is_symlink():
        raise SystemExit(f"{PLACE} exists: this machine has a SLURM, which this test leaves alone")
    with tempfile.TemporaryDirectory() as scratch, processor_time() as used:
        Path(scratch).chmod(0o755)  # munged is another user
        (Path(scratch) / "project").mkdir()
        folder = project(Path(scratch) / "project")
        number = arguments.tori or arguments.meshes
        if arguments.tori:
            thousand.make(folder / "set", number)
            config, targets = {"meshes": "set", "spectrum": {"k": arguments.k}}, ["points"]
        else:
            small_meshes(folder, tuple(f"mesh{i}" for i in range(number)), level=3)
            config, targets = {"meshes": "set.tsv", "spectrum": {"k": 60}, "figures": {"pixels": 300}}, []
        if arguments.broken:
            mesh = sorted(folder.glob("set/*.ply" if arguments.tori else "mesh*.ply"))[number // 2]
            mesh.write_bytes(b"ply\nno mesh")
        begin, before = time.monotonic(), used()
        run = snakemake(folder, *targets, config={**config, "results": "here"}, timeout=7200)
        assert run.returncode == (1 if arguments.broken else 0), run.stderr[-4000:]
        local, local_used = time.monotonic() - begin, used() - before
        if arguments.starved:  # 60 eigenpairs of 642 vertices need more than twice as much
            requirements = folder / "config/resources.yaml"
            rows = yaml.safe_load(requirements.read_text())
            rows["stages"] = {stage: row | {"mb": 1, "bytes": 0} for stage, row in rows["stages"].items()}
            requirements.write_text(yaml.safe_dump(rows))
        profile = folder / "profiles/slurm/config.yaml"
        settings = yaml.safe_load(profile.read_text())
        if arguments.ungrouped:
            del settings["groups"], settings["group-components"]
        else:
            settings["group-components"] = {"mesh": arguments.a_job}
        settings["cores"] = arguments.cores
        name = "slurm-pool"
        if arguments.plain:
            name = settings["executor"] = "slurm"
            settings = {key: value for key, value in settings.items() if not key.startswith("slurm-pool-")}
        # a cluster without accounting: ask the queue how jobs are
        settings |= {f"{name}-status-command": "squeue", f"{name}-no-account": True, "latency-wait": 10}
        settings |= {f"{name}-init-seconds-before-status-checks": 2, "seconds-between-status-checks": 2}
        settings["default-resources"]["slurm_partition"] = "main"
        if arguments.starved:
            settings["default-resources"]["mem_mb"] = 1
            settings[f"{name}-disable-memory-fudge"] = True
        profile.write_text(yaml.safe_dump(settings))
        (Path(scratch) / "slurm").mkdir()
        overlay = folder / "cluster.yaml"
        overlay.write_text(yaml.safe_dump({**config, "results": "there"}))
        words = arguments.words or Path(scratch) / "words"
        with cluster(Path(scratch) / "slurm", arguments.nodes, arguments.node_cores) as nodes:
            begin, before = time.monotonic(), used()
            command = [sys.executable, "-m", "snakemake", *targets, "--workflow-profile", "profiles/slurm"]
            command += ["--configfile", str(overlay)]
            with words.open("w") as file:
                run = subprocess.Popen(command, cwd=folder, stdout=file, stderr=file)
            try:
                if arguments.kill:
                    kill_in_the_middle(nodes[1], folder / "there", number // 4, run)
                _, status, own = os.wait4(run.pid, 0)
                run.returncode = os.waitstatus_to_exitcode(status)
            finally:
                run.kill()
            seconds, cluster_used = time.monotonic() - begin, used() - before
        text = words.read_text()
        if run.returncode != (1 if arguments.broken else 0):
            logs = [path.read_text()[-3000:] for path in (folder / ".snakemake/slurm_logs").rglob("*.log")]
            raise SystemExit("\n".join([text[-6000:], *logs[:3]]))
        submitted = text.count("has been submitted with SLURM jobid")
        for line in sorted(set(re.findall(r"^Trying to restart.*|.*node failure.*", text, re.MULTILINE))):
            print(line)
        print(f"{submitted} jobs of SLURM, load {os.getloadavg()[0]:.1f}; a mesh:")
        print(f"with SLURM {seconds / number:.2f} s of the clock, {cluster_used / number:.2f} s of processor")
        print(f"of it {(own.ru_utime + own.ru_stime) / number:.3f} s in the process that submits")
        print(f"without {local / number:.2f} s of the clock, {local_used / number:.2f} s of processor")
        here, there = digests(folder / "here"), digests(folder / "there")
        assert here == there, [name for name in here if here[name] != there.get(name)]
        print(f"{len(there)} files, the same bytes as without SLURM")
        if arguments.broken:
            print((folder / "there/failures.csv").read_text())
