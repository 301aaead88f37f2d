"""The fit of a model to records."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _ctid
from ._arguments import LARGEST_SEED, number, whole
from ._ctid import DataError
from ._diagnosis import Diagnosis
from ._frames import (
    Array,
    Data,
    Records,
    band_table,
    columns_in,
    series,
    stacked,
    table,
    to_frames,
    to_one_frame,
)
from ._model import Model
from ._options import SEED, Effort, Progress, phases

if TYPE_CHECKING:
    import pandas as pd
    from typing_extensions import Self


def _p(value: float) -> str:
    if np.isnan(value):
        return "-"
    return "< 0.001" if value < 0.001 else f"{value:.3f}"


class Fit:
    """A model that was fitted to records; immutable."""

    __slots__ = ("_indexes", "_native")

    def __init__(self, native: _ctid.Fit, indexes: Sequence[Any]) -> None:
        self._native = native
        self._indexes = list(indexes)

    @property
    def model(self) -> Model:
        """The model with its fitted values."""
        return Model(self._native.model)

    @property
    def params(self) -> pd.Series[float]:
        """All parameters, then the initial states, in the units of the text."""
        all = self._native.estimates
        result: pd.Series[float] = series([e[0] for e in all], [e[1] for e in all], "value")
        return result

    @property
    def std_errors(self) -> pd.Series[float]:
        """Standard errors under the noise of the residual; NaN of what is known, at a bound, or not determined."""
        all = self._native.estimates
        result: pd.Series[float] = series([e[0] for e in all], [e[2] for e in all], "std_error")
        return result

    def conf_int(self, level: float = 0.95) -> pd.DataFrame:
        """Confidence intervals: columns `lower` and `upper`. `level`: probability that an interval contains the true value, between 0 and 1."""
        halves = [np.nan if half is None else half for half in self._native.half_widths(level)]
        all = self._native.estimates
        lower = [e[1] - half for e, half in zip(all, halves, strict=True)]
        upper = [e[1] + half for e, half in zip(all, halves, strict=True)]
        result: pd.DataFrame = table({"lower": lower, "upper": upper}, [e[0] for e in all], "parameter")
        return result

    @property
    def cov(self) -> pd.DataFrame:
        """Covariance of what was fitted, under the noise of the residual. Raises `DataError` where the records do not determine all of it."""
        found = self._native.covariance()
        if found is None:
            which = "; ".join(" with ".join(names) for names in self._not_determined)
            raise DataError(
                f"the records do not determine all that is fitted ({which or 'see summary()'}): make some of it known, or give priors"
            )
        names, matrix = found
        result: pd.DataFrame = table({name: matrix[:, k] for k, name in enumerate(names)}, names, "parameter")
        return result

    def _tables(self, of: Callable[[Array, Array], Array]) -> pd.DataFrame:
        parts = []
        for k, (record, times, outputs) in enumerate(self._series):
            columns = {name: of(measured, model) for name, measured, model in outputs}
            index = self._indexes[k] if len(self._indexes) == len(self._series) else None
            if index is None or len(index[1]) != len(times):
                index = ("t [s]", times)
            parts.append((record, index, columns))
        if len(parts) == 1:
            _, (name, index), columns = parts[0]
            result: pd.DataFrame = table(columns, index, name)
            return result
        records = [record for record, _, _ in parts]
        names = [f"{name} ({k + 1})" if records.count(name) > 1 else name for k, name in enumerate(records)]
        result = stacked([(name, index, columns) for name, (_, index, columns) in zip(names, parts, strict=True)])
        return result

    @property
    def residuals(self) -> pd.DataFrame:
        """Measured minus simulated, a column for each output; NaN where nothing was measured. Several records stand under their names."""
        return self._tables(lambda measured, model: measured - model)

    @property
    def fitted(self) -> pd.DataFrame:
        """Simulated outputs of the fitted model on its records, one column for each output."""
        return self._tables(lambda _, model: model)

    @property
    def starts(self) -> dict[str, int]:
        """How many starts were tried, and how many of them ended in the best minimum."""
        tried, agree = self._native.starts
        return {"tried": tried, "agree": agree}

    @property
    def bic(self) -> float:
        """Bayesian information criterion; smaller is better."""
        return self._native.bic

    def scores(self, test: Records | None = None) -> pd.DataFrame:
        """Simulation error (`rmse`, in the unit of the output) and fit (`fit_percent`, %) of each output, on the fitted records or others.

        On others the initial states are fitted to the first rows, which are not scored.
        """
        found = self._scores if test is None else self._score_of(test)
        result: pd.DataFrame = table(
            {"rmse": [s[1] for s in found], "fit_percent": [s[2] for s in found]}, [s[0] for s in found], "output"
        )
        return result

    def score(self, test: Records) -> float:
        """Simulation fit on other records, never one step ahead: `100 (1 - rmse/s)` with the standard deviation s of the readings, %.

        Of several outputs it is their mean. `scores` has each. 100 is perfect, 0 no better than the mean, and below zero worse.
        """
        found = self._score_of(test)
        if not found:
            raise DataError("test: no record: give a frame, or a list of them")
        return float(np.mean([s[2] for s in found]))

    @property
    def _not_determined(self) -> list[list[str]]:
        return self._native.not_determined

    @property
    def _units(self) -> list[str]:
        return self._native.output_units

    @property
    def _series(self) -> list[tuple[str, Array, list[tuple[str, Array, Array]]]]:
        return self._native.series

    @property
    def _scores(self) -> list[tuple[str, float, float]]:
        return self._native.scores

    def _score_of(self, test: Records) -> list[tuple[str, float, float]]:
        frames = to_frames(test, "test", self._wanted, self._native.model.references)
        return self._native.score(frames) if frames else []

    @property
    def _name(self) -> str:
        model = self._native.model
        return " + ".join([model.name, *model.effects])

    @property
    def _wanted(self) -> list[str]:
        model = self._native.model
        return [column for _, column in model.inputs + model.outputs]

    def simulate(self, data: Data, interval: float | None = 0.95, *, first: int = 5) -> pd.DataFrame:
        """The fitted model on the inputs of another record.

        Columns are pairs: the output, and `mean`, `lower` and `upper` of the band that holds the model's output with probability `interval`, and
        `reading lower` and `reading upper` of the band of a reading. Where the record has readings, the initial states are fitted to the `first`
        of each output; else they are those of the text. Without an interval, or where the records do not determine the parameters, there is the
        mean alone.
        """
        model = self._native.model
        signals = [column for _, column in model.inputs]
        wanted = signals + columns_in(data, [column for _, column in model.outputs])
        frame = to_one_frame(data, "test", wanted)
        found = self._native.simulate(frame, whole("first", first, 1), 0.95 if interval is None else number("interval", interval))
        outputs = [name for name, _ in model.outputs]
        return band_table(zip(outputs, found["outputs"].values(), strict=True), data, interval, wanted)

    def failures(self) -> pd.DataFrame:
        """Where the model fails on its records: windows of time, ranges of the output, the inputs and the states, directions of change and frequencies whose error is above the noise.

        Columns: `output`, `by`, `signal` (the input or the state), `record` of a window of time, the edges `from` and `to`, `samples`, the `mean` of the residual (measured minus
        model), its `rms`, and its `share` of the squared error among those of the same `by`. The worst first. `failures_in_words` says the same.
        """
        rows: dict[str, list[Any]] = {
            key: [] for key in ("output", "by", "signal", "record", "from", "to", "samples", "mean", "rms", "share")
        }
        found: list[tuple[Any, ...]] = []
        for output, _, bins, _ in self._native.outputs:
            sums: dict[tuple[str, str | None], float] = {}
            for by, signal, (_, _, _, count, _, rms, _) in bins:
                sums[by, signal] = sums.get((by, signal), 0.0) + count * rms * rms
            for by, signal, (record, start, end, count, mean, rms, fails) in bins:
                if fails:
                    whole = sums[by, signal]
                    share = count * rms * rms / whole if whole > 0.0 else np.nan
                    found.append((output, by, signal, record, start, end, count, mean, rms, share))
        for row in sorted(found, key=lambda row: -row[-1]):
            for key, value in zip(rows, row, strict=True):
                rows[key].append(value)
        result: pd.DataFrame = table(rows)
        return result

    def failures_in_words(self) -> list[str]:
        """Where the model fails, as the program says it."""
        outputs = self._native.outputs
        many = len(outputs) > 1
        return [f"{name}: {line}" if many else line for name, _, _, lines in outputs for line in lines]

    def summary(self) -> str:
        """Parameters with standard errors and 95 % intervals, fit %, and the tests of the residual."""
        estimates = self._native.estimates
        halves = self._native.half_widths(0.95)
        head = ["", "value", "std. error", "lower", "upper", "unit"]
        rows = [head]
        for (name, value, error, unit, known), half in zip(estimates, halves, strict=True):
            if error is None or half is None:
                why = "(known)" if known else "(at a bound, or not determined)"
                rows.append([name, f"{value:.6g}", why, "", "", unit])
            else:
                numbers = [f"{value:.6g}", f"{error:.3g}", f"{value - half:.6g}", f"{value + half:.6g}"]
                rows.append([name, *numbers, unit])
        tried, agree = self._native.starts
        lines = [self._name, "", *_aligned(rows), ""]
        lines.append(f"{agree} of {tried} starts ended in this minimum")
        for names in self._not_determined:
            lines.append(f"warning: these records do not determine {' and '.join(names)} one without the other")
        if self._native.control_loop is not None:
            lines.append(f"warning: {self._native.control_loop}")
        rows = [["", "fit %", "rmse", "whiteness p", "input p"]]
        tests = {name: p for name, p, _, _ in self._native.outputs}
        for name, rmse, percent in self._scores:
            white, trace = tests.get(name, (np.nan, np.nan))
            rows.append([name, f"{percent:.2f}", f"{rmse:.4g}", _p(white), _p(trace)])
        lines += ["", *_aligned(rows)]
        return "\n".join(line.rstrip() for line in lines) + "\n"

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
        """Searches the catalogue of effects, at every port of the model, for what it is missing.

        `test`: records that take part in no fit and no choice, and are only scored. `effort`: `"quick"` (5 s), `"normal"` (40 s) or `"thorough"`
        (10 min); `time_limit` in s goes before it, and what it does not allow is left out (`left_out`). Ctrl-C ends it.

        Raises `DataError` and `ModelError`.
        """
        others = self._native.model.references
        frames = to_frames(test, "test", self._wanted, others) if test is not None else []
        with phases(progress, _ctid.time_limit(effort, time_limit)) as on_phase:
            found = self._native.diagnose(
                frames,
                effort=effort,
                time_limit=time_limit,
                max_effects=None if max_effects is None else whole("max_effects", max_effects, 1),
                seed=whole("seed", seed, 0, LARGEST_SEED),
                progress=on_phase,
            )
        return Diagnosis(found)

    def to_dict(self) -> dict[str, Any]:
        """The result as `ctid compare --json` writes it; numbers that are none are None."""
        result: dict[str, Any] = json.loads(self._native.json())
        return result

    def to_modelica(self) -> str:
        """The model's text with its fitted values, and their standard errors in comments."""
        return self._native.to_modelica()

    def report(self, path: str | os.PathLike[str]) -> None:
        """Writes the page of `ctid compare --report`, which needs no network."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self._native.html())

    def plot(self, ax: Any = None) -> Any:
        """Measured and simulated outputs, and their residuals; returns matplotlib axes."""
        from ._plot import fit_axes

        return fit_axes(self._series, self._units, ax)

    def __repr__(self) -> str:
        percent = ", ".join(f"{name} {fit:.1f} %" for name, _, fit in self._scores)
        return f"<ctid.Fit of {self._name}: {percent}>"

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: object) -> Self:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return _fit_of, (self._native.to_bytes(), self._indexes)


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    first_left = [f"{row[0]:<{widths[0]}}  " for row in rows]
    rest = ["  ".join(f"{cell:>{w}}" for cell, w in zip(row[1:-1], widths[1:-1], strict=True)) for row in rows]
    last = [f"{row[-1]:>{widths[-1]}}" if row[-1][:1].isdigit() else row[-1] for row in rows]
    return [f"  {a}{b}  {c}" for a, b, c in zip(first_left, rest, last, strict=True)]


def _fit_of(content: bytes, indexes: list[Any]) -> Fit:
    return Fit(_ctid.Fit.from_bytes(content), indexes)
