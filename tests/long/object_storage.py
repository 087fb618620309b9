"""Results in object storage: a server of S3's protocol, made here, and all tables compared with a local run.

pip install snakemake-storage-plugin-s3 "moto[server]"
python tests/long/object_storage.py
python tests/long/object_storage.py --endpoint http://127.0.0.1:9000 --key KEY --secret SECRET
"""

import argparse
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "workflow"))
sys.path.insert(0, str(Path(__file__).parents[1]))

import boto3
from runs import digests, project, small_meshes, snakemake

BUCKET = "sid-results"


@contextmanager
def server(folder: Path):
    """A server on this machine; yields its address."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with (folder / "server.log").open("w") as words:
        process = subprocess.Popen(
            [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)],
            stdout=words,
            stderr=words,
        )
    try:
        for _ in range(300):
            with socket.socket() as trial:
                if trial.connect_ex(("127.0.0.1", port)) == 0:
                    break
            time.sleep(0.2)
        yield f"http://127.0.0.1:{port}"
    finally:
        process.kill()
        process.wait()


def download(bucket, folder: Path) -> dict[str, str]:
    """Digests of all that is in the storage."""
    for item in bucket.objects.all():
        path = folder / item.key
        path.parent.mkdir(parents=True, exist_ok=True)
        bucket.download_file(item.key, str(path))
    return digests(folder / "out")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--meshes", type=int, default=2)
    parser.add_argument("--endpoint", help="a server that is there; otherwise one is started")
    parser.add_argument("--key", default="key")
    parser.add_argument("--secret", default="secret")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        scratch = Path(scratch)
        names = tuple(f"mesh{i}" for i in range(arguments.meshes))
        config = {"meshes": "set.tsv", "spectrum": {"k": 60}, "figures": {"pixels": 300}, "results": "out"}
        folders = {}
        for name in ("local", "first", "second"):
            (scratch / name).mkdir()
            folders[name] = project(scratch / name)
            small_meshes(folders[name], names)
        local = snakemake(folders["local"], config=config)
        assert local.returncode == 0, local.stderr[-3000:]
        here = digests(folders["local"] / "out")
        with server(scratch) as started:
            endpoint = arguments.endpoint or started
            keys = {"aws_access_key_id": arguments.key, "aws_secret_access_key": arguments.secret}
            bucket = boto3.resource("s3", endpoint_url=endpoint, region_name="us-east-1", **keys).Bucket(
                BUCKET
            )
            os.environ["SNAKEMAKE_STORAGE_S3_ACCESS_KEY"] = arguments.key
            os.environ["SNAKEMAKE_STORAGE_S3_SECRET_KEY"] = arguments.secret
            storage = ["--default-storage-provider", "s3", "--default-storage-prefix", f"s3://{BUCKET}"]
            storage += ["--storage-s3-endpoint-url", endpoint, "--storage-s3-region", "us-east-1"]
            begin = time.monotonic()
            run = snakemake(folders["first"], *storage, config=config, timeout=1800)
            assert run.returncode == 0, run.stdout[-3000:] + run.stderr[-6000:]
            seconds = time.monotonic() - begin
            there = download(bucket, scratch / "all")
            assert here == there, [name for name in here | there if here.get(name) != there.get(name)]
            print(f"{len(there)} files in the storage, the same bytes as of a local run, {seconds:.0f} s")
            left = [path for path in digests(folders["first"] / "out")]
            print(f"{len(left)} of them are also in the folder of the run: {left[:5]}")
            # another machine: results are in the storage alone
            run = snakemake(folders["second"], *storage, config=config, timeout=1800)
            assert "Nothing to be done" in run.stdout + run.stderr, run.stdout[-3000:] + run.stderr[-6000:]
            print("nothing to be done on another machine")
            # a setting is changed there: only what depends on it is made again
            changed = {**config, "selection": {"rings": 2}}
            run = snakemake(folders["second"], *storage, config=changed, timeout=1800)
            assert run.returncode == 0, run.stdout[-3000:] + run.stderr[-6000:]
            assert snakemake(folders["local"], config=changed).returncode == 0
            shutil.rmtree(scratch / "all")
            assert digests(folders["local"] / "out") == download(bucket, scratch / "all")
            print("the same after a change of settings on the other machine")
