"""Bags that nobody should send, made one by one: a table of names and of what makes each."""

import os
import shutil
import sqlite3
import struct
from collections.abc import Callable, Iterator
from pathlib import Path

import lz4.frame
import zstandard

from gait_lab.analysis.bag import TYPES, BagWriter

MAGIC = b"\x89MCAP0\r\n"
HUGE = 2**63 - 1
STRING = b"\0\1\0\0\5\0\0\0walk\0"
"""A serialised std_msgs/String."""


# -- MCAP, record by record ------------------------------------------------------------------------


def _record(kind: int, *parts: bytes, length: int | None = None) -> bytes:
    data = b"".join(parts)
    return struct.pack("<BQ", kind, len(data) if length is None else length) + data


def _text(value: bytes | str) -> bytes:
    data = value.encode() if isinstance(value, str) else value
    return struct.pack("<I", len(data)) + data


def _message(time: int = 10, data: bytes = STRING, channel: int = 1) -> bytes:
    return _record(5, struct.pack("<HIQQ", channel, 0, time, time), data)


def _chunk(packed: bytes, size: int, kind: str) -> bytes:
    return _record(6, struct.pack("<QQQI", 0, HUGE, size, 0), _text(kind),
                  struct.pack("<Q", len(packed)), packed)  # fmt: skip


def _schema(kind: str = "std_msgs/msg/String", definition: str = "string data") -> bytes:
    return _record(3, struct.pack("<H", 1), _text(kind), _text("ros2msg"), _text(definition))


def _channel(topic: str = "/odom", encoding: str = "cdr", schema: int = 1) -> bytes:
    return _record(4, struct.pack("<HH", 1, schema), _text(topic), _text(encoding), _text(b""))


def _mcap(*records: bytes, profile: str = "ros2", end: bytes | None = None) -> bytes:
    footer = _record(2, struct.pack("<QQI", 0, 0, 0)) + MAGIC if end is None else end
    return MAGIC + _record(1, _text(profile), _text("")) + b"".join(records) + footer


def _of_type(kind: str, data: bytes, topic: str) -> bytes:
    """A file with one message of a type of Jazzy."""
    schema = _schema(kind, TYPES.generate_msgdef(kind)[0])
    return _mcap(schema, _channel(topic), _message(data=data))


def _one(schema: bytes, topic: str = "/odom") -> bytes:
    """A file with a String, whatever its schema says."""
    return _mcap(schema, _channel(topic), _message())


ZEROS = bytes(2**20)


def _zstd_zeros(mebibytes: int) -> bytes:
    """A frame of zstd that does not tell its size."""
    packer = zstandard.ZstdCompressor(write_content_size=False).compressobj()
    return b"".join([*(packer.compress(ZEROS) for _ in range(mebibytes)), packer.flush()])


def _lz4_zeros(mebibytes: int) -> bytes:
    with lz4.frame.LZ4FrameCompressor() as packer:
        parts = [packer.begin(), *(packer.compress(ZEROS) for _ in range(mebibytes))]
        return b"".join([*parts, packer.flush()])


