"""Overhead of the package, as ratios in one run.

`python overhead.py CTID RLS`: the program, and the example `many_samples` of the crate ct-rls
(`cargo build --release -p ctid` and `cargo build --release -p ct-rls --example many_samples`). `python overhead.py`: four fits at once alone.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd

import ctid

ROOT = Path(__file__).resolve().parents[2]
MODELS = ROOT / "examples" / "models"
SAMPLES, PARAMETERS, REPEATS = 1_000_000, 3, 7


def regressors() -> tuple[np.ndarray, np.ndarray]:
    """Those of the example of the crate: a multiplicative generator, so that both see the same numbers."""
    state, numbers = 1, np.empty(SAMPLES * PARAMETERS)
    for i in range(numbers.size):
        state = state * 16807 % 2147483647
        numbers[i] = state / 2147483647.0 - 0.5
    phi = numbers.reshape(SAMPLES, PARAMETERS)
    return phi, phi[:, 0] + 2.0 * phi[:, 1] + 3.0 * phi[:, 2]


def estimator() -> ctid.ContinuousRls:
    return ctid.ContinuousRls(np.zeros(PARAMETERS), 1e3 * np.eye(PARAMETERS), forgetting=0.02)


def best(work: object) -> float:
    """The shortest of several times, in s."""
    times = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        work()  # type: ignore[operator]
        times.append(time.perf_counter() - began)
    return min(times)


def four_fits() -> None:
    """Four fits from four threads of Python, and one after the other."""
    frame = pd.read_csv(MODELS / "coupled-heaters.csv")
    frame = frame.set_index(frame.columns[0])
    model = ctid.Model.from_file(MODELS / "coupled-heaters.toml")

    def fit(seed: int) -> ctid.Fit:
        return model.fit(frame, starts=48, seed=seed)

    at_once, after = [], []
    with ThreadPoolExecutor(4) as pool:
        for _ in range(REPEATS):
            began = time.perf_counter()
            parallel = list(pool.map(fit, range(4)))
            at_once.append(time.perf_counter() - began)
            began = time.perf_counter()
            alone = [fit(seed) for seed in range(4)]
            after.append(time.perf_counter() - began)
    assert all(a.params.equals(b.params) for a, b in zip(parallel, alone, strict=True)), "both have to find the same"
    threads = os.environ.get("RAYON_NUM_THREADS", "all")
    print(
        f"four fits from four threads, {os.cpu_count()} cores, {threads} threads for each fit's starts: "
        f"{min(at_once) / min(after):.3f} times the {min(after):.3f} s of one after the other"
    )


def main(program: str, example: str) -> None:
    phi, y = regressors()
    crate = {}
    for _ in range(3):
        for line in subprocess.run([example], check=True, capture_output=True, text=True).stdout.splitlines():
            name, seconds, theta = line.split()
            crate[name] = min(float(seconds), crate.get(name, np.inf))
    rls = estimator()
    rls.run(phi, y, 0.1)
    assert repr(float(rls.theta[0])) == theta, "both have to find the same"
    whole = best(lambda: estimator().run(phi, y, 0.1))
    print(f"ContinuousRls.run, {SAMPLES} samples, all estimates kept: {whole / crate['kept']:.3f} times the crate's {crate['kept']:.4f} s")
    whole = best(lambda: estimator().run(phi, y, 0.1, trajectory=False))
    print(f"ContinuousRls.run, innovations alone: {whole / crate['innovations']:.3f} times the crate's {crate['innovations']:.4f} s")

    rows = list(phi)
    values = y.tolist()

    def single() -> None:
        update = estimator().update
        for row, value in zip(rows, values, strict=True):
            update(row, value, 0.1)

    def nothing() -> None:
        for _ in zip(rows, values, strict=True):
            pass

    beyond = (best(single) - best(nothing) - crate["innovations"]) / SAMPLES
    print(f"ContinuousRls.update: {1e9 * beyond:.0f} ns a call beyond the crate's")

    for name in ("heated-block", "coupled-heaters"):
        frame = pd.read_csv(MODELS / f"{name}.csv")
        frame = frame.set_index(frame.columns[0])
        fit = ctid.Model.from_file(MODELS / f"{name}.toml").fit(frame)
        package, by_program = [], []
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "d.json"
            for _ in range(8):
                began = time.perf_counter()
                fit.diagnose(progress=False)
                package.append(time.perf_counter() - began)
                command = [program, "diagnose", str(MODELS / f"{name}.csv"), "--model", str(MODELS / f"{name}.toml"), "--json", str(out)]
                subprocess.run(command, check=True, capture_output=True)
                by_program.append(json.loads(out.read_text())["seconds"])
                out.unlink()
        print(f"diagnose, {name}: {min(package) / min(by_program):.3f} times the program's {min(by_program):.3f} s")


if __name__ == "__main__":
    if len(sys.argv) == 3:
        main(*sys.argv[1:])
    else:
        four_fits()
