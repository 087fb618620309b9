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

    Parameters
    ----------
    word : bytes

    Returns
    -------
    float

    Raises
    ------
    ValueError
        If it is none.

    Examples
    --------
    >>> number(b"-1.5e2")
    -150.0
    """
    if b"_" in word:
        raise ValueError(f"{word!r} is no number")
    return float(word)


def integer(word: bytes) -> int:
    """A whole number that fits into 64 bits.

    Parameters
    ----------
    word : bytes

    Returns
    -------
    int

    Raises
    ------
    ValueError
        If it is none, or too large.

    Examples
    --------
    >>> integer(b"-42")
    -42
    >>> integer(b"1.0")
    Traceback (most recent call last):
    ...
    ValueError: ...
    """
    value = int(word)
    if b"_" in word or not -(2**63) <= value < 2**63:
        raise ValueError(f"{word!r} is no whole number")
    return value


def numbers(words: list[bytes], dtype: np.dtype) -> np.ndarray:
    """Words as numbers of a type.

    Parameters
    ----------
    words : list of bytes
    dtype : numpy.dtype

    Returns
    -------
    (n,) array of that type

    Raises
    ------
    InputError
        If one is no number of the type.

    Examples
    --------
    >>> numbers([b"1", b"0.5"], np.dtype("f4")).tolist()
    [1.0, 0.5]
    >>> numbers([b"300"], np.dtype("u1"))
    Traceback (most recent call last):
    ...
    sid.errors.InputError: '300' stands where a number of type uint8 should; export it again
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