def _mcaps() -> Iterator[tuple[str, bytes]]:
    start, odometry = _schema() + _channel(), "nav_msgs/msg/Odometry"
    many = struct.pack("<IIIII", 256, 0, 0, 0, 2**32 - 1)
    yield "nothing", b""
    yield "magic alone", MAGIC
    yield "no message", _mcap()
    yield "no end", _mcap(start, _message(), end=b"")
    yield "another profile", _mcap(start, _message(), profile="ros1")
    yield "a record of 8 EiB", _mcap(start, _record(5, b"", length=2**63))
    yield "a record of 1 TiB", _mcap(start, _record(5, b"", length=2**40))
    yield "a name of 4 GiB", _mcap(_record(4, struct.pack("<HHI", 1, 1, 2**32 - 1)))
    yield "no schema", _mcap(_channel(), _message())
    yield "no channel", _mcap(_message())
    yield "an unknown encoding", _mcap(_schema(), _channel(encoding="protobuf"), _message())
    yield "an unknown type", _one(_schema("evil/msg/Thing", "evil/Thing x"))
    yield "a type that holds itself", _one(_schema("a/msg/A", "a/A x"))
    yield "another definition", _one(_schema(odometry, "float64[1000000000] x"))
    yield "a definition that is none", _one(_schema(odometry, "[" * 100_000))
    yield "a long definition", _one(_schema("a/msg/A", "float64 x\n" * 200_000))
    yield "a long topic", _one(_schema(), "/" + "a" * 10**6)
    yield "an odd topic", _one(_schema(), "\x1b[2J/../<script>")
    yield "an empty message", _mcap(start, _message(data=b""))
    yield "a short message", _mcap(_schema(odometry, ""), _channel(), _message(data=STRING))
    yield "the end of time", _mcap(start, _message(2**64 - 1), _message(0))
    yield "tiny messages", _mcap(_schema(), _channel("/other"), _message() * 200_000)
    yield "many channels", _mcap(_schema(), *(
        _record(4, struct.pack("<HH", n, 1), _text(f"/t{n}"), _text("cdr"), _text(b""))
        for n in range(60_000)
    ))  # fmt: skip
    for kind, topic in (
        ("sensor_msgs/msg/JointState", "/joint_states"),
        ("visualization_msgs/msg/MarkerArray", "/gait/footsteps"),
        ("diagnostic_msgs/msg/DiagnosticArray", "/diagnostics"),
        ("sensor_msgs/msg/PointCloud2", "/vision/percepts"),
        ("std_msgs/msg/String", "/robot_description"),
    ):
        yield f"4e9 items of {topic}", _of_type(kind, many, topic)
        yield f"zeros as {topic}", _of_type(kind, bytes(400), topic)
    endless = "<mujoco><include file='/dev/zero'/></mujoco>"
    for text_ in ("<robot>" * 50_000, endless, "[" * 100_000):
        for topic in ("/robot_description", "/scene_description", "/gait/support"):
            data = b"\0\1\0\0" + _text(text_ + "\0")
            yield f"{topic} {text_[:9]}", _of_type("std_msgs/msg/String", data, topic)
    for kind, pack in (("zstd", _zstd_zeros), ("lz4", _lz4_zeros)):
        for size in (0, 2**20, 2**62):
            yield f"512 MiB of {kind} as {size}", _mcap(start, _chunk(pack(512), size, kind))
        more = pack(1) + pack(512)
        yield f"512 MiB of {kind} in a second frame", _mcap(start, _chunk(more, 2**20, kind))
        yield f"no {kind}", _mcap(start, _chunk(b"\xff" * 1000, 1000, kind))
    yield "an unknown packing", _mcap(start, _chunk(b"\0" * 100, 100, "rar"))
    yield "a chunk in a chunk", _mcap(start, _chunk(_chunk(_message(), 30, ""), 100, ""))
    plain = _message() * 10
    yield "a plain chunk that is longer", _mcap(start, _chunk(plain, HUGE, ""))
    for name, where in (("0", 0), ("itself", 30), ("behind", 10**6), ("far", HUGE)):
        end = _record(2, struct.pack("<QQI", where, where, 0)) + MAGIC
        yield f"a summary at {name}", _mcap(start, _message(), end=end)


# -- sqlite3 ---------------------------------------------------------------------------------------

