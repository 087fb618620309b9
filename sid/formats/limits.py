"""How much memory a file may ask for, judged by what its header announces before anything is allocated."""

from sid.errors import InputError

# Of memory, for each byte of the file. Deflate cannot pack tighter than 1,032 to one, so that no mesh that is
# packed by zlib is refused. Measured of whole readings of bumpy grids: 4 (MAT) to 23 (ASCII OFF), binary PLY
# 22,
# OBJ 11, GLB 8; of a flat grid as VTP 39 by zlib and 80 by LZMA.
BYTES_PER_BYTE = 1032
ALWAYS_ALLOWED = 2**28  # bytes of memory that a file of any size may ask for


def check_memory(announced: int, file_size: int, what: str) -> None:
    """Refuse a file that announces far more than it holds.

    Parameters
    ----------
    announced : int
        Bytes of memory that what the header announces would take.
    file_size : int
        Bytes of the file.
    what : str
        What is announced, as in "a grid of 9 x 9 x 9 points".

    Raises
    ------
    InputError
        If that is more than `ALWAYS_ALLOWED` and more than `BYTES_PER_BYTE` for each byte of the file.

    Examples
    --------
    >>> check_memory(10**6, 100, "a small grid")
    >>> check_memory(10**12, 100, "a large grid")
    Traceback (most recent call last):
    ...
    sid.errors.InputError: it announces a large grid, 1,000,000 MB of memory out of a file of 100 bytes; ...
    """
    if announced > max(ALWAYS_ALLOWED, BYTES_PER_BYTE * file_size):
        raise InputError(
            f"it announces {what}, {announced // 10**6:,} MB of memory out of a file of {file_size:,} bytes; "
            "the file is damaged or too large, export a smaller mesh"
        )
