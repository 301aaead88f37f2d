"""Time of one recursive least squares update of padasip (Python), in nanoseconds: the shortest of 20 runs over 1000 samples.

Called by the bench `rls` with the number of parameters; the data are those of `rls_cases`.
"""

import math
import sys
import time

import numpy as np
import padasip

SAMPLES = 1000


def wave(k, i):
    return math.sin(0.7 * (k * (2 * i + 3)) + 0.1 * ((k * k) % 97))


def main():
    p = int(sys.argv[1])
    phi = np.array([[wave(k, i) for i in range(p)] for k in range(SAMPLES)])
    y = [wave(k, 1) + 0.5 * wave(k, 5) for k in range(SAMPLES)]
    shortest = math.inf
    for _ in range(20):
        rls = padasip.filters.FilterRLS(p, mu=0.98, eps=0.01, w="zeros")
        began = time.perf_counter()
        for k in range(SAMPLES):
            rls.adapt(y[k], phi[k])
        shortest = min(shortest, time.perf_counter() - began)
    print(shortest / SAMPLES * 1e9)


main()
