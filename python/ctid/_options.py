"""Options that several calls share, and the printing of progress."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Literal

#: How much time a search may take: 5 s, 40 s, 10 min.
Effort = Literal["quick", "normal", "thorough"]
#: What the inputs do between two rows: constant, or on a straight line.
Hold = Literal["zero", "first"]
#: Called with every phase that begins; True prints them in a terminal and in a notebook, False prints nothing.
Progress = bool | Callable[[str], object]

#: Number of random starts, their seed, and the largest order of the noise model.
STARTS, SEED, NOISE_ORDER = 12, 1, 6
#: What they may be at most.
MOST_STARTS, LARGEST_NOISE_ORDER = 10_000, 20
#: What a prior is, for messages.
PRIOR = "the value and its standard error"


def _is_seen() -> bool:
    """Whether somebody sees at once what is written to standard error: in a terminal, and in a notebook."""
    if sys.stderr is None:
        return False
    get_shell = getattr(sys.modules.get("IPython"), "get_ipython", None)
    in_notebook = get_shell is not None and type(get_shell()).__name__ == "ZMQInteractiveShell"
    return in_notebook or sys.stderr.isatty()


class _Line:
    """The present phase with the time since the begin, on one line that is written again every second."""

    def __init__(self, limit: float | None) -> None:
        self._began = time.monotonic()
        self._of = "" if limit is None else f" of {limit:g}"
        self._phase = ""
        self._width = 0
        self._over = threading.Event()
        self._lock = threading.Lock()
        self._clock = threading.Thread(target=self._tick, daemon=True)
        self._clock.start()

    def tell(self, phase: str) -> None:
        self._phase = phase
        self._write()

    def _write(self) -> None:
        with self._lock:
            seconds = time.monotonic() - self._began
            text = f"{self._phase} ... {seconds:.0f}{self._of} s" if self._phase else ""
            # Spaces instead of a sequence that clears the line: a notebook knows none.
            print(f"\r{text:<{self._width}}", end="", file=sys.stderr, flush=True)
            self._width = len(text)

    def _tick(self) -> None:
        while not self._over.wait(1.0):
            self._write()

    def close(self) -> None:
        self._over.set()
        self._clock.join()
        self.tell("")
        print(end="\r", file=sys.stderr, flush=True)


@contextmanager
def phases(progress: Progress, limit: float | None = None) -> Iterator[Callable[[str], object] | None]:
    """What is called with every phase that begins, None to print nothing; at the end the line of the last phase is cleared. `limit`: of the time, in s."""
    if callable(progress):
        yield progress
    elif progress and _is_seen():
        line = _Line(limit)
        try:
            yield line.tell
        finally:
            line.close()
    else:
        yield None
