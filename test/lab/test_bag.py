"""Bags are written and read back by two independent readers, whole and broken."""

import os
import shutil
import signal
import sqlite3
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

pytest.importorskip("rosbags")

from gait_lab.analysis.bag import TYPES, BagWriter, open_bag
from gait_lab.record.recorder import CLOCK, message_class, stamp_of
from robot_core.errors import NaoGaitError

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


def write(path: Path, ticks: int = 5, storage: str = "mcap") -> None:
    with BagWriter(path, storage) as writer:
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


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_bag_reads_back(tmp_path: Path, storage: str) -> None:
    write(tmp_path / "bag", storage=storage)
    found = open_bag(tmp_path / "bag", ("/joint_states", "/robot_description", "/absent")).messages
    assert [stamp for stamp, _ in found["/joint_states"]] == [n * 10_000_000 for n in range(5)]
    assert found["/joint_states"][3][1].position == pytest.approx([3e7, 3e7 + 1, 3e7 + 2])
    assert found["/robot_description"][0][1].data == "<robot/>"
    assert found["/absent"] == []
    whole = open_bag(str(tmp_path / "bag"))
    assert "/joint_command" in whole.messages
    assert len(repr(whole)) < 1000, "without the messages"
    joints = open_bag(tmp_path / "bag", wanted=lambda _, kind: kind.endswith("/JointState"))
    kept = {topic for topic, messages in joints.messages.items() if messages}
    assert kept == {"/joint_states", "/joint_command"}
    assert all(each.count > 0 for each in joints.topics.values()), "the others are only counted"


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
    assert info["version"] == 9
    assert info["storage_identifier"] == "mcap"
    assert info["relative_file_paths"] == ["bag.mcap"]
    assert info["message_count"] == 11
    assert info["duration"] == {"nanoseconds": 40_000_000}
    topics = {t["topic_metadata"]["name"]: t for t in info["topics_with_message_count"]}
    assert topics["/joint_states"]["message_count"] == 5
    assert topics["/joint_states"]["topic_metadata"]["type"] == JOINT_STATE
    (qos,) = topics["/robot_description"]["topic_metadata"]["offered_qos_profiles"]
    assert qos["durability"] == "transient_local"
    assert qos["reliability"] == "reliable"


def test_an_error_while_recording_keeps_what_was_recorded(tmp_path: Path) -> None:
    def record_until_it_fails() -> None:
        with BagWriter(tmp_path / "bag") as writer:
            writer.add_topic("/text", STRING)
            writer.write("/text", 7, text("kept"))
            raise RuntimeError("the disk is full")

    with pytest.raises(RuntimeError, match="disk"):
        record_until_it_fails()
    assert open_bag(tmp_path / "bag").messages["/text"][0][1].data == "kept"


