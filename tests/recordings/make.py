#!/usr/bin/env python3
"""Writes the recordings in this folder with the programs that people use: rosbags, mcap, NumPy and SciPy.

    pip install rosbags mcap mcap-ros2-support numpy scipy h5py hdf5storage
    python3 tests/recordings/make.py

The signals are those of `signal` below; the tests of `rig-data` compute them too. Versions: rosbags 0.11, mcap 1.6,
hdf5storage 0.2.
"""

import json
import math
import shutil
import sqlite3
from pathlib import Path

import hdf5storage
import numpy
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import StoragePlugin, Writer as BagWriter
from rosbags.typesys import Stores, get_typestore
from scipy.io import savemat

HERE = Path(__file__).parent
ROWS = 200
PERIOD = 2_000_000  # ns
START = 1_700_000_000_000_000_000  # ns since 1970
NAMES = ["gripper", "elbow", "shoulder"]


def signal(k):
    """Position, velocity and torque of elbow and shoulder in row k, and the force along x of the wrist sensor."""
    t = 0.002 * k
    q = [0.5 * math.sin(3 * t), 0.3 * math.cos(2 * t)]
    qd = [1.5 * math.cos(3 * t), -0.6 * math.sin(2 * t)]
    return t, q, qd, [2.0 * q[0], -4.0 * q[1]], 10.0 * t


store = get_typestore(Stores.ROS2_HUMBLE)
Time = store.types["builtin_interfaces/msg/Time"]
Header = store.types["std_msgs/msg/Header"]
JointState = store.types["sensor_msgs/msg/JointState"]
Wrench = store.types["geometry_msgs/msg/Wrench"]
WrenchStamped = store.types["geometry_msgs/msg/WrenchStamped"]
Vector3 = store.types["geometry_msgs/msg/Vector3"]


def header(ns, frame):
    return Header(Time(ns // 10**9, ns % 10**9), frame)


def joint_state(k):
    _, q, qd, tau, _ = signal(k)
    array = numpy.array
    return JointState(
        header(START + k * PERIOD, "base"), NAMES, array([0.01] + q), array([0.0] + qd), array([0.0] + tau)
    )


def wrench(ns):
    t = (ns - START) * 1e-9
    return WrenchStamped(
        header(ns, "tool0"), Wrench(Vector3(10.0 * t, 0.0, -9.81), Vector3(0.0, 0.25, 5.0 * t))
    )


def bag(name, plugin, split):
    """A bag with joint states at 500 Hz and a wrist sensor at 100 Hz, 1 ms later, in `split` files."""
    folder = HERE / name
    shutil.rmtree(folder, ignore_errors=True)
    parts = []
    for part in range(split):
        own = folder if split == 1 else HERE / f"{name}_{part}"
        shutil.rmtree(own, ignore_errors=True)
        with BagWriter(own, version=9, storage_plugin=plugin) as writer:
            joints = writer.add_connection("/joint_states", JointState.__msgtype__, typestore=store)
            sensor = writer.add_connection("/ft_sensor/wrench", WrenchStamped.__msgtype__, typestore=store)
            for k in range(part * ROWS // split, (part + 1) * ROWS // split):
                ns = START + k * PERIOD
                writer.write(joints, ns + 300_000, store.serialize_cdr(joint_state(k), JointState.__msgtype__))
                if k % 5 == 0:
                    late = ns + 1_000_000
                    writer.write(sensor, late + 300_000, store.serialize_cdr(wrench(late), WrenchStamped.__msgtype__))
        parts.append(own)
    if split > 1:
        # rosbags writes one file a bag; the recorder of ROS 2 splits a bag into several.
        folder.mkdir()
        names = []
        for part, own in enumerate(parts):
            file = next(own.glob("*.mcap"))
            names.append(f"{name}_{part}.mcap")
            shutil.move(file, folder / names[-1])
            text = (own / "metadata.yaml").read_text()
            shutil.rmtree(own)
        old = next(line for line in text.splitlines() if line.strip().startswith("- ") and ".mcap" in line)
        indent = old[: len(old) - len(old.lstrip())]
        listed = "\n".join(f"{indent}- {n}" for n in names)
        (folder / "metadata.yaml").write_text(text.replace(old, listed, 1))


def old_bag():
    """The same without definitions, as ROS 2 wrote it before Iron, in pages so small that rows and trees span several."""
    bag("bag_old", StoragePlugin.SQLITE3, 1)
    with sqlite3.connect(HERE / "bag_old" / "bag_old.db3") as base:
        base.execute("DROP TABLE message_definitions")
    base.execute("PRAGMA page_size = 512")
    base.execute("VACUUM")
    base.close()


def other_json():
    """JSON of a logger that knows nothing of this project: nested, camel case, degrees, zstd."""
    with open(HERE / "other.mcap", "wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD)
        writer.start()
        schema = writer.register_schema("Arm", "jsonschema", b'{"type":"object"}')
        channel = writer.register_channel("/arm/telemetry", "json", schema)
        for k in range(ROWS):
            t, q, _, tau, _ = signal(k)
            data = {
                "joints": {"names": ["elbow", "shoulder"], "positionDeg": [math.degrees(v) for v in q], "torque": tau},
                "mode": "run",
            }
            ns = START + k * PERIOD
            writer.add_message(channel, ns, json.dumps(data).encode(), ns)
        writer.finish()


def shuffled():
    """Samples of this project's own kind, whose second half was stored first: chunks are not in the order of time."""
    with open(HERE / "shuffled.mcap", "wb") as stream:
        writer = Writer(stream, chunk_size=2000, compression=CompressionType.LZ4)
        writer.start()
        schema = writer.register_schema("rig.JointState", "jsonschema", b'{"type":"object"}')
        channel = writer.register_channel("/joint/state", "json", schema)
        for k in [*range(100, 200), *range(100)]:
            t, q, _, tau, _ = signal(k)
            ns = k * PERIOD
            data = json.dumps({"t": t, "q1": q[0], "tau1": tau[0]}).encode()
            writer.add_message(channel, ns, data, ns)
        writer.finish()


def arrays():
    """NumPy and MATLAB files with the columns of a recording."""
    rows = [signal(k) for k in range(ROWS)]
    table = {
        "t": numpy.array([r[0] for r in rows]),
        "q": numpy.array([r[1] for r in rows]),
        "tau": numpy.array([r[3] for r in rows], dtype=numpy.float32),
    }
    numpy.savez(HERE / "arrays.npz", **table)
    numpy.savez_compressed(HERE / "compressed.npz", **table)
    savemat(HERE / "arrays.mat", table, do_compression=True)
    log = {"t": table["t"], "q": table["q"].T, "tau": table["tau"].T, "rate": 500.0, "note": "a text"}
    savemat(HERE / "structure.mat", {"log": log}, do_compression=False)
    # Version 7.3, as MATLAB writes it: numbers compressed by parts.
    small = hdf5storage.Options(matlab_compatible=True, compress_size_threshold=1000)
    for name in ["arrays_73.mat", "structure_73.mat"]:
        (HERE / name).unlink(missing_ok=True)
    hdf5storage.writes(table, filename=str(HERE / "arrays_73.mat"), options=small)
    hdf5storage.writes({"log": log}, filename=str(HERE / "structure_73.mat"), options=small)


if __name__ == "__main__":
    bag("bag_mcap", StoragePlugin.MCAP, 1)
    bag("bag_split", StoragePlugin.MCAP, 2)
    bag("bag_sqlite", StoragePlugin.SQLITE3, 1)
    old_bag()
    other_json()
    shuffled()
    arrays()
