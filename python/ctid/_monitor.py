"""A model beside a running plant."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _ctid
from ._ctid import DataError
from ._frames import table

if TYPE_CHECKING:
    import pandas as pd
    from typing_extensions import Self


@dataclass(frozen=True)
class RowResult:
    """Result of one row."""

    #: Measured minus model, by output; NaN without a reading, and while it learns.
    residuals: dict[str, float]
    #: Innovations of the noise model (residual minus its one-step prediction), in standard deviations.
    innovations: dict[str, float]
    #: Alarm (the model does not fit any more), or its update with a better diagnosis: the object that `ctid monitor` writes as a line of JSON.
    alarm: dict[str, Any] | None
    #: Outputs whose noise has grown, or has returned to its former size.
    scatter: list[dict[str, Any]]
    #: Notices about the rows or the phase (learning, monitoring), by `kind`.
    notices: list[dict[str, Any]]
    #: Why readings are not used, by output.
    lost: dict[str, str]


class Monitor:
    """Monitors a plant row by row. It first fits the model, then reports when the model no longer fits, the onset, and the effects that explain it."""

    __slots__ = ("_inputs", "_native", "_outputs")

    def __init__(self, native: _ctid.Monitor) -> None:
        self._native = native
        self._inputs, self._outputs = native.signals

    def update(self, t: float, inputs: Mapping[str, float], outputs: Mapping[str, float]) -> RowResult:
        """Takes in a row: the time in s, every input, and those outputs that have a reading. Raises `DataError`."""
        u = _values("inputs", inputs, self._inputs, True)
        y = _values("outputs", outputs, self._outputs, False)
        innovations, alarm, scatter, notices, lost = self._native.update(_value("time", t), u, y)
        names = self._outputs
        pairs = [(name, pair or (np.nan, np.nan)) for name, pair in zip(names, innovations, strict=False)]
        return RowResult(
            residuals={name: pair[0] for name, pair in pairs},
            innovations={name: pair[1] for name, pair in pairs},
            alarm=None if alarm is None else json.loads(alarm),
            scatter=[json.loads(one) for one in scatter],
            notices=notices,
            lost={name: why for name, why in zip(names, lost, strict=False) if why is not None},
        )

    @property
    def estimates(self) -> pd.DataFrame:
        """The parameters as they are tracked: as learned, now, half the width of the 95 % interval, unit."""
        all = self._native.estimates
        columns = {
            "learned": [e[2] for e in all],
            "value": [e[3] for e in all],
            "half_width": [np.nan if e[4] is None else e[4] for e in all],
            "unit": [e[1] for e in all],
        }
        result: pd.DataFrame = table(columns, [e[0] for e in all], "parameter")
        return result

    @property
    def phase(self) -> str:
        """`learning`, `watching` or `alarmed`."""
        return self._native.progress[0]

    @property
    def rows(self) -> int:
        """Rows that were taken in."""
        return self._native.rows

    def __repr__(self) -> str:
        return f"<ctid.Monitor {self.phase}, {self.rows} rows>"

    def __copy__(self) -> Self:
        return type(self)(_ctid.Monitor.from_bytes(self._native.to_bytes()))

    def __deepcopy__(self, memo: object) -> Self:
        return self.__copy__()

    def __reduce__(self) -> tuple[Any, ...]:
        return _monitor_of, (self._native.to_bytes(),)


def _values(role: str, given: Mapping[str, float], names: list[str], all_needed: bool) -> list[float]:
    if not isinstance(given, Mapping):
        raise DataError(f"{role} are {given!r}: give values by name, {{{', '.join(f'{name!r}: ...' for name in names)}}}")
    for name in given:
        if name not in names:
            raise DataError(f'"{name}" is not one of the {role} of the model: it has {", ".join(names) or "none"}')
    lacking = [name for name in names if name not in given]
    if lacking and all_needed:
        raise DataError(f"{role}: there is no value of {', '.join(lacking)}: every input is needed")
    return [_value(f'"{name}"', given.get(name, np.nan)) for name in names]


def _value(name: str, value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise DataError(f"{name} is {value!r}: give a number, float('nan') where there is no reading") from None


def _monitor_of(content: bytes) -> Monitor:
    return Monitor(_ctid.Monitor.from_bytes(content))
