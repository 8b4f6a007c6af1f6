"""How long the whole of `imucal calibrate` takes on xsens-mti, in units of SciPy's accelerometer fit alone.

Builds the release binary, then runs both alternately in one go, so that a slow moment of the machine slows both: prints the ratio of the
medians, and the binary's peak memory. A benchmark and no test: it fails for nothing but a failed run.

    python3 tests/oracle/speed.py [ROUNDS]     # IMUCAL_DATA, default ../shared/data
"""

import os
import pathlib
import statistics
import subprocess
import sys
import time

import acc_fit_time

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = pathlib.Path(os.environ.get("IMUCAL_DATA", ROOT / ".." / "shared" / "data"))


def seconds(run):
    begin = time.perf_counter()
    run()
    return time.perf_counter() - begin


def run(command):
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def peak_memory(command):
    """High-water mark of one run in MiB, watched from outside: what a child reports holds its parent's share too."""
    child, peak = subprocess.Popen(command, stdout=subprocess.DEVNULL), 0
    while child.poll() is None:
        try:
            lines = pathlib.Path(f"/proc/{child.pid}/status").read_text().splitlines()
        except OSError:
            break
        name = next((line for line in lines if line.startswith("Name:")), "")
        marks = [int(line.split()[1]) for line in lines if line.startswith("VmHWM")]
        if name.endswith("imucal"):
            peak = max([peak, *marks])
    assert child.wait() == 0, command
    return peak / 1024


def main():
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 30
    subprocess.run(["cargo", "build", "--locked", "--release", "--quiet", "-p", "imucal-host"], cwd=ROOT, check=True)
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    command = [str(target / "release" / "imucal"), "calibrate", str(DATA / "real" / "xsens-mti.csv.gz")]
    fit = acc_fit_time.problem()
    whole, alone = [], []
    for _ in range(rounds):
        alone.append(min(seconds(fit) for _ in range(5)))
        whole.append(seconds(lambda: run(command)))
    ratio = statistics.median(whole) / statistics.median(alone)
    print(f"imucal calibrate, all of it: {1e3 * statistics.median(whole):.1f} ms; SciPy's accelerometer fit alone: "
          f"{1e3 * statistics.median(alone):.2f} ms; ratio {ratio:.1f}; peak memory {peak_memory(command):.0f} MiB")


if __name__ == "__main__":
    main()
