"""Rests and their means, for acc_t9.py, gyr_turns.py and acc_fit_time.py.

A simple detector after imu_tk's idea: the sample variance of each accelerometer axis in a window of about 1 s centred on the
sample (odd number of rows), the norm of the three against MULTIPLE times that of the recording's first seconds (at rest by
protocol). A maximal run of quiet centres at least a window long is a rest, [start, end) in rows.
"""

import numpy as np

from common import load, triad

MULTIPLE = 6.0
INITIAL_S = {"xsens-mti": 30.0, "mpu9150-0": 5.0, "mpu9150-1": 5.0}


def detect(x, dt, initial_s):
    n = len(x)
    w = int(round(1.0 / dt))
    w += 1 - w % 2
    h = w // 2
    z = x - x.mean(0)
    c1 = np.vstack([np.zeros(3), np.cumsum(z, 0)])
    c2 = np.vstack([np.zeros(3), np.cumsum(z * z, 0)])
    i = np.arange(h, n - h)
    var = (c2[i + h + 1] - c2[i - h]) / w - ((c1[i + h + 1] - c1[i - h]) / w) ** 2
    level = np.linalg.norm(x[: int(round(initial_s / dt))].var(0))
    quiet = np.zeros(n, dtype=int)
    quiet[h : n - h] = np.linalg.norm(var, axis=1) < MULTIPLE * level
    edges = np.flatnonzero(np.diff(np.r_[0, quiet, 0])).reshape(-1, 2)
    return [(int(a), int(b)) for a, b in edges if b - a >= w]


def rests_of(name):
    """-> (manifest, columns, x, offset, per_unit, intervals, means of x)"""
    manifest, cols = load(name)
    x, offset, per_unit = triad(manifest, cols, "acc")
    iv = detect(x, float(np.median(np.diff(cols["t"]))), INITIAL_S[name])
    return manifest, cols, x, offset, per_unit, iv, np.array([x[a:b].mean(0) for a, b in iv])
