"""Threads, memory, Ctrl-C, and estimators against their own single steps."""

from __future__ import annotations

import copy
import os
import pickle
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from conftest import MODELS

import ctid


def test_four_fits_at_once(block):
    model = ctid.Model.from_file(MODELS / "heated-block.mo")
    alone = model.fit(block, known={"C": 52.0})
    with ThreadPoolExecutor(4) as pool:
        fits = list(pool.map(lambda _: model.fit(block, known={"C": 52.0}), range(4)))
    assert all(fit.params.equals(alone.params) for fit in fits)


def test_the_lock_is_released(block):
    fit = ctid.Model.from_file(MODELS / "heated-block.mo").fit(block, known={"C": 52.0})
    counted, stop = [0], threading.Event()

    def count() -> None:
        while not stop.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    began = time.perf_counter()
    fit.diagnose(progress=False)
    seconds = time.perf_counter() - began
    stop.set()
    thread.join()
    assert counted[0] > 50.0 * seconds


@pytest.mark.skipif(os.name == "nt", reason="signals are not those of Windows")
def test_ctrl_c_ends_a_search():
    toml = MODELS / "house.toml"
    import pandas as pd

    frame = pd.read_csv(MODELS / "house.csv")
    fit = ctid.Model.from_file(toml).fit(frame.set_index(frame.columns[0]))
    # A shell that runs the tests in the background has them ignore Ctrl-C.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    began = time.perf_counter()
    try:
        with pytest.raises(KeyboardInterrupt):
            fit.diagnose(effort="thorough", progress=False)
    finally:
        signal.signal(signal.SIGINT, before)
    assert time.perf_counter() - began < 30.0


def test_phases_are_told(block):
    fit = ctid.Model.from_file(MODELS / "heated-block.mo").fit(block, known={"C": 52.0})
    phases: list[str] = []
    fit.diagnose(progress=phases.append)
    assert phases[0] == "fitting the model" and len(phases) > 2

    def fails(phase: str) -> None:
        raise RuntimeError(phase)

    with pytest.raises(RuntimeError, match="fitting the model"):
        fit.diagnose(progress=fails)


def resident() -> int:
    """Memory of the process in bytes."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is read from /proc")
def test_memory_stays_flat(block):
    frame = block.iloc[:60]
    model = ctid.Model.from_file(MODELS / "heated-block.mo")
    sizes = []
    for k in range(1000):
        fit = model.fit(frame, known={"C": 52.0})
        fit.residuals, fit.to_dict()
        if k % 100 == 99:
            sizes.append(resident())
    assert sizes[-1] - sizes[1] < 8 << 20, sizes


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is read from /proc")
def test_memory_of_monitors_stays_flat():
    text = (MODELS / "heated-block.mo").read_text(encoding="utf-8")
    row = (0.0, {"u": 1.0, "Ta": 20.0}, {"y": 20.0})
    sizes = []
    for k in range(1000):
        # Another text each time.
        model = ctid.Model.from_text(text.replace("min=0) = 0.2", f"min=0) = {0.2 + 1e-4 * k!r}"))
        pickle.loads(pickle.dumps(model.monitor())).update(*row)
        if k % 100 == 99:
            sizes.append(resident())
    assert sizes[-1] - sizes[1] < 2 << 20, sizes


@pytest.mark.parametrize("parameters", [1, 2, 3, 5, 8])
def test_whole_arrays_are_single_steps(parameters):
    rng = np.random.default_rng(2)
    phi = rng.standard_normal((500, parameters))
    y = phi @ np.arange(1.0, parameters + 1) + 0.01 * rng.standard_normal(500)
    y[7] = np.nan
    rls = ctid.ContinuousRls(np.zeros(parameters), 100.0 * np.eye(parameters), forgetting=0.02)
    single = copy.copy(rls)
    trajectory, innovations = rls.run(phi, y, 0.5)
    for k in range(500):
        epsilon = single.update(phi[k], y[k], 0.5)
        assert epsilon == innovations[k] or (np.isnan(epsilon) and k == 7)
        assert (single.theta == trajectory[k]).all()
    assert (single.P == rls.P).all()
    np.testing.assert_allclose(rls.theta, np.arange(1.0, parameters + 1), atol=0.02)
    kept = pickle.loads(pickle.dumps(rls))
    assert (kept.theta == rls.theta).all() and (kept.P == rls.P).all()
    wide = np.asfortranarray(phi)
    again = ctid.ContinuousRls(np.zeros(parameters), 100.0 * np.eye(parameters), forgetting=0.02)
    assert (again.run(wide, y, np.full(500, 0.5), trajectory=False) == innovations)[np.arange(500) != 7].all()


def test_output_error_finds_the_plant():
    oe = ctid.StabilizedOe((1, 0), [5.0, 1.0], forgetting=0.002, bandwidth=0.4)
    y, us, ys = 0.0, [], []
    for k in range(3000):
        u = 1.0 if k // 60 % 2 == 0 else -1.0
        us.append(u), ys.append(y)
        y += (1.0 - np.exp(-0.05)) * (2.0 * u - y)
    trajectory = oe.run(np.array(us), np.array(ys), 0.5)
    np.testing.assert_allclose(trajectory[-1], [10.0, 2.0], rtol=0.02)
    assert (copy.copy(oe).theta == oe.theta).all()
    found = ctid.Fcloe((1, 0)).fit(np.array(ys), 0.5, u=np.array(us))
    np.testing.assert_allclose(found["theta"], [10.0, 2.0], rtol=1e-3)
