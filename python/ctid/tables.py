"""Published tables, computed again: what a paper prints beside what many runs of the same experiment give."""

from __future__ import annotations

import json
from typing import Any

from . import _ctid

__all__ = ["udink"]


def udink(runs: int = 200, seed: int = 1) -> dict[str, Any]:
    """The tables of ten Brummelhuis' and Udink ten Cate's tank, as `ctid tables udink --json` writes them.

    `runs`: noises, 20 or more; `seed`: what they are drawn from. Raises `ctid.ModelError`.
    """
    result: dict[str, Any] = json.loads(_ctid.udink_tables(runs, seed))
    return result
