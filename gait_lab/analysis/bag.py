"""Bags: rosbag2 folders with MCAP or sqlite3 inside, written and read.

`BagWriter` appends serialised messages, without a ROS graph. `open_bag` reads MCAP or sqlite3,
plain or zstd. A whole bag is read by its index; one that is damaged, or whose recorder was killed,
is read from its beginning as far as possible. Reading never writes to a bag. The tools of ROS
(`ros2 bag info`, `ros2 bag play`) read what is written here.
"""

import contextlib
import io
import itertools
import os
import sqlite3
import tempfile
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import IO, Any

import numpy as np
import yaml
from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import Reader, StoragePlugin, Writer, WriterError
from rosbags.rosbag2.storage_mcap import McapWriter
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore

from robot_core.errors import NaoGaitError

TYPES = get_typestore(Stores.ROS2_JAZZY)
STORAGES = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}
SYNC_PERIOD = 0.5
"""[s] of wall time that a killed process may lose."""
LARGEST_METADATA = 4 * 1024 * 1024
"""[bytes] of metadata.yaml, which is parsed as a whole."""
LARGEST_CHUNK, PIECE = 64 * 1024 * 1024, 1024 * 1024
"""[bytes] of a record of MCAP, also unpacked, and of a message; of a piece that is unpacked."""
LARGEST_UNPACKED, LARGEST_RATIO = 1024**3, 30
"""[bytes] of an unpacked file, or how many times its size: the larger of both."""
STEP_BACK, STEP_AHEAD = 500_000_000, 10_000_000_000
"""[ns] between two messages of a steady topic beyond which the clock was set, or it paused."""
_NO_TIME_LIMIT = QosTime(9223372036, 854775807)
_MAGIC = {".mcap": b"\x89MCAP0\r\n", ".db3": b"SQLite format 3\x00"}
_ZSTD, _LISTED = ".zstd", "relative_file_paths"
_TABLES = ("topics", "messages", "schema", "metadata")
"""What rosbag2 keeps in a database."""
_PADDING = (0, 4, 8, 12)
"""Bytes that DDS adds to a message ending in empty arrays; rosbags does not expect them."""

Raw = tuple[str, str, int, bytes]
"""Topic, message type, log time [ns], serialised message."""
Wanted = Callable[[str, str], bool]
"""Whether messages of a topic and a type are read."""


class BagWriter(AbstractContextManager["BagWriter"]):
    """Writes a rosbag2 folder, which is complete also if the recording ends by an error.

    A killed process loses the last moment and metadata.yaml. `open_bag` does without it; for the
    tools of ROS, `ros2 bag reindex` makes a new one.

    Args:
        path: The new folder.
        storage: `mcap` or `sqlite3`.

    Raises:
        NaoGaitError: The storage is unknown, or the folder exists or cannot be made.
    """

    def __init__(self, path: Path, storage: str = "mcap") -> None:
        if storage not in STORAGES:
            raise NaoGaitError("storage", storage, STORAGES)
        self.path = path
        self._connections: dict[str, Connection] = {}
        self._counts: dict[str, int] = {}
        try:
            self._writer = Writer(path, version=9, storage_plugin=STORAGES[storage])
            self._writer.open()
        except (OSError, WriterError) as error:
            raise NaoGaitError("bag", str(path), f"a new folder ({error})") from error
        self._synced = time.monotonic()

    @staticmethod
    def knows(message_type: str) -> bool:
        """True if messages of this type (`std_msgs/msg/String`) can be written."""
        return message_type in TYPES.fielddefs

    def add_topic(self, topic: str, message_type: str, *, latched: bool = False) -> None:
        """Announce a topic, `/name`, before its first message.

        Raises:
            NaoGaitError: The type is not one of Jazzy.
        """
        if not self.knows(message_type):
            raise NaoGaitError(f"type of topic {topic}", message_type, "a message type of Jazzy")
        durability = QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE
        qos = Qos(
            QosHistory.KEEP_LAST,
            1 if latched else 10,
            QosReliability.RELIABLE,
            durability,
            _NO_TIME_LIMIT,
            _NO_TIME_LIMIT,
            QosLiveliness.AUTOMATIC,
            _NO_TIME_LIMIT,
            False,
        )
        self._connections[topic] = self._writer.add_connection(
            topic, message_type, typestore=TYPES, offered_qos_profiles=[qos]
        )
        self._counts[topic] = 0

    def write(self, topic: str, stamp: int, data: bytes) -> None:
        """Append a serialised (CDR) message; stamp in ns."""
        with self._storing():
            self._writer.write(self._connections[topic], stamp, data)
        self._counts[topic] += 1
        self.sync()

    @contextlib.contextmanager
    def _storing(self) -> Iterator[None]:
        """Turn a full or vanished disk into NaoGaitError."""
        try:
            yield
        except (OSError, sqlite3.Error) as error:
            allowed = f"a disk with space (after {sum(self._counts.values())} messages)"
            raise NaoGaitError(f"bag {self.path}", str(error), allowed) from error

    @property
    def counts(self) -> Mapping[str, int]:
        """Messages written by topic."""
        return self._counts

    def sync(self) -> None:
        """Pass on to the operating system what has waited for `SYNC_PERIOD`; call it regularly."""
        now = time.monotonic()
        if now - self._synced <= SYNC_PERIOD:
            return
        self._synced = now
        storage: Any = self._writer.storage
        if storage is None:
            return
        # rosbags has no flush. Its MCAP writer keeps up to 1 MB in memory: close the chunk early.
        # Its sqlite3 writer has one transaction until the end: commit it and begin another.
        with self._storing():
            if isinstance(storage, McapWriter):
                if storage.chunk.bio.tell():
                    storage.close_chunk()
                    storage.bio.flush()
            else:
                storage.conn.commit()

    def close(self) -> None:
        """Write the index and metadata.yaml; a second call does nothing."""
        if self._writer.storage is not None:
            if not any(self._counts.values()):
                self._writer.min_timestamp = 0  # else an empty bag would start in the year 2262
            with self._storing():
                self._writer.close()

    def __exit__(self, *_: object) -> None:
        self.close()