TOPICS = (
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, "
    "serialization_format TEXT, offered_qos_profiles TEXT)"
)
MESSAGES = (
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)"
)
ENDLESS = "WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) SELECT "
ODOM = "INSERT INTO topics VALUES(1, '/odom', 'nav_msgs/msg/Odometry', 'cdr', '')"
DATABASES: dict[str, tuple[str, ...]] = {
    "no table": (),
    "no messages": (TOPICS,),
    "no topics": (MESSAGES,),
    "no rows": (TOPICS, MESSAGES),
    "a topic alone": (TOPICS, MESSAGES, ODOM),
    "other columns": ("CREATE TABLE topics(a)", "CREATE TABLE messages(b)"),
    "endless messages": (
        TOPICS, ODOM, f"CREATE VIEW messages AS {ENDLESS} x AS id, 1 AS topic_id, "
        "x AS timestamp, x'00' AS data FROM c",
    ),
    "endless topics": (
        MESSAGES, f"CREATE VIEW topics AS {ENDLESS} x AS id, '/odom' AS name, "
        "'nav_msgs/msg/Odometry' AS type, 'cdr' AS serialization_format, '' AS "
        "offered_qos_profiles FROM c",
    ),
    "tables and endless views": (
        TOPICS, MESSAGES, ODOM, f"CREATE VIEW schema AS {ENDLESS} x AS schema_version FROM c",
    ),
    "text as time": (TOPICS, MESSAGES, ODOM, "INSERT INTO messages VALUES(1, 1, 'now', x'00')"),
    "text as data": (TOPICS, MESSAGES, ODOM, "INSERT INTO messages VALUES(1, 1, 5, 'text')"),
    "nothing as data": (TOPICS, MESSAGES, ODOM, "INSERT INTO messages VALUES(1, 1, 5, NULL)"),
    "a number as data": (TOPICS, MESSAGES, ODOM, "INSERT INTO messages VALUES(1, 1, 5, 7)"),
    "another topic": (TOPICS, MESSAGES, ODOM, "INSERT INTO messages VALUES(1, 9, 5, x'00')"),
    "negative time": (
        TOPICS, MESSAGES, ODOM, "INSERT INTO messages VALUES(1, 1, -9223372036854775808, x'00')",
    ),
    "large data": (TOPICS, MESSAGES, ODOM, "INSERT INTO messages VALUES(1, 1, 5, zeroblob(3e8))"),
    "an odd name": (
        TOPICS, MESSAGES, "INSERT INTO topics VALUES(1, char(27) || '[2J', NULL, 5, x'ff')",
        "INSERT INTO messages VALUES(1, 1, 5, x'00')",
    ),
    "a long name": (TOPICS, MESSAGES, f"INSERT INTO topics VALUES(1, '{'a' * 10**6}', '', '', '')"),
    "the same topic": (
        TOPICS, MESSAGES, ODOM, ODOM.replace("(1,", "(2,"),
        "INSERT INTO messages VALUES(1, 1, 5, x'00')",
    ),
    "tiny messages": (
        TOPICS, MESSAGES, ODOM.replace("odom", "other"),
        "INSERT INTO messages WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c "
        "LIMIT 200000) SELECT x, 1, x, x'00' FROM c",
    ),
    "many topics": (
        TOPICS, MESSAGES, "INSERT INTO topics WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT "
        "x + 1 FROM c LIMIT 100000) SELECT x, '/t' || x, 'std_msgs/msg/String', 'cdr', '' FROM c",
    ),
    "a version": (
        TOPICS, MESSAGES, "CREATE TABLE schema(schema_version, ros_distro)",
        "INSERT INTO schema VALUES(9000000000, 'x')",
    ),
}  # fmt: skip


def _database(path: Path, statements: tuple[str, ...]) -> None:
    path.unlink(missing_ok=True)
    connection = sqlite3.connect(path)
    for statement in statements:
        connection.execute(statement)
    connection.commit()
    connection.close()
    if not path.exists():
        path.write_bytes(b"SQLite format 3\0")


# -- metadata --------------------------------------------------------------------------------------

METADATA = (
    "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: {storage}\n"
    "  duration: {{nanoseconds: {ns}}}\n  starting_time: {{nanoseconds_since_epoch: {ns}}}\n"
    "  message_count: {count}\n  topics_with_message_count: {topics}\n"
    "  compression_format: '{packing}'\n  compression_mode: '{mode}'\n"
    "  relative_file_paths: [{file}]\n  files: []\n  custom_data: null\n  ros_distro: jazzy\n"
)
USUAL = {"storage": "mcap", "ns": 1, "count": 1, "topics": "[]", "packing": "", "mode": "",
         "file": "whole.mcap"}  # fmt: skip
