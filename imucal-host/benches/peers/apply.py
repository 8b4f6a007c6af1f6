"""Corrects an accelerometer and a gyroscope as `imucal apply` does, in f32, from a CSV or Parquet file to another.

apply.py ENGINE [IN OUT]        ENGINE: polars, polars-streaming or duckdb; alone, whether it is installed
"""

import sys

GAIN = [[1.01, 0.002, 0.003], [0.0, 0.99, 0.001], [0.0, 0.0, 1.02]]
BIAS = {"acc": [0.1, -0.2, 0.3], "gyr": [0.01, -0.02, 0.03]}


def polars_columns():
    import polars as pl

    for sensor, bias in BIAS.items():
        parts = [
            pl.col(f"{sensor}_{axis}").cast(pl.Float32) - pl.lit(b, pl.Float32) for axis, b in zip("xyz", bias)
        ]
        for axis, row in zip("xyz", GAIN):
            terms = [part * pl.lit(g, pl.Float32) for part, g in zip(parts, row)]
            yield sum(terms[1:], terms[0]).alias(f"{sensor}_{axis}")


def polars(source, target):
    import polars as pl

    read = pl.read_csv if source.endswith("csv") else pl.read_parquet
    corrected = read(source).with_columns(*polars_columns())
    if target.endswith("csv"):
        corrected.write_csv(target)
    else:
        corrected.write_parquet(target, compression="snappy")


def polars_streaming(source, target):
    import polars as pl

    scan = pl.scan_csv if source.endswith("csv") else pl.scan_parquet
    corrected = scan(source).with_columns(*polars_columns())
    if target.endswith("csv"):
        corrected.sink_csv(target)
    else:
        corrected.sink_parquet(target, compression="snappy")


def duckdb(source, target):
    import duckdb

    columns = ["t"]
    for sensor, bias in BIAS.items():
        parts = [f"({sensor}_{axis}::FLOAT - {b}::FLOAT)" for axis, b in zip("xyz", bias)]
        for axis, row in zip("xyz", GAIN):
            terms = " + ".join(f"{g}::FLOAT * {part}" for g, part in zip(row, parts))
            columns.append(f"{terms} AS {sensor}_{axis}")
    form = "FORMAT CSV, HEADER" if target.endswith("csv") else "FORMAT PARQUET, COMPRESSION SNAPPY"
    duckdb.sql(f"COPY (SELECT {', '.join(columns)} FROM '{source}') TO '{target}' ({form})")


ENGINES = {"polars": polars, "polars-streaming": polars_streaming, "duckdb": duckdb}
if len(sys.argv) == 2:
    module = sys.argv[1].split("-")[0]
    try:
        __import__(module)
    except ImportError as missing:
        sys.exit(f"{missing}; install {module}")
else:
    ENGINES[sys.argv[1]](*sys.argv[2:])
