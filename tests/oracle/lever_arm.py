"""The arm from the point that cameras follow to the accelerometer, from BROAD's recordings with positions.

    (p + C r)″ = C (G (f(t + δ) − b)) + g        C: attitude, body to n, at t + ε against p       r: the arm, body axes

Both sides are taken in n and through the same band (Butterworth, zero phase), which leaves out g and slow errors of the cameras as well as
what is faster than they see. r, b, the nine entries of G and both times come out of one linear least squares; rows that are more than
five robust deviations off are left out. Standard errors are those of blocks of 20 s (cluster-robust), and for each half of the
movement the arm is estimated again with all else held: where it keeps its value, it is a property of the recording.

Three bands show that the arm does not depend on the frequency, the rests how the unit lies on the board: `up` is the direction of
what the accelerometer feels at the first rest.

    python3 tests/oracle/lever_arm.py     # IMUCAL_DATA, default ../shared/data; writes tests/golden/lever_arm_broad.json
"""

import numpy as np
from scipy.ndimage import binary_dilation
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation

from common import load, triad, write

NAMES = ["broad-02-rotation", "broad-10-translation", "broad-24-tapping"]
BANDS = [(0.3, 5.0), (0.3, 3.0), (1.0, 8.0)]
G = np.array([0.0, 0.0, 9.81])
STRIDE, BLOCK = 8, 20.0


def bridged(t, x):
    good = np.isfinite(x).all(1)
    return np.stack([np.interp(t, t[good], column[good]) for column in x.T], 1), good


def read(name):
    manifest, cols = load(name)
    t = cols["t"]
    acc, good_acc = bridged(t, triad(manifest, cols, "acc")[0])
    p, good_p = bridged(t, np.stack([cols[f"ref_p{a}"] for a in "xyz"], 1))
    q = np.stack([cols[f"ref_q{a}"] for a in "xyzw"], 1)
    good_q = np.isfinite(q).all(1)
    own = q[good_q]
    turns = np.ones(len(own))
    turns[1:] = np.where((own[1:] * own[:-1]).sum(1) < 0, -1, 1)
    q[good_q] = own * np.cumprod(turns)[:, None]
    c = Rotation.from_quat(bridged(t, q)[0]).as_matrix()
    step = np.median(np.diff(t))
    near = binary_dilation(~(good_acc & good_p & good_q), iterations=int(1.0 / step))
    return t, acc, c, p, ~near, step


def derivative(x, step, order):
    y = np.zeros_like(x)
    y[1:-1] = (x[2:] - x[:-2]) / (2 * step) if order == 1 else (x[2:] - 2 * x[1:-1] + x[:-2]) / step**2
    return y


def columns(t, acc, c, p, step, band):
    low = butter(4, band[1] * 2 * step, output="sos")
    high = butter(3, band[0] * 2 * step, "high", output="sos")
    through = lambda x: sosfiltfilt(high, sosfiltfilt(low, x, axis=0), axis=0)
    into_n = lambda x: np.einsum("nij,nj->ni", c, x)
    y = through(derivative(p, step, 2) - into_n(acc) - G)
    arm = [-through(derivative(c[:, :, k], step, 2)) for k in range(3)]
    bias = [through(c[:, :, k]) for k in range(3)]
    gain = [through(c[:, :, i] * acc[:, [j]]) for i in range(3) for j in range(3)]
    late = through(into_n(derivative(acc, step, 1)))
    turned = through(np.einsum("nij,nj->ni", derivative(c, step, 1), acc))
    return y, np.stack(arm + bias + gain + [late, turned], 2)


def solve(a, y, block):
    keep = np.ones(len(y), bool)
    for _ in range(4):
        inverse = np.linalg.inv(np.einsum("nki,nkj->ij", a[keep], a[keep]))
        x = inverse @ np.einsum("nki,nk->i", a[keep], y[keep])
        square = ((y - a @ x) ** 2).sum(1)
        keep = square < 25 * np.median(square) / 2.37
    scores = np.einsum("nki,nk->ni", a, y - a @ x) * keep[:, None]
    sums = np.stack([scores[block == b].sum(0) for b in np.unique(block)])
    return x, np.sqrt(np.diag(inverse @ (sums.T @ sums) @ inverse))


def main():
    out = {}
    for name in NAMES:
        t, acc, c, p, good, step = read(name)
        rows = np.flatnonzero(good)[::STRIDE]
        first = acc[(t > 5) & (t < 30)].mean(0)
        entry = {"up": first / np.linalg.norm(first), "bands": []}
        for band in BANDS:
            y, a = columns(t, acc, c, p, step, band)
            x, std = solve(a[rows], y[rows], t[rows] // BLOCK)
            y = y - a[:, :, 3:] @ x[3:]
            # Half of the turning before it, half after.
            turning = np.cumsum((a[rows][:, :, :3] ** 2).sum((1, 2)))
            early = turning < 0.5 * turning[-1]
            halves = [solve(a[rows[h]][:, :, :3], y[rows[h]], t[rows[h]] // 5.0)[0] for h in (early, ~early)]
            print(f"{name:<21} {band[0]}-{band[1]} Hz, mm: {(1e3 * x[:3]).round(2)} ± {(1e3 * std[:3]).round(2)}"
                  f"  halves {(1e3 * halves[0]).round(2)} {(1e3 * halves[1]).round(2)}  up {entry['up'].round(3)}")
            entry["bands"].append({"band_hz": band, "arm_m": x[:3], "std_m": std[:3], "halves_m": halves})
        out[name] = entry
    write("lever_arm_broad.json", out)


if __name__ == "__main__":
    main()
