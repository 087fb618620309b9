"""``python -m sid``: the command ``sid``."""

import sys

from sid.cli import main

if __name__ == "__main__":
    sys.exit(main())
