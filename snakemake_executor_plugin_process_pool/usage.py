"""What a script has used of time, memory and disk, measured by the process that runs it."""

import os
import resource
import sys
import time
from contextlib import suppress
from dataclasses import dataclass

MEGABYTE = 2**20


@dataclass(frozen=True)
class Usage:
    """What one run of a script has used.

    Parameters
    ----------
    seconds : float
        By the clock.
    processor : float
        Seconds of processor, of the process and of those that it waited for.
    memory : float
        The most memory that the process had at once, in MB. What it had before the script is part of it.
    address_space : float or None
        The most address space that it ever had, in MB; none where the system does not tell.
    read, written : float or None
        MB from and to the disk; none where the system does not tell.
    """

    seconds: float
    processor: float
    memory: float
    address_space: float | None
    read: float | None
    written: float | None


class Meter:
    """Measures from its making to `usage`."""

    def __init__(self):
        # Linux forgets the peak when told so: what an earlier script needed is not this one's
        with suppress(OSError), open("/proc/self/clear_refs", "w") as file:
            file.write("5")
        self._begin, self._processor, self._disk = time.monotonic(), _processor(), _disk()

    def usage(self) -> Usage:
        """What has been used so far."""
        read, written = (
            (now - before) / MEGABYTE if now is not None and before is not None else None
            for now, before in zip(_disk(), self._disk, strict=True)
        )
        return Usage(
            seconds=time.monotonic() - self._begin,
            processor=_processor() - self._processor,
            memory=peak() / MEGABYTE,
            address_space=_told_by("status", "VmPeak", 1024 / MEGABYTE),
            read=read,
            written=written,
        )


def peak() -> int:
    """The most memory, in bytes, that this process has had at once."""
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return used if sys.platform == "darwin" else used * 1024


def _processor() -> float:
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


def _disk() -> tuple[float | None, float | None]:
    return _told_by("io", "read_bytes"), _told_by("io", "write_bytes")


def _told_by(name: str, key: str, scale: float = 1) -> float | None:
    with suppress(OSError, ValueError), open(f"/proc/self/{name}") as file:
        for line in file:
            if line.startswith(f"{key}:"):
                return float(line.split()[1]) * scale
    return None