@dataclass(frozen=True, slots=True)
class TopicSummary:
    """A topic of a bag.

    Attributes:
        type: `package/msg/Name`.
    """

    type: str
    count: int


@dataclass(frozen=True, slots=True)
class BagContents:
    """What was found in a bag.

    Attributes:
        messages: (log time [ns], message) of the wanted topics, in the order of the log; empty for
            a topic that the bag lacks.
        remarks: What was wrong with the bag, in words; empty for a whole one.
    """

    path: Path
    messages: Mapping[str, list[tuple[int, Any]]] = field(repr=False)
    topics: Mapping[str, TopicSummary]
    remarks: tuple[str, ...]


def open_bag(
    path: str | Path, topics: Iterable[str] | None = None, wanted: Wanted | None = None
) -> BagContents:
    """Read a bag; only messages that are wanted are kept in memory.

    Args:
        path: A rosbag2 folder, or one .mcap or .db3 file.
        topics: The wanted topics; None for all.
        wanted: Further chooses by topic and type.

    Returns:
        The contents; of a damaged bag what is left, with remarks.

    Raises:
        NaoGaitError: The path is no bag at all.
    """
    path = Path(path)
    files = _files(path)
    remarks: list[str] = []
    names = None if topics is None else frozenset(topics)

    def chosen(topic: str, kind: str) -> bool:
        return (names is None or topic in names) and (wanted is None or wanted(topic, kind))

    try:
        # An index can be broken in any way, and the reader then raises any exception.
        found, raw = _whole(path, files, chosen)
    except Exception as error:
        found, raw = _salvaged(path, files, chosen, error, remarks)
    absent: dict[str, list[tuple[int, Any]]] = {topic: [] for topic in names or ()}
    messages = absent | _deserialised(found, raw, remarks)
    return BagContents(path, messages, dict(sorted(found.items())), tuple(remarks))


def on_one_clock(bag: BagContents, topic: str, always: Collection[str] = ()) -> tuple[
    BagContents, str
]:  # fmt: skip
    """The longer side of a bag whose clock was set while it was recorded.

    Such a bag is in order only in its files: by time, both sides are mixed.

    Args:
        bag: The bag.
        topic: One that was sent steadily, by which the steps are found.
        always: Topics of which all messages are kept, such as latched ones.

    Returns:
        The bag, and what was left out in words; empty if its clock was not set.
    """
    try:
        files = _files(bag.path)
        times = np.array([time for file in files for time in _log_times(file, topic)])
    except Exception:  # damaged, and said so already; or each file is compressed
        return bag, ""
    gaps = np.diff(times)
    steps = np.flatnonzero((gaps < -STEP_BACK) | (gaps > STEP_AHEAD))
    if not len(steps):
        return bag, ""
    bounds = [0, *(steps + 1).tolist(), len(times)]
    first, last = max(itertools.pairwise(bounds), key=lambda side: side[1] - side[0])
    wanted = {name for name, messages in bag.messages.items() if messages}
    kept: list[Raw] = []
    position = 0
    for file in files:
        for each in _MESSAGES[file.suffix](file):
            # What follows the last message of the other side may be of before or after the step.
            inside = first < position < last or (position == first and each[0] == topic)
            if each[0] in always or (each[0] in wanted and (inside or position == first == 0)):
                kept.append(each)
            position += each[0] == topic
    kept.sort(key=lambda each: each[2])
    remarks = list(bag.remarks)
    messages = _deserialised(bag.topics, kept, remarks)
    steps_text = ", ".join(f"{1e-9 * gaps[step]:+.1f} s" for step in steps[:3])
    more = f" and {len(steps) - 3} more" if len(steps) > 3 else ""
    text = (
        f"the clock steps by {steps_text}{more} in this bag: only the longest part is used, "
        f"{100 * (last - first) / len(times):.0f} % of {topic}"
    )
    remarks.append(text)
    return replace(bag, messages=messages, remarks=tuple(dict.fromkeys(remarks))), text


