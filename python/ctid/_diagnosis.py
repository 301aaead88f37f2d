"""The diagnosis of a model."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _ctid
from ._arguments import LARGEST_SEED, numbers, pair, pairs, whole
from ._design import BETWEEN, RANGE, Design
from ._frames import Array, table
from ._model import Model
from ._options import SEED, Effort, Progress, phases

if TYPE_CHECKING:
    import pandas as pd
    from typing_extensions import Self


class Diagnosis:
    """What a model is missing; immutable."""

    __slots__ = ("_found", "_native")

    def __init__(self, native: _ctid.Diagnosis) -> None:
        self._native = native
        self._found: dict[str, Any] = json.loads(native.json())

    @property
    def verdict(self) -> str:
        """`effect`, `undecided`, `partial`, `unexplained` or `adequate`."""
        return str(self._found["verdict"])

    @property
    def effects(self) -> list[str]:
        """The effects that were found, in order."""
        return list(self._found["effects"])

    @property
    def groups(self) -> list[list[str]]:
        """For each added effect: the effect itself, then all effects that these records do not distinguish from it, best first."""
        return [list(group) for group in self._found["groups"]]

    @property
    def ranking(self) -> pd.DataFrame:
        """The single effects that were fitted, the best first: `bic_gain` (larger is better), the error at each output, the sizes in words, the share
        `visibility` of the effect that the fitted parameters do not compensate for, and the minimum detectable size `smallest_visible`, in the unit
        of the first of the sizes."""
        singles = self._found["singles"]
        columns: dict[Any, list[Any]] = {
            "effect": [s["effect"] for s in singles],
            "bic_gain": [s["bic_gain"] for s in singles],
        }
        for output in self._outputs:
            columns[f"rmse {output}"] = [s["rmse_per_output"].get(output) for s in singles]
        columns["sizes"] = [
            ", ".join(f"{p['name']} = {p['value']:.4g} {p['unit']}".rstrip() for p in s["sizes"]) for s in singles
        ]
        for key in ("visibility", "smallest_visible"):
            columns[key] = [float("nan") if s.get(key) is None else s[key] for s in singles]
        result: pd.DataFrame = table(columns)
        return result

    @property
    def _outputs(self) -> list[str]:
        steps = self._found["steps"]
        return list(steps[0]["rmse_per_output"]) if steps else []

    @property
    def ladder(self) -> pd.DataFrame:
        """The believed model, then every model after it: what was added, its error at each output (held out too), its criterion."""
        steps = self._found["steps"]
        columns: dict[Any, list[Any]] = {"added": [s["added"] for s in steps]}
        for output in self._outputs:
            columns[f"rmse {output}"] = [s["rmse_per_output"][output] for s in steps]
            if any(s.get("rmse_test_per_output") for s in steps):
                columns[f"rmse {output} test"] = [(s.get("rmse_test_per_output") or {}).get(output) for s in steps]
        columns["weighted_rmse"] = [s["weighted_rmse"] for s in steps]
        columns["bic"] = [s["bic"] for s in steps]
        result: pd.DataFrame = table(columns)
        return result

    @property
    def params(self) -> pd.DataFrame:
        """Parameters and initial states of the last model: `value`, `std_error`, `unit`, and the `effect` that each belongs to."""
        all = self._found["steps"][-1]["parameters"]
        columns = {
            "value": [p["value"] for p in all],
            "std_error": [np.nan if p["std_error"] is None else p["std_error"] for p in all],
            "unit": [p["unit"] for p in all],
            "effect": [p.get("effect") for p in all],
        }
        result: pd.DataFrame = table(columns, [p["name"] for p in all], "parameter")
        return result

    @property
    def left_out(self) -> list[str]:
        """What the time limit left out of the search; empty where it is complete."""
        return list(self._found["left_out"])

    @property
    def model(self) -> Model:
        """The model with the effects that were found in it, and the values of the last step."""
        return Model(self._native.model)

    def summary(self) -> str:
        """The finding, in sentences."""
        return "\n".join(self._native.sentences) + "\n"

    def to_dict(self) -> dict[str, Any]:
        """The result as `ctid diagnose --json` writes it; numbers that are none are None."""
        result: dict[str, Any] = json.loads(self._native.json())
        return result

    def report(self, path: str | os.PathLike[str]) -> None:
        """Writes the page of `ctid diagnose --report`, which needs no network."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self._page)

    @property
    def _title(self) -> str:
        return str(self._found["model"])

    @property
    def _units(self) -> list[str]:
        return self._native.output_units

    @property
    def _series(self) -> list[tuple[str, bool, Array, list[tuple[str, Array, list[Array]]]]]:
        return self._native.series

    @property
    def _page(self) -> str:
        return self._native.html()

    def design(
        self,
        between: tuple[str, str],
        ranges: Mapping[str, tuple[float, float]] | None = None,
        *,
        slews: Mapping[str, float] | None = None,
        inputs: Sequence[str] | None = None,
        duration: float | None = None,
        effort: Effort = "normal",
        time_limit: float | None = None,
        seed: int = SEED,
        progress: Progress = True,
    ) -> Design:
        """Proposes the next experiment, which distinguishes two effects, as `ctid design` does.

        `ranges`: smallest and largest value of inputs, in their units; without them what the records visited. `slews`: the largest change in a second.
        `inputs`: those that are applied; without them all that have a range or moved. `duration` in s; without it that of the longest record.

        Raises `ModelError` where the effects or the limits do not allow one.
        """
        first, second = pair("between", between, BETWEEN)
        within = pairs("ranges", ranges, RANGE)
        applied = list(inputs) if inputs is not None else list(within)
        with phases(progress, _ctid.time_limit(effort, time_limit)) as on_phase:
            found, time_unit = self._native.design(
                (str(first), str(second)),
                ranges=within,
                slews=numbers("slews", slews),
                inputs=applied,
                duration=duration,
                seed=whole("seed", seed, 0, LARGEST_SEED),
                effort=effort,
                time_limit=time_limit,
                progress=on_phase,
            )
        return Design(json.loads(found), time_unit)

    def plot(self, ax: Any = None) -> Any:
        """Measured outputs, the believed model and the last one, and the fall of the error; returns matplotlib axes."""
        from ._plot import diagnosis_axes

        return diagnosis_axes(self._series, self._units, self._title, self._found, ax)

    def __repr__(self) -> str:
        effects = ", ".join(self.effects)
        return f"<ctid.Diagnosis {self.verdict}{': ' if effects else ''}{effects}>"

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: object) -> Self:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return _diagnosis_of, (self._native.to_bytes(),)


def _diagnosis_of(content: bytes) -> Diagnosis:
    return Diagnosis(_ctid.Diagnosis.from_bytes(content))
