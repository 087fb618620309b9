"""Hashes of the files that people give, by which a run knows whether one is still what it was."""

import json
import os
import time
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from sid.store.arrays import content_hash
from sid.store.atomic import replacing

RECENT = 2 * 10**9  # nanoseconds: the clock of a file system may not tell two changes within them apart


class FileHashes:
    """Hashes of files, kept so that a file that has not changed is read once.

    A file is read again where its size, its place on the disk, or the time of the last change of its content
    or its attributes is another. That time (``st_ctime``) is the system's own: no copy that keeps its date
    sets it back.

    Parameters
    ----------
    path : str or Path
        Where the hashes are kept, a JSON file; begun anew where it is missing or damaged.

    Examples
    --------
    >>> hashes = FileHashes("no_such_folder/hashes.json")
    >>> len(hashes.of(["example/creature.ply", "example/creature_marks.csv"]).split())
    2
    """

    def __init__(self, path: str | Path) -> None:
        self._path = Path(path)
        self._kept: dict[str, list] = {}
        with suppress(OSError, ValueError):
            kept = json.loads(self._path.read_bytes())
            if isinstance(kept, dict):
                self._kept = kept
        self._changed = False

    def of(self, paths: Iterable[str | Path]) -> str:
        """What stands in some files, as one hash.

        Parameters
        ----------
        paths : iterable of str or Path
            Those that cannot be read are passed over; whoever works with them says so.

        Returns
        -------
        str
            64 hexadecimal digits each, with spaces between them; empty without a file.

        Examples
        --------
        >>> hashes = FileHashes("no_such_folder/hashes.json")
        >>> hashes.of(["example/creature.ply"]) == content_hash(["example/creature.ply"])
        True
        >>> hashes.of(["no_such_mesh.ply"])
        ''
        """
        return " ".join(filter(None, map(self._hash, map(str, paths))))

    def keep(self) -> None:
        """Write what was read since; without a word if that cannot be, it only saves time.

        Examples
        --------
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     hashes = FileHashes(f"{folder}/hashes.json")
        ...     found = hashes.of(["example/creature.ply"])
        ...     hashes.keep()
        ...     FileHashes(f"{folder}/hashes.json").of(["example/creature.ply"]) == found
        True
        """
        if self._changed:
            with suppress(OSError), replacing(self._path) as part:
                part.write_text(json.dumps(self._kept), encoding="ascii")

    def _hash(self, path: str) -> str:
        try:
            state = _state(path)
            kept = self._kept.get(path)
            if isinstance(kept, list) and len(kept) == 2 and kept[0] == state:
                return str(kept[1])
            began = time.time_ns()
            found = content_hash([path])
            if state == _state(path) and began - max(state[2:]) > RECENT:
                self._kept[path] = [state, found]
                self._changed = True
            return found
        except OSError:
            return ""


def _state(path: str) -> list[int]:
    found = os.stat(path)
    return [found.st_size, found.st_ino, found.st_mtime_ns, found.st_ctime_ns]
