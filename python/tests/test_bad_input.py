"""Whatever is handed over: an exception that names the place and the mend, never a panic."""

from __future__ import annotations

import warnings
from collections.abc import Callable

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
    refused(model, frame, "row 2", "not a number")
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
    with pytest.raises(ctid.ModelError, match="not one of the inputs"):
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
    refused(model, block.set_index(pd.Index([f"row {k}" for k in range(len(block))])), "not a number")
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
    with pytest.raises(ctid.ModelError, match="there is no such file.toml"):
        ctid.Model.from_file("there is no such file.toml")
    with pytest.raises(ctid.ModelError):
        ctid.Model.tank("no-tank")
    with pytest.raises(ctid.ModelError):
        ctid.Model.tank("single-tank", known={"area": "wide"})


def test_a_model_file_without_its_text(tmp_path):
    (tmp_path / "block.toml").write_text('model = "gone.mo"\n', encoding="utf-8")
    with pytest.raises(ctid.ModelError, match="gone.mo"):
        ctid.Model.from_file(tmp_path / "block.toml")


def says(error: type[Exception], call: Callable[[], object], *words: str) -> None:
    with pytest.raises(error) as caught:
        call()
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message, message


def test_arguments_are_named(model, block):
    def fit(**options: object) -> Callable[[], object]:
        return lambda: model.fit(block, **options)

    for options, words in [
        ({"priors": {"k": 0.1}}, ['priors["k"]', "0.1", "standard error"]),
        ({"priors": {"k": (0.1, None)}}, ['priors["k"]', "None", "number"]),
        ({"priors": 3}, ["priors", "by name"]),
        ({"known": {"C": None}}, ['known["C"]', "None", "number"]),
        ({"known": {"C": "52 J"}}, ['known["C"]', "'52 J'"]),
        ({"known": ["C"]}, ["known", "by name"]),
        ({"starts": -1}, ["starts is -1", "from 1 to"]),
        ({"starts": 0}, ["starts is 0", "from 1 to"]),
        ({"starts": 2.5}, ["starts is 2.5", "whole number"]),
        ({"seed": -1}, ["seed is -1", "from 0 to"]),
        ({"noise_order": -1}, ["noise_order is -1", "from 0 to 20"]),
        ({"noise_order": 99}, ["noise_order is 99", "from 0 to 20"]),
    ]:
        says(ctid.ModelError, fit(**options), *words)
    # The limits themselves are allowed, and what is said by other types of numbers.
    plain = model.fit(block, known={"C": 52.0}, starts=1, noise_order=0)
    again = model.fit(block, known=pd.Series({"C": 52}), starts=np.int64(1), noise_order=np.uint8(0))
    assert again.params.equals(plain.params)
    model.fit(block, known={"C": 52.0}, starts=1, noise_order=20, seed=2**64 - 1)


def test_one_record_is_simulated(model, block, tour):
    tank = ctid.Model.tank("single-tank", known={"area": 154.0}).fit(tour, inputs=["u"], outputs=["y"])
    for fit, record in [(model.fit(block, known={"C": 52.0}), block), (tank, tour)]:
        says(ctid.DataError, lambda: fit.simulate([record]), "test", "one record", "list")
        says(ctid.DataError, lambda: fit.simulate(None), "test", "one record")
        says(ctid.DataError, lambda: fit.simulate(3), "test", "int is not a record")
        says(ctid.ModelError, lambda: fit.simulate(record, interval="wide"), "interval", "'wide'")
        says(ctid.ModelError, lambda: fit.simulate(record, first=-1), "first is -1")


def test_arguments_of_a_search(model, block, tour):
    tank = ctid.Model.tank("single-tank", known={"area": 154.0}).fit(tour, inputs=["u"], outputs=["y"])
    for fit in (model.fit(block, known={"C": 52.0}), tank):
        for option, value in [("max_effects", 0), ("max_effects", -1), ("max_effects", 1.5), ("seed", -1)]:
            says(ctid.ModelError, lambda: fit.diagnose(progress=False, **{option: value}), f"{option} is {value}")
        d = fit.diagnose(effort="quick", max_effects=1, progress=False)
        for between in ("lag(u)", "ab", ("lag(u)",), ("a", "b", "c"), None):
            says(ctid.ModelError, lambda: d.design(between, progress=False), "between", "pair", repr(between))
        for options, words in [
            ({"ranges": {"u": 3.0}}, ['ranges["u"]', "smallest"]),
            ({"ranges": {"u": (0.0, None)}}, ['ranges["u"]', "None"]),
            ({"ranges": 3.0}, ["ranges", "by name"]),
            ({"slews": {"u": "slow"}}, ['slews["u"]', "'slow'"]),
            ({"seed": -1}, ["seed is -1"]),
        ]:
            says(ctid.ModelError, lambda: d.design(("const_leak", "overflow"), progress=False, **options), *words)


def test_arguments_of_a_plant():
    for options, words in [
        ({"known": {"area": None}}, ["area", "None"]),
        ({"known": 154.0}, ["known", "by name"]),
        ({"priors": {"alpha": 12.0}}, ['priors["alpha"]', "standard error"]),
        ({"start": {"alpha": None}}, ['start["alpha"]', "None"]),
    ]:
        says(ctid.ModelError, lambda: ctid.Model.tank("single-tank", **options), *words)


