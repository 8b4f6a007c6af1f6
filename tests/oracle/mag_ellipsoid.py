"""Magnetometer ellipsoids of three real clouds: px4-mag, hamagure-mag-2, broad-01-undisturbed; three residuals each.

  plain                r = (|y| - F) / |A'u|, y = A (x - b), u = y / |y|, A upper triangular (first-order orthogonal distance)
  orthogonal           exact signed orthogonal distance, footpoint by Newton in the Lagrange multiplier (common.footpoints)
  curvature_corrected  plain minus E[r] = 1/2 sigma^2 (tr(A'A) - |A n|^2) / (F s), n = A'u / s, s = |A'u|, sigma^2 = 2 cost / (n - 9):
                       three fits from the plain one, the correction held fixed within each

F is an arbitrary constant (only F/A matters to r); then the gauge det(A) = 1, with the field norm F' in the recording's unit.
Rows with a NaN are dropped; of broad (magnetometer slower than the rows) a sample equal to the one before is dropped too.
Standard errors: classical s^2 (J'J)^-1, and the central 68 % half-width of a moving block bootstrap (300 resamples, block length: first lag
at which the residual's autocorrelation is below .05, at most n/10; rows weighted by how often they are drawn). A resample whose fit
fails or whose centre is more than F' away counts as lost. gauge_order: six of A (det 1), F', b.

    python3 tests/oracle/mag_ellipsoid.py [NAME]       # IMUCAL_DATA, default ../shared/data; writes tests/golden/mag_ellipsoid_NAME.json
"""

import sys

import numpy as np

from common import (canonical, condition, covariance, curvature, distance, fit, fit_corrected, fit_orthogonal, gauge, gauge_jacobian, gauge_vector,
                    jac_complex, jacobian, load, nonlinearity, residual, start_algebraic, start_sphere, triad, write)

CLOUDS = {"px4-mag": 0.5, "hamagure-mag-2": 0.5, "broad-01-undisturbed": 50.0}
RESAMPLES, SEED = 300, 538
ORDER = ["a11", "a12", "a13", "a22", "a23", "a33", "field_norm", "b1", "b2", "b3"]


def weighted(p, w, fun, jac):
    """Levenberg-Marquardt on sum w r^2 from p, through the 9x9 normal equations of scaled columns; None where it does not settle."""
    mu = 0.0
    r = fun(p)
    cost = w @ (r * r)
    for _ in range(100):
        J = jac(p)
        G, h = J.T @ (w[:, None] * J), J.T @ (w * r)
        d = np.sqrt(np.diag(G))
        G, h = G / np.outer(d, d), h / d
        while True:
            try:
                step = np.linalg.solve(G + mu * np.eye(9), h)
            except np.linalg.LinAlgError:
                return None
            q = p - step / d
            rq = fun(q)
            cq = w @ (rq * rq)
            if np.isfinite(cq) and cq <= cost * (1 + 1e-13):
                break
            mu = max(4 * mu, 1e-6)
            if mu > 1e6:
                return None
        p, r, cost, mu = q, rq, cq, (0.0 if mu < 1e-5 else mu / 10)
        if mu == 0.0 and step @ h <= 1e-10 * cost / w.sum():      # within 1e-5 of a standard deviation of the minimum
            return p
    return None


def refit(variant, x, w, F, p):
    """One weighted fit of a variant from p."""
    if variant == "orthogonal":
        return weighted(p, w, lambda q: distance(q, x, F), lambda q: distance(q, x, F, True))
    c, J = np.zeros(len(x)), lambda q: jacobian(q, x, F)
    q = weighted(p, w, lambda q: residual(q, x, F), J)
    if variant == "curvature_corrected":
        for _ in range(3):
            if q is None:
                return None
            r = residual(q, x, F) - c
            c = curvature(q, x, F, w @ (r * r) / (w.sum() - 9))
            q = weighted(q, w, lambda q: residual(q, x, F) - c, J)
    return q


