"""Overlapping Allan deviations by AllanTools, and equivalent degrees of freedom.

The noise is made of whole numbers by a linear congruential generator, so that Rust makes the same numbers: white noise, a random walk
and both. Lengths of averages are 1, 2, 3, 4, 6, 8, 12 ... up to a quarter of the samples; beyond 8192 the samples are averaged first, by
as many as the cascade strides.

    python3 tests/oracle/allan_deviation.py     # writes tests/golden/allan_deviation.json
"""

import json
from pathlib import Path

import allantools
import numpy as np

RATE = 100.0
LONGEST = 8192


def numbers(count, seed):
    """Numbers of [-0.5, 0.5), each a multiple of 2^-16."""
    out = np.empty(count)
    state = seed
    for k in range(count):
        state = (state * 6364136223846793005 + 1442695040888963407) % 2**64
        out[k] = (state >> 48) / 65536.0 - 0.5
    return out


def lengths(count):
    all_of = sorted({2**k for k in range(30)} | {3 * 2**k for k in range(30)})
    return [m for m in all_of if m <= count // 4]


def deviations(samples):
    out = []
    for m in lengths(len(samples)):
        stride = 1
        while m // stride > LONGEST:
            stride *= 2
        whole = len(samples) // stride * stride
        averaged = samples[:whole].reshape(-1, stride).mean(axis=1)
        rate = RATE / stride
        taus, value, _, terms = allantools.oadev(averaged, rate=rate, data_type="freq", taus=[m / RATE])
        assert len(taus) == 1 and abs(taus[0] - m / RATE) < 1e-9, (m, taus)
        out.append({"samples": m, "deviation": float(value[0]), "terms": int(terms[0])})
    return out


def degrees():
    """Of one kind of noise; N of AllanTools counts phases, one more than samples.

    White noise by `edf_simple`, the formula of NIST SP 1065, table 5. The others by `edf_greenhall`, for flicker and walk from averages
    of four samples on: it takes shorter ones as if they were long.
    """
    kinds = {"quantisation": 2, "white": 0, "flicker": -1, "walk": -2}
    out = []
    for kind, alpha in kinds.items():
        for count in (1000, 100000):
            for m in (1, 4, 32, count // 20, count // 5):
                if m < 4 and alpha < 0:
                    continue
                if kind == "white":
                    edf = allantools.edf_simple(count + 1, m, alpha)
                else:
                    edf = allantools.edf_greenhall(alpha, 2, m, count + 1, overlapping=True)
                out.append({"kind": kind, "samples": m, "of": count, "edf": float(edf)})
    return out


def main():
    count = 80000
    white = numbers(count, 1)
    walk = np.cumsum(numbers(count, 2)) / 64.0
    cases = {"white": white, "walk": walk, "both": 9.8125 + white + walk}
    golden = {
        "rate": RATE,
        "count": count,
        "cases": {name: deviations(samples) for name, samples in cases.items()},
        "degrees": degrees(),
    }
    path = Path(__file__).parent.parent / "golden" / "allan_deviation.json"
    path.write_text(json.dumps(golden, indent=1) + "\n")
    for name, found in golden["cases"].items():
        print(name, found[0], found[-1])


if __name__ == "__main__":
    main()
