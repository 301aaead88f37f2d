"""A model in continuous time."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

from . import _ctid
from ._arguments import LARGEST_SEED, number, numbers, pairs, whole
from ._ctid import ModelError
from ._frames import Records, as_list, index_of, row_count, series, to_frames
from ._linear import StateSpace, state_space
from ._monitor import Monitor
from ._options import (
    LARGEST_NOISE_ORDER,
    MOST_STARTS,
    NOISE_ORDER,
    PRIOR,
    SEED,
    STARTS,
    Hold,
    Progress,
    phases,
)

if TYPE_CHECKING:
    import pandas as pd
    from typing_extensions import Self

    from ._fit import Fit
    from ._tank_model import Known, Plant


def _columns(
    model: _ctid.Model, given: Sequence[str] | Mapping[str, str] | None, role: Literal["inputs", "outputs"]
) -> list[str] | None:
    """The columns of signals in the order of the model: by name where the names are those of the model, else in the order given."""
    if given is None:
        return None
    own: list[tuple[str, str]] = model.inputs if role == "inputs" else model.outputs
    names = [name for name, _ in own]
    if isinstance(given, str):
        raise ModelError(f'{role} are a list: write {role}=["{given}"]')
    if isinstance(given, Mapping):
        for name in given:
            if name not in names:
                raise ModelError(f'"{name}" is not one of the {role} of {model.name}: it has {", ".join(names) or "none"}')
        return [str(given.get(name, column)) for name, column in own]
    columns = [str(column) for column in given]
    if len(columns) != len(names):
        raise ModelError(
            f'{len(columns)} {role} are given, and {model.name} has {len(names)} ({", ".join(names)}): name a column for each, {role}=[...]'
        )
    return names if set(columns) == set(names) else columns


class Model:
    """A model in continuous time; immutable.

    `Model.from_file` and `Model.from_text` read a flat subset of Modelica. Its parameters are fitted but for those that the text declares
    `final` and those that are known.
    """

    __slots__ = ("_native",)

    def __init__(self, native: _ctid.Model) -> None:
        self._native = native

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> Model:
        """Reads a model's text (`.mo`), or a model file of the program `ctid` (`.toml`) with its columns and known parameters.

        Raises `ModelError`, which names the file, the line, the column and the mend, and `FileNotFoundError`.
        """
        name = os.fspath(path)
        if name.lower().endswith(".toml"):
            return cls(_ctid.Model.from_model_file(name))
        with open(name, encoding="utf-8") as file:
            return cls(_ctid.Model.from_text(file.read(), name))

    @classmethod
    def from_text(cls, text: str, name: str = "model.mo") -> Model:
        """Reads a model's text; `name` stands for it in messages.

        Raises `ModelError`, which names the line, the column and the mend.
        """
        return cls(_ctid.Model.from_text(text, name))

    @property
    def name(self) -> str:
        """The model's name."""
        return self._native.name

    @property
    def text(self) -> str:
        """The text as it was read, without effects."""
        return self._native.text

    @property
    def effects(self) -> list[str]:
        """The effects that were added, in order."""
        return self._native.effects

    @property
    def inputs(self) -> list[str]:
        """Names of the inputs, in the order of the text."""
        return [name for name, _ in self._native.inputs]

    @property
    def outputs(self) -> list[str]:
        """Names of the outputs, in the order of the text."""
        return [name for name, _ in self._native.outputs]

    @property
    def states(self) -> list[str]:
        """Names of the states, those of effects last."""
        return self._native.states

    @property
    def params(self) -> pd.Series[float]:
        """The parameters: fitted values where the model comes from a fit or a diagnosis, else those of its text."""
        all = self._native.parameters
        result: pd.Series[float] = series([p[0] for p in all], [p[1] for p in all], "value")
        return result

    def fit(
        self,
        data: Records,
        inputs: Sequence[str] | Mapping[str, str] | None = None,
        outputs: Sequence[str] | Mapping[str, str] | None = None,
        known: Mapping[str, float] | None = None,
        priors: Mapping[str, tuple[float, float]] | None = None,
        *,
        hold: Hold | None = None,
        starts: int = STARTS,
        seed: int = SEED,
        noise_order: int = NOISE_ORDER,
        progress: Progress = False,
    ) -> Fit:
        """Fits the model to records by simulation error.

        `data`: a frame whose index is the time, in s where its name says no unit (`t [min]`), or dates; NaN is a missing reading. A list of
        frames are several experiments, each with initial states of its own. An index that counts rows is read as seconds, with a warning where it has
        no name.
        `inputs`, `outputs`: the columns of the signals: names of the model, or columns in the order of the model, or `{signal: column}`; without
        them the columns have the model's names. A column in another unit (`u [mV]`) is converted.
        `known`: parameters that are not fitted, in the units of the text.
        A controller of the model file needs the column of its reference: then the loop is simulated, as the program does.
        `priors`: what is known of parameters beside the records, `{name: (value, standard error)}`.
        `hold`: what the inputs do between rows, `"zero"` or `"first"`; without it as the model file says, else `"zero"`.
        `starts`, from 1, and `seed`: of the random starts. `noise_order`: the largest order of the noise model that standard errors allow for, 0 (white
        noise) to 20.

        Raises `DataError` and `ModelError`.
        """
        native = self._native
        native = native.with_settings(
            inputs=_columns(native, inputs, "inputs"),
            outputs=_columns(native, outputs, "outputs"),
            known=numbers("known", known),
            priors=pairs("priors", priors, PRIOR),
            hold=hold,
        )
        wanted = [column for _, column in native.inputs + native.outputs]
        records = as_list(data)
        frames = to_frames(records, "data", wanted, native.references)
        with phases(progress) as on_phase:
            fitted = _ctid.Fit.of_model(
                native,
                frames,
                starts=whole("starts", starts, 1, MOST_STARTS),
                seed=whole("seed", seed, 0, LARGEST_SEED),
                noise_order=whole("noise_order", noise_order, 0, LARGEST_NOISE_ORDER),
                progress=on_phase,
            )
        from ._fit import Fit

        return Fit(fitted, [index_of(record, row_count(record), wanted) for record in records])

    @staticmethod
    def tank(
        plant: Plant,
        known: Mapping[str, Known] | None = None,
        *,
        effects: Sequence[str] = (),
        where: Mapping[str, str] | None = None,
        start: Mapping[str, float] | None = None,
        priors: Mapping[str, tuple[float, float]] | None = None,
        hold: Hold | None = None,
    ) -> Model:
        """One of the plants of the program: `single-tank`, `single-tank-linear`, `cascaded-tanks`, `cascaded-tanks-linear`, `first-order`, `three-tank`.

        `known`, `start`, `priors` and `hold` are what a model file has under these names: `known={"area": 154.0}`. `effects` are in the model
        already, in the vessel that `where` names. Raises `ModelError`.
        """
        from ._tank_model import tank

        return tank(plant, known, effects=effects, where=where, start=start, priors=priors, hold=hold)

    def linearize(self, at: Mapping[str, float] | None = None) -> StateSpace:
        """The matrices of the model about values of its states and inputs, `at={"T": 40.0, "u": 30.0}`; a linear model needs none.

        Slopes are exact. Time is in the model's unit; `at["time"]` is the time of a model that hangs on it. Raises `ModelError` where the model
        delays a signal, or a slope is not finite there.
        """
        return state_space(self._native.linearize(numbers("at", at)))

    def monitor(self, *, false_alarm_every: float = 1e6, learn: int = 1000, time_unit: float = 1.0) -> Monitor:
        """The model beside a running plant.

        `false_alarm_every`: mean number of rows between false alarms, 1000 or more; `learn`: fewest rows to learn from, 100 to 1024; `time_unit`:
        seconds in one unit of the model's time. Raises `ModelError`.
        """
        every = number("false_alarm_every", false_alarm_every)
        return Monitor(self._native.monitor(number("time_unit", time_unit), every, whole("learn", learn, 1)))

    def to_modelica(self) -> str:
        """The model as text, its effects in it; its values are the fitted ones where it comes from a fit or a diagnosis."""
        return self._native.to_modelica()

    def __repr__(self) -> str:
        effects = "".join(f" + {effect}" for effect in self.effects)
        return f"<ctid.Model {self.name}{effects}>"

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: object) -> Self:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return _model_of, (self._native.to_bytes(),)


def _model_of(content: bytes) -> Model:
    return Model(_ctid.Model.from_bytes(content))
