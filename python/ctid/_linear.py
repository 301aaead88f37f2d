"""Linear models: matrices about a point, identification from records, recursive estimators."""

from __future__ import annotations

import json
import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from . import _ctid
from ._arguments import number, pair
from ._ctid import DataError, ModelError
from ._frames import Array, Data, Records, as_list, series, to_frames

if TYPE_CHECKING:
    import pandas as pd

#: How the parameters of a linear model are found.
Method = Literal["stabilized-oe", "ct-rls", "ls", "iv", "fcloe", "recursive-fcloe", "srivc", "rivc"]
#: Polynomials R and S of a controller `u = R/S (r - y)`, by rising powers of s.
Controller = tuple[Sequence[float], Sequence[float]]


@dataclass(frozen=True)
class StateSpace:
    """`d(x - x0)/dt = A (x - x0) + B (u - u0) + dx`, `y - y0 = C (x - x0) + D (u - u0)`. Time is in the model's unit."""

    A: Array
    B: Array
    C: Array
    D: Array
    #: Where it holds: the states, the inputs, the slopes of the states, the outputs.
    x: Array
    u: Array
    dx: Array
    y: Array
    states: list[str]
    inputs: list[str]
    outputs: list[str]

    @property
    def poles(self) -> npt.NDArray[np.complex128]:
        """Eigenvalues of A, in 1 over the model's unit of time."""
        return np.linalg.eigvals(self.A).astype(np.complex128)

    def to_control(self) -> Any:
        """The same as `control.StateSpace`, where the package `control` is installed."""
        try:
            import control  # type: ignore[import-not-found, import-untyped, unused-ignore]
        except ImportError:
            raise ImportError("control.StateSpace needs python-control: pip install control") from None
        names = {"states": self.states, "inputs": self.inputs, "outputs": self.outputs}
        return control.StateSpace(self.A, self.B, self.C, self.D, **names)


class Identification:
    """A linear model `A(s) y = B(s) u + d` that was identified; immutable."""

    __slots__ = ("_curves", "_found")

    def __init__(self, found: dict[str, Any], curves: tuple[Array, Array, Array]) -> None:
        self._found = found
        self._curves = curves

    @property
    def method(self) -> str:
        """How it was found."""
        return str(self._found["method"])

    @property
    def order(self) -> tuple[int, int]:
        """Orders n of A and m of B."""
        return int(self._found["order"]["n"]), int(self._found["order"]["m"])

    @property
    def params(self) -> pd.Series[float]:
        """`a1..an, b0..bm`, and an offset where the method estimates one."""
        all = self._found["parameters"]
        result: pd.Series[float] = series([p["name"] for p in all], [p["value"] for p in all], "value")
        return result

    @property
    def std_errors(self) -> pd.Series[float]:
        """Their standard errors; NaN where they are not known."""
        all = self._found["parameters"]
        result: pd.Series[float] = series([p["name"] for p in all], [p["std_error"] for p in all], "std_error")
        return result

    @property
    def time_constants(self) -> list[float]:
        """Time constants of the real poles in s, the slowest first."""
        return list(self._found["time_constants"])

    @property
    def fit_percent(self) -> float:
        """`100 (1 - rmse/s)` with the standard deviation s of the output, of a simulation, %."""
        return float(self._found["fit_percent"])

    @property
    def warnings(self) -> list[str]:
        """Warnings to read before the model is used."""
        return list(self._found["sentences"])

    @property
    def simulated(self) -> tuple[Array, Array]:
        """Times [s], and the simulated output at these times."""
        return self._curves[0], self._curves[2]

    def to_dict(self) -> dict[str, Any]:
        """The result as `ctid identify --json` writes it; numbers that are none are None."""
        result: dict[str, Any] = json.loads(json.dumps(self._found))
        return result

    def to_control(self) -> Any:
        """`B(s)/A(s)` as `control.TransferFunction`, a column for each input, where the package `control` is installed. A delay is not in it."""
        try:
            import control  # type: ignore[import-not-found, import-untyped, unused-ignore]
        except ImportError:
            raise ImportError("control.TransferFunction needs python-control: pip install control") from None
        values = self.params
        n, m = self.order
        refined = self._found.get("refined") or {"integrator": False, "inputs": [None]}
        # With an integrator A is s + a2 s^2 + .., else 1 + a1 s + ..
        begin = [0.0, 1.0] if refined["integrator"] else [1.0]
        a = [*begin, *(values[f"a{i}"] for i in range(len(begin), n + 1))][::-1]
        inputs = ["" if k == 0 else f"_{k + 1}" for k in range(len(refined["inputs"]))]
        b = [[values[f"b{i}{one}"] for i in range(m, -1, -1)] for one in inputs]
        return control.TransferFunction([b], [[a] * len(b)])

    def plot(self, ax: Any = None) -> Any:
        """Measured and simulated output, and the residual; returns matplotlib axes."""
        from ._plot import fit_axes

        time, measured, simulated = self._curves
        return fit_axes([(str(self._found["record"]), time, [("output", measured, simulated)])], [], ax)

    def __repr__(self) -> str:
        return f"<ctid.Identification by {self.method}, order {self.order}: {self.fit_percent:.1f} %>"


