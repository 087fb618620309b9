"""What ``sid run`` becomes: Snakemake, but that a wrong option takes one line and not its whole usage."""

import argparse
from runpy import run_module
from typing import NoReturn

from sid.cli.messages import say


def _refuse(parser: argparse.ArgumentParser, message: str) -> NoReturn:
    """Refuse arguments, in place of the method of every parser."""
    say(f"{message.replace('unrecognized arguments:', 'unknown option')}; see snakemake --help")
    raise SystemExit(2)


if __name__ == "__main__":
    # Snakemake makes its parser itself, so only the class can be told, which a type checker does not allow
    argparse.ArgumentParser.error = _refuse  # type: ignore[method-assign, assignment]
    run_module("snakemake", run_name="__main__", alter_sys=True)  # as python -m does
