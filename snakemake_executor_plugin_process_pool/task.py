"""What is handed to a process of the pool."""

from dataclasses import dataclass

THREADS = (
    "OMP_NUM_THREADS",
    "GOTO_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)  # those that Snakemake sets for the jobs that it starts itself
HANDED_OVER = "SNAKEMAKE_PROCESS_POOL"  # environment variable from here to the fork server


@dataclass(frozen=True)
class Task:
    """A script and what it runs with.

    Parameters
    ----------
    source : str
        The script's text.
    file : str
        Its path, for tracebacks and ``__file__``.
    job : bytes
        The pickled object that the script finds as ``snakemake``.
    search_path : tuple of str
        Where else the script's imports are looked for, after all other places.
    folder : str
        The working directory.
    threads : int
        How many threads BLAS and OpenMP may use.
    """

    source: str
    file: str
    job: bytes
    search_path: tuple[str, ...]
    folder: str
    threads: int = 1
