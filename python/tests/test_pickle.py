"""Every class of the package is pickled and copied, and goes on as if nothing had been."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable

import numpy as np
import pytest
from conftest import MODELS

import ctid


def ways(thing: object) -> list[object]:
    """Its copies."""
    pickled = [pickle.loads(pickle.dumps(thing, protocol)) for protocol in (2, pickle.HIGHEST_PROTOCOL)]
    return [*pickled, copy.copy(thing), copy.deepcopy(thing)]


ORDERS = [(n, m, offset) for n in (1, 2, 3) for m in range(n) for offset in (False, True)]


@pytest.mark.parametrize(("n", "m", "offset"), ORDERS)
def test_output_error_goes_on_to_the_bit(n, m, offset):
    rng = np.random.default_rng(1)
    u = np.where(np.arange(600) // 40 % 2 == 0, 1.0, -0.5)
    y = 1.5 + 2.0 * np.sin(0.04 * np.arange(600)) + 0.05 * rng.standard_normal(600)
    y[[7, 150, 320]] = np.nan
    theta = [[10.0], [15.0, 50.0], [20.0, 120.0, 200.0]][n - 1] + [1.0, *[0.0] * m] + [0.0] * offset
    oe = ctid.StabilizedOe((n, m), theta, forgetting=0.005, bandwidth=0.8, hold="first", offset=offset)
    # Before the first sample, and later.
    for begin, end in [(0, 1), (1, 300)]:
        for again in ways(oe):
            assert (again.theta == oe.theta).all() and (again.filter == oe.filter).all()
            expected = copy.copy(oe).run(u[begin:], y[begin:], 0.5)
            assert np.array_equal(again.run(u[begin:], y[begin:], 0.5), expected)
        oe.run(u[begin:end], y[begin:end], 0.5)
    again = pickle.loads(pickle.dumps(oe))
    assert again.model_output == oe.model_output and repr(again) == repr(oe)
    assert again.update(0.3, 0.2, 0.5) == oe.update(0.3, 0.2, 0.5)


def test_a_run_that_has_stopped_stays_so():
    oe = ctid.StabilizedOe((1, 0), [5.0, 1.0], forgetting=0.002, bandwidth=0.4)
    assert np.isnan(oe.update(np.nan, np.nan, -1.0))
    oe.run(np.array([1e30, 1e150, 1e30]), np.zeros(3), 1e20)
    for again in ways(oe):
        assert np.array_equal([again.update(1.0, 1.0, 1.0)], [copy.copy(oe).update(1.0, 1.0, 1.0)], equal_nan=True)


@pytest.mark.parametrize("parameters", [1, 2, 6, 8])
def test_recursive_least_squares_goes_on_to_the_bit(parameters):
    rng = np.random.default_rng(2)
    phi = rng.standard_normal((400, parameters))
    y = phi @ np.arange(1.0, parameters + 1) + 0.01 * rng.standard_normal(400)
    rls = ctid.ContinuousRls(np.zeros(parameters), 100.0 * np.eye(parameters), forgetting=0.02, c=0.9, gamma=0.8)
    rls.run(phi[:200], y[:200], 0.5)
    rls.update(np.full(parameters, np.nan), 1.0, 0.5)
    assert not rls.used
    for again in ways(rls):
        assert (again.outcome, again.used) == (rls.outcome, rls.used)
        assert (again.P == rls.P).all() and again.excitation == rls.excitation
        theta, epsilon = copy.copy(rls).run(phi[200:], y[200:], 0.5)
        found = again.run(phi[200:], y[200:], 0.5)
        assert (found[0] == theta).all() and (found[1] == epsilon).all()


def test_what_is_no_pickle_is_refused():
    rls = ctid.ContinuousRls(np.zeros(2), np.eye(2), forgetting=0.02)
    oe = ctid.StabilizedOe((1, 0), [5.0, 1.0], forgetting=0.002, bandwidth=0.4)
    for content in (b"", b"abc", rls.to_bytes(), oe.to_bytes()[:-3]):
        with pytest.raises(ctid.Error):
            ctid.StabilizedOe.from_bytes(content)
    with pytest.raises(ctid.Error):
        ctid.ContinuousRls.from_bytes(oe.to_bytes())


def test_every_other_class_is_pickled_and_copied(block, tour):
    fit = ctid.Model.from_file(MODELS / "heated-block.mo").fit(block, known={"C": 52.0})
    tank = ctid.Model.tank("single-tank", known={"area": 154.0})
    tank_fit = tank.fit(tour, inputs=["u"], outputs=["y"])
    d = fit.diagnose(effort="quick", progress=False)
    tank_d = tank_fit.diagnose(effort="quick", max_effects=1, progress=False)
    mon, tank_mon = fit.model.monitor(learn=200), tank.monitor(learn=200)
    step = mon.update(0.0, {"u": 1.0, "Ta": 20.0}, {"y": 20.0})
    tank_mon.update(0.0, {"u": 1.0}, {"y": 20.0})
    plan = d.design(("lag(u)", "delay(u)"), {"u": (0.0, 100.0)}, effort="quick", progress=False)
    tank_plan = tank_d.design(("overflow", "const_leak"), {"u": (2.0, 6.0)}, effort="quick", progress=False)
    identified = ctid.identify(tour, "srivc")
    linear = fit.model.linearize(at={"T": 40.0, "u": 30.0, "Ta": 20.0})
    of: list[tuple[object, Callable[..., object]]] = [
        (fit.model, lambda x: x.to_modelica()),
        (tank, lambda x: x.text),
        (tank_fit.model, lambda x: (x.text, x.params.to_dict())),
        (fit, lambda x: x.params.to_dict()),
        (tank_fit, lambda x: x.params.to_dict()),
        (d, lambda x: x.to_dict()),
        (tank_d, lambda x: x.to_dict()),
        (mon, lambda x: (x.phase, x.rows)),
        (tank_mon, lambda x: (x.phase, x.rows)),
        (step, lambda x: x.notices),
        (plan, lambda x: x.to_dict()),
        (tank_plan, lambda x: (x.to_dict(), x.experiment["u"].tolist())),
        (identified, lambda x: x.to_dict()),
        (linear, lambda x: (x.A.tolist(), x.states)),
        (ctid.Fcloe((2, 1), levels="mean"), lambda x: (x.order, x.controller, x.levels)),
    ]
    for thing, said in of:
        for again in ways(thing):
            assert type(again) is type(thing)
            assert said(again) == said(thing), thing
    classes = {type(thing).__mro__[-2] for thing, _ in of} | {ctid.ContinuousRls, ctid.StabilizedOe}
    public = [value for value in vars(ctid).values() if isinstance(value, type) and not issubclass(value, Exception)]
    assert [value for value in public if value not in classes] == []
