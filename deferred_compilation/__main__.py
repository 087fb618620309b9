"""The detached process that compiles."""

import sys

from deferred_compilation import compile_now

compile_now(sys.argv[1:])
