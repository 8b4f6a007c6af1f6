"""How long SciPy takes for the accelerometer fit alone: the unit of comparison of a benchmark.

The fit as a SciPy user would write it: least_squares(method="lm"), numerical Jacobian (two-point), the plain norm cost
g - |A (x - b)|, nine parameters from nominal (A = 1, b = 0), over the stored rests of xsens-mti (no recording is needed).
Prints one number: the median time of a fit in seconds.

    python3 tests/oracle/acc_fit_time.py
"""

import json
import statistics
import time

import numpy as np
from scipy.optimize import least_squares

from common import GOLDEN

RUNS, WARM = 200, 10


def problem():
    """The fit as a function without arguments; it has been checked to reach the golden cost."""
    golden = json.loads((GOLDEN / "acc_t9_xsens-mti.json").read_text())
    x, g = np.array(golden["observations"]), golden["gravity"]

    def fun(p):
        A = np.array([[p[0], p[1], p[2]], [0.0, p[3], p[4]], [0.0, 0.0, p[5]]])
        return g - np.linalg.norm((x - p[6:]) @ A.T, axis=1)

    def fit():
        return least_squares(fun, np.array([1.0, 0, 0, 1, 0, 1, 0, 0, 0]), method="lm")

    want = golden["plain_cost"]
    cost = fit().cost
    assert abs(cost - want["cost"]) < 1e-8 * want["cost"] + 1e-12, (cost, want["cost"])
    return fit


def main():
    fit = problem()
    times = []
    for _ in range(WARM + RUNS):
        t = time.perf_counter()
        fit()
        times.append(time.perf_counter() - t)
    print(f"{statistics.median(times[WARM:]):.6e}")


if __name__ == "__main__":
    main()
