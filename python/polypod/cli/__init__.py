"""The command line. Each command is a module, and a thin layer over the functions that Python users call.

Exit status: 0 done, 1 done but some states have no answer, 2 wrong input.
"""

from polypod.cli.app import main

__all__ = ["main"]
