"""A model, its fit, its diagnosis."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from . import _ctid
from ._ctid import DataError, ModelError
from ._frames import Array, Data, Records, as_list, index_of, need_pandas, series, table, to_frame, to_frames

from ._linear import StateSpace, state_space
from ._monitor import Monitor

if TYPE_CHECKING:
    import pandas as pd
    from typing_extensions import Self

    from ._tank_model import Known, Plant

#: How much time a search may take: 5 s, 40 s, 10 min.
Effort = Literal["quick", "normal", "thorough"]
#: What the inputs do between two rows: they stand, or run on a straight line.
Hold = Literal["zero", "first"]
#: Called with every phase that begins; True prints them where the terminal is one, False prints nothing.
Progress = bool | Callable[[str], object]

_STARTS, _SEED, _NOISE_ORDER = 12, 1, 6


def _teller(progress: Progress) -> Callable[[str], object] | None:
    if callable(progress):
        return progress
    if progress and sys.stderr.isatty():
        return lambda phase: print(f"\r\x1b[K{phase} ...", end="", file=sys.stderr, flush=True)
    return None


def _clear(progress: Progress) -> None:
    if progress is True and sys.stderr.isatty():
        print("\r\x1b[K", end="", file=sys.stderr, flush=True)


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
                raise ModelError(f'"{name}" is none of the {role} of {model.name}: it has {", ".join(names) or "none"}')
        return [str(given.get(name, column)) for name, column in own]
    columns = [str(column) for column in given]
    if len(columns) != len(names):
        raise ModelError(
            f'{len(columns)} {role} are given, and {model.name} has {len(names)} ({", ".join(names)}): name a column for each, {role}=[...]'
        )
    return names if set(columns) == set(names) else columns


class Model:
    """A model in continuous time; it never changes.

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
        starts: int = _STARTS,
        seed: int = _SEED,
        noise_order: int = _NOISE_ORDER,
        progress: Progress = False,
    ) -> Fit:
        """Fits the model to records by simulation error.

        `data`: a frame whose index is the time, in s where its name says no unit (`t [min]`), or dates; NaN is a missing reading. A list of
        frames are several experiments, each with initial states of its own.
        `inputs`, `outputs`: the columns of the signals: names of the model, or columns in the order of the model, or `{signal: column}`; without
        them the columns have the model's names. A column in another unit (`u [mV]`) is converted.
        `known`: parameters that are not fitted, in the units of the text.
        `priors`: what is known of parameters beside the records, `{name: (value, standard error)}`.
        `hold`: what the inputs do between rows, `"zero"` or `"first"`; without it as the model file says, else `"zero"`.
        `starts`, `seed`: of the random starts. `noise_order`: the largest order of the noise model that standard errors allow for.

        Raises `DataError` and `ModelError`.
        """
        native = self._native
        native = native.with_settings(
            inputs=_columns(native, inputs, "inputs"),
            outputs=_columns(native, outputs, "outputs"),
            known={str(name): float(value) for name, value in (known or {}).items()},
            priors={str(name): (float(v), float(e)) for name, (v, e) in (priors or {}).items()},
            hold=hold,
        )
        wanted = [column for _, column in native.inputs + native.outputs]
        records = as_list(data)
        frames = to_frames(records, "data", wanted)
        try:
            fitted = native.fit(frames, starts=starts, seed=seed, noise_order=noise_order, progress=_teller(progress))
        finally:
            _clear(progress)
        return Fit(fitted, [index_of(record, _rows(record)) for record in records])

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
        found = self._native.linearize({str(name): float(value) for name, value in (at or {}).items()})
        return state_space(found)

    def monitor(self, *, false_alarm_every: float = 1e6, learn: int = 1000, time_unit: float = 1.0) -> Monitor:
        """The model beside a running plant.

        `false_alarm_every`: mean number of rows between false alarms, 1000 or more; `learn`: fewest rows to learn from, 100 to 1024; `time_unit`:
        seconds in one unit of the model's time. Raises `ModelError`.
        """
        return Monitor(self._native.monitor(float(time_unit), float(false_alarm_every), int(learn)))

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


def _rows(data: Data) -> int:
    if isinstance(data, Mapping):
        return max((np.asarray(values).size for values in data.values()), default=0)
    return len(data)


def _p(value: float) -> str:
    if np.isnan(value):
        return "-"
    return "< 0.001" if value < 0.001 else f"{value:.3f}"


