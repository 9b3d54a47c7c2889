"""Reading rosbag2 bags: MCAP or sqlite3, zstd or plain, whole, or what a killed recorder left.

A whole bag is read by its index. One without metadata.yaml, cut off or damaged is read from its
beginning for as far as it makes sense; nothing is written to it.
"""

import sqlite3
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rosbags.rosbag2 import Reader
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore

from nao_lipm_gait.errors import NaoGaitError

TYPES = get_typestore(Stores.ROS2_JAZZY)
STORAGES = {".mcap": "mcap", ".db3": "sqlite3"}
_MAGIC = {".mcap": b"\x89MCAP0\r\n", ".db3": b"SQLite format 3\x00"}
_ZSTD = ".zstd"
_PADDING = (0, 4, 8, 12)
"""Bytes by which DDS fills up a message that ends in empty arrays, and rosbags does not expect."""

Raw = tuple[str, str, int, bytes]
"""Topic, message type, log time [ns], serialised message."""


@dataclass(frozen=True, slots=True)
class TopicSummary:
    """A topic of a bag."""

    type: str
    count: int


@dataclass(frozen=True, slots=True)
class BagContents:
    """What was found in a bag."""

    path: Path
    messages: Mapping[str, list[tuple[int, Any]]]
    """(log time [ns], message) of the wanted topics, in the order of the log."""
    topics: Mapping[str, TopicSummary]
    """Everything that the bag holds."""
    remarks: tuple[str, ...]
    """What was wrong with the bag, in words; empty for a whole one."""
    start: int
    """[ns] log time of the first message, 0 without any."""
    end: int
    """[ns] of the last one."""


def open_bag(path: Path, topics: Iterable[str] | None = None) -> BagContents:
    """Read the wanted topics of a bag (all if None): a folder, or one .mcap or .db3 file.

    Raises NaoGaitError for what is no bag at all; a damaged one gives what is left, with remarks.
    """
    files = _files(path)
    remarks: list[str] = []
    try:
        # An index can be broken in any way, and the reader then fails in any way.
        types, raw = _whole(path)
    except Exception as error:
        types = {}
        raw = _salvaged(path, files, error, remarks)
    return _decoded(path, types, raw, None if topics is None else set(topics), remarks)


def read_bag(path: Path, topics: Iterable[str] | None = None) -> dict[str, list[tuple[int, Any]]]:
    """(log time [ns], message) of each topic, in the order of the log; all topics if None.

    A topic that the bag lacks gives an empty list. Raises NaoGaitError for what is no bag.
    """
    return dict(open_bag(path, topics).messages)


def _files(path: Path) -> list[Path]:
    """The storage files of a bag; NaoGaitError if there are none that could be one."""
    if path.is_dir():
        files = sorted(file for file in path.iterdir() if _storage(file) in STORAGES)
    else:
        files = [path] if path.is_file() else []
    if not files:
        found = "does not exist"
        if path.is_dir():
            names = sorted(file.name for file in path.iterdir())
            found = f"a folder with {', '.join(names[:6])}" if names else "an empty folder"
        raise _no_bag(path, found)
    for file in files:
        _check_magic(file)
    return files


def _storage(file: Path) -> str:
    """`.mcap` or `.db3`, also below `.zstd`."""
    return Path(file.stem).suffix if file.suffix == _ZSTD else file.suffix


def _check_magic(file: Path) -> None:
    if file.suffix == _ZSTD:
        return
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


def _no_bag(path: Path, found: str) -> NaoGaitError:
    return NaoGaitError(
        "bag", f"{path}: {found}", "a folder that rosbag2 wrote, or an .mcap or .db3 file"
    )


def _whole(path: Path) -> tuple[dict[str, str], list[Raw]]:
    """Type by topic, and all messages."""
    with Reader(path) as reader:
        types = {connection.topic: connection.msgtype for connection in reader.connections}
        raw = [
            (connection.topic, connection.msgtype, stamp, bytes(data))
            for connection, stamp, data in reader.messages()
        ]
    return types, raw


