"""Pictures, where matplotlib is installed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ._frames import Array


def _axes(rows: int, ax: Any) -> list[Any]:
    """So many axes below each other, or those that are given."""
    try:
        from matplotlib import pyplot
    except ImportError:
        raise ImportError("a picture needs matplotlib: pip install matplotlib") from None
    if ax is None:
        _, axes = pyplot.subplots(rows, 1, sharex=True, squeeze=False, figsize=(8.0, 2.6 * rows), layout="constrained")
        return list(axes[:, 0])
    given = list(np.ravel(np.asarray(ax, dtype=object)))
    if len(given) != rows:
        raise ValueError(f"{rows} axes are needed, and {len(given)} are given")
    return given


def _label(name: str, units: Sequence[str], k: int) -> str:
    """A name with the unit of output `k`, where that is known."""
    unit = units[k] if k < len(units) else ""
    return f"{name} [{unit}]" if unit else name


def fit_axes(series: Sequence[tuple[str, Array, list[tuple[str, Array, Array]]]], units: Sequence[str], ax: Any) -> Any:
    """Measured and simulated, and the residual, of each output of the first record."""
    record, time, outputs = series[0]
    axes = _axes(2 * len(outputs), ax)
    for k, (name, measured, model) in enumerate(outputs):
        above, below = axes[2 * k], axes[2 * k + 1]
        above.plot(time, measured, ".", ms=2, color="0.5", label="measured")
        above.plot(time, model, lw=1.2, label="model")
        above.set_ylabel(_label(name, units, k))
        above.legend(loc="best", fontsize="small")
        below.plot(time, measured - model, lw=0.8)
        below.axhline(0.0, lw=0.5, color="0.5")
        below.set_ylabel(_label(f"{name} residual", units, k))
    axes[0].set_title(record)
    axes[-1].set_xlabel("time [s]")
    return axes


def diagnosis_axes(
    series: Sequence[tuple[str, bool, Array, list[tuple[str, Array, list[Array]]]]],
    units: Sequence[str],
    title: str,
    found: dict[str, Any],
    ax: Any,
) -> Any:
    """Measured, the believed model and the last one, of each output of the first record; then the error of every step."""
    record, _, time, outputs = series[0]
    axes = _axes_apart(len(outputs), ax)
    steps = found["steps"]
    for k, (axis, (name, measured, models)) in enumerate(zip(axes, outputs, strict=False)):
        axis.plot(time, measured, ".", ms=2, color="0.5", label="measured")
        if models:
            axis.plot(time, models[0], lw=1.2, label=title)
        if len(models) > 1:
            axis.plot(time, models[-1], lw=1.2, label=" + ".join([title, *found["effects"]]))
        axis.set_ylabel(_label(name, units, k))
        axis.set_xlabel("time [s]")
        axis.legend(loc="best", fontsize="small")
    axes[0].set_title(record)
    last = axes[-1]
    names = [step["added"] or title for step in steps]
    for k, output in enumerate(name for name, _, _ in outputs):
        errors = [step["rmse_per_output"][output] for step in steps]
        last.plot(range(len(steps)), errors, "o-", label=_label(output, units, k))
        floor = next((noise["level"] for noise in found["noise"] if noise["output"] == output), None)
        if floor is not None:
            last.axhline(floor, lw=0.8, ls="--", color="0.5")
    last.set_xticks(range(len(steps)), names)
    last.set_ylabel("simulation error, rms")
    last.set_ylim(bottom=0.0)
    last.legend(loc="best", fontsize="small")
    return axes


def _axes_apart(outputs: int, ax: Any) -> list[Any]:
    """Axes for outputs, and one more that does not share their time."""
    if ax is not None:
        return _axes(outputs + 1, ax)
    try:
        from matplotlib import pyplot
    except ImportError:
        raise ImportError("a picture needs matplotlib: pip install matplotlib") from None
    _, axes = pyplot.subplots(outputs + 1, 1, squeeze=False, figsize=(8.0, 2.6 * (outputs + 1)), layout="constrained")
    return list(axes[:, 0])
