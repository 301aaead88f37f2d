"""Linear models as those of python-control."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import MODELS

import ctid

control = pytest.importorskip("control", reason="python-control is not installed")


def test_an_identified_model(tour):
    found = ctid.identify(tour, "srivc", (2, 1))
    p, transfer = found.params, found.to_control()
    for s in (0.0, 0.01j, 0.3 + 0.2j):
        np.testing.assert_allclose(transfer(s), (p["b0"] + p["b1"] * s) / (1.0 + p["a1"] * s + p["a2"] * s**2), rtol=1e-12)
    # Of another method, whose result says nothing of integrators and inputs.
    found = ctid.identify(tour, "ls", (1, 0))
    transfer = found.to_control()
    np.testing.assert_allclose(-1.0 / transfer.poles().real, found.time_constants)
    np.testing.assert_allclose(transfer(0.0), found.params["b0"])


def test_an_integrator(tour):
    p = ctid.identify(tour, "srivc", (1, 0), integrator=True).to_control()
    assert list(p.poles()) == [0.0]
    found = ctid.identify(tour, "srivc", (2, 0), integrator=True)
    s = 0.01 + 0.02j
    np.testing.assert_allclose(found.to_control()(s), found.params["b0"] / (s + found.params["a2"] * s**2), rtol=1e-12)


def test_several_inputs(block):
    found = ctid.identify(block, "srivc", (1, 0), inputs=["u [%]", "Ta [degC]"], output="y [degC]")
    p, s = found.params, 0.01j
    expected = np.array([[p["b0"], p["b0_2"]]]) / (1.0 + p["a1"] * s)
    np.testing.assert_allclose(found.to_control()(s), expected, rtol=1e-12)


def test_matrices():
    model = ctid.Model.from_file(MODELS / "heated-block.mo")
    linear = model.linearize()
    system = linear.to_control()
    for name in "ABCD":
        assert (np.asarray(getattr(system, name)) == getattr(linear, name)).all()
    assert (system.state_labels, system.input_labels, system.output_labels) == (linear.states, linear.inputs, linear.outputs)
    np.testing.assert_allclose(system.poles(), linear.poles)
