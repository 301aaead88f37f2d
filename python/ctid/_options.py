"""Options that several calls share, and the printing of progress."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Literal

#: How much time a search may take: 5 s, 40 s, 10 min.
Effort = Literal["quick", "normal", "thorough"]
#: What the inputs do between two rows: constant, or on a straight line.
Hold = Literal["zero", "first"]
#: Called with every phase that begins; True prints them where the terminal is one, False prints nothing.
Progress = bool | Callable[[str], object]

#: Number of random starts, their seed, and the largest order of the noise model.
STARTS, SEED, NOISE_ORDER = 12, 1, 6


def phase_printer(progress: Progress) -> Callable[[str], object] | None:
    """What is called with every phase that begins; None prints nothing."""
    if callable(progress):
        return progress
    if progress and sys.stderr.isatty():
        return lambda phase: print(f"\r\x1b[K{phase} ...", end="", file=sys.stderr, flush=True)
    return None


def clear_line(progress: Progress) -> None:
    """Clears the line of the last phase from the terminal."""
    if progress is True and sys.stderr.isatty():
        print("\r\x1b[K", end="", file=sys.stderr, flush=True)