def test_messages_name_arguments(model, block, tour):
    def plain(message: str) -> None:
        """Neither options of the program nor tables of its model file."""
        assert not any(name in message for name in ("--", "[columns]", "[known]", "[prior]")), message

    frame = block.copy()
    frame["y [degC]"] = np.nan
    plain(refused(model, frame, '"y [degC]"', "in inputs=[...] or outputs=[...]", "df.loc[FIRST:LAST]"))
    frame["y [degC]"] = 20.0
    plain(refused(model, frame, '"y [degC]"', "in inputs=[...] or outputs=[...]"))
    with pytest.raises(ctid.DataError) as caught:
        model.fit(block, priors={"k": (0.1, -1.0)})
    assert 'priors["k"] = [0.1, -1.0]' in str(caught.value)
    plain(str(caught.value))
    with pytest.raises(ctid.DataError) as caught:
        ctid.identify(tour.assign(**{"y [cm]": 20.0}), "srivc")
    assert 'in inputs=[...] or output="..."' in str(caught.value)
    plain(str(caught.value))
    with pytest.raises(ctid.ModelError) as caught:
        ctid.identify(tour, "ct-rls", bandwidth=-1.0)
    assert str(caught.value).startswith("bandwidth is -1")


def test_rows_of_a_monitor(model):
    mon = model.monitor()
    u, y = {"u": 1.0, "Ta": 20.0}, {"y": 20.0}
    for time, inputs, outputs, words in [
        (0.0, {**u, "Ta": float("nan")}, y, ['"Ta"', "NaN", "not used"]),
        (0.0, {**u, "u": float("inf")}, y, ['"u"', "inf"]),
        (0.0, {**u, "u": 1e200}, y, ['"u"', "too large"]),
        (float("nan"), u, y, ["time", "NaN"]),
        (None, u, y, ["time", "None"]),
        (0.0, {**u, "u": None}, y, ['"u"', "None"]),
        (0.0, 1.0, y, ["inputs", "by name", "'Ta'"]),
        (0.0, {"u": 1.0}, y, ["Ta", "every input"]),
    ]:
        says(ctid.DataError, lambda: mon.update(time, inputs, outputs), *words)
    assert mon.rows == 0
    for options, words in [({"learn": -1}, ["learn is -1"]), ({"learn": 200.5}, ["learn is 200.5"]), ({"false_alarm_every": None}, ["false_alarm_every"])]:
        says(ctid.ModelError, lambda: model.monitor(**options), *words)


def test_arguments_of_a_linear_model(tour):
    for order in (3, (1,), (1, 2, 3), (0, 0), (1, 2), (-1, 0), (1.5, 0), "21", None):
        says(ctid.ModelError, lambda: ctid.Fcloe(order=order), "order is", repr(order))
        says(ctid.ModelError, lambda: ctid.identify(tour, "srivc", order), "order is", repr(order))
    says(ctid.ModelError, lambda: ctid.identify(tour, "fcloe", controller=3.0), "controller", "R and S")
    says(ctid.ModelError, lambda: ctid.identify(tour, "fcloe", limits=3.0), "limits", "pair")
    fcloe, y = ctid.Fcloe(controller=([1.0], ["s"])), np.ones(50)  # type: ignore[list-item]
    says(ctid.DataError, lambda: fcloe.fit(y, 1.0, r=y), "controller")
    says(ctid.DataError, lambda: ctid.Fcloe().fit(y, 1.0, u=y, theta0=["a", 1.0]), "theta0")


def test_runs_of_a_table():
    for study in (ctid.tables.udink, ctid.tables.baysse):
        for runs in (-1, 3, 20.5):
            says(ctid.ModelError, lambda: study(runs=runs), "runs")
        says(ctid.ModelError, lambda: study(seed=-1), "seed is -1")


def test_an_index_that_counts_rows_is_told(model, block):
    counted = block.reset_index(drop=True)
    with pytest.warns(UserWarning, match="counts rows, and is read as seconds") as told:
        fit = model.fit(counted, known={"C": 52.0})
    assert len(told) == 1 and told[0].filename == __file__
    with pytest.warns(UserWarning, match="test: the index counts rows") as told:
        fit.simulate(counted)
    assert told[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        named = model.fit(counted.rename_axis(index="t [s]"), known={"C": 52.0})
        model.fit(block, known={"C": 52.0})
    assert named.params.equals(fit.params)


def test_parameters(model, block):
    for options in ({"known": {"kk": 1.0}}, {"priors": {"kk": (1.0, 0.1)}}):
        with pytest.raises(ctid.ModelError, match="kk is not a parameter"):
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
    with pytest.raises(ctid.ModelError, match="not a method"):
        ctid.identify({"t": np.arange(50.0), "u": np.ones(50), "y": np.ones(50)}, "magic")  # type: ignore[arg-type]
    with pytest.raises(ctid.DataError):
        ctid.identify({"t": np.arange(50.0), "u": np.ones(50), "y": np.ones(50)}, "srivc")
