"""Bags: written as rosbag2 folders with MCAP or sqlite3 inside, from serialised messages.

`BagWriter` knows no ROS graph; `TopicRecorder` feeds one from raw subscriptions. `ros2 bag info`
and `ros2 bag play` read what is written here; `bag_reading` reads it back.
"""

import importlib
import math
import struct
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer, WriterError
from rosbags.rosbag2.storage_mcap import McapWriter

from gait_lab.analysis.bag_reading import TYPES
from gait_lab.record.clock_order import ClockOrder
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.ros.process import stay_local, stop_on_signal

if TYPE_CHECKING:
    from rclpy.node import Node

CLOCK = "rosgraph_msgs/msg/Clock"
SYNC_PERIOD = 0.5
"""Seconds of wall time that a killed process may lose."""
STORAGES = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}
DISCOVERY_PERIOD = 0.5
"""Seconds of wall time between two looks for new topics."""
CLOCK_PERIOD = 5.0
"""Seconds of wall time that /clock may be found later than the first other topic."""
NOBODY_PERIOD = 8.0
"""Seconds of wall time without any topic, after which a recording's duration counts."""

_NO_TIME_LIMIT = QosTime(9223372036, 854775807)


class BagWriter:
    """A rosbag2 folder, complete also when the recording ends by an error.

    A killed process loses the last moment and metadata.yaml: `read_bag` does without, for the tools
    of ROS `ros2 bag reindex` makes it again.
    """

    def __init__(self, path: Path, storage: str = "mcap") -> None:
        """Create the bag; NaoGaitError if the folder exists or cannot be made."""
        if storage not in STORAGES:
            raise NaoGaitError("storage", storage, f"one of {', '.join(STORAGES)}")
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
        """Announce a topic, `/name`, before its first message."""
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
        self._writer.write(self._connections[topic], stamp, data)
        self._counts[topic] += 1
        self.sync()

    @property
    def counts(self) -> Mapping[str, int]:
        """Messages written by topic."""
        return self._counts

    def sync(self) -> None:
        """Hand to the operating system what has waited for `SYNC_PERIOD`; call it now and then."""
        now = time.monotonic()
        if now - self._synced <= SYNC_PERIOD:
            return
        self._synced = now
        storage: Any = self._writer.storage
        if storage is None:
            return
        # rosbags has no flush. Its MCAP writer keeps up to 1 MB in memory: close the chunk early.
        # Its sqlite3 writer keeps one transaction open to the end: commit it, begin another.
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
            self._writer.close()

    def __enter__(self) -> "BagWriter":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


def message_class(message_type: str) -> Any:
    """The Python class of `package/msg/Name`; ImportError if it is not installed."""
    package, _, name = message_type.partition("/msg/")
    try:
        return getattr(importlib.import_module(f"{package}.msg"), name)
    except AttributeError as error:
        raise ImportError(f"no message {message_type}") from error


