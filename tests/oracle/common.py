"""Shared parts of the oracles: reading a recording, the norm residual and its fits.

Conventions (all oracles): x = (raw - offset) / per_unit, calibrated y = A (x - b). The nine parameters of the norm form are
theta = (a11, a12, a13, a22, a23, a33, b1, b2, b3), A upper triangular. In raw units: gain = A / per_unit, bias = offset + per_unit b.

Norm residual ("plain"), in units of x, the first-order orthogonal distance from the ellipsoid |A (x - b)| = F:

    r = (|y| - F) / s,   u = y / |y|,   s = |A' u|

Everything is written from these equations, with nothing taken from the Rust estimators.
"""

import csv
import gzip
import json
import os
import tomllib
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

HERE = Path(__file__).resolve().parent
GOLDEN = HERE.parent / "golden"
ROOT = HERE.parent.parent
UT = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]


def data_dir():
    d = os.environ.get("IMUCAL_DATA")
    return Path(d) if d else ROOT.parent / "shared" / "data"


def load(name):
    """-> (manifest, {column: float array}); an empty field is NaN."""
    base = data_dir() / "real" / name
    with open(f"{base}.toml", "rb") as f:
        manifest = tomllib.load(f)
    path = Path(f"{base}.csv")
    op = (lambda: open(path, newline="")) if path.exists() else (lambda: gzip.open(f"{base}.csv.gz", "rt", newline=""))
    with op() as f:
        rows = csv.reader(f)
        head = next(rows)
        table = np.array([[float(v) if v else np.nan for v in row] for row in rows])
    return manifest, {h: table[:, i] for i, h in enumerate(head)}


def triad(manifest, cols, sensor):
    """Samples of one triad in the manifest's unit, with counts made nominal. -> (x (n,3), offset, per_unit)"""
    raw = np.stack([cols[f"{sensor}_{a}"] for a in "xyz"], axis=1)
    if manifest["units"].get(sensor) == "counts":
        c = manifest["counts"][sensor]
        return (raw - c["offset"]) / c["per_unit"], c["offset"], c["per_unit"]
    return raw, 0.0, 1.0


# --- the norm residual ------------------------------------------------------------------------------------------------------

def unpack(p):
    A = np.zeros((3, 3), dtype=np.asarray(p).dtype)
    for k, (i, j) in enumerate(UT):
        A[i, j] = p[k]
    return A, np.asarray(p)[6:9]


def pack(A, b):
    return np.array([A[i, j] for i, j in UT] + list(b))


def canonical(p):
    """The same ellipsoid with a positive diagonal (the sign of a row of A does not matter to the norm)."""
    A, b = unpack(np.asarray(p, float))
    A = A * np.sign(np.diag(A))[:, None]
    return pack(A, b)


def residual(p, x, F):
    """The plain residual; holds for complex p too (complex step)."""
    A, b = unpack(p)
    y = (x - b) @ A.T
    rho = np.sqrt((y * y).sum(1))
    v = (y / rho[:, None]) @ A
    return (rho - F) / np.sqrt((v * v).sum(1))


def jac_complex(p, x, F, fun=residual):
    """Jacobian by complex step: exact to rounding, used to verify the analytic one."""
    J = np.empty((len(fun(p, x, F)), len(p)))
    for k in range(len(p)):
        q = np.asarray(p).astype(complex)
        q[k] += 1e-30j
        J[:, k] = fun(q, x, F).imag / 1e-30
    return J


def jacobian(p, x, F):
    """Analytic Jacobian of the plain residual."""
    A, b = unpack(p)
    d = x - b
    y = d @ A.T
    rho = np.sqrt((y * y).sum(1))
    u = y / rho[:, None]
    v = u @ A
    s = np.sqrt((v * v).sum(1))
    n = v / s[:, None]
    r = (rho - F) / s
    An = n @ A.T
    g = (An - u * (u * An).sum(1)[:, None]) / rho[:, None]      # d s through u: g . dy
    w = (u - r[:, None] * g) / s[:, None]                        # d r through y: w . dy
    J = np.empty((len(x), 9))
    for k, (i, j) in enumerate(UT):
        # dy_i = da d_j, and A itself in s: d v_j = da u_i -> d s = n_j u_i da
        J[:, k] = w[:, i] * d[:, j] - r / s * n[:, j] * u[:, i]
    J[:, 6:9] = -(w @ A)
    return J


def plain_norm(p, x, F):
    """The usual cost of open tools, in calibrated units: |A (x - b)| - F."""
    A, b = unpack(p)
    y = (x - b) @ A.T
    return np.sqrt((y * y).sum(1)) - F


