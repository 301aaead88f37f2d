"""The Cascaded Tanks of the benchmark package `identibench` from plain physics: two tanks in series, and the effects that a diagnosis adds.

It needs `pip install identibench`, which fetches the records at the first run. Prints the scores (rmse on the test record, in V) of the plain model
and of the one with the effects.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

import ctid

#: Sampling interval of the benchmark in s, where the sequences do not say.
INTERVAL = 4.0


def frame(u: np.ndarray, y: np.ndarray, interval: float) -> pd.DataFrame:
    """A sequence as a record; outputs beyond those that are known are missing."""
    rows = len(u)
    known = np.full(rows, np.nan)
    known[: len(y)] = np.ravel(y)[:rows]
    index = pd.Index(interval * np.arange(rows), name="t [s]")
    return pd.DataFrame({"u": np.ravel(u), "y": known}, index=index)


def interval_of(attrs: dict[str, Any]) -> float:
    rate = attrs.get("fs")
    return 1.0 / float(rate) if rate else INTERVAL


def build_model(context: Any) -> Callable[[np.ndarray, np.ndarray, dict[str, Any]], np.ndarray]:
    """Fits to the whole estimation record: nothing is chosen by a validation record. `hyperparameters={"diagnose": True}` adds effects."""
    records = [frame(s.u, s.y, interval_of(s.attrs)) for s in context.get_train_valid_sequences()]
    model = ctid.Model.tank("cascaded-tanks")
    fit = model.fit(records, inputs=["u"], outputs=["y"])
    if context.hyperparameters.get("diagnose"):
        found = fit.diagnose(progress=False)
        print(found)
        if found.effects:
            fit = found.model.fit(records, inputs=["u"], outputs=["y"])

    def simulate(u: np.ndarray, y_init: np.ndarray, attrs: dict[str, Any]) -> np.ndarray:
        first = max(len(y_init), 1)
        band = fit.simulate(frame(u, y_init, interval_of(attrs)), interval=None, first=first)
        return np.asarray(band.iloc[:, 0]).reshape(-1, 1)

    return simulate


if __name__ == "__main__":
    import identibench
    from identibench.datasets.workshop import BenchmarkCascadedTanks_Simulation as spec

    spec.ensure_datasets_exist()
    for hyperparameters in ({}, {"diagnose": True}):
        result = identibench.run_benchmark(spec, build_model, hyperparameters)
        print(hyperparameters or "plain physics", result["metric_score"])
