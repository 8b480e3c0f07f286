"""Threads and processor instructions for batches.

Answers depend on neither, bit by bit.
"""

from __future__ import annotations

import os
from collections.abc import Mapping

from polypod import _core
from polypod.errors import PolypodError


def set_threads(count: int) -> None:
    """Lets batches use this many threads; 0, as at the start, for one on each core.

    The variable POLYPOD_THREADS sets it when the package is loaded. Batches that are not worth a second
    thread use one: less than a few thousand states, or a few where a state takes a millisecond.
    """
    if type(count) is not int or count < 0:
        raise PolypodError(f"threads are {count!r}; must be a whole number, 0 for one on each core")
    _core.set_threads(count)


def instruction_sets() -> list[str]:
    """Names of the instruction sets that batches can use on this processor, the narrowest registers first."""
    return _core.instruction_sets()


def set_instructions(name: str) -> None:
    """Lets batches use no wider registers than those of this instruction set: to compare their speeds.

    At the start they use the widest there are. The variable POLYPOD_INSTRUCTIONS sets it when the package is
    loaded.
    """
    if not _core.use_instructions(name):
        raise PolypodError(f"instructions are {name!r}; this processor has {', '.join(instruction_sets())}")


def configure(environment: Mapping[str, str] = os.environ) -> None:
    """Follows POLYPOD_THREADS and POLYPOD_INSTRUCTIONS.

    Raises:
        PolypodError: a value that means nothing here.
    """
    threads, instructions = environment.get("POLYPOD_THREADS"), environment.get("POLYPOD_INSTRUCTIONS")
    if threads:
        if not threads.isdecimal():
            raise PolypodError(
                f"POLYPOD_THREADS is {threads!r}; must be a whole number, 0 for one on each core"
            )
        set_threads(int(threads))
    if instructions:
        try:
            set_instructions(instructions)
        except PolypodError as error:
            raise PolypodError(f"POLYPOD_INSTRUCTIONS: {error}") from None