def curvature(p, x, F, sigma2):
    """E[r] at the true parameters under isotropic noise sigma^2 of x, from the mean curvature of the ellipsoid."""
    A, b = unpack(p)
    y = (x - b) @ A.T
    u = y / np.linalg.norm(y, axis=1)[:, None]
    v = u @ A
    s = np.linalg.norm(v, axis=1)
    An = (v / s[:, None]) @ A.T
    return 0.5 * sigma2 * ((A * A).sum() - (An * An).sum(1)) / (F * s)


# --- starts -----------------------------------------------------------------------------------------------------------------

def start_sphere(x, F):
    """Linear least-squares sphere, scaled to F."""
    m = x.mean(0)
    z = x - m
    M = np.c_[2 * z, np.ones(len(z))]
    c = np.linalg.lstsq(M, (z * z).sum(1), rcond=None)[0]
    R = np.sqrt(c[3] + c[:3] @ c[:3])
    return pack(np.eye(3) * F / R, c[:3] + m)


def start_algebraic(x, F):
    """Algebraic ellipsoid (smallest singular vector); None where the quadric is no ellipsoid."""
    m, k = x.mean(0), x.std()
    z = (x - m) / k
    D = np.c_[z * z, 2 * z[:, [0]] * z[:, [1]], 2 * z[:, [0]] * z[:, [2]], 2 * z[:, [1]] * z[:, [2]], 2 * z, np.ones(len(z))]
    q = np.linalg.svd(D, full_matrices=False)[2][-1]
    Q = np.array([[q[0], q[3], q[4]], [q[3], q[1], q[5]], [q[4], q[5], q[2]]])
    if np.trace(Q) < 0:
        q, Q = -q, -Q
    if np.linalg.eigvalsh(Q).min() <= 0:
        return None
    c = -np.linalg.solve(Q, q[6:9])
    h = c @ Q @ c - q[9]
    if h <= 0:
        return None
    R = np.linalg.cholesky(Q / h * F * F).T / k
    return pack(R, c * k + m)


# --- fits -------------------------------------------------------------------------------------------------------------------

def polish(p, fun, jac, rounds=25):
    """Gauss-Newton steps by QR in scaled columns to the last digits; keeps p if a step would not lower the gradient."""
    def grad(q):
        r, J = fun(q), jac(q)
        nrm = np.linalg.norm(J, axis=0)
        return r, J / nrm, nrm
    r, Q, nrm = grad(p)
    g = np.linalg.norm(Q.T @ r)
    for _ in range(rounds):
        q = p - np.linalg.lstsq(Q, r, rcond=None)[0] / nrm
        rq, Qq, nq = grad(q)
        gq = np.linalg.norm(Qq.T @ rq)
        if not gq < g:
            break
        p, r, Q, nrm, g = q, rq, Qq, nq, gq
    return p


def lm(p0, fun, jac, max_nfev=2000, tol=1e-15, final=True):
    sol = least_squares(fun, p0, jac=jac, method="lm", xtol=tol, ftol=tol, gtol=tol, x_scale="jac", max_nfev=max_nfev)
    return polish(sol.x, fun, jac) if final else sol.x


def fit(x, F, p0, correction=None, **kw):
    """Plain fit, or with a fixed correction subtracted from the residual."""
    c = 0.0 if correction is None else correction
    return canonical(lm(p0, lambda p: residual(p, x, F) - c, lambda p: jacobian(p, x, F), **kw))


def fit_corrected(x, F, p, rounds=3, **kw):
    """Curvature-corrected fit from the plain solution p. -> (p, correction of the last round)"""
    c = np.zeros(len(x))
    for _ in range(rounds):
        r = residual(p, x, F) - c
        c = curvature(p, x, F, r @ r / (len(x) - 9))
        p = fit(x, F, p, c, **kw)
    return p, c


def footpoints(p, x, F):
    """Nearest points of the ellipsoid |A (q - b)| = F, by Newton in the Lagrange multiplier.

    (I + l M)(q - b) = x - b with M = A'A; in M's eigenbasis sum m z^2/(1 + l m)^2 = F^2 is convex and falling right of -1/max m,
    so Newton from the left of the root climbs to it without overshoot.
    """
    A, b = unpack(p)
    m, V = np.linalg.eigh(A.T @ A)
    z = (x - b) @ V
    l = ((np.sqrt(m) * np.abs(z) / F - 1) / m).max(1)
    for _ in range(60):
        k = 1 + l[:, None] * m
        h = (m * z * z / k**2).sum(1) - F * F
        dl = h / (2 * (m * m * z * z / k**3).sum(1))
        l = l + dl
        if np.all(np.abs(dl) <= 1e-12 * (np.abs(l) + 1 / m.max())):
            break
    return b + (z / (1 + l[:, None] * m)) @ V.T, l


