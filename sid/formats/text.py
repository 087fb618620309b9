"""Lines and numbers of text files, whatever their encoding and line ends."""

import numpy as np

from sid.errors import InputError

UTF8_MARK = b"\xef\xbb\xbf"


def lines_of(content: bytes) -> list[bytes]:
    r"""Lines of a text; only \n, \r\n and \r end a line.

    `str.splitlines` would end one at a form feed and at the byte 0x85 too, which is part of many letters.

    Parameters
    ----------
    content : bytes
        A byte order mark of UTF-8 in front is dropped.

    Returns
    -------
    list of bytes

    Raises
    ------
    InputError
        If it is UTF-16 or binary.

    Examples
    --------
    >>> lines_of(b"v 1\x852\r\nf 3")
    [b'v 1\x852', b'f 3']
    """
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputError("it is text in UTF-16; save it as UTF-8")
    if b"\0" in content:
        raise InputError(
            "it holds zero bytes, which no text has; it is damaged or of another kind, export it again"
        )
    return content.removeprefix(UTF8_MARK).splitlines()


def number(word: bytes) -> float:
    """A floating-point number; underscores, which Python allows, are refused.

    Raises
    ------
    ValueError
    """
    if b"_" in word:
        raise ValueError(f"{word!r} is no number")
    return float(word)


def integer(word: bytes) -> int:
    """A whole number that fits into 64 bits.

    Raises
    ------
    ValueError
    """
    value = int(word)
    if b"_" in word or not -(2**63) <= value < 2**63:
        raise ValueError(f"{word!r} is no whole number")
    return value


def numbers(words: list[bytes], dtype: np.dtype) -> np.ndarray:
    """Words as numbers of a type.

    Raises
    ------
    InputError
        If one is no number of the type.
    """
    read = number if dtype.kind == "f" else integer
    try:
        return np.array([read(word) for word in words], dtype)
    except (ValueError, OverflowError):
        for word in words:
            try:
                np.array(read(word), dtype)
            except (ValueError, OverflowError):
                found = word[:30].decode("latin-1")
                raise InputError(
                    f"{found!r} stands where a number of type {dtype.name} should; export it again"
                ) from None
        raise
