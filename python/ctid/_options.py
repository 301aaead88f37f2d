"""Options that several calls share, and the printing of progress."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Literal

#: How much time a search may take: 5 s, 40 s, 10 min.
Effort = Literal["quick", "normal", "thorough"]
#: What the inputs do between two rows: constant, or on a straight line.
Hold = Literal["zero", "first"]
#: Called with every phase that begins; True prints them where the terminal is one, False prints nothing.
Progress = bool | Callable[[str], object]

#: Number of random starts, their seed, and the largest order of the noise model.
STARTS, SEED, NOISE_ORDER = 12, 1, 6


@contextmanager
def phases(progress: Progress) -> Iterator[Callable[[str], object] | None]:
    """What is called with every phase that begins, None to print nothing; at the end the line of the last phase is cleared."""
    printed = progress is True and sys.stderr.isatty()
    try:
        if callable(progress):
            yield progress
        elif printed:
            yield lambda phase: print(f"\r\x1b[K{phase} ...", end="", file=sys.stderr, flush=True)
        else:
            yield None
    finally:
        if printed:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)
