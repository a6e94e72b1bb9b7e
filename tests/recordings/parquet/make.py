#!/usr/bin/env python3
"""Writes the Parquet files in this folder with the programs that people use, and what they hold as CSV.

    pip install pyarrow pandas
    python3 tests/recordings/parquet/make.py

The signals are those of `signal` in tests/recordings/make.py. Versions: pyarrow 26.0, pandas 3.1.
"""

import math
from pathlib import Path

import numpy
import pandas
import pyarrow
import pyarrow.parquet

HERE = Path(__file__).parent
ROWS = 40
START = pandas.Timestamp("2026-03-01T12:00:00.123456789")


def table():
    """Time, position in degrees, torque of elbow and shoulder, and columns of every type of number."""
    k = numpy.arange(ROWS)
    t = 0.002 * k
    q = [0.5 * numpy.sin(3 * t), 0.3 * numpy.cos(2 * t)]
    return pandas.DataFrame(
        {
            "t": t,
            "q1_deg": numpy.degrees(q[0]),
            "tau1": 2.0 * q[0],
            "q2_deg": numpy.degrees(q[1]),
            "tau2": -4.0 * q[1],
            "count": k - 20,
            "on": k % 7 < 3,
            "state": (k // 20).astype("uint8"),
            "large": (k.astype("uint64") + numpy.uint64(2**63)),
            "small": (-(k**3)).astype("int32"),
            "unsigned": (k.astype("uint32") + numpy.uint32(2**31)),
            "load": numpy.where(k % 5 == 2, numpy.nan, 0.25 * k),
            "mode": ["run" if own % 2 else "hold" for own in k],
        }
    )


def columns():
    """The same table in the codecs and encodings, and as text."""
    frame = table()
    frame.to_csv(HERE / "columns.csv", index=False)
    frame.to_parquet(HERE / "columns.parquet")  # snappy, dictionaries
    own = pyarrow.Table.from_pandas(frame, preserve_index=False)
    floats = [name for name in frame if frame[name].dtype == "float64"]
    whole = ["count", "large", "small", "unsigned", "state"]
    small = {"data_page_size": 32, "write_batch_size": 4, "row_group_size": 15}
    for name, codec, how in [
        ("split", "none", {"column_encoding": dict.fromkeys(floats, "BYTE_STREAM_SPLIT")}),
        ("delta", "gzip", {"column_encoding": dict.fromkeys(whole, "DELTA_BINARY_PACKED"), "data_page_version": "2.0"}),
        ("pages", "zstd", {"data_page_version": "2.0", "use_dictionary": True, "write_page_checksum": True, **small}),
        ("old", "lz4", {"version": "1.0", "use_dictionary": True, "write_page_checksum": True, **small}),
    ]:
        how = {"use_dictionary": False, "compression": codec, **how}
        pyarrow.parquet.write_table(own, HERE / f"columns_{name}.parquet", **how)


def lists():
    """Arrays of joints as lists, in small pages and groups, with columns that hold no numbers."""
    frame = table()
    q = [list(pair) for pair in zip(numpy.radians(frame.q1_deg), numpy.radians(frame.q2_deg))]
    tau = [list(pair) for pair in zip(frame.tau1, frame.tau2)]
    pyarrow.parquet.write_table(
        pyarrow.table(
            {
                "t": pyarrow.array(frame.t),
                "q": pyarrow.array(q, pyarrow.list_(pyarrow.float64(), 2)),
                "tau": pyarrow.array(tau, pyarrow.list_(pyarrow.float32())),
                "empty": pyarrow.array([[]] * ROWS, pyarrow.list_(pyarrow.float64())),
                "pose": pyarrow.array([{"x": 1.0, "y": 2.0}] * ROWS),
                "day": pyarrow.array([START.date()] * ROWS),
            }
        ),
        HERE / "lists.parquet",
        compression="zstd",
        row_group_size=15,
        data_page_size=64,
        write_batch_size=4,
    )
    ragged = [[0.1 * k] * (1 if k == 27 else 2) for k in range(ROWS)]
    pyarrow.parquet.write_table(
        pyarrow.table({"t": pyarrow.array(frame.t), "q": ragged, "tau": tau}), HERE / "ragged.parquet"
    )


def stamps():
    """Times of a clock as the index, and rows that were chosen."""
    frame = table()[["q1_deg", "tau1", "q2_deg", "tau2"]]
    frame.index = START + pandas.to_timedelta((2_000_000 * numpy.arange(ROWS)).astype("int64"), unit="ns")
    frame.to_parquet(HERE / "stamps.parquet")  # An index without a name.
    frame.rename_axis("stamp").to_csv(HERE / "stamps.csv")
    frame.rename_axis("stamp").astype("float64").to_parquet(
        HERE / "stamps_us.parquet", coerce_timestamps="us", allow_truncated_timestamps=True
    )
    chosen = table()[["t", "q1_deg", "tau1", "q2_deg", "tau2"]]
    chosen[chosen.index % 3 != 1].to_parquet(HERE / "chosen.parquet", compression="gzip")
    chosen.loc[27, "q2_deg"] = math.nan
    chosen.to_parquet(HERE / "missing.parquet")


if __name__ == "__main__":
    columns()
    lists()
    stamps()
