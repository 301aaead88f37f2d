"""Plants of the program: a monitor beside them, the next experiment, their matrices."""

from __future__ import annotations

import json
import pickle
import subprocess

import numpy as np
import pytest
from conftest import RECORDS

import ctid

OTHER = ("seconds", "effort", "written_by")


@pytest.fixture(scope="module")
def leaking() -> list[tuple[float, float, float]]:
    """Time, command and level of a tank that loses water from 3000 s on."""
    rng = np.random.default_rng(1)
    level, rows = 16.0, []
    for k in range(4000):
        u = float(4.0 + 2.0 * (np.sin(0.013 * k) > 0.0) - 1.0 * (np.sin(0.05 * k) > 0.5))
        rows.append((float(k), u, float(level + 0.05 * rng.standard_normal())))
        leak = 0.0 if k < 3000 else 3.0
        for _ in range(20):
            level += 0.05 * (10.0 * u - 12.5 * np.sqrt(level) - leak) / 154.0
    return rows


def watched(mon: ctid.Monitor, rows: list[tuple[float, float, float]]) -> list[dict[str, object]]:
    """The alarms; on the way the monitor is pickled, while it learns and later."""
    alarms = []
    for k, (t, u, y) in enumerate(rows):
        if k in (500, 2000, 3100):
            mon = pickle.loads(pickle.dumps(mon))
        step = mon.update(t, {"u": u}, {"y": y})
        if step.alarm is not None:
            alarms.append(step.alarm)
    return alarms


def test_a_tank_is_watched_as_the_program_does(program, leaking, tmp_path):
    tank = ctid.Model.tank("single-tank", known={"area": 154.0})
    mon = tank.monitor(units=("V", "cm"))
    assert mon.phase == "learning"
    alarms = watched(mon, leaking)
    assert 3000.0 < alarms[0]["time"] < 3100.0
    assert any("const_leak" in alarm["effects"] for alarm in alarms)
    text = "t [s],u [V],y [cm]\n" + "".join(f"{t!r},{u!r},{y!r}\n" for t, u, y in leaking)
    command = [program, "monitor", "--model", str(RECORDS / "tour.toml")]
    ended = subprocess.run(command, input=text, text=True, check=True, capture_output=True, cwd=tmp_path)
    lines = [json.loads(line) for line in ended.stdout.splitlines()]
    by_program = [line for line in lines if "verdict" in line]
    assert [{k: v for k, v in line.items() if k in alarms[0]} for line in by_program] == alarms


def test_a_monitor_of_a_fit_has_its_units(leaking, tour):
    fit = ctid.Model.tank("single-tank", known={"area": 154.0}).fit(tour, inputs=["u"], outputs=["y"])
    mon = fit.model.monitor(learn=300)
    for t, u, y in leaking[:2900]:
        mon.update(t, {"u": u}, {"y": y})
    estimates = mon.estimates
    assert mon.phase == "watching" and list(estimates.index) == ["pump_gain", "alpha"]
    assert estimates["value"]["pump_gain"] == pytest.approx(10.0, rel=0.05)
    assert "cm" in estimates["unit"]["pump_gain"] and "V" in estimates["unit"]["pump_gain"]


def test_two_levels_are_watched():
    rng = np.random.default_rng(2)
    known = {"area_upper": 30.0, "area_lower": 30.0}
    mon = ctid.Model.tank("cascaded-tanks", known={**known, "measured": ["upper", "lower"]}).monitor(learn=300)
    upper = lower = 8.0
    for k in range(1500):
        u = 3.0 + 1.5 * (np.sin(0.02 * k) > 0.0)
        readings = {"level_upper": upper + 0.02 * rng.standard_normal(), "level_lower": lower + 0.02 * rng.standard_normal()}
        step = mon.update(float(k), {"u": u}, readings)
        for _ in range(10):
            between = 5.0 * np.sqrt(upper)
            upper += 0.1 * (5.0 * u - between) / 30.0
            lower += 0.1 * (between - 6.0 * np.sqrt(lower)) / 30.0
    assert mon.phase == "watching" and set(step.innovations) == {"level_upper", "level_lower"}


def test_what_a_tanks_monitor_refuses():
    tank = ctid.Model.tank("single-tank", known={"area": 154.0})
    with pytest.raises(ctid.ModelError, match="time_unit"):
        tank.monitor(time_unit=60.0)
    with pytest.raises(ctid.ModelError):
        tank.monitor(learn=3)
    with pytest.raises(ctid.ModelError):
        ctid.Model.tank("three-tank", known={"measured": "T3"}).monitor()
    with pytest.raises(ctid.DataError, match="not one of the inputs"):
        tank.monitor().update(0.0, {"v": 1.0}, {"y": 1.0})


