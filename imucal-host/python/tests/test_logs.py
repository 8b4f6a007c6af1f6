"""MCAP that the module writes, read by the readers of its own makers."""

from __future__ import annotations

import pathlib
from typing import Any

import numpy as np
import pytest
from mcap_ros2.reader import read_ros2_messages

import imucal


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
    for message in read_ros2_messages(str(tmp_path / "made.mcap")):
        assert message.schema is not None
        found.setdefault(message.channel.topic, []).append((message.schema.name, message.ros_msg))
        stamp = message.ros_msg.header.stamp
        assert stamp.sec * 10**9 + stamp.nanosec == message.log_time_ns == message.publish_time_ns
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
