"""How many threads there may be."""

import os
from numbers import Integral


def processors() -> int:
    """Processors that this process may run on.

    Returns
    -------
    int

    Examples
    --------
    >>> processors() >= 1
    True
    """
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def check_threads(threads: int | None) -> int:
    """A number of threads that this process can use.

    Parameters
    ----------
    threads : int, optional
        None stands for all there are.

    Returns
    -------
    int

    Raises
    ------
    ValueError
        If it is no whole number from 1 to `processors`.

    Examples
    --------
    >>> check_threads(1), check_threads(None) == processors()
    (1, True)
    """
    there = processors()
    if threads is None:
        return there
    if isinstance(threads, bool) or not isinstance(threads, Integral) or not 1 <= threads <= there:
        raise ValueError(f"threads is {threads}; here it must be a whole number from 1 to {there}")
    return int(threads)