def _deserialised(
    found: Mapping[str, TopicSummary], raw: Iterable[Raw], remarks: list[str]
) -> dict[str, list[tuple[int, Any]]]:
    messages: dict[str, list[tuple[int, Any]]] = {topic: [] for topic in found}
    unreadable: dict[str, int] = {}
    for topic, kind, stamp, data in raw:
        # A column of sqlite holds values of any type.
        message = _message(kind, data) if isinstance(stamp, int) else None
        if message is None:
            unreadable[topic] = unreadable.get(topic, 0) + 1
        else:
            messages[topic].append((stamp, message))
    for topic, count in unreadable.items():
        each = found[topic]
        remarks.append(f"{topic}: {count} of {each.count} messages ({each.type}) unreadable")
    return messages


def _files(path: Path) -> list[Path]:
    """The storage files of a bag; NaoGaitError if there are none that could be one."""
    try:
        os.stat(path)
    except FileNotFoundError as error:
        raise _no_bag(path, "does not exist") from error
    except (OSError, ValueError) as error:  # ValueError: a null byte
        raise _no_bag(path, str(error)) from error
    if path.is_dir():
        # A named pipe in place of a file would be waited for.
        found = (each for each in path.iterdir() if each.is_file())
        files = sorted(each for each in found if _suffix(each) in _MAGIC)
        about = path / "metadata.yaml"
        if about.exists() and not (about.is_file() and about.stat().st_size <= LARGEST_METADATA):
            raise _no_bag(about, f"no file, or more than {LARGEST_METADATA} bytes")
    else:
        files = [path] if path.is_file() else []
    if not files:
        reason = "no file"
        if path.is_dir():
            names = sorted(file.name for file in path.iterdir())
            reason = f"a folder with {', '.join(names[:6])}" if names else "an empty folder"
        raise _no_bag(path, reason)
    for file in files:
        _check_magic(file)
    return files


def _suffix(file: Path) -> str:
    """`.mcap` or `.db3`, also below `.zstd`."""
    return Path(file.stem).suffix if file.suffix == _ZSTD else file.suffix


def _check_magic(file: Path) -> None:
    if file.suffix == _ZSTD:
        _check_unpacked(file)
        return
    status = file.stat()
    if status.st_size > max(LARGEST_UNPACKED, LARGEST_RATIO * 512 * status.st_blocks):
        raise _no_bag(file, f"{status.st_size} bytes, hardly any of which are stored")
    magic = _MAGIC.get(file.suffix)
    if magic is None:
        raise _no_bag(file, f"a file ending in {file.suffix or 'nothing'}")
    try:
        with file.open("rb") as stream:
            start = stream.read(len(magic))
    except OSError as error:
        raise _no_bag(file, str(error)) from error
    if start and start != magic[: len(start)]:
        raise _no_bag(file, f"a file that begins with {start[:8]!r}")
    if file.suffix == ".mcap":
        _check_chunks(file)
    else:
        with contextlib.closing(_database(file)) as connection:
            _check_tables(file, connection)


def _database(file: Path) -> sqlite3.Connection:
    """A database that is only read."""
    return sqlite3.connect(f"{file.resolve().as_uri()}?mode=ro&immutable=1", uri=True)


