"""Forty seeded random ellipsoid clouds with known truth, eight of them with their points.

A cloud: directions u uniform on a polar cap holding a given share (coverage) of the sphere about a random axis, x = A^-1 u + b + noise,
A = 1 + U(-.15, .15)^(3x3) brought to upper triangle with the same A'A, |b| up to 2, noise .2-1 % of the radius, F = 1 known.
For each: the plain norm fit r = (|y| - 1) / |A'u| and the curvature-corrected one (see mag_ellipsoid.py), squared Mahalanobis distances of the
truth in (A, b) and in the algebraic chart (common.algebraic), the likelihood ratio (|r(truth)|^2 - |r(fit)|^2) / s^2, condition of the
column-normalised Jacobian and the one-sigma nonlinearity (common.nonlinearity). Points are rounded to nine significant digits before any fit.

    python3 tests/oracle/ellipsoid_clouds.py           # writes tests/golden/ellipsoid_clouds.json
    python3 tests/oracle/ellipsoid_clouds.py 600       # statistics of that many clouds by coverage, nothing written
"""

import sys

import numpy as np

from common import (condition, covariance, fit, fit_corrected, fit_orthogonal, distance, jac_complex, jacobian, mahalanobis2, nonlinearity, pack,
                    residual, start_algebraic, start_sphere, unpack, write)

CHI2_9999 = 33.71995   # chi-square, 9 degrees of freedom, 99.99 %
STORED = 8


def cloud(seed, coverage=None, n_max=2000):
    g = np.random.default_rng(seed)
    n = int(round(np.exp(g.uniform(np.log(100), np.log(n_max)))))
    cov = g.uniform(0.1, 1.0) if coverage is None else coverage
    noise = g.uniform(0.002, 0.01)
    A = np.eye(3) + g.uniform(-0.15, 0.15, (3, 3))
    b = g.normal(size=3)
    b *= g.uniform(0, 2) / np.linalg.norm(b)
    ax = g.normal(size=3)
    ax /= np.linalg.norm(ax)
    c = 1 - 2 * cov * g.random(n)
    phi = g.uniform(0, 2 * np.pi, n)
    e1 = np.cross(ax, np.eye(3)[np.argmin(np.abs(ax))])
    e1 /= np.linalg.norm(e1)
    e2 = np.cross(ax, e1)
    u = c[:, None] * ax + np.sqrt(1 - c * c)[:, None] * (np.cos(phi)[:, None] * e1 + np.sin(phi)[:, None] * e2)
    x = u @ np.linalg.inv(A).T + b + noise * g.normal(size=(n, 3))
    x = np.array([[float(f"{v:.9g}") for v in row] for row in x])
    return {"seed": seed, "n": n, "coverage": cov, "noise": noise, "x": x, "p": pack(np.linalg.cholesky(A.T @ A).T, b)}


def report(p, J, r, n, truth, x, fun):
    s2 = r @ r / (n - 9)
    A, b = unpack(p)
    se = np.sqrt(np.diag(covariance(J, s2)))
    r0 = fun(truth)
    return {
        "A": A, "b": b, "cost": 0.5 * r @ r, "rms": np.sqrt(r @ r / n), "standard_errors": se, "condition": condition(J),
        "nonlinearity": nonlinearity(p, J, s2, fun), "mahalanobis2": mahalanobis2(p, truth, J, s2),
        "mahalanobis2_algebraic": mahalanobis2(p, truth, J, s2, 1.0, x.mean(0)), "likelihood_ratio": (r0 @ r0 - r @ r) / s2,
        "max_relative_se_gain": max(se[[0, 3, 5]] / np.diag(A)),
    }


