"""Results equal the program's to the last digit."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import get_args

import numpy as np
import pandas as pd
import pytest
from conftest import MODELS, RECORDS, read_csv

import ctid
from ctid._linear import Method

#: All methods of `identify`.
METHODS = get_args(Method)

#: What depends on the clock, and the mark of a file.
OTHER = ("seconds", "written_by", "effort")


def results(program: str, folder: Path, *arguments: str | Path) -> dict[str, object]:
    out = folder / "result.json"
    subprocess.run([program, *map(str, arguments), "--json", str(out)], check=True, capture_output=True, cwd=folder)
    found = json.loads(out.read_text(encoding="utf-8"))
    out.unlink()
    return own(found)


def own(found: dict[str, object]) -> dict[str, object]:
    """A result without what depends on the clock, and without the name of a record: a frame has no file."""
    result = {key: value for key, value in found.items() if key not in OTHER}
    if isinstance(result.get("not_noise"), dict):
        result["not_noise"] = {key: value for key, value in result["not_noise"].items() if key != "record"}
    return result


def read(path: Path, index: str) -> pd.DataFrame:
    return read_csv(path, index_col=index)


def test_a_model_of_ones_own(program, tmp_path):
    toml, csv = MODELS / "heated-block.toml", MODELS / "heated-block.csv"
    fit = ctid.Model.from_file(toml).fit(read(csv, "t [s]"))
    assert own(fit.to_dict()) == results(program, tmp_path, "compare", csv, "--model", toml)
    found = own(fit.diagnose(progress=False).to_dict())
    assert found == results(program, tmp_path, "diagnose", csv, "--model", toml)
    # The columns named in the call, in the place of the model file.
    signals = {"inputs": {"u": "heater [%]", "Ta": "room [degC]"}, "outputs": {"y": "block [degC]"}}
    again = ctid.Model.from_file(MODELS / "heated-block.mo").fit(read(csv, "t [s]"), known={"C": 52.0}, **signals)
    assert own(again.to_dict()) == own(fit.to_dict())


def test_several_outputs_and_the_mended_model(program, tmp_path):
    toml, csv = MODELS / "coupled-heaters.toml", MODELS / "coupled-heaters.csv"
    frame = read_csv(csv)
    frame = frame.set_index(frame.columns[0])
    fit = ctid.Model.from_file(toml).fit(frame)
    assert own(fit.to_dict()) == results(program, tmp_path, "compare", csv, "--model", toml)


def test_a_loop_of_a_model_file(program, tmp_path):
    mo = "model Plant\n  parameter Real K = 1;\n  parameter Real tau(unit=\"s\", min=0) = 40;\n  input Real u;\n  output Real y = x;\n"
    (tmp_path / "plant.mo").write_text(mo + "  Real x(start=0);\nequation\n  tau*der(x) = K*u - x;\nend Plant;\n")
    toml = '[controller.u]\ntype = "PI"\noutput = "y"\nreference = "r"\ngain = 0.8\nintegral_time = 60.0\n'
    (tmp_path / "m.toml").write_text('model = "plant.mo"\n\n[columns]\ntime = "t [s]"\nu = "u"\ny = "y"\n\n' + toml)
    draw = np.random.default_rng(3)
    x = integral = 0.0
    rows = []
    for k in range(800):
        r = float((k // 45) * 7 % 5) - 2.0
        y = x + 0.05 * draw.standard_normal()
        u = 0.8 * (r - y + integral / 60.0)
        rows.append((float(k), r, u, y))
        integral += r - y
        x += (2.0 * u - x) * (1.0 - np.exp(-1.0 / 60.0))
    frame = pd.DataFrame(rows, columns=["t [s]", "r", "u", "y"]).set_index("t [s]")
    frame.to_csv(tmp_path / "loop.csv")
    fit = ctid.Model.from_file(tmp_path / "m.toml").fit(read(tmp_path / "loop.csv", "t [s]"))
    found = own(fit.to_dict())
    assert found == results(program, tmp_path, "compare", "loop.csv", "--model", "m.toml")
    assert found["control_loop"]["simulated"]


def test_an_effect_is_added_as_the_program_adds_it(program, tmp_path):
    toml, csv = MODELS / "heated-block.toml", MODELS / "heated-block.csv"
    for name in (toml, csv, MODELS / "heated-block.mo"):
        (tmp_path / name.name).write_bytes(name.read_bytes())
    d = ctid.Model.from_file(toml).fit(read(csv, "t [s]")).diagnose(progress=False)
    subprocess.run([program, "diagnose", csv.name, "--model", toml.name, "--json", "d.json"], check=True, capture_output=True, cwd=tmp_path)
    for effect in d.effects:
        command = [program, "add", effect, "--model", toml.name, "--from", "d.json"]
        subprocess.run(command, check=True, capture_output=True, cwd=tmp_path)
    better = d.model.fit(read(csv, "t [s]"))
    assert own(better.to_dict()) == results(program, tmp_path, "compare", csv.name, "--model", toml.name)


def test_a_simulation(program, tmp_path):
    toml, csv = MODELS / "heated-block.toml", MODELS / "heated-block.csv"
    command = [program, "simulate", str(toml), str(csv), "--fit", str(csv), "--out", "y.csv"]
    subprocess.run(command, check=True, capture_output=True, cwd=tmp_path)
    by_program = read_csv(tmp_path / "y.csv")
    band = ctid.Model.from_file(toml).fit(read(csv, "t [s]")).simulate(read(csv, "t [s]"))
    assert band["y", "mean"].tolist() == by_program.iloc[:, 1].tolist()
    assert band["y", "lower"].tolist() == by_program.iloc[:, 2].tolist()
    assert band["y", "upper"].tolist() == by_program.iloc[:, 3].tolist()


def test_a_tank(program, tmp_path, tour, tour_test):
    data = [RECORDS / "tour.csv", "--model", RECORDS / "tour.toml"]
    fit = ctid.Model.tank("single-tank", known={"area": 154.0}).fit(tour, inputs=["u"], outputs=["y"])
    assert own(fit.to_dict()) == results(program, tmp_path, "compare", *data)
    found = own(fit.diagnose(test=tour_test, progress=False).to_dict())
    assert found == results(program, tmp_path, "diagnose", *data, "--test", RECORDS / "tour-test.csv")


def test_an_experiment(program, tmp_path):
    toml, csv = MODELS / "heated-block.toml", MODELS / "heated-block.csv"
    d = ctid.Model.from_file(toml).fit(read(csv, "t [s]")).diagnose(effort="quick", progress=False)
    between = ("lag(u)", "delay(u)")
    plan = d.design(between, {"u": (0.0, 100.0)}, slews={"u": 20.0}, duration=600.0, progress=False)
    options = ["--between", *between, "--input", "u=0..100", "--slew", "20", "--duration", "600"]
    by_program = results(program, tmp_path, "design", csv, "--model", toml, *options)
    assert own(plan.to_dict()) == by_program
    best = by_program["experiment"]
    assert plan.experiment.index.tolist() == best["time"] and len(best["time"]) > 100
    assert plan.experiment["u"].tolist() == best["inputs"][0]["values"]


def test_a_monitor(program, tmp_path):
    toml = MODELS / "heated-block.toml"
    rng, temperature, rows = np.random.default_rng(1), 20.0, []
    for k in range(2600):
        u = 80.0 if k // 60 % 2 else 20.0
        rows.append((5.0 * k, u, 20.0, float(temperature + 0.1 * rng.standard_normal())))
        loss = 0.17 if k < 2000 else 0.3
        temperature += 5.0 / 52.0 * (0.12 * u - loss * (temperature - 20.0))
    mon = ctid.Model.from_file(toml).monitor(learn=200)
    steps = [mon.update(t, {"u": u, "Ta": room}, {"y": y}) for t, u, room, y in rows]
    alarms = [step.alarm for step in steps if step.alarm is not None]
    text = "t [s],heater [%],room [degC],block [degC]\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows)
    command = [program, "monitor", "--model", str(toml), "--learn", "200"]
    ended = subprocess.run(command, input=text, text=True, check=True, capture_output=True, cwd=tmp_path)
    lines = [json.loads(line) for line in ended.stdout.splitlines()]
    by_program = [line for line in lines if "verdict" in line]
    assert alarms and [{k: v for k, v in line.items() if k in alarms[0]} for line in by_program] == alarms


@pytest.mark.parametrize("method", METHODS)
def test_a_linear_model(program, tmp_path, tour, method):
    found = own(ctid.identify(tour, method, (1, 0)).to_dict())
    record = found.pop("record")
    by_program = results(program, tmp_path, "identify", RECORDS / "tour.csv", "--method", method, "--order", "1,0")
    assert record == "data" and by_program.pop("record") == "tour.csv"
    # The record's name is all that differs.
    assert json.loads(json.dumps(found).replace('"data"', '"tour.csv"')) == by_program


def test_a_table(program, tmp_path):
    assert own(ctid.tables.baysse(runs=10, seed=2)) == results(program, tmp_path, "tables", "baysse", "--runs", "10", "--seed", "2")


def test_the_time_unit_of_a_model_file(tmp_path):
    toml, csv = MODELS / "heated-block.toml", MODELS / "heated-block.csv"
    per_second = ctid.Model.from_file(toml).fit(read(csv, "t [s]"))
    (tmp_path / "heated-block.mo").write_text((MODELS / "heated-block.mo").read_text(encoding="utf-8"), encoding="utf-8")
    text = toml.read_text(encoding="utf-8").replace('time = "t [s]"', 'time = "t [min]"\ntime_unit = "s"')
    (tmp_path / "m.toml").write_text(text, encoding="utf-8")
    minutes = read(csv, "t [s]")
    minutes.index = pd.Index(minutes.index / 60.0, name="t [min]")
    fit = ctid.Model.from_file(tmp_path / "m.toml").fit(minutes)
    np.testing.assert_allclose(fit.params, per_second.params, rtol=1e-5)
