"""Logs that others write and read: bags of Python's writers, and MCAP that the module writes in Python's reader."""

from __future__ import annotations

import pathlib
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

import imucal

from conftest import Program

Message = tuple[str, str, int, dict[str, Any]]
BEGIN = 1_700_000_000_123_456_789


def messages(recording: imucal.Recording) -> list[Message]:
    """Topic, type, stamp (ns) and content, by rows."""
    assert recording.acc is not None and recording.gyr is not None and recording.mag is not None
    unknown = [0.0] * 9
    rows = []
    for row, time in enumerate(recording.t):
        stamp = BEGIN + round(time * 1e9)
        header = {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": "imu_link"}

        def axes(values: Any) -> dict[str, float]:
            return dict(zip("xyz", map(float, values)))

        imu = {
            "header": header,
            "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 0.0},
            "orientation_covariance": [-1.0, *unknown[1:]],
            "angular_velocity": axes(recording.gyr[row]),
            "angular_velocity_covariance": unknown,
            "linear_acceleration": axes(recording.acc[row]),
            "linear_acceleration_covariance": unknown,
        }
        field = axes(recording.mag[row] * 1e-6)
        mag = {"header": header, "magnetic_field": field, "magnetic_field_covariance": unknown}
        rows.append(("/imu/data", "sensor_msgs/msg/Imu", stamp, imu))
        rows.append(("/imu/mag", "sensor_msgs/msg/MagneticField", stamp, mag))
    return rows


def write_mcap(path: pathlib.Path, rows: list[Message]) -> None:
    store = get_typestore(Stores.ROS2_HUMBLE)
    with path.open("wb") as file:
        writer = McapWriter(file)
        kinds = {kind for _, kind, _, _ in rows}
        schemas = {kind: writer.register_msgdef(kind, store.generate_msgdef(kind, ros_version=2)[0]) for kind in kinds}
        for topic, kind, stamp, content in rows:
            writer.write_message(topic, schemas[kind], content, log_time=stamp, publish_time=stamp)
        writer.finish()  # type: ignore[no-untyped-call]


def write_bag(path: pathlib.Path, rows: list[Message]) -> None:
    store = get_typestore(Stores.ROS1_NOETIC)

    def made(kind: str, content: Any) -> Any:
        if isinstance(content, list):
            return np.array(content)
        if not isinstance(content, dict):
            return content
        inner = {name: detail for name, (_, detail) in store.fielddefs[kind][1]}
        fields = {name: made(str(inner[name]), value) for name, value in content.items()}
        return store.types[kind](**({"seq": 0} if kind == "std_msgs/msg/Header" else {}), **fields)

    with BagWriter(path) as writer:
        topics = {topic: kind for topic, kind, _, _ in rows}
        connections = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in topics.items()}
        for topic, kind, stamp, content in rows:
            writer.write(connections[topic], stamp, store.serialize_ros1(made(kind, content), kind))


def write_csv(path: pathlib.Path, rows: list[Message]) -> None:
    lines = ["t,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,mag_x,mag_y,mag_z"]
    for (_, _, stamp, imu), (_, _, _, mag) in zip(rows[::2], rows[1::2]):
        # µT as the reader of a log makes them.
        field = [value * 1e6 for value in mag["magnetic_field"].values()]
        numbers = [*imu["linear_acceleration"].values(), *imu["angular_velocity"].values(), *field]
        lines.append(",".join([str(stamp), *map(repr, numbers)]))
    path.write_text("\n".join(lines) + "\n")
    units = '[units]\nt = "ns"\nacc = "m/s^2"\ngyr = "rad/s"\nmag = "uT"\n'
    path.with_suffix(".toml").write_text('format = "imucal-recording/1"\n' + units)