def solve(c, orthogonal=False):
    x, truth, n = c["x"], c["p"], c["n"]
    sols = [fit(x, 1.0, s) for s in (start_sphere(x, 1.0), start_algebraic(x, 1.0), truth) if s is not None]
    p = sols[0]
    out = {"start_disagreement": max(np.abs(q - p).max() for q in sols)}
    fun = lambda q: residual(q, x, 1.0)
    J = jacobian(p, x, 1.0)
    assert np.abs(J - jac_complex(p, x, 1.0)).max() < 1e-12
    out["plain"] = report(p, J, fun(p), n, truth, x, fun)
    q, corr = fit_corrected(x, 1.0, p)
    fun_c = lambda q: residual(q, x, 1.0) - corr
    out["curvature_corrected"] = report(q, jacobian(q, x, 1.0), fun_c(q), n, truth, x, fun_c)
    if orthogonal:
        q = fit_orthogonal(x, 1.0, p)
        fun_o = lambda q: distance(q, x, 1.0)
        out["orthogonal"] = report(q, distance(q, x, 1.0, True), fun_o(q), n, truth, x, fun_o)
    return out


def main():
    clouds = []
    for seed in range(40):
        stored = seed < STORED
        c = cloud(seed, coverage=[0.1, 0.2, 0.3, 0.4, 0.55, 0.7, 0.85, 1.0][seed], n_max=300) if stored else cloud(seed)
        s = solve(c)
        A, b = unpack(c["p"])
        entry = {"seed": seed, "n": c["n"], "coverage": c["coverage"], "noise": c["noise"], "true_A": A, "true_b": b} | s
        if stored:
            entry["points"] = c["x"]
        else:
            for v in ("plain", "curvature_corrected"):
                entry[v] = {k: entry[v][k] for k in ("mahalanobis2", "mahalanobis2_algebraic", "likelihood_ratio", "condition", "nonlinearity", "max_relative_se_gain")}
        clouds.append(entry)
        f = s["plain"]
        print(f"{seed:3d} n {c['n']:5d} coverage {c['coverage']:.2f} noise {c['noise']:.4f} condition {f['condition']:8.1f} nonlinearity {f['nonlinearity']:8.3g} "
              f"d2 {f['mahalanobis2']:10.2f} algebraic {f['mahalanobis2_algebraic']:6.2f} LR {f['likelihood_ratio']:6.2f} starts {s['start_disagreement']:.1e}")
    write("ellipsoid_clouds.json", {"generator": "tests/oracle/ellipsoid_clouds.py", "F": 1.0, "chi2_9_9999": CHI2_9999,
                                    "theta_order": ["a11", "a12", "a13", "a22", "a23", "a33", "b1", "b2", "b3"], "clouds": clouds})


def statistics(count):
    rows = []
    for seed in range(count):
        c = cloud(seed)
        s = solve(c, orthogonal=True)
        rows.append([c["coverage"]] + [s[v][k] for v in ("plain", "orthogonal", "curvature_corrected")
                                       for k in ("mahalanobis2", "mahalanobis2_algebraic", "likelihood_ratio")])
    t = np.array(rows)
    print("coverage N; then plain, orthogonal, curvature-corrected, each (A, b) | algebraic | likelihood ratio: median, 95 %, max, number beyond", CHI2_9999)
    for lo, hi in ((0.1, 0.15), (0.15, 0.2), (0.2, 0.3), (0.3, 0.4), (0.4, 0.5), (0.5, 0.75), (0.75, 1.0)):
        d = t[(t[:, 0] >= lo) & (t[:, 0] < hi), 1:]
        for v, name in enumerate(("plain", "orthogonal", "corrected")):
            print(f"{lo:.2f}-{hi:.2f} {len(d):4d} {name:10s}", " | ".join(
                f"{np.median(k):8.2f} {np.quantile(k, .95):9.2f} {k.max():10.2f} {np.sum(k > CHI2_9999):3d}" for k in d[:, 3 * v : 3 * v + 3].T))


if __name__ == "__main__":
    statistics(int(sys.argv[1])) if len(sys.argv) > 1 else main()
