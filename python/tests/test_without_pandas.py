"""Without pandas and matplotlib: results are mappings of arrays that keep the names and the times."""

from __future__ import annotations

import subprocess
import sys

from conftest import MODELS, RECORDS

SCRIPT = '''
import csv
import sys

# An import of a module that is None here raises ImportError.
sys.modules["pandas"] = sys.modules["matplotlib"] = None
import numpy as np

import ctid


def record(path):
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    return {name: np.array([float(row[k] or "nan") for row in rows[1:]]) for k, name in enumerate(rows[0])}


def names(table, *first):
    """The first columns and that all are arrays of one length."""
    assert type(table) is dict and list(table)[: len(first)] == list(first), list(table)
    assert all(isinstance(column, np.ndarray) for column in table.values()), table
    assert len({column.shape for column in table.values()}) == 1 and next(iter(table.values())).ndim == 1
    return table


data = record(sys.argv[1] + "/heated-block.csv")
time = data["t [s]"]
fit = ctid.Model.from_file(sys.argv[1] + "/heated-block.toml").fit(data)
assert list(fit.params) == list(fit.std_errors) and fit.params["C"] == 52.0
intervals = names(fit.conf_int(), "parameter", "lower", "upper")
assert intervals["parameter"].tolist() == list(fit.params)
cov = names(fit.cov, "parameter")
assert list(cov)[1:] == cov["parameter"].tolist() and np.isclose(cov["k"][cov["parameter"] == "k"], fit.std_errors["k"] ** 2)
assert names(fit.scores(), "output", "rmse", "fit_percent")["output"].tolist() == ["y"]
for table in (fit.residuals, fit.fitted):
    assert (names(table, "t [s]", "y")["t [s]"] == time).all()
assert np.allclose(fit.residuals["y"] + fit.fitted["y"], data["block [degC]"])
band = names(fit.simulate(data), "t [s]", ("y", "mean"), ("y", "lower"))
assert (band["t [s]"] == time).all()
names(fit.failures(), "output", "by", "signal")

halves = [{name: column[part] for name, column in data.items()} for part in (slice(200), slice(200, None))]
several = names(fit.model.fit(halves).residuals, "record", "t [s]", "y")
assert (several["t [s]"] == time).all()
assert several["record"].tolist() == ["data 1"] * 200 + ["data 2"] * (len(time) - 200)

d = fit.diagnose(effort="quick", progress=False)
assert "k" in names(d.params, "parameter", "value", "std_error")["parameter"]
names(d.ladder, "added")
assert names(d.ranking, "effect", "bic_gain")["smallest_visible"].dtype == float
plan = d.design(("lag(u)", "delay(u)"), {"u": (0.0, 100.0)}, effort="quick", progress=False)
assert (np.diff(names(plan.experiment, "t [s]", "u")["t [s]"]) > 0.0).all()
names(plan.experiments, "inputs", "decides")

mon, temperature = fit.model.monitor(learn=200), 20.0
for k in range(1500):
    u = 80.0 if k // 60 % 2 else 20.0
    mon.update(5.0 * k, {"u": u, "Ta": 20.0}, {"y": temperature + 0.1 * np.sin(7.0 * k * k)})
    temperature += 5.0 / 52.0 * (0.12 * u - 0.17 * (temperature - 20.0))
assert mon.phase == "watching" and "k" in names(mon.estimates, "parameter", "learned", "value")["parameter"]

tour = record(sys.argv[2] + "/tour.csv")
tank = ctid.Model.tank("single-tank", known={"area": 154.0}).fit(tour)
output = list(tank.residuals)[1]
assert (names(tank.residuals, "t [s]")["t [s]"] == tour["t [s]"]).all()
assert (names(tank.simulate(tour), "t [s]", (output, "mean"))["t [s]"] == tour["t [s]"]).all()
assert ctid.identify(tour, "srivc").params["a1"] > 0.0

# A temperature T is no time where the model reads it.
own = """model Lag
  input Real u;
  parameter Real tau(min=1.0) = 50.0;
  output Real T(start=0.0);
equation
  tau*der(T) = u - T;
end Lag;
"""
lag = {"T": data["block [degC]"], "u": data["heater [%]"], "t": time}
assert (names(ctid.Model.from_text(own).fit(lag).residuals, "t", "T")["t"] == time).all()

for picture in (fit.plot, d.plot):
    try:
        picture()
    except ImportError as error:
        assert "pip install matplotlib" in str(error)
    else:
        raise AssertionError("a picture without matplotlib")
print("all")
'''


def test_tables_are_mappings():
    ended = subprocess.run([sys.executable, "-c", SCRIPT, str(MODELS), str(RECORDS)], capture_output=True, text=True)
    assert ended.stdout == "all\n", ended.stderr