def test_an_experiment_is_designed_as_the_program_does(program, tour, tmp_path):
    fit = ctid.Model.tank("single-tank", known={"area": 154.0}).fit(tour, inputs=["u"], outputs=["y"])
    d = pickle.loads(pickle.dumps(fit.diagnose(progress=False)))
    between = ("pump_saturation", "overflow")
    plan = d.design(between=between, ranges={"u": (2.0, 8.0)}, slews={"u": 0.5}, duration=400.0, progress=False)
    options = ["--range", "2", "8", "--slew", "0.5", "--duration", "400", "--json", "plan.json", "--out", "next.csv"]
    command = [program, "design", RECORDS / "tour.csv", "--model", RECORDS / "tour.toml", "--between", *between, *options]
    subprocess.run([str(part) for part in command], check=True, capture_output=True, cwd=tmp_path)
    by_program = json.loads((tmp_path / "plan.json").read_text(encoding="utf-8"))
    found = json.loads(json.dumps(plan.to_dict()).replace('"data"', '"tour.csv"'))
    assert {k: v for k, v in found.items() if k not in OTHER} == {k: v for k, v in by_program.items() if k not in OTHER}
    assert plan.prospect == "decides"
    frame = plan.experiment
    assert list(frame.columns) == ["u"] and frame["u"].between(2.0, 8.0).all()
    assert 300.0 < frame.index[-1] <= 400.0
    assert len(plan.experiments) == len(by_program["candidates"])
    # A copy is the same, and what was not asked for stays as it is.
    assert pickle.loads(pickle.dumps(plan)).to_dict() == plan.to_dict()


def test_what_a_design_refuses(tour):
    fit = ctid.Model.tank("single-tank", known={"area": 154.0}).fit(tour, inputs=["u"], outputs=["y"])
    d = fit.diagnose(effort="quick", max_effects=1, progress=False)
    for between, limits, says in [
        (("overflow", "no_effect"), {}, "no_effect"),
        (("overflow", "overflow"), {}, "itself"),
        (("overflow", "const_leak"), {"ranges": {"v": (0.0, 1.0)}}, '"v" is not applied'),
        (("overflow", "const_leak"), {"slews": {"v": 1.0}}, '"v" is not applied'),
        (("overflow", "const_leak"), {"inputs": ["v"]}, '"v" is not applied'),
        (("overflow", "const_leak"), {"ranges": {"u": (5.0, 5.0)}}, "5"),
        (("overflow:upper", "const_leak"), {}, "one tank"),
    ]:
        with pytest.raises(ctid.ModelError, match=says):
            d.design(between, progress=False, **limits)
    with pytest.raises(ctid.ModelError, match="in the model already"):
        d.model.fit(tour, inputs=["u"], outputs=["y"]).diagnose(effort="quick", progress=False).design(("overflow", "const_leak"))


