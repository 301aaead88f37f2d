"""What a user writes, from the first line to the last: run as a test, and checked by mypy --strict."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

import ctid


def listing(models: Path, folder: Path) -> dict[str, object]:
    """The listing on a bundled record: the first 300 rows are fitted, the others held out."""
    whole = pd.read_csv(models / "heated-block.csv", index_col="t [s]")
    whole.columns = pd.Index(["u", "Ta", "y"])
    df, test = whole.iloc[:300], whole.iloc[300:]
    model = ctid.Model.from_file(models / "heated-block.mo")
    fit = model.fit(df, inputs=["u", "Ta"], outputs=["y"], known={"C": 52.0}, priors={"k": (0.1, 0.2)})
    print(fit.summary())
    numbers = (fit.params, fit.std_errors, fit.conf_int(), fit.cov, fit.residuals, fit.starts)
    band = fit.simulate(test, interval=0.95)
    score = fit.score(test)
    failures = fit.failures()
    d = fit.diagnose(test=test, effort="quick", progress=False)
    tables = (d.verdict, d.effects, d.groups, d.ranking, d.ladder)
    better = d.model
    fit.plot()
    d.plot()
    d.report(folder / "report.html")
    found = d.to_dict()
    text = better.to_modelica()
    at = {name: 20.0 for name in [*better.states, *better.inputs]}
    linear = better.linearize(at=at)
    plan = d.design(between=("lag(u)", "delay(u)"), ranges={"u": (0, 100)}, effort="quick", progress=False)
    mon = better.monitor()
    step = mon.update(0.0, {"u": 3.0, "Ta": 20.0}, {"y": 41.0})
    rls = ctid.ContinuousRls(np.zeros(2), 1e3 * np.eye(2), forgetting=0.02)
    innovation = rls.update(np.array([1.0, 0.5]), 2.0, 0.1)
    trajectory, innovations = rls.run(np.ones((10, 2)), np.ones(10), 0.1)
    identified = ctid.identify(df, method="srivc", order=(1, 0), inputs="u", output="y")
    oe = ctid.StabilizedOe((1, 0), [10.0, 1.0], forgetting=0.002, bandwidth=0.1)
    oe.update(1.0, 0.5, 1.0)
    fcloe = ctid.Fcloe(order=(1, 0)).fit(df["y"].to_numpy(), 5.0, u=df["u"].to_numpy())
    published = (ctid.tables.udink(runs=20), ctid.tables.baysse(runs=10))
    return {
        "numbers": numbers, "band": band, "score": score, "failures": failures, "tables": tables, "better": better, "found": found, "text": text,
        "linear": linear, "plan": plan, "step": step, "innovation": innovation, "trajectory": trajectory, "innovations": innovations,
        "identified": identified, "fcloe": fcloe, "published": published, "fit": fit, "diagnosis": d,
    }