def _check_tables(file: Path, connection: sqlite3.Connection) -> None:
    """Refuse a database that would compute its rows, of which there may be no end."""
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_CHUNK)
    try:
        for name, sql in connection.execute("SELECT name, sql FROM sqlite_master"):
            words = str(sql).upper().replace("(", " ").split()
            if name in _TABLES and (words[:2] != ["CREATE", "TABLE"] or "AS" in words):
                raise _no_bag(file, f"{name} that are computed")
        ((size,),) = connection.execute("SELECT max(length(data)) FROM messages")
        too_large = (size or 0) > LARGEST_CHUNK
    except sqlite3.DataError:  # a text beyond the limit
        too_large = True
    except (sqlite3.Error, UnicodeDecodeError):  # damaged: found when it is read
        return
    if too_large:
        raise _no_bag(file, f"a message of more than {LARGEST_CHUNK} bytes")


def _check_unpacked(file: Path) -> None:
    """Refuse a packed file that would fill the disk when it is unpacked."""
    most = max(LARGEST_UNPACKED, LARGEST_RATIO * file.stat().st_size)
    with file.open("rb") as packed:
        if _unpacked_size(packed, "zstd", most) > most:
            raise _no_bag(file, f"more than {most} bytes unpacked")


def _unpacked_size(packed: IO[bytes], kind: str, most: int) -> int:
    """[bytes] that a packed stream holds, counted until there are more than `most`."""
    import lz4.frame
    import zstandard

    size = 0
    unpacker: IO[bytes]
    if kind == "lz4":
        unpacker = lz4.frame.open(packed)
    else:
        unpacker = zstandard.ZstdDecompressor().stream_reader(packed, read_across_frames=True)
    with contextlib.suppress(zstandard.ZstdError, RuntimeError, EOFError):  # found when it is read
        while size <= most and (block := unpacker.read(PIECE)):
            size += len(block)
    return size


def _check_chunks(file: Path) -> None:
    """Refuse an MCAP file with a record that would fill the memory when it is unpacked."""
    length = file.stat().st_size
    with file.open("rb") as stream:
        stream.seek(len(_MAGIC[".mcap"]))
        while len(head := stream.read(9)) == 9:
            size = int.from_bytes(head[1:], "little")
            end = stream.tell() + size
            if end > length:
                return  # damaged: found when it is read
            if size <= LARGEST_CHUNK and head[0] == 6:
                size = _chunk_size(stream.read(size))
            if size > LARGEST_CHUNK:
                raise _no_bag(file, f"a record of {size} bytes, more than {LARGEST_CHUNK}")
            stream.seek(end)


def _chunk_size(chunk: bytes) -> int:
    """[bytes] of a chunk that is unpacked: times, size, checksum, packing, length, data."""
    size = int.from_bytes(chunk[16:24], "little")
    data = 40 + int.from_bytes(chunk[28:32], "little")
    kind = chunk[32 : data - 8].decode("ascii", "replace")
    if size > LARGEST_CHUNK or kind not in ("zstd", "lz4"):
        return size
    return max(size, _unpacked_size(io.BytesIO(chunk[data:]), kind, LARGEST_CHUNK))


def _no_bag(path: Path, found: str) -> NaoGaitError:
    return NaoGaitError(
        "bag", f"{path}: {found}", "a folder that rosbag2 wrote, or an .mcap or .db3 file"
    )


def _whole(
    path: Path, files: list[Path], wanted: Wanted
) -> tuple[dict[str, TopicSummary], list[Raw]]:
    """All topics, and the wanted messages."""
    if path.is_dir():
        _check_listed(path, files)
    with Reader(path) as reader:
        topics: dict[str, TopicSummary] = {}
        for each in reader.connections:
            before = topics[each.topic].count if each.topic in topics else 0
            topics[each.topic] = TopicSummary(each.msgtype, before + each.msgcount)
        chosen = [each for each in reader.connections if wanted(each.topic, each.msgtype)]
        raw = [
            (connection.topic, connection.msgtype, stamp, bytes(data))
            for connection, stamp, data in (reader.messages(chosen) if chosen else ())
        ]
    return topics, raw


def _check_listed(path: Path, files: list[Path]) -> None:
    """Refuse metadata that names another file than those that were checked."""
    metadata = yaml.safe_load((path / "metadata.yaml").read_bytes())
    names = {Path(name).name for name in metadata["rosbag2_bagfile_information"][_LISTED]}
    if foreign := sorted(names - {file.name for file in files}):
        raise NaoGaitError(_LISTED, foreign, "the files of the bag")


