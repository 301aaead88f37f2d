"""The listing runs, and what it shows is right."""

from __future__ import annotations

import copy
import pickle
import shutil
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
import pandas as pd
import pytest
from conftest import MODELS
from listing import listing

import ctid


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, object]:
    folder: Path = tmp_path_factory.mktemp("listing")
    result = listing(MODELS, folder)
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert page.startswith("<!doctype html>") and len(page) > 100_000
    return result


def lagging_block() -> pd.DataFrame:
    """The heated block of the bundled record, read by a sensor that lags by 40 s."""
    rng = np.random.default_rng(3)
    block = sensor = 20.0
    rows = []
    for k in range(600):
        u = 20.0 + 60.0 * (np.sin(0.02 * k) + np.sin(0.11 * k) > 0.0)
        rows.append((5.0 * k, u, 20.0, sensor + 0.05 * rng.standard_normal()))
        for _ in range(50):
            block += 0.1 / 52.0 * (0.12 * u - 0.17 * (block - 20.0))
            sensor += 0.1 / 40.0 * (block - sensor)
    return pd.DataFrame(rows, columns=["t [s]", "u", "Ta", "y"]).set_index("t [s]")


def test_what_is_missing_is_found_and_added():
    frame = lagging_block()
    df, test = frame.iloc[:400], frame.iloc[400:]
    fit = ctid.Model.from_file(MODELS / "heated-block.mo").fit(df, known={"C": 52.0})
    failures = fit.failures()
    assert len(failures) > 0 and fit.failures_in_words()
    assert set(failures["by"]) <= {"time", "output", "input", "state", "direction", "frequency"}
    named = failures["by"].isin(["input", "state"])
    assert failures["signal"].notna().equals(named)
    d = fit.diagnose(test=test, progress=False)
    assert d.verdict in ("effect", "undecided")
    assert any("lag(" in effect for group in d.groups for effect in group)
    ladder = d.ladder
    assert ladder["rmse y"].iloc[-1] < 0.5 * ladder["rmse y"].iloc[0]
    assert ladder["rmse y test"].iloc[-1] < 0.5 * ladder["rmse y test"].iloc[0]
    better = d.model
    assert better.effects == d.effects and len(better.states) > 1
    again = ctid.Model.from_text(better.to_modelica())
    assert again.states == better.states and again.params.equals(better.params)
    assert better.fit(df, known={"C": 52.0}).score(test) > fit.score(test)
    assert np.allclose(better.linearize().poles.real.max(), -0.17 / 52.0, rtol=0.1)
    assert pickle.loads(pickle.dumps(d)).to_dict() == d.to_dict()


def test_numbers_go_together(found):
    params, errors, intervals, cov, residuals, starts = found["numbers"]
    free = [name for name in params.index if not np.isnan(errors[name])]
    assert "C" not in free and params["C"] == 52.0
    assert list(cov.index) == free
    np.testing.assert_allclose(np.sqrt(np.diag(cov)), errors[free])
    half = (intervals["upper"] - intervals["lower"])[free] / 2
    assert (half > 1.9 * errors[free]).all() and (half < 2.2 * errors[free]).all()
    assert len(residuals) == 300 and residuals.index.name == "t [s]"
    assert starts["tried"] >= starts["agree"] > 0


def test_the_band_holds_the_mean(found):
    band = found["band"]
    assert list(band.columns) == [("y", n) for n in ("mean", "lower", "upper", "reading lower", "reading upper")]
    assert (band["y", "lower"] < band["y", "mean"]).all() and (band["y", "mean"] < band["y", "upper"]).all()
    assert 90.0 < found["score"] < 100.0


def test_what_else_is_there(found):
    assert found["linear"].A.shape == (len(found["better"].states),) * 2
    assert found["plan"].prospect in ("decides", "may", "hardly", "twins")
    assert found["trajectory"].shape == (10, 2) and found["innovations"].shape == (10,)
    assert found["identified"].fit_percent > 50.0
    assert found["fcloe"]["successful"]
    udink, baysse = found["published"]
    assert udink["exact"]["of"] == 72 and baysse["of"] == 32
    assert found["step"].alarm is None


