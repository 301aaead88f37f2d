"""Whatever holds numbers is read by the estimators; what holds none is refused by name."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest

import ctid

PHI = np.array([[1, 2], [0, 1], [3, 1], [1, 0]])
Y = np.array([5, 2, 5, 1])

#: The same numbers in other forms; each holds them exactly.
FORMS: dict[str, Callable[[np.ndarray], object]] = {
    "int": lambda a: a,
    "unsigned": lambda a: a.astype(np.uint8),
    "float32": lambda a: a.astype(np.float32),
    "the other byte order": lambda a: a.astype(">f8"),
    "list": lambda a: a.tolist(),
    "tuple": lambda a: tuple(a.tolist()),
    "pandas": lambda a: pd.Series(a) if a.ndim == 1 else pd.DataFrame(a),
    "steps": lambda a: np.repeat(a.astype(float), 2, axis=-1)[..., ::2],
}


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
def test_recursive_least_squares_reads_them(form):
    expected = ctid.ContinuousRls(np.zeros(2), 100.0 * np.eye(2), forgetting=0.02)
    rls = ctid.ContinuousRls(form(np.zeros(2, int)), form(100 * np.eye(2, dtype=int)), forgetting=0.02)
    assert rls.update(form(PHI[0]), 5, 1) == expected.update(PHI[0].astype(float), 5.0, 1.0)
    found, innovations = rls.run(form(PHI), form(Y), form(np.array([1, 2, 1, 1])))
    again, same = expected.run(PHI.astype(float), Y.astype(float), np.array([1.0, 2.0, 1.0, 1.0]))
    assert (found == again).all() and (innovations == same).all()


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
def test_output_error_reads_them(form):
    u, y = np.array([1, 1, 0, 1]), np.array([0, 1, 2, 1])
    expected = ctid.StabilizedOe((1, 0), [5.0, 1.0], forgetting=0.002, bandwidth=0.4, filter0=[5.0])
    oe = ctid.StabilizedOe((1, 0), form(np.array([5, 1])), forgetting=0.002, bandwidth=0.4, filter0=form(np.array([5])))
    assert (oe.run(form(u), form(y), 1.0) == expected.run(u.astype(float), y.astype(float), 1.0)).all()


def test_what_holds_no_numbers_is_refused_by_name():
    rls = ctid.ContinuousRls(np.zeros(2), np.eye(2), 0.02)
    oe = ctid.StabilizedOe((1, 0), [5.0, 1.0], forgetting=0.002, bandwidth=0.4)
    matrix, column = np.eye(2), np.ones(2)
    for wrong, says in [
        (np.array([1.0, None]), "object"),
        (["a", "b"], "<U1"),
        (np.array([1j, 2.0]), "complex128"),
        (pd.to_datetime(["2026-01-01", "2026-01-02"]), "datetime64"),
        (None, "object"),
        ([[1.0, 2.0], [3.0]], "different lengths"),
        (np.ones((2, 2, 2)), "(2, 2, 2)"),
    ]:
        for name, call in [
            ("theta0", lambda: ctid.ContinuousRls(wrong, matrix, 0.02)),
            ("P0", lambda: ctid.ContinuousRls(column, wrong, 0.02)),
            ("phi", lambda: rls.update(wrong, 1.0, 1.0)),
            ("phi", lambda: rls.run(wrong, column, 1.0)),
            ("y", lambda: rls.run(matrix, wrong, 1.0)),
            ("dt", lambda: rls.run(matrix, column, wrong)),
            ("theta0", lambda: ctid.StabilizedOe((1, 0), wrong, 0.002, 0.4)),
            ("u", lambda: oe.run(wrong, column, 1.0)),
            ("y", lambda: oe.run(column, wrong, 1.0)),
        ]:
            with pytest.raises(ctid.DataError) as caught:
                call()
            message = str(caught.value)
            assert message.startswith(f"{name} ") and says in message and "\n" not in message, message
    assert (rls.theta == 0.0).all() and (oe.theta == [5.0, 1.0]).all()
    for order in (3, (1,), (-1, 0), (1, 1), (1.5, 0), None):
        with pytest.raises(ctid.ModelError, match="an order is"):
            ctid.StabilizedOe(order, [5.0, 1.0], 0.002, 0.4)  # type: ignore[arg-type]
