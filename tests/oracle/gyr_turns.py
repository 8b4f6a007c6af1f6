"""Gyroscope gain (full 3x3) from the turns between rests: xsens-mti, mpu9150-0, mpu9150-1.

Rests and the accelerometer calibration are those of acc_t9.py's golden files (run that first). A turn goes from rest i to rest i + 1:
from row start = end_i - m_i to row stop = begin_j + m_j, both included, m = floor(min(0.25 s, a quarter of the rest)) in rows.

    theta_k = A_g (w_k - b(t_k)) dt_k,   C <- C exp([theta_k]x),   predicted u_j = C' u_i
    dt_k = (t_{k+1} - t_{k-1}) / 2 inside, half an interval at start and stop (sample k held between the mid-points to its neighbours)
    b(t): the straight line through the mean rates of rests i and j at their mid times (t of the first row + t of the last row) / 2
    u = y / |y|, y = A (mean of x over the rest - b) of the accelerometer; exact exponential per sample (unit quaternions)
    cost = 1/2 sum |predicted u_j - measured u_j|^2; w nominal: (raw - offset) / per_unit

Standard errors: s^2 (J'J)^-1 with s^2 = 2 cost / (2 turns - 9). Jacobian by complex step. Counts per (rad/s): K = (A_g / per_unit)^-1, its
column norms and diagonal; and per_unit / diag(A_g), which is what T K (raw - b) with a unit diagonal of T gives.
"constant_bias_no_margin" holds b at the first rest's mean and sets m = 0, as other tools do, for comparison with data/README.md.
"sensitivity" moves the margin m and the rest detector's threshold: how far the segmentation moves the result.

    python3 tests/oracle/gyr_turns.py     # IMUCAL_DATA, default ../shared/data; writes tests/golden/gyr_turns_NAME.json
"""

import json

import numpy as np
from scipy.optimize import least_squares

import rests
from common import GOLDEN, condition, covariance, fit, load, pack, polish, triad, unpack, write

MARGIN_S = 0.25


def product(q):
    """Ordered quaternion product along axis 1 (pairwise tree); q: (turns, samples, 4)."""
    while q.shape[1] > 1:
        if q.shape[1] % 2:
            one = np.zeros_like(q[:, :1])
            one[..., 0] = 1
            q = np.concatenate([q, one], axis=1)
        a, b = q[:, 0::2], q[:, 1::2]
        aw, av, bw, bv = a[..., :1], a[..., 1:], b[..., :1], b[..., 1:]
        q = np.concatenate([aw * bw - (av * bv).sum(-1, keepdims=True), aw * bv + bw * av + np.cross(av, bv)], axis=-1)
    return q[:, 0]


def quaternion(theta):
    h2 = (theta * theta).sum(-1, keepdims=True) / 4
    zero = np.abs(h2) < 1e-20
    h = np.sqrt(np.where(zero, 1.0, h2))
    return np.concatenate([np.where(zero, 1 - h2 / 2, np.cos(h)), 0.5 * theta * np.where(zero, 1 - h2 / 6, np.sin(h) / h)], axis=-1)


def build(t, w, iv, u, margin_s, constant_bias=False):
    dt = float(np.median(np.diff(t)))
    turns = [(end - margin(begin, end, dt, margin_s), nb + margin(nb, ne, dt, margin_s)) for (begin, end), (nb, ne) in zip(iv, iv[1:])]
    mean = np.array([w[a:b].mean(0) for a, b in iv])
    if constant_bias:
        mean[:] = mean[0]
    mid = np.array([(t[a] + t[b - 1]) / 2 for a, b in iv])
    n = max(b - a + 1 for a, b in turns)
    d, h = np.zeros((len(turns), n, 3)), np.zeros((len(turns), n))
    for i, (a, b) in enumerate(turns):
        tt = t[a : b + 1]
        s = ((tt - mid[i]) / (mid[i + 1] - mid[i]))[:, None]
        d[i, : len(tt)] = w[a : b + 1] - (mean[i] + s * (mean[i + 1] - mean[i]))
        g = np.diff(tt) / 2
        h[i, : len(tt)] = np.r_[g, 0] + np.r_[0, g]
    return {"turns": turns, "mean": mean, "mid": mid, "dw": d * h[..., None], "u": u}


def margin(begin, end, dt, margin_s):
    return int(np.floor(min(margin_s / dt, (end - begin) / 4) + 1e-9))


def predicted(p, s):
    q = product(quaternion(s["dw"] @ p.reshape(3, 3).T))
    w, v, u = q[:, :1], q[:, 1:], s["u"][:-1]
    c = np.cross(v, u)                       # C' u = u - 2 w v x u + 2 v x (v x u)
    return u - 2 * w * c + 2 * np.cross(v, c)


def residual(p, s):
    return (predicted(p, s) - s["u"][1:]).ravel()


def jac(p, s):
    return np.stack([residual(p + 1e-30j * e, s).imag / 1e-30 for e in np.eye(9)], axis=1)