def run(name, F):
    manifest, cols = load(name)
    x, offset, per_unit = triad(manifest, cols, "mag")
    x = x[~np.isnan(x).any(1)]
    if name.startswith("broad"):
        x = x[np.r_[True, (np.diff(x, axis=0) != 0).any(1)]]
    n = len(x)
    sols = [fit(x, F, s) for s in (start_sphere(x, F), start_algebraic(x, F)) if s is not None]
    disagreement = np.abs(sols[0] - sols[-1]).max()
    assert disagreement < 1e-9, disagreement
    p = sols[0]
    assert np.abs(jacobian(p, x, F) - jac_complex(p, x, F)).max() < 1e-10
    pc, corr = fit_corrected(x, F, p)
    po = fit_orthogonal(x, F, p)
    out = {"generator": "tests/oracle/mag_ellipsoid.py", "recording": name, "unit": manifest["units"]["mag"], "rows_used": n, "F": F,
           "start_disagreement": disagreement, "theta_order": ORDER[:6] + ORDER[7:], "gauge_order": ORDER, "variants": {}}
    base = None
    for variant, q, fun, jac in (
        ("plain", p, lambda q: residual(q, x, F), lambda q: jacobian(q, x, F)),
        ("orthogonal", po, lambda q: distance(q, x, F), lambda q: distance(q, x, F, True)),
        ("curvature_corrected", pc, lambda q: residual(q, x, F) - corr, lambda q: jacobian(q, x, F)),
    ):
        r, J = fun(q), jac(q)
        s2 = r @ r / (n - 9)
        C = covariance(J, s2)
        D = gauge_jacobian(q, F)
        se = np.sqrt(np.diag(D @ C @ D.T))
        z = r - r.mean()
        lags = min(n - 1, n // 10 + 1)
        f = np.fft.rfft(z, 2 * n)
        acf = np.fft.irfft(f * np.conj(f))[: max(lags, 21)]
        acf = acf / acf[0]
        below = np.flatnonzero(acf[1:] < 0.05)
        block = int(min(max(1, n // 10), below[0] + 1 if len(below) else n))
        A, Fg, b = gauge(q, F)
        v = gauge_vector(q, F)
        rng = np.random.default_rng(SEED)
        boot, lost = [], 0
        for _ in range(RESAMPLES):
            starts = rng.integers(0, n - block + 1, -(-n // block))
            rows = (starts[:, None] + np.arange(block)).ravel()[:n]
            w = np.bincount(rows, minlength=n).astype(float)
            k = refit(variant, x[w > 0], w[w > 0], F, q)
            k = None if k is None or not np.all(np.isfinite(k)) else gauge_vector(canonical(k), F)
            if k is None or np.linalg.norm(k[7:] - v[7:]) > Fg:
                lost += 1
            else:
                boot.append(k)
        lo, hi = np.quantile(boot, [0.15865525393, 0.84134474607], axis=0)
        entry = {
            "theta": q, "gain_det1": A, "field_norm": Fg, "center": b, "center_raw": offset + per_unit * b, "cost": 0.5 * r @ r,
            "rms": np.sqrt(r @ r / n), "s2": s2, "standard_errors_theta": np.sqrt(np.diag(C)), "standard_errors_gauge": se, "condition": condition(J),
            "nonlinearity": nonlinearity(q, J, s2, fun), "autocorrelation_lag_1_to_20": acf[1:21], "durbin_watson": (np.diff(r) ** 2).sum() / (r @ r),
            "bootstrap": {"block": block, "resamples": RESAMPLES, "seed": SEED, "lost": lost, "half_width_68": (hi - lo) / 2},
        }
        if base is None:
            base = (v, se)
        entry["difference_from_plain_in_standard_errors"] = (v - base[0]) / base[1]
        out["variants"][variant] = entry
        print(f"{name} {variant}: n {n} rms {entry['rms']:.6g} F' {Fg:.7g} center {b} condition {entry['condition']:.2f} nonlinearity {entry['nonlinearity']:.3g} "
              f"DW {entry['durbin_watson']:.4f} block {block} lost {lost}")
        print("   A", v[:6], "\n   se", se, "\n   bootstrap/se", (hi - lo) / 2 / se, "\n   difference/se", entry["difference_from_plain_in_standard_errors"], flush=True)
    write(f"mag_ellipsoid_{name}.json", out)


if __name__ == "__main__":
    np.set_printoptions(precision=6, suppress=True, linewidth=150)
    for recording, norm in CLOUDS.items():
        if len(sys.argv) < 2 or recording in sys.argv[1:]:
            run(recording, norm)