def stamp_of(clock: bytes) -> int:
    """[ns] in a serialised rosgraph_msgs/Clock."""
    order = "<" if clock[1] & 1 else ">"
    seconds, nanoseconds = struct.unpack_from(f"{order}iI", clock, 4)
    return int(seconds) * 1_000_000_000 + int(nanoseconds)


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic to record."""

    name: str
    type: str
    latched: bool = False
    """Transient local: the last message is kept for those who come late."""


class TopicRecorder:
    """Writes topics to a bag, stamped with simulated time once /clock ticks, else with wall time.

    All subscriptions are raw: nothing is decoded on the way, so a busy machine keeps up.
    """

    DEPTH = 5000
    """Messages that may wait while the recorder is busy."""

    def __init__(
        self, node: "Node", writer: BagWriter, *, simulated_time: bool | None = None
    ) -> None:
        """`simulated_time` None: messages are held until `/clock` ticks or `use_wall_time`."""
        self._node = node
        self._writer = writer
        self._simulated = simulated_time
        self._order = ClockOrder(writer.write)
        if simulated_time is False:
            self._order.use_wall_time()
        self._subscriptions: dict[str, tuple[Any, Callable[[bytes, Any], None]]] = {}
        self._types: dict[str, Any] = {}
        self._refused: set[str] = set()

    @property
    def topics(self) -> tuple[str, ...]:
        return tuple(self._subscriptions)

    @property
    def now(self) -> float:
        """[s] of simulated time up to which has been recorded; 0 before the first tick."""
        return 1e-9 * (self._order.now or 0)

    def add(self, topic: Topic, *, best_effort: bool = False) -> None:
        """Subscribe; ImportError if the type is not installed, NaoGaitError if it is unknown."""
        from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

        cls = message_class(topic.type)
        name = self._node.resolve_topic_name(topic.name)
        self._writer.add_topic(name, topic.type, latched=topic.latched)
        qos = QoSProfile(
            depth=self.DEPTH,
            reliability=(
                ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE
            ),
            durability=(
                DurabilityPolicy.TRANSIENT_LOCAL if topic.latched else DurabilityPolicy.VOLATILE
            ),
        )
        handler: Any = self._handler(name, topic.type == CLOCK)
        self._types[name] = cls
        self._subscriptions[name] = (
            self._node.create_subscription(cls, name, handler, qos, raw=True), handler
        )  # fmt: skip

    def add_new_topics(self, wanted: set[str] | None = None) -> list[tuple[str, str]]:
        """Subscribe to the topics that have appeared (of those `wanted`, if not None).

        Returns (topic, reason) for each that cannot be recorded, once.
        """
        from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

        refused = []
        for name, types in self._node.get_topic_names_and_types():
            if name in self._subscriptions or name in self._refused:
                continue
            if wanted is not None and name not in wanted:
                continue
            offers = [offer.qos_profile for offer in self._node.get_publishers_info_by_topic(name)]
            if not offers:
                continue
            latched = all(q.durability == DurabilityPolicy.TRANSIENT_LOCAL for q in offers)
            best_effort = any(q.reliability == ReliabilityPolicy.BEST_EFFORT for q in offers)
            try:
                self.add(Topic(name, types[0], latched), best_effort=best_effort)
            except (ImportError, NaoGaitError) as error:
                self._refused.add(name)
                refused.append((name, str(error)))
        return refused

    def _handler(self, name: str, is_clock: bool) -> Callable[[bytes, Any], None]:
        if is_clock and self._simulated is not False:
            return lambda data, info: self._order.tick(name, _arrival(info), stamp_of(data), data)
        return lambda data, info: self._order.message(name, _arrival(info), data)

    def decide(self, simulated_time: bool) -> None:
        """Which time a recorder of no given time uses."""
        self._simulated = simulated_time
        if not simulated_time:
            self._order.use_wall_time()

    def close(self) -> None:
        """Take what has arrived and was not handled yet, then stop listening."""
        for name, (subscription, handle) in self._subscriptions.items():
            with subscription.handle:
                while (taken := subscription.handle.take_message(self._types[name], True)):
                    handle(*taken)
            self._node.destroy_subscription(subscription)
        self._subscriptions.clear()
        if self._simulated is None and self._order.now is None:
            self._order.use_wall_time()
        self._order.close()


def _arrival(info: Any) -> int:
    """[ns] wall time at which the middleware got a message, which may be long before its turn."""
    return int(info["received_timestamp"]) or time.time_ns()


def record(
    out: Path,
    *,
    topics: tuple[str, ...] = (),
    duration: float | None = None,
    simulated_time: bool | None = None,
    storage: str = "mcap",
    say: Callable[[str], None] = print,
) -> int:
    """`nao_gait record`: all topics (or those named) until Ctrl-C or `duration` s of wall time.

    Returns the number of messages. `simulated_time` None: use /clock if anyone publishes it.
    """
    import rclpy
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.signals import SignalHandlerOptions

    from gait_lab.drive.ros_names import checked_topics

    topics = checked_topics(topics)
    if duration is not None and not 0.0 < duration < 1e9:
        raise NaoGaitError("duration", duration, "more than 0 s")
    stay_local()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    began = time.monotonic()
    try:
        node = rclpy.create_node("nao_gait_record")
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        with BagWriter(out, storage) as writer, stop_on_signal() as stop:
            recorder = TopicRecorder(node, writer, simulated_time=simulated_time)
            wanted = {node.resolve_topic_name(topic) for topic in topics} or None
            if wanted is not None and simulated_time is not False:
                wanted.add("/clock")
            say(f"recording to {out}; Ctrl-C ends")
            choice = _TimeChoice(node, simulated_time)
            end = math.inf
            look = 0.0
            while not stop and (now := time.monotonic()) < end:
                if choice.look(now):
                    recorder.decide(bool(choice.simulated))
                    say(f"in {'simulated' if choice.simulated else 'wall'} time")
                if duration is not None and end == math.inf and choice.began(now):
                    end = now + duration
                if now >= look:
                    look = now + DISCOVERY_PERIOD
                    for topic, reason in recorder.add_new_topics(wanted):
                        say(f"not recorded: {topic}: {reason}")
                executor.spin_once(timeout_sec=min(0.2, end - now))
                writer.sync()
            recorder.close()
            total = sum(writer.counts.values())
    finally:
        rclpy.try_shutdown()
    say(f"{out}: {total} messages of {len(writer.counts)} topics, "
        f"{time.monotonic() - began:.0f} s")  # fmt: skip
    return total


class _TimeChoice:
    """Simulated time if anyone publishes /clock, which may be discovered after other topics."""

    def __init__(self, node: "Node", simulated: bool | None) -> None:
        self.simulated = simulated
        self._node = node
        self._told = False
        self._born = time.monotonic()
        self._deadline = math.inf

    def look(self, now: float) -> bool:
        """Whether it has just been decided."""
        if self._told:
            return False
        if self.simulated is None:
            if self._node.count_publishers("/clock"):
                self.simulated = True
            elif now > self._deadline:
                self.simulated = False
            elif self._deadline == math.inf and _others_publish(self._node):
                self._deadline = now + CLOCK_PERIOD
        self._told = self.simulated is not None
        return self._told

    def began(self, now: float) -> bool:
        """Whether the recording's duration counts from now on."""
        return self._told or now > self._born + NOBODY_PERIOD


def _others_publish(node: "Node") -> bool:
    own = {topic for topic, _ in node.get_publisher_names_and_types_by_node(
        node.get_name(), node.get_namespace())}  # fmt: skip
    return any(
        node.count_publishers(topic) for topic, _ in node.get_topic_names_and_types()
        if topic not in own
    )  # fmt: skip
