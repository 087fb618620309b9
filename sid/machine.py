"""The memory of the machine that a job runs on."""

import os
from pathlib import Path

LIMITS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")  # of a container


def memory(asked: int | None = None) -> int:
    """Bytes of memory that processes here may use in all: the machine's, a container's or SLURM's, the least.

    Parameters
    ----------
    asked : int, optional
        What this job has asked its cluster for; it counts within a step of a SLURM job only.

    Returns
    -------
    int

    Examples
    --------
    >>> 0 < memory(asked=2**30) <= memory()
    True
    """
    limits = [os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")]
    if "SLURM_MEM_PER_NODE" in os.environ:
        limits.append(int(os.environ["SLURM_MEM_PER_NODE"]) * 2**20)
    if asked is not None and "SLURM_STEP_ID" in os.environ:
        limits.append(asked)
    for path in LIMITS:
        try:
            limits.append(int(Path(path).read_text()))
        except (OSError, ValueError):  # there is none, or it says "max"
            continue
    return min(limits)