def solve(s, p0):
    sol = least_squares(residual, p0, jac=jac, args=(s,), method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    return polish(sol.x, lambda p: residual(p, s), lambda p: jac(p, s))


def naive(p, s):
    """Rotation matrices one by one, to check the quaternion tree."""
    from scipy.spatial.transform import Rotation
    out = []
    for i, row in enumerate(s["dw"]):
        C = np.eye(3)
        for m in Rotation.from_rotvec(row @ p.reshape(3, 3).T).as_matrix():
            C = C @ m
        out.append(C.T @ s["u"][i])
    return np.array(out)


def directions(x, A, b):
    y = (x - b) @ A.T
    return y / np.linalg.norm(y, axis=1)[:, None]


def run(name):
    acc = json.loads((GOLDEN / f"acc_t9_{name}.json").read_text())
    manifest, cols = load(name)
    w, offset, per_unit = triad(manifest, cols, "gyr")
    t, iv = cols["t"], [tuple(k) for k in acc["intervals"]]
    s = build(t, w, iv, directions(np.array(acc["observations"]), np.array(acc["A"]), np.array(acc["b"])), MARGIN_S)
    one = np.eye(3).ravel()
    rng = np.random.default_rng(3)
    sols = np.array([solve(s, one + k * rng.uniform(-0.05, 0.05, 9)) for k in (0, 1, 1, 1)])
    disagreement = np.abs(sols - sols[0]).max()
    assert disagreement < 1e-10, disagreement
    p = sols[0]
    assert np.abs(naive(p, s) - predicted(p, s)).max() < 1e-11
    r, J = residual(p, s), jac(p, s)
    turns = len(s["turns"])
    s2 = r @ r / (2 * turns - 9)
    se = np.sqrt(np.diag(covariance(J, s2))).reshape(3, 3)
    A = p.reshape(3, 3)
    pu, mu = predicted(p, s), s["u"][1:]
    angle = np.arctan2(np.linalg.norm(np.cross(pu, mu), axis=1), (pu * mu).sum(1))
    turned = np.degrees(2 * np.arccos(np.clip(np.abs(product(quaternion(s["dw"] @ A.T))[:, 0]), 0, 1)))
    K = np.linalg.inv(A / per_unit)
    nominal = residual(one, s)

    # how far the segmentation moves it
    x, _, _ = triad(manifest, cols, "acc")
    g, dt = manifest["site"]["gravity"], float(np.median(np.diff(t)))
    moved = []
    for margin_s, multiple in ((0.0, 6.0), (0.1, 6.0), (0.5, 6.0), (1.0, 6.0), (0.25, 5.0), (0.25, 8.0), (0.25, 12.0)):
        rests.MULTIPLE = multiple
        jv = rests.detect(x, dt, rests.INITIAL_S[name])
        obs = np.array([x[a:b].mean(0) for a, b in jv])
        aa, ab = unpack(fit(obs, g, pack(np.array(acc["A"]), np.array(acc["b"]))))
        k = build(t, w, jv, directions(obs, aa, ab), margin_s)
        q = solve(k, p)
        rq = residual(q, k)
        moved.append({"margin_s": margin_s, "multiple": multiple, "turns": len(k["turns"]), "per_unit_over_diagonal": per_unit / np.diag(q.reshape(3, 3)),
                      "max_change_in_standard_errors": np.abs((q - p) / se.ravel()).max(), "rms_angle_deg": np.degrees(np.sqrt(rq @ rq / len(k["turns"])))})
    rests.MULTIPLE = 6.0
    k = build(t, w, iv, s["u"], 0.0, constant_bias=True)
    q = solve(k, p)
    rq = residual(q, k)
    peer = {"A": q.reshape(3, 3), "per_unit_over_diagonal": per_unit / np.diag(q.reshape(3, 3)), "cost": 0.5 * rq @ rq, "rms_angle_deg": np.degrees(np.sqrt(rq @ rq / turns))}

    out = {
        "generator": "tests/oracle/gyr_turns.py", "recording": name, "offset": offset, "per_unit": per_unit, "margin_s": MARGIN_S, "intervals": iv,
        "turns_first_last_row": s["turns"], "rest_mean_rate": s["mean"], "rest_mid_time": s["mid"], "directions": s["u"],
        "A": A, "gain": A / per_unit, "standard_errors": se, "inverse_gain": K, "column_norms": np.linalg.norm(K, axis=0), "diagonal": np.diag(K),
        "per_unit_over_diagonal": per_unit / np.diag(A), "bias_first_rest_raw": offset + per_unit * s["mean"][0],
        "cost": 0.5 * r @ r, "s2": s2, "dof": 2 * turns - 9, "rms_angle_rad": np.sqrt((angle**2).mean()), "rms_angle_deg": np.degrees(np.sqrt((angle**2).mean())),
        "rms_angle_nominal_deg": np.degrees(np.sqrt(nominal @ nominal / turns)), "condition": condition(J), "start_disagreement": disagreement,
        "angle_per_turn_rad": angle, "turned_deg": turned, "sensitivity": moved, "constant_bias_no_margin": peer,
    }
    write(f"gyr_turns_{name}.json", out)
    np.set_printoptions(precision=6, suppress=True, linewidth=140)
    print(f"{name}: {turns} turns, cost {out['cost']:.8e}, rms {out['rms_angle_deg']:.4f} deg (nominal gain {out['rms_angle_nominal_deg']:.3f}), condition {out['condition']:.2f}, starts {disagreement:.1e}")
    print("  A", A.ravel(), "\n  se", se.ravel())
    print("  per_unit/diag(A)", out["per_unit_over_diagonal"], "+-", out["per_unit_over_diagonal"] * np.diag(se) / np.diag(A))
    print("  K diagonal", out["diagonal"], "column norms", out["column_norms"], "bias of the first rest", out["bias_first_rest_raw"])
    print("  turned, deg:", turned.round(0), "worst angles, deg:", np.sort(np.degrees(angle))[-4:])
    print("  constant bias, no margin:", peer["per_unit_over_diagonal"], f"rms {peer['rms_angle_deg']:.4f} deg")
    for k in moved:
        print("  ", k)


if __name__ == "__main__":
    for recording in ("xsens-mti", "mpu9150-0", "mpu9150-1"):
        run(recording)
