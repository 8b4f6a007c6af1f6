"""Accelerometer, six parameters (diagonal A and b), from the six faces of imucal-ferraris.

    |A (x_i - b)| = g,   A = diag(a1, a2, a3),   i = 1 .. 6: means of x over the face regions (first to last row, both included)

Six equations, six unknowns: the minimum of the norm cost (residual in raw units, see common.py) is an exact zero, so there is no
degree of freedom left for standard errors; what is given instead propagates the standard error of the region means, taken as white
(var(x)/n of each axis), through the inverse Jacobian. Peer's result for comparison: data/README.md.

    python3 tests/oracle/acc_t6.py        # IMUCAL_DATA, default ../shared/data; writes tests/golden/acc_t6_imucal-ferraris.json
"""

import numpy as np
from scipy.optimize import least_squares

from common import jac_complex, load, polish, residual, triad, write

REGIONS = {"x_p": (540, 1271), "x_a": (1620, 2361), "y_p": (2814, 3298), "y_a": (3740, 4152), "z_p": (4522, 4975), "z_a": (5376, 5983)}
PEER = {"gain": [0.996746, 1.002438, 1.023395], "bias": [0.537117, -0.616203, 0.398867]}


def nine(q):
    z = 0 * q[0]
    return np.array([q[0], z, z, q[1], z, q[2], q[3], q[4], q[5]])


def main():
    name = "imucal-ferraris"
    manifest, cols = load(name)
    x, offset, per_unit = triad(manifest, cols, "acc")
    g = manifest["site"]["gravity"]
    obs = np.array([x[a : b + 1].mean(0) for a, b in REGIONS.values()])
    var = np.array([x[a : b + 1].var(0, ddof=1) / (b + 1 - a) for a, b in REGIONS.values()])
    fun = lambda q, x=obs, F=g: residual(nine(q), x, F)
    jac = lambda q: jac_complex(q, obs, g, fun)
    rng = np.random.default_rng(6)
    sols = []
    for k in range(8):
        q0 = np.r_[1.0, 1, 1, 0, 0, 0] + (k > 0) * rng.uniform(-1, 1, 6) * np.r_[np.full(3, 0.1), np.full(3, 1.0)]
        sol = least_squares(fun, q0, jac=jac, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15)
        sols.append(polish(sol.x, fun, jac))
    sols = np.array(sols)
    disagreement = np.abs(sols - sols[0]).max()
    assert disagreement < 1e-10, disagreement
    q = sols[0]
    J, r = jac(q), fun(q)
    # d r / d x is the unit normal (to first order in r, here zero)
    v = (obs - q[3:]) * q[:3] ** 2
    n = v / np.linalg.norm(v, axis=1)[:, None]
    Ji = np.linalg.inv(J)
    se = np.sqrt(np.diag(Ji @ np.diag((n * n * var).sum(1)) @ Ji.T))
    out = {
        "generator": "tests/oracle/acc_t6.py", "recording": name, "gravity": g, "offset": offset, "per_unit": per_unit,
        "regions_first_last": REGIONS, "observations": obs, "theta_order": ["a11", "a22", "a33", "b1", "b2", "b3"],
        "theta": q, "inverse_gain": 1 / q[:3], "cost": 0.5 * r @ r, "start_disagreement": disagreement,
        "standard_errors_white": se, "condition": float(np.linalg.cond(J / np.linalg.norm(J, axis=0))), "peer": PEER,
    }
    write(f"acc_t6_{name}.json", out)
    np.set_printoptions(precision=7, suppress=True)
    print("a", q[:3], "1/a", 1 / q[:3], "b", q[3:], "cost", out["cost"], "condition", out["condition"])
    print("difference from the peer: 1/a", 1 / q[:3] - PEER["gain"], "b", q[3:] - PEER["bias"], "white se", se)


if __name__ == "__main__":
    main()
