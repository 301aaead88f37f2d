"""The next experiment."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from ._frames import table

if TYPE_CHECKING:
    import pandas as pd


#: What pairs hold, for messages.
BETWEEN, RANGE = "of effects, between=(\"lag(u)\", \"delay(u)\")", "the smallest and the largest value"


class Design:
    """An experiment that was proposed; immutable."""

    __slots__ = ("_found", "_time_unit")

    def __init__(self, found: dict[str, Any], time_unit: float) -> None:
        self._found = found
        self._time_unit = time_unit

    @property
    def prospect(self) -> str:
        """`decides`, `may`, `hardly`, or `twins` if no experiment distinguishes the two effects."""
        return str(self._found["prospect"])

    @property
    def experiment(self) -> pd.DataFrame:
        """The best experiment, to be applied: a column for each input, in its unit; the index is the time in s."""
        found = self._found["experiment"]
        columns = {one["input"]: one["values"] for one in found["inputs"]}
        result: pd.DataFrame = table(columns, found["time"], "t [s]")
        return result

    @property
    def experiments(self) -> pd.DataFrame:
        """All experiments that were tried, the best first: what each applies, and the probability with which it decides."""
        all = self._found["experiments"]
        applied = ["; ".join(f"{i['input']}: {i['kind']} {i['low']:.3g}..{i['high']:.3g}" for i in e["inputs"]) for e in all]
        result: pd.DataFrame = table({"inputs": applied, "decides": [e["power"]["decides"] for e in all]})
        return result

    def to_dict(self) -> dict[str, Any]:
        """The result as `ctid design --json` writes it; numbers that are none are None."""
        result: dict[str, Any] = json.loads(json.dumps(self._found))
        return result

    def __repr__(self) -> str:
        return f"<ctid.Design {self.prospect}>"
