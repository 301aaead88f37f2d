"""What else a plant of the program can do: a monitor beside it, its matrices, its next experiment."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from . import _ctid
from ._arguments import LARGEST_SEED, number, numbers, pair, pairs, whole
from ._ctid import ModelError
from ._design import BETWEEN, RANGE, Design
from ._frames import table
from ._linear import StateSpace, state_space
from ._monitor import Monitor
from ._options import Progress, phases

if TYPE_CHECKING:
    import pandas as pd


def linearized(tank: _ctid.Tank, values: Mapping[str, float], at: Mapping[str, float] | None) -> StateSpace:
    """The matrices of a plant with these values of its parameters."""
    return state_space(tank.linearize(dict(values), numbers("at", at)))


def linearized_with_effects(fit: _ctid.TankFit, at: Mapping[str, float] | None) -> StateSpace:
    """The matrices of the text of a plant with effects."""
    return state_space(fit.linearize(numbers("at", at)))


def monitored(
    tank: _ctid.Tank, units: tuple[str, str], false_alarm_every: float, learn: int, time_unit: float
) -> Monitor:
    """A monitor that runs the model beside the running plant; `units`: of the command and of the readings."""
    if time_unit != 1.0:
        raise ModelError(f"{tank.name}: the time of a plant is in s, leave time_unit out")
    return Monitor(tank.monitor(units, number("false_alarm_every", false_alarm_every), whole("learn", learn, 1)))


def _of_the_only(what: str, given: Mapping[str, Any], name: str, plant: str) -> Any:
    """The entry of the only applied signal; an error if there is an entry for another signal."""
    for other in given:
        if other != name:
            raise ModelError(f'{what}: "{other}" is not applied to {plant}: its experiment has the one signal "{name}"')
    return given.get(name)


def designed(
    content: bytes,
    plant: str,
    applied: str,
    between: tuple[str, str],
    ranges: Mapping[str, tuple[float, float]] | None,
    slews: Mapping[str, float] | None,
    inputs: Sequence[str],
    *,
    duration: float | None,
    effort: str,
    time_limit: float | None,
    seed: int,
    progress: Progress,
) -> TankDesign:
    """The experiment that distinguishes two effects; `content`: plant and records, in the form in which a fit is pickled."""
    first, second = pair("between", between, BETWEEN)
    for name in inputs:
        _of_the_only("inputs", {name: None}, applied, plant)
    found = _of_the_only("ranges", pairs("ranges", ranges, RANGE), applied, plant)
    slew = _of_the_only("slews", numbers("slews", slews), applied, plant)
    with phases(progress, _ctid.time_limit(effort, time_limit)) as on_phase:
        text = _ctid.tank_design(
            content,
            (str(first), str(second)),
            range=found,
            slew=slew,
            duration=duration,
            seed=whole("seed", seed, 0, LARGEST_SEED),
            effort=effort,
            time_limit=time_limit,
            progress=on_phase,
        )
    return TankDesign(json.loads(text), 1.0)


class TankDesign(Design):
    """An experiment that was proposed for a plant; immutable."""

    __slots__ = ()

    @property
    def experiment(self) -> pd.DataFrame:
        """The best experiment, to be applied: the command, in its unit; the index is the time in s."""
        found = self._found["experiment"]
        result: pd.DataFrame = table({found["name"]: found["values"]}, found["time"], "t [s]")
        return result

    @property
    def experiments(self) -> pd.DataFrame:
        """All experiments that were tried, the best first: what each applies, and the probability with which it decides."""
        name = self._found["experiment"]["name"]
        all = self._found["candidates"]
        applied = [f"{name}: {e['kind']} {e['low']:.3g}..{e['high']:.3g}" for e in all]
        result: pd.DataFrame = table({"inputs": applied, "decides": [e["power"]["decides"] for e in all]})
        return result
