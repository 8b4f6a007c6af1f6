"""Seconds that SciPy takes to fit gain and bias of points near a sphere; the quickest of so many times.

norm_fit.py POINTS.csv LENGTH REPEATS
"""

import sys
import time

try:
    import numpy as np
    from scipy.optimize import least_squares
except ImportError as missing:
    sys.exit(f"{missing}; install numpy and scipy")

path, length, repeats = sys.argv[1], float(sys.argv[2]), int(sys.argv[3])
points = np.loadtxt(path, delimiter=",")


def residuals(p):
    gain = np.array([[p[0], p[1], p[2]], [0.0, p[3], p[4]], [0.0, 0.0, p[5]]])
    return np.linalg.norm((points - p[6:]) @ gain.T, axis=1) - length


start = np.array([1.0, 0, 0, 1.0, 0, 1.0, 0, 0, 0])
seconds = []
for _ in range(repeats):
    begun = time.perf_counter()
    found = least_squares(residuals, start, method="lm")
    seconds.append(time.perf_counter() - begun)
    assert found.success
print(min(seconds))
