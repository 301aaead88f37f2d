"""Writes sampling.txt: exact sampling of x' = A x + b u, computed with 80 digits by mpmath.

Van Loan's augmented matrix [[A, b, 0], [0, 0, 1], [0, 0, 0]] h has, in its exponential, phi0, h phi1 b and h^2 phi2 b
side by side. Every number of A, b and h is an f64, so there is no error in the input.
"""

from pathlib import Path

from mpmath import expm, matrix, mp, mpf

mp.dps = 80


def companion(poles):
    """Monic coefficients of the product of (p - pole), rounded to f64 at the end."""
    c = [mpf(1)]
    for pole in poles:
        c = [low - pole * high for low, high in zip([0] + c, c + [0])]
    n = len(poles)
    a = [[1.0 if j == i + 1 else 0.0 for j in range(n)] for i in range(n - 1)]
    return a + [[float(-x) for x in c[:-1]]], [0.0] * (n - 1) + [1.0]


def oscillator(w):
    return [[0.0, w], [-w, 0.0]], [0.0, 1.0]


CASES = [
    ("lag", ([[-0.25]], [0.5]), 4.0),
    ("integrator", ([[0.0]], [1.0]), 3.0),
    ("growth", ([[0.75]], [1.0]), 8.0),
    ("three integrators", ([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]], [0.0, 0.0, 1.0]), 0.7),
    ("Jordan block of 4", ([[-2.0 if i == j else float(j == i + 1) for j in range(4)] for i in range(4)], [1.0, 2.0, 3.0, 4.0]), 1.5),
    ("triple pole", companion([-1, -1, -1]), 2.5),
    ("five poles in one place", companion([-2] * 5), 0.5),
    ("pole at 0 and a lag", companion([0, mpf("-0.1")]), 5.0),
    ("stiff, 9 decades", companion([mpf("-1e-3"), mpf("-1e6")]), 1.0),
    ("stiff, fast and slow step", companion([mpf("-1e-4"), mpf("-1"), mpf("-1e4")]), 10.0),
    ("stiff, 6 poles", companion([-mpf(10) ** k for k in range(-3, 3)]), 2.0),
    ("states in unlike units", ([[-1.0, 1e8], [-1e-8, -2.0]], [1e6, 1.0]), 1.0),
    ("oscillator, 1000 rad", oscillator(1000.0), 1.0),
    ("lightly damped pair beside a lag", ([[0.0, 1.0, 0.0], [-25.0, -0.002, 1.0], [0.0, 0.0, -1.0]], [0.0, 0.0, 1.0]), 7.0),
    ("far from normal", ([[-1.0, 1000.0, 0.0], [0.0, -1.5, 1000.0], [0.0, 0.0, -2.0]], [0.0, 0.0, 1.0]), 1.0),
    ("tiny step", companion([-1, -2, -3]), 1e-9),
]


def main():
    lines = ["# name; then n, h, A by rows, b, phi0 by rows, h phi1 b, h phi2 b. Made by sampling.py."]
    for name, (a, b), h in CASES:
        n = len(b)
        augmented = matrix(n + 2, n + 2)
        for i in range(n):
            for j in range(n):
                augmented[i, j] = mpf(a[i][j])
            augmented[i, n] = mpf(b[i])
        augmented[n, n + 1] = mpf(1)
        e = expm(augmented * mpf(h), method="taylor")
        numbers = [n, h]
        numbers += [x for row in a for x in row] + b
        numbers += [float(e[i, j]) for i in range(n) for j in range(n)]
        numbers += [float(e[i, n]) for i in range(n)] + [float(e[i, n + 1] / mpf(h)) for i in range(n)]
        lines += [name, " ".join(repr(x) for x in numbers)]
    Path(__file__).with_suffix(".txt").write_text("\n".join(lines) + "\n")


main()
