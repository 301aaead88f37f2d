"""Published tables, computed again: what a paper prints beside what many runs of the same experiment give."""

from __future__ import annotations

import json
from typing import Any

from . import _ctid
from ._arguments import LARGEST_SEED, whole

__all__ = ["baysse", "udink"]


def baysse(runs: int = 100, seed: int = 1) -> dict[str, Any]:
    """The tables of Baysse's, Carrillo's and Habbadi's output error in closed loop, as `ctid tables baysse --json` writes them.

    `runs`: noises, 10 or more; `seed`: what they are drawn from. Raises `ctid.ModelError`.
    """
    result: dict[str, Any] = json.loads(_ctid.baysse_tables(whole("runs", runs, 1), whole("seed", seed, 0, LARGEST_SEED)))
    return result


def udink(runs: int = 200, seed: int = 1) -> dict[str, Any]:
    """The tables of ten Brummelhuis' and Udink ten Cate's tank, as `ctid tables udink --json` writes them.

    `runs`: noises, 20 or more; `seed`: what they are drawn from. Raises `ctid.ModelError`.
    """
    result: dict[str, Any] = json.loads(_ctid.udink_tables(whole("runs", runs, 1), whole("seed", seed, 0, LARGEST_SEED)))
    return result