KILLED = """
import sys
sys.path.insert(0, "test/lab")
from pathlib import Path
from test_bag import STRING, text
import gait_lab.analysis.bag
gait_lab.analysis.bag.SYNC_PERIOD = -1.0  # sync at every message
writer = gait_lab.analysis.bag.BagWriter(Path(sys.argv[1]), sys.argv[2])
writer.add_topic("/text", STRING)
for number in range(100):
    writer.write("/text", number, text(f"kept {number}"))
print("written", flush=True)
sys.stdin.read()
"""


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_killed_recording_opens_without_metadata(tmp_path: Path, storage: str) -> None:
    """Kill -9: no index, no metadata.yaml, and nothing of what was handed over is lost."""
    root = Path(__file__).resolve().parents[2]
    with subprocess.Popen(
        [sys.executable, "-c", KILLED, str(tmp_path / "bag"), storage],
        cwd=root, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        assert process.stdout.readline() == "written\n"
        os.kill(process.pid, signal.SIGKILL)
    assert not (tmp_path / "bag" / "metadata.yaml").exists()
    before = sorted((f.name, f.stat().st_size) for f in (tmp_path / "bag").iterdir())
    bag = open_bag(tmp_path / "bag")
    assert [message.data for _, message in bag.messages["/text"]] == [
        f"kept {number}" for number in range(100)
    ]
    assert "metadata.yaml is missing" in bag.remarks[0]
    assert sorted((f.name, f.stat().st_size) for f in (tmp_path / "bag").iterdir()) == before


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_waiting_messages_reach_the_disk_without_a_further_one(
    tmp_path: Path, storage: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gait_lab.analysis.bag.SYNC_PERIOD", 1e9)
    writer = BagWriter(tmp_path / "bag", storage)
    writer.add_topic("/text", STRING)
    writer.write("/text", 1, text("waits"))
    assert not open_bag(tmp_path / "bag").messages.get("/text")
    monkeypatch.setattr("gait_lab.analysis.bag.SYNC_PERIOD", 0.0)
    writer.sync()
    assert open_bag(tmp_path / "bag").messages["/text"][0][1].data == "waits"
    writer.close()


# sqlite keeps the root of its tree of messages anywhere in the file: less of it can be lost.
@pytest.mark.parametrize(("storage", "share"), [("mcap", 0.5), ("mcap", 0.95), ("sqlite3", 0.95)])
def test_a_truncated_bag_gives_its_beginning(tmp_path: Path, storage: str, share: float) -> None:
    write(tmp_path / "bag", ticks=9000, storage=storage)
    (file,) = (f for f in (tmp_path / "bag").iterdir() if f.suffix in (".mcap", ".db3"))
    os.truncate(file, round(share * file.stat().st_size))
    bag = open_bag(tmp_path / "bag", ("/joint_states",))
    found = [stamp // 10_000_000 for stamp, _ in bag.messages["/joint_states"]]
    assert 0.5 * share * 9000 < len(found) < 9000
    assert found == list(range(len(found)))
    assert any("breaks off after" in remark for remark in bag.remarks)


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_bag_cut_off_anywhere_is_no_exception(tmp_path: Path, storage: str) -> None:
    write(tmp_path / "bag", ticks=50, storage=storage)
    (file,) = (f for f in (tmp_path / "bag").iterdir() if f.suffix in (".mcap", ".db3"))
    whole = file.read_bytes()
    for length in range(0, len(whole), len(whole) // 23):
        file.write_bytes(whole[:length])
        bag = open_bag(tmp_path / "bag")
        complete = sum(topic.count for topic in bag.topics.values()) == 101
        assert bag.remarks or complete, length


def test_a_database_of_a_damaged_length_is_named_as_damaged(tmp_path: Path) -> None:
    write(tmp_path / "bag", storage="sqlite3")
    with (tmp_path / "bag" / "bag.db3").open("r+b") as file:
        file.seek(28)
        file.write(b"\x7f\xff\xff\xff")  # pages: 8 TiB
    bag = open_bag(tmp_path / "bag")
    assert bag.remarks
    assert not any("Errno" in remark for remark in bag.remarks)


def test_a_lone_file_is_a_bag(tmp_path: Path) -> None:
    write(tmp_path / "bag")
    write(tmp_path / "other", storage="sqlite3")
    for file in (tmp_path / "bag" / "bag.mcap", tmp_path / "other" / "other.db3"):
        bag = open_bag(file)
        assert len(bag.messages["/joint_states"]) == 5
        assert bag.remarks == ()


@pytest.mark.parametrize("mode", ["FILE", "MESSAGE", "STORAGE"])
@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_compressed_bags_are_read(tmp_path: Path, storage: str, mode: str) -> None:
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, Writer

    from gait_lab.analysis.bag import STORAGES

    if (storage, mode) == ("sqlite3", "STORAGE"):
        pytest.skip("sqlite3 has no compression of its own")
    writer = Writer(tmp_path / "bag", version=9, storage_plugin=STORAGES[storage])
    writer.set_compression(getattr(CompressionMode, mode), CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection("/text", STRING, typestore=TYPES)
        for number in range(20):
            writer.write(connection, number, text(f"packed {number}"))
    bag = open_bag(tmp_path / "bag")
    assert bag.messages["/text"][19][1].data == "packed 19"
    assert bag.remarks == ()
    if mode == "FILE":
        (tmp_path / "bag" / "metadata.yaml").unlink()
        assert len(open_bag(tmp_path / "bag").messages["/text"]) == 20


def test_messages_that_end_in_empty_arrays_are_read(tmp_path: Path) -> None:
    """DDS fills these up to a multiple of 8 bytes."""
    serialization = pytest.importorskip("rclpy.serialization")
    from sensor_msgs.msg import JointState

    data = serialization.serialize_message(JointState(name=["a"], position=[0.5]))
    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic("/joint_command", JOINT_STATE)
        writer.write("/joint_command", 0, data)
    ((_, message),) = open_bag(tmp_path / "bag").messages["/joint_command"]
    assert list(message.position) == [0.5]
    assert len(message.effort) == 0


def test_messages_of_an_unknown_or_wrong_type_are_counted_not_read(tmp_path: Path) -> None:
    write(tmp_path / "bag", storage="sqlite3")
    (tmp_path / "bag" / "metadata.yaml").unlink()
    with sqlite3.connect(tmp_path / "bag" / "bag.db3") as base:
        base.execute("UPDATE topics SET type = 'my_msgs/msg/Own' WHERE name = '/joint_command'")
        base.execute("UPDATE messages SET data = x'00010000' WHERE id = 2")
    bag = open_bag(tmp_path / "bag")
    assert bag.topics["/joint_command"].count == 5
    assert bag.messages["/joint_command"] == []
    assert len(bag.messages["/joint_states"]) == 4
    remarks = "\n".join(bag.remarks)
    assert "/joint_command: 5 of 5 messages (my_msgs/msg/Own) unreadable" in remarks
    assert "/joint_states: 1 of 5 messages" in remarks


def test_what_is_no_bag_is_refused_in_words(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.txt").write_text("no bag")
    (tmp_path / "text.mcap").write_text("no bag")
    (tmp_path / "folder").mkdir()
    shutil.copy(tmp_path / "text.txt", tmp_path / "folder" / "notes.txt")
    for name, found in (
        ("empty", "an empty folder"),
        ("nowhere", "does not exist"),
        ("text.txt", "a file ending in .txt"),
        ("text.mcap", "a file that begins with"),
        ("folder", "a folder with notes.txt"),
    ):
        with pytest.raises(NaoGaitError, match=found):
            open_bag(tmp_path / name)


def test_a_file_of_no_bytes_is_told(tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "bag_0.mcap").touch()
    bag = open_bag(tmp_path / "bag")
    assert bag.topics == {}
    assert "bag_0.mcap is empty" in bag.remarks


def test_clock_stamps_are_read_from_the_wire() -> None:
    stamp = 12_345_678_901
    message = TYPES.types[CLOCK](clock=time_message(stamp))
    assert stamp_of(bytes(TYPES.serialize_cdr(message, CLOCK))) == stamp


def test_what_cannot_be_is_refused(tmp_path: Path) -> None:
    write(tmp_path / "bag")
    with pytest.raises(NaoGaitError, match=r"^bag: .*a new folder"):
        BagWriter(tmp_path / "bag")
    with pytest.raises(NaoGaitError, match=r"storage: .*mcap, sqlite3"):
        BagWriter(tmp_path / "other", "tape")
    with BagWriter(tmp_path / "other") as writer, pytest.raises(NaoGaitError, match="topic /x"):
        writer.add_topic("/x", "my_msgs/msg/Unknown")
    with pytest.raises(NaoGaitError, match="rosbag2 wrote"):
        open_bag(tmp_path / "nothing")
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
    assert open_bag(tmp_path / "bag").messages == {"/text": []}


@pytest.mark.parametrize("name", ["walk.mcap", "walk.db3", "metadata.yaml"])
@pytest.mark.parametrize("target", ["pipe", "/dev/zero", "/"])
def test_only_regular_files_are_a_bag(tmp_path: Path, name: str, target: str) -> None:
    folder = tmp_path / "bag"
    folder.mkdir()
    (folder / "other.mcap").write_bytes(b"")
    if target == "pipe":
        os.mkfifo(folder / name)
    else:
        (folder / name).symlink_to(target)
    if name == "metadata.yaml":
        with pytest.raises(NaoGaitError, match=r"metadata\.yaml: no file"):
            open_bag(folder)
    else:
        assert "other.mcap is empty" in open_bag(folder).remarks
        (folder / "other.mcap").unlink()
        with pytest.raises(NaoGaitError, match="a folder with"):
            open_bag(folder)


@pytest.mark.parametrize("name", ["bomb.mcap.zstd", "bomb.db3.zstd"])
def test_a_packed_file_that_would_fill_the_disk_is_refused(tmp_path: Path, name: str) -> None:
    zstandard = pytest.importorskip("zstandard")
    file = tmp_path / name
    block = bytes(2**24)
    with file.open("wb") as stream, zstandard.ZstdCompressor(1).stream_writer(stream) as packed:
        for _ in range(65):
            packed.write(block)
    with pytest.raises(NaoGaitError, match="more than 1073741824 bytes unpacked"):
        open_bag(file)


def test_a_chunk_that_unpacks_to_more_than_the_memory_is_refused(tmp_path: Path) -> None:
    from mcap.writer import Writer

    file = tmp_path / "bomb.mcap"
    with file.open("wb") as stream:
        writer = Writer(stream, chunk_size=2**30)
        writer.start()
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"")
        channel = writer.register_channel("/text", "cdr", schema)
        for time in range(8):
            writer.add_message(channel, time, bytes(10**7), time)
        writer.finish()
    assert file.stat().st_size < 20_000
    with pytest.raises(NaoGaitError, match="a record of 8000"):
        open_bag(file)


FILL = """
import resource, sys
from pathlib import Path
from gait_lab.analysis.bag import BagWriter
from robot_core.errors import NaoGaitError
resource.setrlimit(resource.RLIMIT_FSIZE, (10**6, 10**6))
try:
    with BagWriter(Path(sys.argv[1]), sys.argv[2]) as writer:
        writer.add_topic("/text", "std_msgs/msg/String")
        for number in range(1000):
            writer.write("/text", number, bytes(4000))
except NaoGaitError as error:
    print(error)
"""


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_disk_that_is_full_is_one_line(tmp_path: Path, storage: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", FILL, str(tmp_path / "bag"), storage],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    (line,) = done.stdout.splitlines()
    assert line.startswith(f"bag {tmp_path}/bag: got ")
    assert "a disk with space" in line
    assert (done.returncode, done.stderr) == (0, "")