def central(slopes, x: list[float], u: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of `slopes(x, u)` by x and by u."""
    at, columns = np.array([*x, *u]), []
    for i in range(at.size):
        step = np.zeros(at.size)
        step[i] = 1e-5 * at[i]
        up, down = (np.array(slopes((at + s)[: len(x)], (at + s)[len(x) :])) for s in (step, -step))
        columns.append((up - down) / (2.0 * step[i]))
    all = np.array(columns).T
    return all[:, : len(x)], all[:, len(x) :]


def test_the_matrices_of_a_tank(tour):
    model = ctid.Model.tank("single-tank", known={"area": 154.0}).fit(tour, inputs=["u"], outputs=["y"]).model
    p = model.params
    linear = model.linearize(at={"level": 12.0, "u": 4.0})
    a, b = central(lambda x, u: (p["pump_gain"] * u - p["alpha"] * np.sqrt(x)) / 154.0, [12.0], [4.0])
    np.testing.assert_allclose(linear.A, a, rtol=1e-8)
    np.testing.assert_allclose(linear.B, b, rtol=1e-8)
    np.testing.assert_allclose(linear.dx, (p["pump_gain"] * 4.0 - p["alpha"] * np.sqrt(12.0)) / 154.0)
    assert (linear.C == 1.0).all() and (linear.D == 0.0).all() and linear.y == 12.0
    assert (linear.states, linear.inputs, linear.outputs) == (["level"], ["u"], ["level"])
    again = pickle.loads(pickle.dumps(model)).linearize(at={"level": 12.0, "u": 4.0})
    assert (again.A == linear.A).all()
    with pytest.raises(ctid.ModelError, match="level, u"):
        model.linearize()


def test_the_matrices_of_two_tanks():
    start = {"pump_gain": 5.0, "alpha_upper": 4.0, "alpha_lower": 6.0}
    known = {"area_upper": 30.0, "area_lower": 20.0, "measured": ["upper", "lower"]}
    linear = ctid.Model.tank("cascaded-tanks", known=known, start=start).linearize(
        at={"level_upper": 9.0, "level_lower": 5.0, "u": 3.0}
    )

    def slopes(x, u):
        between = 4.0 * np.sqrt(x[0])
        return [(5.0 * u[0] - between) / 30.0, (between - 6.0 * np.sqrt(x[1])) / 20.0]

    a, b = central(slopes, [9.0, 5.0], [3.0])
    np.testing.assert_allclose(linear.A, a, rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(linear.B, b, rtol=1e-8, atol=1e-12)
    assert (linear.C == np.eye(2)).all() and linear.outputs == ["level_upper", "level_lower"]
    # A linear plant has the same matrices everywhere.
    lag = ctid.Model.tank("first-order", start={"K": 2.0, "tau": 80.0}).linearize()
    np.testing.assert_allclose((lag.A[0, 0], lag.B[0, 0]), (-1.0 / 80.0, 2.0 / 80.0))


def test_the_text_of_a_tank(tour):
    fit = ctid.Model.tank("single-tank", known={"area": 154.0}).fit(tour, inputs=["u"], outputs=["y"])
    text = fit.to_modelica()
    assert text == fit.model.to_modelica()
    own = ctid.Model.from_text(text)
    assert own.states == ["level"] and own.params["alpha"] == fit.params["alpha"]
    # The same record with the text gives the same fit.
    again = own.fit(tour, inputs={"u": "u"}, outputs={"level": "y"})
    for name in ("pump_gain", "alpha"):
        np.testing.assert_allclose(again.params[name], fit.params[name], rtol=1e-4)
    # A measured flow into the tank is the last input.
    disturbed = tour.assign(d=np.where(np.arange(len(tour)) // 50 % 2, 1.0, 0.0))
    linear = ctid.Model.tank("single-tank-linear")
    text = linear.fit(disturbed, inputs=["u", "d"], outputs=["y"], known={"disturbance": "tank"}).to_modelica()
    assert "K*u - outflow + disturbance_gain*d" in text


def test_a_tank_with_an_effect_as_text(tour):
    fit = ctid.Model.tank("single-tank", known={"area": 154.0}, effects=["overflow"]).fit(tour, inputs=["u"], outputs=["y"])
    text = fit.to_modelica()
    assert "overflow is limit(level)" in text
    assert text == fit.model.to_modelica()
    # The text fits the record as the tank does.
    again = ctid.Model.from_text(text).fit(tour, inputs={"u": "u"}, outputs={"level": "y"})
    errors = [one.to_dict()["steps"][-1]["rmse_per_output"] for one in (again, fit)]
    (of_text,), (of_tank,) = (list(error.values()) for error in errors)
    assert of_text < 1.02 * of_tank
    # Below the rim it is the tank; pickled, a model has its records again.
    at = {"level": 5.0, "u": 4.0}
    linear, values = fit.model.linearize(at), ctid.Model.from_text(text).params
    assert linear.states == ["level"]
    np.testing.assert_allclose(linear.A, -values["alpha"] / (2.0 * 154.0 * np.sqrt(5.0)), rtol=1e-6)
    np.testing.assert_allclose(linear.B, values["pump_gain"] / 154.0, rtol=1e-6)
    unpickled = pickle.loads(pickle.dumps(fit.model))
    assert (unpickled.linearize(at).A == linear.A).all()


def test_the_text_with_what_a_diagnosis_found(tour, tour_test):
    fit = ctid.Model.tank("single-tank", known={"area": 154.0}).fit(tour, inputs=["u"], outputs=["y"])
    found = fit.diagnose(test=tour_test, progress=False)
    text = found.model.to_modelica()
    assert found.effects and all(f"{effect} is " in text for effect in found.effects)


def test_what_has_no_matrices(tour):
    with pytest.raises(ctid.ModelError, match="no values of pump_gain, alpha"):
        ctid.Model.tank("single-tank", known={"area": 154.0}).linearize(at={"level": 12.0, "u": 4.0})
    mended = ctid.Model.tank("single-tank", known={"area": 154.0}, effects=["overflow"], start={"pump_gain": 9.0, "alpha": 13.0})
    for text in (lambda: mended.linearize(at={"level": 12.0, "u": 4.0}), mended.to_modelica):
        with pytest.raises(ctid.ModelError, match=r"other parameters for overflow .* fit it to records first"):
            text()
    # Both are a constant error of the reading in the text.
    both = ctid.Model.tank("single-tank", known={"area": 154.0}, effects=["sensor_offset", "pipe_height"])
    with pytest.raises(ctid.ModelError, match=r"pipe_height is the same effect .* write the balance"):
        both.fit(tour, inputs=["u"], outputs=["y"]).to_modelica()
