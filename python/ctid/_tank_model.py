"""Tanks, and what is linear like them: the plants of the program, with its catalogue of effects for them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from . import _ctid
from ._arguments import by_name, numbers, pairs
from ._ctid import DataError, ModelError
from ._fit import Fit
from ._frames import Records, as_list, index_of, row_count, series, to_frames
from ._linear import StateSpace, _guess
from ._model import Model
from ._monitor import Monitor
from ._options import NOISE_ORDER, PRIOR, SEED, STARTS, Hold, Progress, phases
from ._tank_plant import linearized, linearized_with_effects, monitored

if TYPE_CHECKING:
    import pandas as pd

#: Plants that there are.
Plant = Literal["single-tank", "single-tank-linear", "cascaded-tanks", "cascaded-tanks-linear", "first-order", "three-tank"]
#: What a side measurement of a plant is: a number, or names.
Known = float | str | Sequence[str]


def _toml(value: object, name: str = "") -> str:
    """A value as a model file writes it; `name` in messages."""
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
    raise ModelError(f"{name} is {value!r}: give a number or a name, or leave it out")


class TankModel(Model):
    """A plant of the program; immutable."""

    __slots__ = ("_parts", "_source", "_units", "_values")

    def __init__(
        self,
        parts: dict[str, Any],
        values: Mapping[str, float] | None = None,
        units: tuple[str, str] = ("", ""),
        source: _ctid.TankFit | bytes | None = None,
    ) -> None:
        self._parts = parts
        self._values = dict(values or {})
        # Of the command and of the readings, as the fitted records say them.
        self._units = units
        # A plant with effects: its fit, or that as it is pickled, whose records the effects of the plant's text are fitted to.
        self._source = source if parts["effects"] else None
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
                lines += [f"{_toml(str(key))} = {_toml(value, key)}" for key, value in parts[name].items()]
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
        starts: int = STARTS,
        seed: int = SEED,
        noise_order: int = NOISE_ORDER,
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
        if (starts, seed, noise_order) != (STARTS, SEED, NOISE_ORDER):
            raise ModelError(f"starts, seed and noise_order of {self.name} are the program's: leave them out")
        records = as_list(data)
        if not records:
            raise DataError("no record: give a frame, or a list of them")
        u = _guess(records[0], inputs if inputs is not None else self.inputs or None, "u", "input")
        y = _guess(records[0], outputs if outputs is not None else self.outputs or None, "y", "output")
        parts = {
            **self._parts,
            "columns": {"input": u if len(u) > 1 else u[0], "output": y if len(y) > 1 else y[0]},
            "known": {**self._parts["known"], **by_name("known", known)},
            "prior": {**self._parts["prior"], **_priors(priors)},
            "hold": self._parts["hold"] if hold is None else hold,
        }
        from ._tank import TankFit

        model = TankModel(parts)
        frames = to_frames(records, "data", [*u, *y])
        with phases(progress) as on_phase:
            fitted = model._native.fit(frames, progress=on_phase)
        return TankFit(fitted, [index_of(record, row_count(record), [*u, *y]) for record in records], parts)

    def to_modelica(self) -> str:
        """The plant as the text of a model in Modelica, with the fitted values where it comes from a fit, otherwise those of `start`.

        Levels are in the unit of their columns, time in s. Effects become the effects at the ports of the text that they are, as in
        `ctid export --modelica`; these are fitted to the records of the plant's fit at the first call. Raises `ModelError` where effects are in
        the model without a fit, where the text has no such effect or does not fit as well as the plant, and where parameters have no values.
        """
        fit = self._with_records()
        if fit is not None:
            return fit.to_modelica()
        text: str = self._native.to_modelica({**self._parts["start"], **self._values})
        return text

    def _with_records(self) -> _ctid.TankFit | None:
        """The fit of a plant with effects; None without effects, or without a fit."""
        if isinstance(self._source, bytes):
            self._source = _ctid.TankFit.from_bytes(self._source, self.text)
        return self._source

    def linearize(self, at: Mapping[str, float] | None = None) -> StateSpace:
        """The matrices of the plant about values of its levels and its command, `at={"level": 12.0, "u": 4.0}`; a linear plant needs none.

        Its levels are `level`, `level_upper` and `level_lower`, or `level_1` to `level_3`; its command is `u`, of two pumps `u1` and `u2`; time
        is in s. Slopes are exact. With effects these are the matrices of the text of `to_modelica`, whose effects may have further states and a
        `time`. Raises `ModelError` where `to_modelica` does, and where a slope is not finite or a signal is delayed.
        """
        fit = self._with_records()
        if fit is not None:
            return linearized_with_effects(fit, at)
        return linearized(self._native, {**self._parts["start"], **self._values}, at)

    def monitor(
        self,
        *,
        false_alarm_every: float = 1e6,
        learn: int = 1000,
        time_unit: float = 1.0,
        units: tuple[str, str] | None = None,
    ) -> Monitor:
        """A monitor that runs the model beside the running plant, as `ctid monitor` watches it; see `Model.monitor`. It learns its values from the first rows.

        `units`: of the command and of the readings, such as `("V", "cm")`; without them those of the fitted records or of the columns. The signals
        of the rows are the columns; without them `u` and `y`, of several levels `level_upper` and `level_lower`. Raises `ModelError`.
        """
        known = units if units is not None else self._units if any(self._units) else self._native.units
        return monitored(self._native, (str(known[0]), str(known[1])), false_alarm_every, learn, time_unit)

    def __reduce__(self) -> tuple[Any, ...]:
        source = self._source
        content = source if source is None or isinstance(source, bytes) else source.to_bytes()
        return TankModel, (self._parts, self._values, self._units, content)


def _priors(given: Mapping[str, tuple[float, float]] | None) -> dict[str, list[float]]:
    return {name: list(prior) for name, prior in pairs("priors", given, PRIOR).items()}


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
    side = by_name("known", known)
    measured = side.get("measured")
    # Of several levels the columns have the levels' names, until a fit names others.
    columns: dict[str, Any] = {}
    if isinstance(measured, (list, tuple)) and len(measured) > 1:
        columns["output"] = [f"level_{str(name).removeprefix('T')}" for name in measured]
    parts: dict[str, Any] = {
        "plant": plant,
        "effects": list(effects),
        "places": by_name("where", where),
        "columns": columns,
        "known": {k: list(v) if isinstance(v, tuple) else v for k, v in side.items()},
        "start": numbers("start", start),
        "prior": _priors(priors),
        "hold": hold,
    }
    return TankModel(parts)
