"""Arrays as few bytes of text, which the page's `arrays.js` reads back."""

import base64
import zlib
from typing import Any

import numpy as np


class Arrays:
    """Arrays in one run of bytes. Each is described by an entry of a few words in the page's JSON.

    The first bytes of all numbers come first, then the second bytes, and so on: that compresses better than
    numbers one after the other.

    Examples
    --------
    >>> arrays = Arrays()
    >>> arrays.indices(np.array([5, 6, 4]))
    {'type': 'u4', 'at': 0, 'length': 3, 'delta': True}
    >>> arrays.size
    12
    """

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self.size = 0

    def exact(self, values: np.ndarray) -> dict[str, Any]:
        """Floats: in single precision where that loses no digit that a file of them holds, else double.

        Parameters
        ----------
        values : array of float

        Returns
        -------
        dict
            The entry.

        Examples
        --------
        >>> arrays = Arrays()
        >>> arrays.exact(np.array([0.5, 0.1]))["type"], arrays.exact(np.array([0.123456789012]))["type"]
        ('f4', 'f8')
        """
        doubles = np.asarray(values, dtype=np.float64).ravel()
        with np.errstate(over="ignore"):  # what is beyond single precision differs
            singles = doubles.astype(np.float32)
        return self._add(singles if _same_decimals(singles, doubles) else doubles)

    def single(self, values: np.ndarray) -> dict[str, Any]:
        """Floats in single precision.

        Parameters
        ----------
        values : array of float

        Returns
        -------
        dict
            The entry.

        Examples
        --------
        >>> Arrays().single(np.array([0.5, 0.25]))
        {'type': 'f4', 'at': 0, 'length': 2}
        """
        return self._add(np.asarray(values, dtype=np.float32).ravel())

    def rows(self, values: np.ndarray) -> list[dict[str, Any]]:
        """A scalar over a grid of times in 15 bits: of its logarithm where all values are positive.

        Each row is written as its difference to the row before, which it resembles.

        Parameters
        ----------
        values : (t, n) float

        Returns
        -------
        list of dict
            An entry for each row.

        Examples
        --------
        >>> entries = Arrays().rows(np.array([[0.0, 1.0, 2.0], [0.0, 2.0, 4.0]]))
        >>> [(entry["low"], entry["high"], entry["log"]) for entry in entries]
        [(0.0, 2.0, False), (0.0, 4.0, False)]
        """
        x = np.asarray(values, dtype=np.float64)
        logarithmic = bool((x > 0).all())
        if logarithmic:
            x = np.log(x)
        entries = []
        before = np.zeros(x.shape[1], dtype=np.int64)
        for row in x:
            low, high = float(row.min()), float(row.max())
            codes = np.round((row - low) / ((high - low) or 1.0) * 32767).astype(np.int64)
            change = (codes - before + 32768) % 65536 - 32768
            entries.append(self._add(_zigzag(change).astype(np.uint16), low=low, high=high, log=logarithmic))
            before = codes
        return entries

    def indices(self, values: np.ndarray) -> dict[str, Any]:
        """Non-negative integers below 2**31, as the difference of each to the one before.

        Parameters
        ----------
        values : array of int

        Returns
        -------
        dict
            The entry.

        Examples
        --------
        >>> Arrays().indices(np.array([5, 6, 4]))
        {'type': 'u4', 'at': 0, 'length': 3, 'delta': True}
        """
        change = np.diff(np.asarray(values, dtype=np.int64).ravel(), prepend=0)
        return self._add(_zigzag(change).astype(np.uint32), delta=True)

    def text(self) -> str:
        """All of them, compressed, as base64.

        Examples
        --------
        >>> arrays = Arrays()
        >>> _ = arrays.single(np.array([0.5]))
        >>> zlib.decompress(base64.b64decode(arrays.text())) == np.array(0.5, "<f4").tobytes()
        True
        """
        return compress(b"".join(self._parts))

    def _add(self, values: np.ndarray, **entry: Any) -> dict[str, Any]:
        little = np.ascontiguousarray(values.astype(values.dtype.newbyteorder("<"), copy=False))
        data = little.reshape(-1, 1).view(np.uint8).T.tobytes()
        entry = {"type": values.dtype.str[1:], "at": self.size, "length": int(values.size)} | entry
        self._parts.append(data)
        self.size += len(data)
        return entry


def compress(data: bytes) -> str:
    """Bytes as the base64 of their deflated form.

    Parameters
    ----------
    data : bytes

    Returns
    -------
    str

    Examples
    --------
    >>> len(compress(bytes(1000))) < 50
    True
    """
    return base64.b64encode(zlib.compress(data, 9)).decode("ascii")


def _zigzag(values: np.ndarray) -> np.ndarray:
    """Small numbers of either sign as small non-negative ones: 0, -1, 1, -2 become 0, 1, 2, 3."""
    return np.where(values < 0, -2 * values - 1, 2 * values)


def _same_decimals(singles: np.ndarray, doubles: np.ndarray) -> bool:
    """Whether single precision, printed with as few digits as tell it apart, reads as the double."""
    with np.errstate(over="ignore"):
        if np.array_equal(singles.astype(np.float64), doubles):
            return True
    some = slice(None, None, max(1, len(doubles) // 1000))  # most arrays that differ do so at once
    return all(
        np.array_equal(singles[part].astype("U").astype(np.float64), doubles[part])
        for part in (some, slice(None))
    )