def _salvaged(path: Path, files: list[Path], error: Exception, remarks: list[str]) -> list[Raw]:
    reason = " ".join(str(error).split()) or type(error).__name__
    if path.is_dir() and not (path / "metadata.yaml").is_file():
        remarks.append(
            "metadata.yaml is missing: the recorder was killed or is still running; "
            "read from the data alone"
        )
    else:
        remarks.append(f"the bag is damaged ({reason}); read from the data alone")
    raw: list[Raw] = []
    for file in files:
        if not file.stat().st_size:
            remarks.append(f"{file.name} is empty")
            continue
        before = len(raw)
        with tempfile.TemporaryDirectory() as folder:
            end = _salvage_file(_unpacked(file, Path(folder)), raw)
        if end is not None:
            count = len(raw) - before
            remarks.append(f"{file.name} breaks off after {count} messages ({end})")
    raw.sort(key=lambda each: each[2])
    return raw


def _salvage_file(file: Path, into: list[Raw]) -> str | None:
    """Append what can be read; why it ended early, None if it did not."""
    read = _mcap_messages if file.suffix == ".mcap" else _sqlite_messages
    try:
        for each in read(file):
            into.append(each)
    except Exception as error:
        return " ".join(str(error).split()) or type(error).__name__
    return None


def _unpacked(file: Path, folder: Path) -> Path:
    """The file without its compression, as far as that can be undone."""
    if file.suffix != _ZSTD:
        return file
    import zstandard

    out = folder / file.stem
    with file.open("rb") as packed, out.open("wb") as plain:
        try:
            for block in zstandard.ZstdDecompressor().read_to_iter(packed):
                plain.write(block)
        except zstandard.ZstdError:
            pass  # cut off: the beginning is there
    return out


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
    # Through a copy: sqlite would write to a bag whose journal is still beside it.
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
            topics = {
                key: (name, kind)
                for key, name, kind in connection.execute("SELECT id, name, type FROM topics")
            }
            # In the order of the file, because an index may be what is damaged.
            rows = connection.execute("SELECT topic_id, timestamp, data FROM messages NOT INDEXED")
            for key, stamp, data in rows:
                yield *topics[key], stamp, data
        finally:
            connection.close()


def _fill_up(database: Path) -> None:
    """Give a cut off database its full length: sqlite opens no shorter one, but reads up to it."""
    with database.open("r+b") as file:
        header = file.read(100)
        page = int.from_bytes(header[16:18], "big")
        length = (65536 if page == 1 else page) * int.from_bytes(header[28:32], "big")
        if file.seek(0, 2) < length:
            file.truncate(length)


def _decoded(
    path: Path,
    types: dict[str, str],
    raw: list[Raw],
    wanted: set[str] | None,
    remarks: list[str],
) -> BagContents:
    messages: dict[str, list[tuple[int, Any]]] = {topic: [] for topic in wanted or ()}
    counts = dict.fromkeys(types, 0)
    unreadable: dict[str, int] = {}
    for topic, kind, stamp, data in raw:
        counts[topic] = counts.get(topic, 0) + 1
        types[topic] = kind
        if wanted is not None and topic not in wanted:
            continue
        message = _message(kind, data)
        if message is None:
            unreadable[topic] = unreadable.get(topic, 0) + 1
        else:
            messages.setdefault(topic, []).append((stamp, message))
    for topic, count in unreadable.items():
        remarks.append(f"{topic}: {count} of {counts[topic]} messages ({types[topic]}) unreadable")
    if wanted is None:
        for topic in counts:
            messages.setdefault(topic, [])
    stamps = [each[2] for each in raw]
    return BagContents(
        path=path,
        messages=messages,
        topics={topic: TopicSummary(types[topic], counts[topic]) for topic in sorted(counts)},
        remarks=tuple(remarks),
        start=min(stamps, default=0),
        end=max(stamps, default=0),
    )


def _message(kind: str, data: bytes) -> Any | None:
    """Deserialised, None if that cannot be."""
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