class Fit:
    """A model that was fitted to records; it never changes."""

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
        """Intervals that hold the truth with probability `level`, within 0 and 1: columns `lower` and `upper`."""
        halves = [np.nan if half is None else half for half in self._native.half_widths(level)]
        all = self._native.estimates
        lower = [e[1] - half for e, half in zip(all, halves, strict=True)]
        upper = [e[1] + half for e, half in zip(all, halves, strict=True)]
        result: pd.DataFrame = table({"lower": lower, "upper": upper}, [e[0] for e in all])
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
        result: pd.DataFrame = need_pandas().DataFrame(matrix, index=names, columns=names)
        return result

    def _tables(self, of: Callable[[Array, Array], Array]) -> pd.DataFrame:
        pandas = need_pandas()
        parts = []
        for k, (record, times, outputs) in enumerate(self._series):
            columns = {name: of(measured, model) for name, measured, model in outputs}
            index = self._indexes[k] if len(self._indexes) == len(self._series) else None
            if index is None or len(index) != len(times):
                index = pandas.Index(times, name="t [s]")
            parts.append((record, pandas.DataFrame(columns, index=index)))
        if len(parts) == 1:
            result: pd.DataFrame = parts[0][1]
            return result
        names = [f"{name} ({k + 1})" if sum(n == name for n, _ in parts) > 1 else name for k, (name, _) in enumerate(parts)]
        result = pandas.concat([part for _, part in parts], keys=names, names=["record"])
        return result

    @property
    def residuals(self) -> pd.DataFrame:
        """Measured minus simulated, a column for each output; NaN where nothing was measured. Several records stand under their names."""
        return self._tables(lambda measured, model: measured - model)

    @property
    def fitted(self) -> pd.DataFrame:
        """What the fitted model gives on its records, a column for each output."""
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
            {"rmse": [s[1] for s in found], "fit_percent": [s[2] for s in found]}, [s[0] for s in found]
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
        frames = to_frames(test, "test", self._wanted)
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
        names = list(data)
        present = [c for _, c in model.outputs if any(str(n) == c or str(n).split(" [")[0] == c for n in names)]
        frame = to_frame(data, "test", signals + present)
        found = self._native.simulate(frame, first, 0.95 if interval is None else interval)
        columns: dict[Any, Array] = {}
        for (output, _), series in zip(model.outputs, found["outputs"].values(), strict=True):
            for name, values in series.items():
                if interval is not None or name == "mean":
                    columns[output, name] = values
        rows = next(iter(columns.values())).size
        result: pd.DataFrame = table(columns, index_of(data, rows))
        return result

    def failures(self) -> pd.DataFrame:
        """Where the model fails on its records: windows of time, levels, inputs, directions and frequencies whose error is above the noise.

        Columns: `output`, `by`, `record` of a window of time, the edges `from` and `to`, `samples`, the `mean` of the residual (measured minus
        model), its `rms`, and its `share` of the squared error among those of the same `by`. The worst first. `failures_in_words` says the same.
        """
        rows: dict[str, list[Any]] = {
            key: [] for key in ("output", "by", "record", "from", "to", "samples", "mean", "rms", "share")
        }
        found: list[tuple[Any, ...]] = []
        for output, _, bins, _ in self._native.outputs:
            sums: dict[str, float] = {}
            for by, (_, _, _, count, _, rms, _) in bins:
                sums[by] = sums.get(by, 0.0) + count * rms * rms
            for by, (record, start, end, count, mean, rms, fails) in bins:
                if fails:
                    share = count * rms * rms / sums[by] if sums[by] > 0.0 else np.nan
                    found.append((output, by, record, start, end, count, mean, rms, share))
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
        seed: int = _SEED,
        progress: Progress = True,
    ) -> Diagnosis:
        """Searches the catalogue of effects, at every port of the model, for what it is missing.

        `test`: records that take part in no fit and no choice, and are only scored. `effort`: `"quick"` (5 s), `"normal"` (40 s) or `"thorough"`
        (10 min); `time_limit` in s goes before it, and what it does not allow is left out (`left_out`). Ctrl-C ends it.

        Raises `DataError` and `ModelError`.
        """
        frames = to_frames(test, "test", self._wanted) if test is not None else []
        if max_effects is not None and max_effects < 1:
            raise ModelError("max_effects is a whole number above zero")
        try:
            found = self._native.diagnose(
                frames,
                effort=effort,
                time_limit=time_limit,
                max_effects=max_effects,
                seed=seed,
                progress=_teller(progress),
            )
        finally:
            _clear(progress)
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


class Diagnosis:
    """What a model is missing; it never changes."""

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
        """For each of them itself, then all that these records cannot tell from it, the best first."""
        return [list(group) for group in self._found["groups"]]

    @property
    def ranking(self) -> pd.DataFrame:
        """The single effects that were fitted, the best first: `bic_gain` (larger is better), the error at each output, and the sizes in words."""
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
        result: pd.DataFrame = table(columns, [p["name"] for p in all])
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
        seed: int = _SEED,
        progress: Progress = True,
    ) -> Design:
        """Proposes the next experiment, which tells two effects apart, as `ctid design` does.

        `ranges`: smallest and largest value of inputs, in their units; without them what the records visited. `slews`: the largest change in a second.
        `inputs`: those that are applied; without them all that have a range or moved. `duration` in s; without it that of the longest record.

        Raises `ModelError` where the effects or the limits do not allow one.
        """
        first, second = between
        applied = list(inputs) if inputs is not None else list(ranges or {})
        try:
            found, time_unit = self._native.design(
                (str(first), str(second)),
                ranges={name: (float(low), float(high)) for name, (low, high) in (ranges or {}).items()},
                slews={name: float(value) for name, value in (slews or {}).items()},
                inputs=applied,
                duration=duration,
                seed=seed,
                effort=effort,
                time_limit=time_limit,
                progress=_teller(progress),
            )
        finally:
            _clear(progress)
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


class Design:
    """An experiment that was proposed; it never changes."""

    __slots__ = ("_found", "_time_unit")

    def __init__(self, found: dict[str, Any], time_unit: float) -> None:
        self._found = found
        self._time_unit = time_unit

    @property
    def prospect(self) -> str:
        """`decides`, `may`, `hardly`, or `twins` where no experiment tells the two apart."""
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


def _model_of(content: bytes) -> Model:
    return Model(_ctid.Model.from_bytes(content))


def _fit_of(content: bytes, indexes: list[Any]) -> Fit:
    return Fit(_ctid.Fit.from_bytes(content), indexes)


def _diagnosis_of(content: bytes) -> Diagnosis:
    return Diagnosis(_ctid.Diagnosis.from_bytes(content))