def _salvaged(
    path: Path, files: list[Path], wanted: Wanted, error: Exception, remarks: list[str]
) -> tuple[dict[str, TopicSummary], list[Raw]]:
    reason = " ".join(str(error).split()) or type(error).__name__
    if path.is_dir() and not (path / "metadata.yaml").is_file():
        remarks.append(
            "metadata.yaml is missing: the recorder was killed or is still running; "
            "read from the data alone"
        )
    else:
        remarks.append(f"the bag is damaged ({reason}); read from the data alone")
    topics: dict[str, TopicSummary] = {}
    raw: list[Raw] = []
    for file in files:
        if not file.stat().st_size:
            remarks.append(f"{file.name} is empty")
            continue
        count = 0
        with tempfile.TemporaryDirectory() as folder:
            plain = _unpacked(file, Path(folder))
            try:
                for topic, kind, stamp, data in _MESSAGES[plain.suffix](plain):
                    count += 1
                    before = topics[topic].count if topic in topics else 0
                    topics[topic] = TopicSummary(kind, before + 1)
                    if wanted(topic, kind):
                        raw.append((topic, kind, stamp, data))
            except Exception as broken:
                end = " ".join(str(broken).split()) or type(broken).__name__
                remarks.append(f"{file.name} breaks off after {count} messages ({end})")
    raw.sort(key=lambda each: each[2])
    return topics, raw


def _unpacked(file: Path, folder: Path) -> Path:
    """The file without its compression, as far as it can be unpacked."""
    if file.suffix != _ZSTD:
        return file
    import zstandard

    out = folder / file.stem
    with file.open("rb") as packed, out.open("wb") as plain:
        try:
            for block in zstandard.ZstdDecompressor().read_to_iter(packed):
                plain.write(block)
        except zstandard.ZstdError:
            pass  # truncated: the beginning is there
    return out


def _log_times(file: Path, topic: str) -> list[int]:
    """[ns] of the messages of a topic in the order of the file, which has an index."""
    if file.suffix == ".mcap":
        from mcap.reader import make_reader

        with file.open("rb") as stream:
            found = make_reader(stream).iter_messages([topic], log_time_order=False)
            return [message.log_time for _, _, message in found]
    with contextlib.closing(_database(file)) as connection:
        rows = connection.execute(
            "SELECT timestamp FROM messages WHERE topic_id IN "
            "(SELECT id FROM topics WHERE name = ?) ORDER BY id", (topic,),
        )  # fmt: skip
        return [time for (time,) in rows if isinstance(time, int)]


def _mcap_messages(file: Path) -> Iterator[Raw]:
    from mcap.records import Channel, Message, Schema
    from mcap.stream_reader import StreamReader

    schemas: dict[int, str] = {}
    channels: dict[int, tuple[str, str]] = {}
    with file.open("rb") as stream:
        for record in StreamReader(stream).records:
            if isinstance(record, Schema):
                schemas[record.id] = record.name
            elif isinstance(record, Channel):
                channels[record.id] = record.topic, schemas.get(record.schema_id, "")
            elif isinstance(record, Message):
                yield *channels[record.channel_id], record.log_time, record.data


def _sqlite_messages(file: Path) -> Iterator[Raw]:
    # From a copy: sqlite would write to a bag whose journal still exists.
    import shutil

    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, file.name)
        for suffix in ("", "-wal", "-journal"):
            part = file.with_name(file.name + suffix)
            if part.is_file():
                shutil.copyfile(part, copy.with_name(copy.name + suffix))
        _fill_up(copy)
        connection = sqlite3.connect(copy)
        try:
            _check_tables(file, connection)
            topics = {
                key: (name, kind)
                for key, name, kind in connection.execute("SELECT id, name, type FROM topics")
            }
            # In the order of the file: an index may be damaged.
            rows = connection.execute("SELECT topic_id, timestamp, data FROM messages NOT INDEXED")
            for key, stamp, data in rows:
                yield *topics[key], stamp, data
        finally:
            connection.close()


_MESSAGES = {".mcap": _mcap_messages, ".db3": _sqlite_messages}


def _fill_up(database: Path) -> None:
    """Extend a truncated database to its full length; sqlite opens no shorter one.

    A length that no bag of this size has is damage, which sqlite then names.
    """
    with database.open("r+b") as file:
        header = file.read(100)
        page = int.from_bytes(header[16:18], "big")
        length = (65536 if page == 1 else page) * int.from_bytes(header[28:32], "big")
        size = file.seek(0, 2)
        if size < length <= max(LARGEST_UNPACKED, LARGEST_RATIO * size):
            file.truncate(length)


def _message(kind: str, data: bytes) -> Any | None:
    """The message; None if it cannot be deserialised."""
    if kind not in TYPES.fielddefs:
        return None
    for padding in _PADDING:
        try:
            return TYPES.deserialize_cdr(data[: len(data) - padding], kind)
        except SerdeError:
            continue
        except Exception:
            return None
    return None