def distance(p, x, F, derivative=False):
    """Signed exact orthogonal distance (positive outside); its derivative is that of |A(q - b)| at the footpoint, over |A'u|."""
    q, l = footpoints(p, x, F)
    A, b = unpack(p)
    e = q - b
    y = e @ A.T
    u = y / np.linalg.norm(y, axis=1)[:, None]
    v = u @ A
    s = np.linalg.norm(v, axis=1)
    if not derivative:
        return ((x - q) * v).sum(1) / s
    J = np.empty((len(x), 9))
    for k, (i, j) in enumerate(UT):
        J[:, k] = u[:, i] * e[:, j] / s
    J[:, 6:9] = -v / s[:, None]
    return J


def fit_orthogonal(x, F, p0, **kw):
    return canonical(lm(p0, lambda p: distance(p, x, F), lambda p: distance(p, x, F, True), **kw))


# --- statistics -------------------------------------------------------------------------------------------------------------

def condition(J):
    return float(np.linalg.cond(J / np.linalg.norm(J, axis=0)))


def covariance(J, s2):
    nrm = np.linalg.norm(J, axis=0)
    R = np.linalg.qr(J / nrm, mode="r")
    Ri = np.linalg.inv(R) / nrm[:, None]
    return s2 * Ri @ Ri.T


def gauge(p, F):
    """A with det 1 and the field norm that goes with it: (A / det^(1/3), F / det^(1/3))."""
    A, b = unpack(p)
    k = np.cbrt(np.linalg.det(A))
    return A / k, F / k, b


def gauge_vector(p, F):
    """(six of A with det 1, field norm, b): ten numbers, nine degrees of freedom."""
    A, Fg, b = gauge(p, F)
    return np.array([A[i, j] for i, j in UT] + [Fg] + list(b))


def write(name, obj):
    GOLDEN.mkdir(exist_ok=True)
    path = GOLDEN / name
    path.write_text(json.dumps(clean(obj), indent=1) + "\n")
    print(f"{path.relative_to(ROOT)}: {path.stat().st_size} bytes")


def clean(o):
    """To plain JSON, floats with 17 significant digits at most; rows of numbers stay lists."""
    if isinstance(o, dict):
        return {k: clean(v) for k, v in o.items()}
    if isinstance(o, (list, tuple)):
        return [clean(v) for v in o]
    if isinstance(o, np.ndarray):
        return clean(o.tolist())
    if isinstance(o, np.generic):
        return o.item()
    return o


def gauge_jacobian(p, F):
    """d gauge_vector / d theta by complex step (F fixed)."""
    def f(q):
        k = (q[0] * q[3] * q[5]) ** (1 / 3)
        return np.r_[q[:6] / k, F / k, q[6:9]]
    return np.stack([f(p + 1e-30j * e).imag / 1e-30 for e in np.eye(9)], axis=1)


def algebraic(p, F, m):
    """The quadric z'Mz - 2 (Mc)'z = q of z = x - m, M = A'A, c = b - m, q = F^2 - c'Mc, as its nine numbers (M, Mc) / q.

    In this chart the norm fit is nearly linear, so that the classical covariance holds even where coverage is poor. m: the centroid.
    """
    A, b = unpack(p)
    M, c = A.T @ A, b - m
    q = F * F - c @ M @ c
    return np.r_[np.array([M[i, j] for i, j in UT]), M @ c] / q


def mahalanobis2(q, p, J, s2, F=None, m=None):
    """Squared distance of p from the estimate q under s2 (J'J)^-1: in theta, or in the algebraic chart if m is given."""
    d = q - p
    if m is not None:
        D = np.stack([algebraic(q + 1e-30j * e, F, m).imag / 1e-30 for e in np.eye(9)], axis=1)
        d = np.linalg.solve(D, algebraic(q, F, m) - algebraic(p, F, m))
    d = J @ d
    return d @ d / s2


def nonlinearity(p, J, s2, fun):
    """|(Q(p + d) - Q(p)) / s2 - 1| for d = one standard deviation along the weakest direction of the column-normalised J; larger sign."""
    nrm = np.linalg.norm(J, axis=0)
    _, s, vt = np.linalg.svd(J / nrm, full_matrices=False)
    d = np.sqrt(s2) * vt[-1] / s[-1] / nrm
    q0 = (fun(p) ** 2).sum()
    return max(abs(((fun(p + k * d) ** 2).sum() - q0) / s2 - 1) for k in (-1, 1))
