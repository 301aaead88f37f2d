"""Whatever is handed over: an exception that names the place and the mend, never a panic."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from conftest import MODELS

import ctid

TEXT = (MODELS / "heated-block.mo").read_text(encoding="utf-8")


@pytest.fixture
def model() -> ctid.Model:
    return ctid.Model.from_text(TEXT)


def refused(model: ctid.Model, frame: object, *words: str, **options: object) -> str:
    with pytest.raises(ctid.DataError) as caught:
        model.fit(frame, known={"C": 52.0}, **options)  # type: ignore[arg-type]
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message, message
    return message


def test_cells_that_are_no_numbers(model, block):
    refused(model, block.astype(object), "objects of Python", "astype(float)")
    frame = block.astype({"y [degC]": object})
    frame.iloc[7, 2] = "Bad"
    refused(model, frame, "row 9", '"y [degC]"', "'Bad'", "to_numeric")
    frame = block.astype({"y [degC]": str})
    refused(model, frame, "row 2", "no number")
    frame = block.astype({"y [degC]": complex})
    refused(model, frame, '"y [degC]"')


def test_infinite_and_missing(model, block):
    frame = block.copy()
    frame["y [degC]"] = np.nan
    refused(model, frame, "y")
    frame = block.copy()
    frame["u [%]"] = np.nan
    refused(model, frame, "u")
    frame = block.copy()
    frame.iloc[:] = np.nan
    refused(model, frame)
    frame.iloc[:] = np.inf
    refused(model, frame)


def test_shapes(model, block):
    refused(model, block.iloc[:5], "rows")
    refused(model, block.iloc[:0])
    refused(model, {"t": np.arange(50.0), "u": np.ones(49), "Ta": np.ones(50), "y": np.ones(50)}, "49", "50")
    refused(model, {"t": np.arange(50.0), "u": np.ones((50, 2)), "Ta": np.ones(50), "y": np.ones(50)}, "50 by 2")
    refused(model, {"t": np.arange(50.0), "u": 1.0, "Ta": np.ones(50), "y": np.ones(50)}, "one number")
    refused(model, {"u": np.ones(50), "Ta": np.ones(50), "y": np.ones(50)}, "time")
    refused(model, [], "no record")
    refused(model, np.ones((50, 3)), "ndarray")
    refused(model, 3, "int")
    refused(model, "tour.csv", "str")
    refused(model, None, "no record")
    refused(model, [block, 3], "int")


def test_columns(model, block):
    refused(model, block.drop(columns="y [degC]"), '"y"', "it has")
    doubled = pd.concat([block, block[["u [%]"]]], axis=1)
    refused(model, doubled, "two columns")
    levels = block.copy()
    levels.columns = pd.MultiIndex.from_product([["a"], levels.columns])
    refused(model, levels, "levels")
    frame = block.rename(columns={"u [%]": "u [kg]"})
    refused(model, frame, "kg")
    with pytest.raises(ctid.ModelError, match="has 2"):
        model.fit(block, inputs=["u"])
    with pytest.raises(ctid.ModelError, match="none of the inputs"):
        model.fit(block, inputs={"w": "u"})


def test_indexes(model, block):
    refused(model, block.iloc[::-1], "goes back", "sort_index")
    shuffled = block.sample(frac=1.0, random_state=1)
    refused(model, shuffled, "goes back")
    twice = block.copy()
    twice.index = pd.Index(np.repeat(block.index.to_numpy()[: len(block) // 2], 2)[: len(block)], name="t [s]")
    refused(model, twice.iloc[: len(block) // 2])
    dates = pd.date_range("2026-01-01", periods=len(block), freq="5s")
    refused(model, block.set_index(dates.tz_localize("Europe/Berlin")), "time zone", "tz_localize(None)")
    refused(model, block.set_index(dates.tz_localize("UTC")), "time zone")
    refused(model, block.set_index(pd.timedelta_range("0s", periods=len(block), freq="5s")), "total_seconds")
    refused(model, block.set_index(dates.to_period("s")), "to_timestamp")
    refused(model, block.set_index(pd.MultiIndex.from_arrays([dates, dates])), "levels")
    refused(model, block.set_index(pd.Index([f"row {k}" for k in range(len(block))])), "no number")
    gap = block.copy()
    gap.index = pd.Index([np.nan, *block.index[1:]], name="t [s]")
    refused(model, gap, "row 2", "missing")
    refused(model, block.reset_index(), "counts rows", "set_index")
    refused(model, block.set_index(pd.DatetimeIndex([pd.NaT, *dates[1:]])), "date is missing")


def test_dates_and_nullable_columns_are_read(model, block):
    plain = model.fit(block, known={"C": 52.0})
    dates = pd.date_range("2026-01-01", periods=len(block), freq="5s")
    dated = model.fit(block.set_index(dates), known={"C": 52.0})
    assert dated.params.equals(plain.params)
    assert dated.residuals.index.equals(dates)
    nullable = block.convert_dtypes()
    assert model.fit(nullable, known={"C": 52.0}).params.equals(plain.params)
    arrays = {"t": block.index.to_numpy(), **{c: block[c].to_numpy() for c in block}}
    assert model.fit(arrays, known={"C": 52.0}).params.equals(plain.params)
    minutes = block.set_index(pd.Index(block.index.to_numpy() / 60.0, name="t [min]"))
    # The model's time is then in minutes too.
    assert model.fit(minutes, known={"C": 52.0 / 60.0}).params["k"] == pytest.approx(plain.params["k"], rel=1e-3)
    missing = block.copy()
    missing.iloc[10:20, 2] = np.nan
    residuals = model.fit(missing, known={"C": 52.0}).residuals
    assert residuals["y"].isna().sum() == 10


def test_several_records(model, block):
    fit = model.fit([block.iloc[:200], block.iloc[200:]], known={"C": 52.0})
    assert list(fit.residuals.index.get_level_values("record").unique()) == ["data 1", "data 2"]
    assert "T(0), record 2" in fit.params.index


def test_models():
    with pytest.raises(ctid.ModelError, match="model.mo:9:25: `kk` is not declared"):
        ctid.Model.from_text(TEXT.replace("k*(T", "kk*(T"))
    with pytest.raises(ctid.ModelError):
        ctid.Model.from_text("")
    with pytest.raises(FileNotFoundError):
        ctid.Model.from_file("there is no such file.mo")
    with pytest.raises(ctid.Error):
        ctid.Model.from_file("there is no such file.toml")
    with pytest.raises(ctid.ModelError):
        ctid.Model.tank("no-tank")
    with pytest.raises(ctid.ModelError):
        ctid.Model.tank("single-tank", known={"area": "wide"})


def test_parameters(model, block):
    for options in ({"known": {"kk": 1.0}}, {"priors": {"kk": (1.0, 0.1)}}):
        with pytest.raises(ctid.ModelError, match="kk is no parameter"):
            model.fit(block, **options)
    with pytest.raises(ctid.Error):
        model.fit(block, priors={"k": (0.1, -1.0)})
    with pytest.raises(ctid.Error):
        model.fit(block, known={"C": float("nan")})
    with pytest.raises(ctid.ModelError, match="hold"):
        model.fit(block, hold="second")
    fit = model.fit(block)
    assert "determine" in fit.summary()
    with pytest.raises(ctid.DataError, match="do not determine"):
        _ = fit.cov
    fit = model.fit(block, known={"C": 52.0})
    for level in (0.0, 1.0, float("nan")):
        with pytest.raises(ctid.ModelError):
            fit.conf_int(level)
    with pytest.raises(ctid.ModelError):
        fit.simulate(block, interval=2.0)
    with pytest.raises(ctid.DataError):
        fit.simulate(block.drop(columns="u [%]"))
    with pytest.raises(ctid.ModelError):
        fit.diagnose(effort="endless", progress=False)
    with pytest.raises(ctid.ModelError):
        fit.diagnose(time_limit=-1.0, progress=False)
    with pytest.raises(ctid.ModelError, match="neither a state nor an input"):
        model.linearize(at={"w": 1.0})


def test_estimators():
    with pytest.raises(ctid.ModelError):
        ctid.ContinuousRls(np.zeros(2), np.eye(3), 0.02)
    with pytest.raises(ctid.ModelError):
        ctid.ContinuousRls(np.zeros(2), -np.eye(2), 0.02)
    rls = ctid.ContinuousRls(np.zeros(2), np.eye(2), 0.02)
    with pytest.raises(ctid.DataError, match="3 entries"):
        rls.update(np.zeros(3), 1.0, 1.0)
    with pytest.raises(ctid.DataError):
        rls.update("ab", 1.0, 1.0)
    with pytest.raises(ctid.DataError):
        rls.update(np.zeros((2, 1)), 1.0, 1.0)
    with pytest.raises(ctid.DataError):
        rls.run(np.zeros((5, 2)), np.zeros(4), 1.0)
    with pytest.raises(ctid.DataError):
        rls.run(np.zeros((5, 3)), np.zeros(5), 1.0)
    assert np.isnan(rls.update([1.0, 0.0], float("nan"), 1.0)) and not rls.used
    with pytest.raises(ctid.ModelError):
        ctid.StabilizedOe((4, 0), [1.0] * 5, 0.01, 1.0)
    with pytest.raises(ctid.ModelError):
        ctid.StabilizedOe((1, 0), [-1.0, 1.0], 0.01, 1.0)
    with pytest.raises(ctid.ModelError, match="no method"):
        ctid.identify({"t": np.arange(50.0), "u": np.ones(50), "y": np.ones(50)}, "magic")  # type: ignore[arg-type]
    with pytest.raises(ctid.DataError):
        ctid.identify({"t": np.arange(50.0), "u": np.ones(50), "y": np.ones(50)}, "srivc")
