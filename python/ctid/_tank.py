"""A fitted plant of the library, and the diagnosis of its missing effects."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _ctid
from ._arguments import LARGEST_SEED, number, whole
from ._design import Design
from ._diagnosis import Diagnosis
from ._fit import Fit
from ._frames import (
    Array,
    Data,
    Records,
    band_table,
    columns_in,
    table,
    to_frames,
    to_one_frame,
)
from ._model import Model
from ._options import SEED, Effort, Progress, phases
from ._tank_model import TankModel
from ._tank_plant import designed

if TYPE_CHECKING:
    import pandas as pd


class TankFit(Fit):
    """A plant that was fitted; immutable."""

    __slots__ = ("_parts", "_tank")

    def __init__(self, native: Any, indexes: Sequence[Any], parts: dict[str, Any]) -> None:
        # What both have, the methods of `Fit` take from it.
        self._native = native
        self._tank: Any = native
        self._indexes = list(indexes)
        self._parts = parts

    @property
    def model(self) -> Model:
        """The plant with its fitted values."""
        return TankModel(self._parts, {e[0]: e[1] for e in self._tank.estimates}, self._tank.units, self._tank)

    @property
    def _not_determined(self) -> list[list[str]]:
        return []

    @property
    def _series(self) -> list[tuple[str, Array, list[tuple[str, Array, Array]]]]:
        all = [one for one in self._tank.series if not one[1]]
        return [(name, time, [(o, measured, models[-1]) for o, measured, models in outputs]) for name, _, time, outputs in all]

    @property
    def _scores(self) -> list[tuple[str, float, float]]:
        return self._scored(self._tank, False)

    def _score_of(self, test: Records) -> list[tuple[str, float, float]]:
        frames = to_frames(test, "test", self._wanted)
        return self._scored(self._tank.with_test(frames), True) if frames else []

    @staticmethod
    def _scored(native: Any, held_out: bool) -> list[tuple[str, float, float]]:
        step = json.loads(native.json())["steps"][-1]
        errors = step["rmse_test_per_output" if held_out else "rmse_per_output"]
        first = 5 if held_out else 0
        result = []
        for o, (name, rmse) in enumerate(errors.items()):
            parts = [outputs[o][1][first:] for _, held, _, outputs in native.series if held == held_out]
            values = np.concatenate(parts)
            result.append((name, rmse, 100.0 * (1.0 - rmse / float(np.nanstd(values)))))
        return result

    @property
    def _wanted(self) -> list[str]:
        model = TankModel(self._parts)
        return model.inputs + model.outputs

    @property
    def _name(self) -> str:
        return " + ".join([self._parts["plant"], *self._parts["effects"]])

    def simulate(self, data: Data, interval: float | None = 0.95, *, first: int = 5) -> pd.DataFrame:
        """The fitted plant on the inputs of another record; see `Fit.simulate`."""
        model = TankModel(self._parts)
        wanted = model.inputs + columns_in(data, model.outputs)
        frame = to_one_frame(data, "test", wanted)
        found = self._native.simulate(frame, whole("first", first, 1), 0.95 if interval is None else number("interval", interval))
        return band_table(found["outputs"].items(), data, interval, wanted)

    def diagnose(
        self,
        test: Records | None = None,
        *,
        effort: Effort = "normal",
        time_limit: float | None = None,
        max_effects: int | None = None,
        seed: int = SEED,
        progress: Progress = True,
    ) -> Diagnosis:
        """Searches the catalogue for what the plant is missing, as `ctid diagnose` does; see `Fit.diagnose`."""
        frames = to_frames(test, "test", self._wanted) if test is not None else []
        with phases(progress, _ctid.time_limit(effort, time_limit)) as on_phase:
            found = self._tank.diagnose(
                frames,
                effort=effort,
                time_limit=time_limit,
                max_effects=None if max_effects is None else whole("max_effects", max_effects, 1),
                seed=whole("seed", seed, 0, LARGEST_SEED),
                progress=on_phase,
            )
        kept = (self._tank.to_bytes(), self._tank.units)
        return TankDiagnosis(found.json(), found.sentences, found.html(), (found.series, found.output_units), self._parts, kept)

    def to_modelica(self) -> str:
        """The plant as the text of a model, with the fitted values; see `TankModel.to_modelica`."""
        return self.model.to_modelica()

    def __reduce__(self) -> tuple[Any, ...]:
        return _tank_fit_of, (self._native.to_bytes(), self._indexes, self._parts)


def _tank_fit_of(content: bytes, indexes: list[Any], parts: dict[str, Any]) -> TankFit:
    return TankFit(_ctid.TankFit.from_bytes(content), indexes, parts)


class TankDiagnosis(Diagnosis):
    """What a plant is missing; immutable."""

    __slots__ = ("_html", "_json", "_kept", "_parts", "_sentences", "_series_of", "_units_of")

    def __init__(
        self,
        text: str,
        sentences: list[str],
        html: str,
        outputs: tuple[Any, list[str]],
        parts: dict[str, Any],
        kept: tuple[bytes, tuple[str, str]],
    ) -> None:
        self._json = text
        self._found = json.loads(text)
        self._sentences = sentences
        self._html = html
        self._series_of, self._units_of = outputs
        self._parts = parts
        # The plant with its records, as a fit is pickled, and the units of its command and its readings.
        self._kept = kept

    @property
    def ranking(self) -> pd.DataFrame:
        """The single effects that were fitted, the best first: `bic_gain` (larger is better), `rmse`, the size in words, and the smallest that would
        have been seen."""
        scores = self._found["scores"]

        def said(size: dict[str, Any] | None) -> str:
            return "" if size is None else f"{size['name']} = {size['value']:.4g} {size['unit']}".rstrip()

        columns = {
            "effect": [s["effect"] for s in scores],
            "place": [s["place"] for s in scores],
            "bic_gain": [s["bic_gain"] for s in scores],
            "rmse": [s.get("rmse") for s in scores],
            "sizes": [said(s["size"]) for s in scores],
            "smallest_visible": [said(s["smallest_visible"]) if isinstance(s["smallest_visible"], dict) else s["smallest_visible"] for s in scores],
        }
        result: pd.DataFrame = table(columns)
        return result

    @property
    def left_out(self) -> list[str]:
        """What the time limit left out of the search; empty where it is complete."""
        return list(self._found["effort"]["left_out"])

    @property
    def model(self) -> Model:
        """The plant with the effects that were found in it, and the values of the last step."""
        effects = self._found["effects"]
        steps = self._found["steps"]
        places = {s["added"]: s["place"] for s in steps if s["added"] in effects and s["place"]}
        parts = {
            **self._parts,
            "effects": [*self._parts["effects"], *effects],
            "places": {**self._parts["places"], **places},
        }
        content, units = self._kept
        return TankModel(parts, {p["name"]: p["value"] for p in steps[-1]["parameters"]}, units, content)

    def summary(self) -> str:
        """The finding, in sentences."""
        return "\n".join(self._sentences) + "\n"

    def to_dict(self) -> dict[str, Any]:
        """The result as `ctid diagnose --json` writes it; numbers that are none are None."""
        result: dict[str, Any] = json.loads(self._json)
        return result

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
        """Proposes the next experiment, which distinguishes two effects, as `ctid design` does; see `Diagnosis.design`.

        Effects are those of `ctid effects`; of several tanks `overflow:upper` says which. The only input has a range and a slew.
        """
        return designed(
            self._kept[0],
            self._title,
            TankModel(self._parts).inputs[0],
            between,
            ranges,
            slews,
            inputs or [],
            duration=duration,
            effort=effort,
            time_limit=time_limit,
            seed=seed,
            progress=progress,
        )

    @property
    def _title(self) -> str:
        return str(self._parts["plant"])

    @property
    def _series(self) -> Any:
        return self._series_of

    @property
    def _units(self) -> list[str]:
        return self._units_of

    @property
    def _page(self) -> str:
        return self._html

    def __reduce__(self) -> tuple[Any, ...]:
        outputs = (self._series_of, self._units_of)
        return TankDiagnosis, (self._json, self._sentences, self._html, outputs, self._parts, self._kept)
