"""Accelerometer, norm form (nine parameters) over the rests of xsens-mti, mpu9150-0 and mpu9150-1.

    cost = 1/2 sum r_i^2,   r = (|y| - g) / |A'u|,   y = A (x - b),   u = y / |y|,   A upper triangular

x_i: mean of the nominal-SI samples over rest i (half-open row intervals, stored, from rests.py). Minimised by MINPACK's LM through
SciPy with an analytic Jacobian (checked against the complex step), polished by Gauss-Newton, from eleven starts that must agree
to 1e-10. Standard errors: s^2 (J'J)^-1, s^2 = 2 cost / (n - 9). Next to them two bootstraps:
  residual  centred residuals inflated by sqrt(n / (n - 9)), drawn with replacement, put on the footpoint of each observation along
            the normal of the fitted ellipsoid, refitted;
  pairs     rests drawn with replacement; a resample with fewer than ten distinct rests, a failed fit or |b - b_fit| > g is counted apart.
"plain_cost" is the usual cost 1/2 sum (g - |A (x - b)|)^2 for comparison with other tools.

    python3 tests/oracle/acc_t9.py        # IMUCAL_DATA, default ../shared/data; writes tests/golden/acc_t9_NAME.json
"""

import numpy as np
from scipy.optimize import least_squares

from common import (condition, covariance, fit, footpoints, jac_complex, jacobian, pack, plain_norm, polish, residual, start_algebraic,
                    start_sphere, unpack, canonical, write)
from rests import INITIAL_S, MULTIPLE, rests_of

SEED, RESAMPLES = 20160624, 1000


def raw_vector(p, offset, per_unit):
    """(gain: six, bias: three) in raw units."""
    A, b = unpack(p)
    return np.r_[p[:6] / per_unit, offset + per_unit * b]


def tk(p, per_unit):
    """calibrated = T K (raw - bias): LSB per unit and the cross terms of the unit upper triangle, in the signs of imu_tk."""
    A, _ = unpack(p)
    d = np.diag(A)
    return np.r_[per_unit / d, -A[0, 1] / d[1], A[0, 2] / d[2], -A[1, 2] / d[2]]


def spread(samples):
    s = np.array(samples)
    q = np.quantile(s, [0.15865525393, 0.84134474607], axis=0)
    return {"std": s.std(0, ddof=1), "half_width_68": (q[1] - q[0]) / 2, "mean": s.mean(0)}


def solve(x, g, rng):
    starts = [pack(np.eye(3), np.zeros(3)), start_sphere(x, g)]
    alg = start_algebraic(x, g)
    if alg is not None:
        starts.append(alg)
    starts += [pack(np.eye(3), np.zeros(3)) + rng.uniform(-1, 1, 9) * np.r_[np.full(6, 0.08), np.full(3, 1.5)] for _ in range(8)]
    sols = np.array([fit(x, g, s) for s in starts])
    disagreement = np.abs(sols - sols[0]).max()
    assert disagreement < 1e-10, disagreement
    p = sols[0]
    assert np.abs(jacobian(p, x, g) - jac_complex(p, x, g)).max() < 1e-12 * max(1.0, np.abs(x).max())
    return p, len(starts), disagreement