LIES: dict[str, object] = {
    "storage": ("sqlite3", "rosbag1", "[]", "evil"), "ns": (-1, 2**64, ".nan", "a"),
    "count": (0, -5, 10**30, "~"), "topics": ("~", "3", "[1]", "[{}]"),
    "packing": ("zstd", "rar"), "mode": ("FILE", "MESSAGE", "x"),
    "file": ("", "/dev/zero", "../../../etc/passwd", "http://127.0.0.1:9/a.mcap", "other.mcap",
             "whole.mcap, whole.mcap", "~", ".", "pipe", "package://a/a.mcap", "3"),
}  # fmt: skip


def _metadata(bomb: str) -> Iterator[tuple[str, str]]:
    yield "empty", ""
    yield "no YAML", "\0"
    yield "a bomb", bomb
    yield "deep", "[" * 100_000
    yield "5 MB", "# nothing\n" * 500_000
    yield "a list", "[1, 2]"
    yield "an object", "!!python/object/apply:os.system [true]"
    for key, values in LIES.items():
        for value in values:  # type: ignore[attr-defined]
            yield f"{key} {value}", METADATA.format(**(USUAL | {key: value}))


def bags(folder: Path, bomb: str) -> Iterator[tuple[str, Path]]:
    """Names and paths of hostile bags; each is there until the next one is asked for."""
    path = folder / "bag.mcap"
    for name, data in _mcaps():
        path.write_bytes(data)
        yield f"mcap, {name}", path
        if len(data) > 2**20:
            path.write_bytes(b"")
    path.unlink()
    path = folder / "bag.db3"
    for name, statements in DATABASES.items():
        _database(path, statements)
        yield f"db3, {name}", path
        path.unlink()
    whole = folder / "whole"
    with BagWriter(whole) as writer:
        writer.add_topic("/text", "std_msgs/msg/String")
        for time in range(50):
            writer.write("/text", 10_000_000 * time, STRING)
    (whole / "whole.mcap").chmod(0o644)
    os.mkfifo(whole / "pipe")
    for name, content in _metadata(bomb):
        (whole / "metadata.yaml").write_text(content)
        yield f"metadata, {name}", whole
    for name, make in PLACES.items():
        (whole / "metadata.yaml").unlink(missing_ok=True)
        make(whole)
        yield f"bag, {name}", whole
    shutil.rmtree(whole)
    packed = folder / "bag.db3.zstd"
    for name, data in (
        ("16 MiB", _zstd_zeros(16)), ("1.1 GiB", _zstd_zeros(1127)),
        ("1.1 GiB in a second frame", _zstd_zeros(1) + _zstd_zeros(1127)),
    ):  # fmt: skip
        packed.write_bytes(data)
        yield f"{name} of zeros", packed
    packed.unlink()
    for path, start in ((folder / "bag.mcap", MAGIC), (folder / "bag.db3", b"SQLite format 3\0")):
        with path.open("wb") as file:
            file.write(start)
            file.truncate(2**40)
        yield f"1 TiB that is not stored in {path.suffix}", path
        path.unlink()


PLACES: dict[str, Callable[[Path], object]] = {
    "metadata is a pipe": lambda bag: os.mkfifo(bag / "metadata.yaml"),
    "metadata is a device": lambda bag: (bag / "metadata.yaml").symlink_to("/dev/zero"),
    "metadata is itself": lambda bag: (bag / "metadata.yaml").symlink_to("metadata.yaml"),
    "a file is a pipe": lambda bag: os.mkfifo(bag / "a.mcap"),
    "a file is a device": lambda bag: (bag / "b.mcap").symlink_to("/dev/zero"),
    "a file is a folder": lambda bag: (bag / "c.db3").mkdir(),
    "a file is itself": lambda bag: (bag / "d.mcap").symlink_to("d.mcap"),
    "no file is left": lambda bag: [each.unlink() for each in bag.glob("*.mcap")],
}
