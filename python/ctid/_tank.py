"""Tanks, and what is linear like them: the plants of the program, with its catalogue of effects for them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from . import _ctid
from ._ctid import DataError, ModelError
from ._frames import Array, Data, Records, as_list, index_of, series, table, to_frame, to_frames
from ._linear import _guess
from ._model import _SEED, Diagnosis, Effort, Fit, Hold, Model, Progress, _clear, _rows, _teller

if TYPE_CHECKING:
    import pandas as pd

#: What a side measurement of a plant is: a number, or names.
Known = float | str | Sequence[str]


def _toml(value: object) -> str:
    """A value as a model file writes it."""
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(one) for one in value) + "]"
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    raise ModelError(f"{value!r} is neither a number nor a name")


class TankModel(Model):
    """A plant of the program; it never changes."""

    __slots__ = ("_parts", "_values")

    def __init__(self, parts: dict[str, Any], values: Mapping[str, float] | None = None) -> None:
        self._parts = parts
        self._values = dict(values or {})
        # The program's parser checks it.
        self._native: Any = _ctid.Tank(self._text(parts))

    @staticmethod
    def _text(parts: dict[str, Any]) -> str:
        """The model file that says the same."""
        lines = [f"plant = {_toml(parts['plant'])}", f"effects = {_toml(parts['effects'])}"]
        if parts["hold"] is not None:
            lines.append(f"hold = {_toml(parts['hold'])}")
        for name in ("columns", "known", "start", "prior"):
            if parts[name]:
                lines.append(f"[{name}]")
                lines += [f"{_toml(str(key))} = {_toml(value)}" for key, value in parts[name].items()]
        for effect, place in parts["places"].items():
            lines += [f"[effect.{effect}]", f"where = {_toml(place)}"]
        return "\n".join(lines) + "\n"

    @property
    def name(self) -> str:
        """The plant."""
        return str(self._native.name)

    @property
    def text(self) -> str:
        """The model file that says the same."""
        return str(self._native.text)

    @property
    def effects(self) -> list[str]:
        """The effects that were added, in order."""
        return list(self._native.effects)

    @property
    def inputs(self) -> list[str]:
        """Columns of the inputs, where they are named."""
        return list(self._native.columns[0])

    @property
    def outputs(self) -> list[str]:
        """Columns of the outputs, where they are named."""
        return list(self._native.columns[1])

    @property
    def states(self) -> list[str]:
        """Names of the initial states that were fitted."""
        return [name for name in self._values if name.endswith("(0)")]

    @property
    def params(self) -> pd.Series[float]:
        """Fitted values, where the model comes from a fit or a diagnosis; else empty, as a plant has none of its own."""
        result: pd.Series[float] = series(list(self._values), list(self._values.values()), "value")
        return result

    def fit(
        self,
        data: Records,
        inputs: Sequence[str] | Mapping[str, str] | None = None,
        outputs: Sequence[str] | Mapping[str, str] | None = None,
        known: Mapping[str, Any] | None = None,
        priors: Mapping[str, tuple[float, float]] | None = None,
        *,
        hold: Hold | None = None,
        starts: int = 12,
        seed: int = _SEED,
        noise_order: int = 6,
        progress: Progress = False,
    ) -> Fit:
        """Fits the plant to records by simulation error, as `ctid compare` does.

        `inputs`: the column of the command, and of a second one; `outputs`: those of the levels; without them the first that begin with u and with y.
        `known`: what a model file has under `[known]`, areas say; `priors`: `{name: (value, standard error)}`. `starts`, `seed` and `noise_order`
        are those of the program and cannot be chosen here.

        Raises `DataError` and `ModelError`.
        """
        if isinstance(inputs, Mapping) or isinstance(outputs, Mapping):
            raise ModelError(f"{self.name} has no signals of its own names: give lists of columns")
        if (starts, seed, noise_order) != (12, _SEED, 6):
            raise ModelError(f"starts, seed and noise_order of {self.name} are the program's: leave them out")
        records = as_list(data)
        if not records:
            raise DataError("no record: give a frame, or a list of them")
        u = _guess(records[0], inputs if inputs is not None else self.inputs or None, "u", "input")
        y = _guess(records[0], outputs if outputs is not None else self.outputs or None, "y", "output")
        parts = {
            **self._parts,
            "columns": {"input": u if len(u) > 1 else u[0], "output": y if len(y) > 1 else y[0]},
            "known": {**self._parts["known"], **(known or {})},
            "prior": {**self._parts["prior"], **{n: [float(v), float(e)] for n, (v, e) in (priors or {}).items()}},
            "hold": self._parts["hold"] if hold is None else hold,
        }
        model = TankModel(parts)
        frames = to_frames(records, "data", [*u, *y])
        try:
            fitted = model._native.fit(frames, progress=_teller(progress))
        finally:
            _clear(progress)
        return TankFit(fitted, [index_of(record, _rows(record)) for record in records], parts)

    def to_modelica(self) -> str:
        """A plant of the program has no text: raises `ModelError`."""
        raise ModelError(f"{self.name} is a plant of the program and has no text: write its balance as a model of your own")

    def linearize(self, at: Mapping[str, float] | None = None) -> Any:
        """Raises `ModelError`: write the balance as a model of your own."""
        return self.to_modelica()

    def monitor(self, *, false_alarm_every: float = 1e6, learn: int = 1000, time_unit: float = 1.0) -> Any:
        """Raises `ModelError`: the program watches plants, `ctid monitor`."""
        raise ModelError(f"{self.name} is a plant of the program: watch it with `ctid monitor`")

    def __reduce__(self) -> tuple[Any, ...]:
        return TankModel, (self._parts, self._values)


def tank(
    plant: str,
    known: Mapping[str, Known] | None = None,
    *,
    effects: Sequence[str] = (),
    where: Mapping[str, str] | None = None,
    start: Mapping[str, float] | None = None,
    priors: Mapping[str, tuple[float, float]] | None = None,
    hold: Hold | None = None,
) -> TankModel:
    """See `Model.tank`."""
    parts: dict[str, Any] = {
        "plant": plant,
        "effects": list(effects),
        "places": dict(where or {}),
        "columns": {},
        "known": {k: list(v) if isinstance(v, tuple) else v for k, v in (known or {}).items()},
        "start": {k: float(v) for k, v in (start or {}).items()},
        "prior": {n: [float(v), float(e)] for n, (v, e) in (priors or {}).items()},
        "hold": hold,
    }
    return TankModel(parts)


class TankFit(Fit):
    """A plant that was fitted; it never changes."""

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
        return TankModel(self._parts, {e[0]: e[1] for e in self._tank.estimates})

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
        names = [str(name) for name in data]
        present = [c for c in model.outputs if any(n == c or n.split(" [")[0] == c for n in names)]
        frame = to_frame(data, "test", model.inputs + present)
        found = self._native.simulate(frame, first, 0.95 if interval is None else interval)
        columns: dict[Any, Array] = {}
        for output, values in found["outputs"].items():
            for name, column in values.items():
                if interval is not None or name == "mean":
                    columns[output, name] = column
        rows = next(iter(columns.values())).size
        result: pd.DataFrame = table(columns, index_of(data, rows))
        return result

    def diagnose(
        self,
        test: Records | None = None,
        *,
        effort: Effort = "normal",
        time_limit: float | None = None,
        max_effects: int | None = None,
        seed: int = _SEED,
        progress: Progress = True,
    ) -> Diagnosis:
        """Searches the catalogue for what the plant is missing, as `ctid diagnose` does; see `Fit.diagnose`."""
        frames = to_frames(test, "test", self._wanted) if test is not None else []
        if max_effects is not None and max_effects < 1:
            raise ModelError("max_effects is a whole number above zero")
        try:
            found = self._tank.diagnose(
                frames, effort=effort, time_limit=time_limit, max_effects=max_effects, seed=seed, progress=_teller(progress)
            )
        finally:
            _clear(progress)
        return TankDiagnosis(found.json(), found.sentences, found.html(), (found.series, found.output_units), self._parts)

    def to_modelica(self) -> str:
        """Raises `ModelError`: a plant has no text."""
        return TankModel(self._parts).to_modelica()

    def __reduce__(self) -> tuple[Any, ...]:
        return _tank_fit_of, (self._native.to_bytes(), self._indexes, self._parts)


def _tank_fit_of(content: bytes, indexes: list[Any], parts: dict[str, Any]) -> TankFit:
    return TankFit(_ctid.TankFit.from_bytes(content), indexes, parts)


class TankDiagnosis(Diagnosis):
    """What a plant is missing; it never changes."""

    __slots__ = ("_html", "_json", "_parts", "_sentences", "_series_of", "_units_of")

    def __init__(self, text: str, sentences: list[str], html: str, outputs: tuple[Any, list[str]], parts: dict[str, Any]) -> None:
        self._json = text
        self._found = json.loads(text)
        self._sentences = sentences
        self._html = html
        self._series_of, self._units_of = outputs
        self._parts = parts

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
        return TankModel(parts, {p["name"]: p["value"] for p in steps[-1]["parameters"]})

    def summary(self) -> str:
        """The finding, in sentences."""
        return "\n".join(self._sentences) + "\n"

    def to_dict(self) -> dict[str, Any]:
        """The result as `ctid diagnose --json` writes it; numbers that are none are None."""
        result: dict[str, Any] = json.loads(self._json)
        return result

    def design(self, *between: Any, **limits: Any) -> Any:
        """Raises `ModelError`: the program designs experiments for plants, `ctid design`."""
        raise ModelError(f"{self._parts['plant']} is a plant of the program: use `ctid design`")

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
        return TankDiagnosis, (self._json, self._sentences, self._html, (self._series_of, self._units_of), self._parts)


#: Plants that there are.
Plant = Literal["single-tank", "single-tank-linear", "cascaded-tanks", "cascaded-tanks-linear", "first-order", "three-tank"]