def solve_plain(x, g):
    fun = lambda p: plain_norm(p, x, g)
    jac = lambda p: jac_complex(p, x, g, plain_norm)
    sol = least_squares(fun, pack(np.eye(3), np.zeros(3)), jac=jac, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    return canonical(polish(sol.x, fun, jac))


def run(name):
    manifest, cols, _, offset, per_unit, iv, x = rests_of(name)
    g = manifest["site"]["gravity"]
    n = len(x)
    rng = np.random.default_rng(SEED)
    p, starts, disagreement = solve(x, g, rng)
    r, J = residual(p, x, g), jacobian(p, x, g)
    s2 = r @ r / (n - 9)
    se = np.sqrt(np.diag(covariance(J, s2)))
    unit = np.r_[np.full(6, 1 / per_unit), np.full(3, per_unit)]

    # residual bootstrap
    A, b = unpack(p)
    foot, _ = footpoints(p, x, g)
    nrm = (foot - b) @ A.T @ A
    nrm /= np.linalg.norm(nrm, axis=1)[:, None]
    e = (r - r.mean()) * np.sqrt(n / (n - 9))
    res = []
    for _ in range(RESAMPLES):
        xb = foot + e[rng.integers(0, n, n)][:, None] * nrm
        q = fit(xb, g, p)
        res.append(np.r_[q, tk(q, per_unit)])
    # pairs bootstrap
    pairs, lost = [], 0
    for _ in range(RESAMPLES):
        k = rng.integers(0, n, n)
        try:
            q = fit(x[k], g, p) if len(set(k)) >= 10 else None
        except (np.linalg.LinAlgError, ValueError):
            q = None
        if q is None or not np.all(np.isfinite(q)) or np.linalg.norm(q[6:] - p[6:]) > g:
            lost += 1
            continue
        pairs.append(np.r_[q, tk(q, per_unit)])

    pp = solve_plain(x, g)
    rp, Jp = plain_norm(pp, x, g), jac_complex(pp, x, g, plain_norm)
    sep = np.sqrt(np.diag(covariance(Jp, rp @ rp / (n - 9))))
    C = covariance(J, s2)
    D = np.stack([tk(p + 1e-30j * e, per_unit).imag / 1e-30 for e in np.eye(9)], axis=1)
    out = {
        "generator": "tests/oracle/acc_t9.py", "recording": name, "gravity": g, "offset": offset, "per_unit": per_unit,
        "detector": {"window_s": 1.0, "multiple": MULTIPLE, "initial_s": INITIAL_S[name]},
        "intervals": iv, "observations": x,
        "theta_order": ["a11", "a12", "a13", "a22", "a23", "a33", "b1", "b2", "b3"],
        "A": A, "b": b, "gain": A / per_unit, "bias": offset + per_unit * b,
        "cost": 0.5 * r @ r, "rms": np.sqrt(r @ r / n), "s2": s2, "standard_errors": se, "standard_errors_raw": se * unit,
        "condition": condition(J), "starts": starts, "start_disagreement": disagreement,
        "tk": {"order": ["lsb_x", "lsb_y", "lsb_z", "yz", "zy", "zx"], "value": tk(p, per_unit), "standard_errors": np.sqrt(np.diag(D @ C @ D.T))},
        "residuals": r,
        "bootstrap_residual": {"resamples": RESAMPLES, "seed": SEED} | {k: v[:9] for k, v in spread(res).items()},
        "bootstrap_pairs": {"resamples": RESAMPLES, "lost": lost} | {k: v[:9] for k, v in spread(pairs).items()},
        "plain_cost": {"A": unpack(pp)[0], "b": pp[6:], "gain": unpack(pp)[0] / per_unit, "bias": offset + per_unit * pp[6:],
                       "cost": 0.5 * rp @ rp, "standard_errors": sep, "tk": tk(pp, per_unit)},
    }
    write(f"acc_t9_{name}.json", out)
    np.set_printoptions(precision=9, suppress=True, linewidth=140)
    print(f"{name}: {n} rests, cost {out['cost']:.7e} (plain {out['plain_cost']['cost']:.7e}), rms {out['rms']:.6f}, condition {out['condition']:.2f}, starts agree to {disagreement:.1e}")
    print("  lsb and cross terms", out["tk"]["value"], "+-", out["tk"]["standard_errors"])
    print("  plain cost          ", out["plain_cost"]["tk"], "bias", out["plain_cost"]["bias"])
    print("  bias", out["bias"], "+-", out["standard_errors_raw"][6:])
    print("  se             ", se)
    print("  residual bootstrap / se", out["bootstrap_residual"]["std"] / se)
    print("  pairs bootstrap / se   ", out["bootstrap_pairs"]["std"] / se, "68 %", out["bootstrap_pairs"]["half_width_68"] / se, "lost", lost)


if __name__ == "__main__":
    for recording in ("xsens-mti", "mpu9150-0", "mpu9150-1"):
        run(recording)