def test_objects_are_pickled_and_copied(found):
    fit, diagnosis = found["fit"], found["diagnosis"]
    again = pickle.loads(pickle.dumps(fit))
    assert again.to_dict()["steps"] == fit.to_dict()["steps"]
    pd.testing.assert_frame_equal(again.residuals, fit.residuals)
    pd.testing.assert_frame_equal(again.cov, fit.cov)
    again = pickle.loads(pickle.dumps(diagnosis))
    assert again.to_dict() == diagnosis.to_dict()
    assert again.model.to_modelica() == diagnosis.model.to_modelica()
    assert copy.deepcopy(fit).summary() == fit.summary()
    model = pickle.loads(pickle.dumps(found["better"]))
    assert model.to_modelica() == found["text"]


def test_a_tank_is_diagnosed(tour, tour_test):
    model = ctid.Model.tank("single-tank", known={"area": 154.0})
    fit = model.fit(tour, inputs=["u"], outputs=["y"])
    assert fit.score(tour_test) < 80.0
    band = fit.simulate(tour_test)
    assert len(band) == len(tour_test)
    d = fit.diagnose(test=tour_test, progress=False)
    assert d.verdict == "effect" and d.effects == ["overflow"]
    better = d.model.fit(tour, inputs=["u"], outputs=["y"])
    assert better.params["overflow.rim"] == pytest.approx(20.0, abs=0.02)
    assert better.score(tour_test) > 98.0
    assert d.ranking["effect"].iloc[0] == "overflow" and d.ladder["rmse y"].iloc[-1] < 0.06
    assert pickle.loads(pickle.dumps(better)).params.equals(better.params)
    assert pickle.loads(pickle.dumps(d)).effects == d.effects
    for shown in (fit, d, pickle.loads(pickle.dumps(d))):
        assert shown.plot()[0].get_ylabel() == "y [cm]"


def _alarms(mon):
    """A block whose loss grows at 10000 s; half way the monitor is pickled."""
    rng = np.random.default_rng(1)
    temperature, kinds, alarms = 20.0, set(), []
    for k in range(2600):
        u = 80.0 if k // 60 % 2 else 20.0
        step = mon.update(5.0 * k, {"u": u, "Ta": 20.0}, {"y": temperature + 0.1 * rng.standard_normal()})
        kinds |= {notice["kind"] for notice in step.notices}
        if step.alarm is not None:
            alarms.append(step.alarm)
        if k == 1500:
            assert not alarms and mon.phase == "watching"
            mon = pickle.loads(pickle.dumps(mon))
        loss = 0.17 if k < 2000 else 0.3
        temperature += 5.0 / 52.0 * (0.12 * u - loss * (temperature - 20.0))
    assert "learned" in kinds and alarms and 10_000.0 < alarms[0]["time"] < 12_000.0
    assert list(mon.estimates.index)
    return alarms


def test_an_alarm_is_raised_and_a_monitor_is_kept(block):
    model = ctid.Model.from_file(MODELS / "heated-block.mo").fit(block, known={"C": 52.0}).model
    alarms = _alarms(model.monitor(learn=200))
    assert "vent" not in alarms[-1]["effects"]


def test_a_monitor_names_a_candidate_of_its_user(block, tmp_path):
    shutil.copy(MODELS / "heated-block.mo", tmp_path)
    vent = """model = "heated-block.mo"

[candidates.vent]
parameters = { q = { unit = "W/K", min = 0.0, start = 0.01 } }
terms = { T = "-q*(T - Ta)" }
"""
    (tmp_path / "block.toml").write_text(vent)
    model = ctid.Model.from_file(tmp_path / "block.toml").fit(block, known={"C": 52.0}).model
    alarms = _alarms(model.monitor(learn=200))
    assert "vent" in alarms[-1]["effects"]