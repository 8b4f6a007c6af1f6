"""Run lengths of the device's drift watch, by the Markov chain of Brook and Evans (1972).

    C' = max(0, C + min(z, c) - k),  z ~ N(0, 1),  alarm where C' >= h        c: a look counts no more than this

The interval from 0 to h is cut into cells; state 0 is C = 0 itself, so that no rounding moves the mass there. The mean run length
from 0 solves (I - Q) a = 1. Two orders of cells and Richardson's extrapolation leave an error that is printed.

Written is, for each reference value k, the run length at thresholds h, and the threshold that belongs to each decade of run lengths.

    python3 tests/oracle/watch_run_length.py     # writes tests/golden/watch_run_length.json
"""

import json
from pathlib import Path

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr

CHARTS = {"step": {"k": 0.5, "clip": 4.0}, "record": {"k": 3.0, "clip": None}}
DECADES = range(3, 12)
CELLS = (400, 800)
# Beyond it the run length has no digits left in double precision.
MOST = {"step": 30.0, "record": 5.0}


def chain(k, h, cells, clip):
    """Mean run length from 0; cells of equal width, mass of a cell at its middle."""
    width = h / cells
    middles = np.concatenate([[0.0], (np.arange(cells) + 0.5) * width])

    def below(x):
        """P(min(z, clip) - k <= x)."""
        p = ndtr(x + k)
        return p if clip is None else np.where(x + k >= clip, 1.0, p)

    edges = np.arange(cells + 1) * width
    cumulative = below(edges[None, :] - middles[:, None])
    q = np.empty((cells + 1, cells + 1))
    q[:, 0] = cumulative[:, 0]
    q[:, 1:] = np.diff(cumulative, axis=1)
    return np.linalg.solve(np.eye(cells + 1) - q, np.ones(cells + 1))[0]


def run_length(k, h, clip):
    coarse, fine = (chain(k, h, cells, clip) for cells in CELLS)
    # The error of middles is of the second order.
    return fine + (fine - coarse) / 3, abs(fine - coarse) / fine


def main():
    out, worst = {}, 0.0
    for name, chart in CHARTS.items():
        k, clip = chart["k"], chart["clip"]
        log = lambda h: np.log10(run_length(k, h, clip)[0])
        thresholds = [brentq(lambda h: log(h) - decade, 1e-3, MOST[name], xtol=1e-7) for decade in DECADES]
        worst = max([worst] + [run_length(k, h, clip)[1] for h in thresholds])
        out[name] = {"k": k, "clip": clip, "decades": list(DECADES), "thresholds": [round(h, 5) for h in thresholds]}
        print(name, out[name]["thresholds"])
    print(f"largest share that the finer cells change: {worst:.1e}")
    path = Path(__file__).parent.parent / "golden" / "watch_run_length.json"
    path.write_text(json.dumps(out, indent=1) + "\n")


main()
