"""Bags are written and read back by two independent readers."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

pytest.importorskip("rosbags")

from gait_lab.bag import CLOCK, TYPES, BagWriter, message_class, read_bag, stamp_of  # noqa: E402
from nao_lipm_gait.errors import NaoGaitError  # noqa: E402

JOINT_STATE = "sensor_msgs/msg/JointState"
STRING = "std_msgs/msg/String"


def time_message(stamp: int) -> Any:
    cls = TYPES.types["builtin_interfaces/msg/Time"]
    return cls(sec=stamp // 1_000_000_000, nanosec=stamp % 1_000_000_000)


def joint_state(stamp: int) -> bytes:
    header = TYPES.types["std_msgs/msg/Header"](stamp=time_message(stamp), frame_id="")
    values = np.arange(3.0) + stamp
    message = TYPES.types[JOINT_STATE](
        header=header, name=["a", "b", "c"], position=values, velocity=values, effort=values
    )
    return bytes(TYPES.serialize_cdr(message, JOINT_STATE))


def text(value: str) -> bytes:
    return bytes(TYPES.serialize_cdr(TYPES.types[STRING](data=value), STRING))


def write(path: Path, ticks: int = 5) -> None:
    with BagWriter(path) as writer:
        writer.add_topic("/robot_description", STRING, latched=True)
        writer.add_topic("/joint_states", JOINT_STATE)
        writer.add_topic("/joint_command", JOINT_STATE)
        writer.write("/robot_description", 0, text("<robot/>"))
        for tick in range(ticks):
            stamp = tick * 10_000_000
            writer.write("/joint_states", stamp, joint_state(stamp))
            writer.write("/joint_command", stamp, joint_state(stamp))
        assert writer.counts == {
            "/robot_description": 1, "/joint_states": ticks, "/joint_command": ticks
        }  # fmt: skip


def test_a_bag_reads_back(tmp_path: Path) -> None:
    write(tmp_path / "bag")
    found = read_bag(tmp_path / "bag", ("/joint_states", "/robot_description", "/absent"))
    assert [stamp for stamp, _ in found["/joint_states"]] == [n * 10_000_000 for n in range(5)]
    assert found["/joint_states"][3][1].position == pytest.approx([3e7, 3e7 + 1, 3e7 + 2])
    assert found["/robot_description"][0][1].data == "<robot/>"
    assert found["/absent"] == []
    assert "/joint_command" in read_bag(tmp_path / "bag")


def test_mcap_readers_find_schema_and_messages(tmp_path: Path) -> None:
    reader = pytest.importorskip("mcap_ros2.reader")
    write(tmp_path / "bag")
    messages = list(reader.read_ros2_messages(str(tmp_path / "bag" / "bag.mcap")))
    assert len(messages) == 11
    last = messages[-1]
    assert last.channel.topic in ("/joint_states", "/joint_command")
    assert last.schema.name == JOINT_STATE
    assert list(last.ros_msg.name) == ["a", "b", "c"]
    assert last.ros_msg.header.stamp.nanosec == 40_000_000


def test_metadata_is_what_rosbag2_of_jazzy_expects(tmp_path: Path) -> None:
    write(tmp_path / "bag")
    whole = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())
    info = whole["rosbag2_bagfile_information"]
    assert info["version"] == 9 and info["storage_identifier"] == "mcap"
    assert info["relative_file_paths"] == ["bag.mcap"]
    assert info["message_count"] == 11
    assert info["duration"] == {"nanoseconds": 40_000_000}
    topics = {t["topic_metadata"]["name"]: t for t in info["topics_with_message_count"]}
    assert topics["/joint_states"]["message_count"] == 5
    assert topics["/joint_states"]["topic_metadata"]["type"] == JOINT_STATE
    (qos,) = topics["/robot_description"]["topic_metadata"]["offered_qos_profiles"]
    assert qos["durability"] == "transient_local" and qos["reliability"] == "reliable"


def test_an_error_while_recording_keeps_what_was_recorded(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError), BagWriter(tmp_path / "bag") as writer:
        writer.add_topic("/text", STRING)
        writer.write("/text", 7, text("kept"))
        raise RuntimeError
    assert read_bag(tmp_path / "bag")["/text"][0][1].data == "kept"


def test_a_killed_recording_leaves_its_synced_messages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mcap")
    from mcap.exceptions import EndOfFile
    from mcap.stream_reader import StreamReader

    monkeypatch.setattr("gait_lab.bag.SYNC_PERIOD", -1.0)  # sync at every message
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic("/text", STRING)
    for number in range(3):
        writer.write("/text", number, text("kept"))
    copy = tmp_path / "as_if_killed.mcap"
    copy.write_bytes((tmp_path / "bag" / "bag.mcap").read_bytes())
    with copy.open("rb") as file:
        records = []
        with pytest.raises(EndOfFile):  # no index: the stream just ends
            for record in StreamReader(file).records:
                records.append(type(record).__name__)
    assert records.count("Message") == 3 and "Schema" in records
    writer.close()


def test_clock_stamps_are_read_from_the_wire() -> None:
    stamp = 12_345_678_901
    message = TYPES.types[CLOCK](clock=time_message(stamp))
    assert stamp_of(bytes(TYPES.serialize_cdr(message, CLOCK))) == stamp


def test_what_cannot_be_is_refused(tmp_path: Path) -> None:
    write(tmp_path / "bag")
    with pytest.raises(NaoGaitError, match="^bag: .*a new folder"):
        BagWriter(tmp_path / "bag")
    with BagWriter(tmp_path / "other") as writer, pytest.raises(NaoGaitError, match="topic /x"):
        writer.add_topic("/x", "my_msgs/msg/Unknown")
    with pytest.raises(NaoGaitError, match="rosbag2 wrote"):
        read_bag(tmp_path / "nothing")
    with pytest.raises(ImportError):
        message_class("my_msgs/msg/Unknown")
    with pytest.raises(ImportError):
        message_class("std_msgs/msg/Unknown")


def test_an_empty_bag_is_a_bag(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic("/text", STRING)
    info = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())
    begin = info["rosbag2_bagfile_information"]["starting_time"]["nanoseconds_since_epoch"]
    assert begin == 0
    assert read_bag(tmp_path / "bag") == {"/text": []}