def test_bags_of_other_writers_give_the_calibration_of_csv_to_the_last_digit(
    program: Program, folder: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    rows = messages(imucal.read(folder / "poses.csv"))
    write_csv(tmp_path / "rows.csv", rows)
    write_mcap(tmp_path / "poses.mcap", rows)
    write_bag(tmp_path / "poses.bag", rows)
    program(tmp_path, "calibrate", "rows.csv", "--json", "csv.json")
    expected = (tmp_path / "csv.json").read_text()
    assert '"status": "accepted"' in expected
    topics = ["--topic", "imu=/imu/data", "--topic", "mag=/imu/mag"]
    for name in ("poses.mcap", "poses.bag"):
        program(tmp_path, "calibrate", name, *topics, "--json", f"{name}.json")
        assert (tmp_path / f"{name}.json").read_text().replace(name, "rows.csv") == expected


def vector(value: Any) -> list[float]:
    return [getattr(value, axis) for axis in "xyz"]


def test_a_log_is_what_other_readers_of_ros_2_find_in_it(tmp_path: pathlib.Path) -> None:
    random = np.random.default_rng(3)
    t = 1_700_000_000 + np.arange(3000) * 0.01
    acc, gyr, mag = random.normal(size=(3, 3000, 3))
    gyr[5] = np.nan
    temperature = np.where(np.arange(3000) % 10 == 0, 21.5, np.nan)
    made = imucal.Recording.from_arrays(
        t - t[0], acc=acc, gyr=gyr, mag=mag, temperature=temperature, units={"mag": "uT"}, name="made.csv"
    )
    made.write(tmp_path / "made.mcap")
    found: dict[str, list[tuple[str, Any]]] = {}
    with (tmp_path / "made.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, message, content in reader.iter_decoded_messages():
            assert schema is not None
            found.setdefault(channel.topic, []).append((schema.name, content))
            stamp = content.header.stamp
            assert stamp.sec * 10**9 + stamp.nanosec == message.log_time == message.publish_time
    lengths = {topic: (messages[0][0], len(messages)) for topic, messages in found.items()}
    assert lengths == {
        "/imu/data_raw": ("sensor_msgs/msg/Imu", 3000),
        "/imu/mag": ("sensor_msgs/msg/MagneticField", 3000),
        "/imu/temperature": ("sensor_msgs/msg/Temperature", 300),
    }
    imu = [message for _, message in found["/imu/data_raw"]]
    np.testing.assert_array_equal([vector(message.linear_acceleration) for message in imu], acc)
    rates = np.array([vector(message.angular_velocity) for message in imu])
    np.testing.assert_array_equal(np.delete(rates, 5, axis=0), np.delete(gyr, 5, axis=0))
    # As ROS says that there is no such measurement.
    assert imu[5].angular_velocity_covariance[0] == -1 and imu[5].linear_acceleration_covariance[0] == 0
    assert all(message.orientation_covariance[0] == -1 for message in imu)
    field = [vector(message.magnetic_field) for _, message in found["/imu/mag"]]
    np.testing.assert_allclose(field, mag * 1e-6, rtol=1e-15)
    assert {message.temperature for _, message in found["/imu/temperature"]} == {21.5}


def test_what_no_message_holds_is_warned_of_or_refused(tmp_path: pathlib.Path) -> None:
    t, acc = np.arange(50) * 0.01, np.full((50, 3), 5.66)
    turned = imucal.Recording.from_arrays(t, acc=acc, gimbal=np.zeros((50, 3)), name="turned.csv")
    with pytest.warns(imucal.ImucalWarning, match="left out the encoder angles"):
        turned.write(tmp_path / "turned.mcap")
    counts = {"counts": {"acc": {"offset": 0.0, "per_unit": 1000.0}}}
    raw = imucal.Recording.from_arrays(t, acc=acc * 1000, units={"acc": "counts"}, manifest=counts, name="raw.csv")
    with pytest.raises(imucal.WriteError, match="acc in counts"):
        raw.write(tmp_path / "raw.mcap")