def _guess(data: Data, given: str | Sequence[str] | None, starts: str, role: str) -> list[str]:
    """The columns of a role: those that are given, else the first whose name begins like it."""
    if isinstance(given, str):
        return [given]
    if given is not None:
        return [str(column) for column in given]
    names = [str(column) for column in data]
    found = [name for name in names if name[:1].lower() == starts or name.split(" [")[0].lower() == role]
    if not found:
        raise DataError(f"data: no column is named like the {role}; there are {', '.join(names) or 'none'}: name it, {role}=...")
    return found[:1]


def identify(
    data: Records,
    method: Method,
    order: tuple[int, int] = (1, 0),
    *,
    inputs: str | Sequence[str] | None = None,
    output: str | None = None,
    reference: str | None = None,
    delay: float | str | None = None,
    integrator: bool = False,
    memory: float | None = None,
    bandwidth: float | None = None,
    levels: Literal["auto", "rest", "mean", "estimated"] | str = "auto",
    controller: Controller | None = None,
    limits: tuple[float, float] = (-np.inf, np.inf),
    hold: Literal["zero", "first"] = "zero",
) -> Identification:
    """Identifies a linear model in continuous time, as `ctid identify` does.

    `data`: a record, or several of srivc and rivc. `inputs`, `output`: columns; without them the first that begins with u and with y. `order`: n of
    A and m of B, n from 1 to 4. `reference`, `controller`: of a loop. `delay`: of srivc and rivc, in s, `"auto"`, or `"0..30"`. `integrator`:
    `A(0) = 0`. `memory`: of a recursion in s. `bandwidth`: of the state variable filters in 1/s. `hold`: of the inputs between rows.

    Raises `DataError` and `ModelError`.
    """
    records = as_list(data)
    if not records:
        raise DataError("no record: give a frame, or a list of them")
    named_inputs = _guess(records[0], inputs, "u", "input")
    named_output = _guess(records[0], output, "y", "output")[0]
    low, high = pair("limits", limits, "the smallest and the largest command")
    wanted = [*named_inputs, named_output, *([reference] if reference is not None else [])]
    frames = to_frames(records, "data", wanted)
    found, curves = _ctid.identify(
        frames,
        named_inputs,
        named_output,
        reference=reference,
        method=method,
        order=_order(order),
        delay=None if delay is None else str(delay),
        integrator=integrator,
        memory=memory,
        bandwidth=bandwidth,
        levels=levels,
        controller=_polynomials(controller),
        limits=(number("limits", low), number("limits", high)),
        hold=hold,
    )
    return Identification(json.loads(found), curves)


class Fcloe:
    """Closed-loop output error over a whole record: the plant `A(s) y = B(s) u` in the loop of a known controller `u = R/S (r - y)`.

    `order`: n of A and m of B. `controller`: polynomials R and S by rising powers of s; None: output error without a loop. `levels`: where zero of
    the signals is, `"estimated"`, `"deviations"` or `"mean"`.
    """

    def __init__(
        self,
        order: tuple[int, int] = (1, 0),
        *,
        controller: Controller | None = None,
        levels: Literal["estimated", "deviations", "mean"] = "estimated",
    ) -> None:
        self.order = _order(order)
        self.controller = controller
        self.levels = levels

    def fit(
        self,
        y: npt.ArrayLike,
        dt: float,
        *,
        r: npt.ArrayLike | None = None,
        u: npt.ArrayLike | None = None,
        theta0: Sequence[float] | None = None,
        level: float = 0.95,
    ) -> dict[str, Any]:
        """Fits it to signals that are sampled every `dt`: the output y (NaN: missing), the reference r of a loop, the input u.

        Returns `theta` (`a1..an, b0..bm`), `std_errors`, `half_widths` of the intervals that hold with probability `level`, `cov`,
        `residual_rms`, and why it ended: `stop`, `successful`. Without `theta0` it starts from regressions, which need u.
        """
        return _ctid.fcloe_fit(
            float(dt),
            None if r is None else _signal("r", r),
            None if u is None else _signal("u", u),
            _signal("y", y),
            order=self.order,
            controller=_polynomials(self.controller),
            levels=self.levels,
            theta0=None if theta0 is None else _signal("theta0", theta0),
            level=level,
        )

    def __repr__(self) -> str:
        return f"<ctid.Fcloe of order {self.order}>"


def _order(order: tuple[int, int]) -> tuple[int, int]:
    try:
        n, m = (operator.index(one) for one in order)
    except (TypeError, ValueError):
        n, m = 0, 0
    if n < 1 or not 0 <= m <= n:
        raise ModelError(f"order is {order!r}: give a pair (n, m) of the orders of A, 1 or more, and B, 0 to n")
    return n, m


def _polynomials(controller: Controller | None) -> tuple[list[float], list[float]] | None:
    if controller is None:
        return None
    r, s = pair("controller", controller, "the polynomials R and S by rising powers of s")
    return _signal("controller", r), _signal("controller", s)


def _signal(name: str, values: npt.ArrayLike) -> list[float]:
    array = np.asarray(values)
    if array.ndim != 1 or array.dtype.kind not in "fiub":
        raise DataError(f"{name}: numbers with one axis are needed, and it has {array.ndim} axes of {array.dtype}")
    result: list[float] = array.astype(np.float64).tolist()
    return result


def state_space(found: Mapping[str, Any]) -> StateSpace:
    """Matrices of the native part."""
    return StateSpace(**found)
