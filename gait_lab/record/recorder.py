"""Records ROS topics to a bag, stamped with simulated time where /clock is published.

All subscriptions are raw: nothing is decoded on the way, so that a busy machine keeps up.
"""

import importlib
import math
import struct
import time
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gait_lab.analysis.bag import BagWriter
from gait_lab.terminal import EXIT_FAILED, EXIT_OK
from robot_core.errors import NaoGaitError
from robot_core.ros.lockstep import UNTIL, LockstepPartner
from robot_core.ros.patience import ANSWER
from robot_core.ros.process import start_rclpy, stop_on_signal

if TYPE_CHECKING:
    from rclpy.node import Node

CLOCK = "rosgraph_msgs/msg/Clock"
IMAGE = "sensor_msgs/msg/Image"
HEADER = "std_msgs/Header"
DISCOVERY_PERIOD = 0.5
"""[s] of wall time between two searches for new topics."""
CLOCK_TIMEOUT = 5.0
"""[s] of wall time that /clock may be discovered later than the first other topic."""
START_TIMEOUT = 8.0
"""[s] of wall time without any topic, after which the duration of a recording counts."""
ANSWER_TIMEOUT = 60.0
"""[s] of wall time after which time may run on without the answer of a node, which may hang."""
LOCKSTEP = "lockstep"
"""Parameter by which a simulator says that it waits."""
KEPT_TICKS = 100_000
"""Ticks of the clock that are kept, 1000 s at 100 Hz."""
WAITING_MAX = 10_000
"""Messages that wait for a clock that stands still, as in a paused simulation; with more, all get
the time of its last tick."""

Write = Callable[[str, int, bytes], None]
"""Called with a topic, its time [ns] and a serialised message."""


class ClockOrder:
    """Gives every message the simulated time of its arrival, or its wall time without a clock.

    A busy recorder handles its messages topic by topic, so that a message handled after a tick of
    the clock may have arrived long before it. The middleware takes the arrival times; they decide.
    Messages that arrive before the first tick are held until there is a tick, or until
    `use_wall_time` says that there is no clock.

    Args:
        write: Called with each message and its time [ns].
    """

    def __init__(self, write: Write) -> None:
        self._write = write
        self._arrivals: list[int] = []
        self._ticks: list[int] = []
        self._waiting: list[tuple[int, int, str, bytes]] = []  # heap: arrival, number, topic, data
        self._number = 0
        self._wall = False

    @property
    def now(self) -> int | None:
        """The newest tick; None before the first."""
        return self._ticks[-1] if self._ticks else None

    def tick(self, topic: str, arrived: int, stamp: int, data: bytes) -> None:
        """Add a message of the clock.

        Args:
            topic: Topic of the clock.
            arrived: [ns] arrival on any steady clock.
            stamp: [ns] simulated time in the message.
            data: The serialised message.
        """
        self._arrivals.append(max(arrived, self._arrivals[-1] if self._arrivals else arrived))
        self._ticks.append(stamp)
        if len(self._ticks) > 2 * KEPT_TICKS:
            del self._arrivals[:KEPT_TICKS], self._ticks[:KEPT_TICKS]
        self._write(topic, stamp, data)
        while self._waiting and self._waiting[0][0] < self._arrivals[-1]:
            before, _, name, message = heappop(self._waiting)
            self._write(name, self._at(before), message)

    def message(self, topic: str, arrived: int, data: bytes) -> None:
        """Add another message; it is written once the clock has passed its arrival [ns]."""
        if self._wall:
            self._write(topic, arrived, data)
        elif not self._arrivals or arrived >= self._arrivals[-1]:
            self._number += 1
            heappush(self._waiting, (arrived, self._number, topic, data))
            if self._arrivals and len(self._waiting) > WAITING_MAX:
                self.flush()
        else:
            self._write(topic, self._at(arrived), data)

    def _at(self, arrived: int) -> int:
        return self._ticks[max(0, bisect_right(self._arrivals, arrived) - 1)]

    def use_wall_time(self) -> None:
        """Use the arrival times from now on, also for the messages that wait."""
        self._wall = True
        waiting, self._waiting = sorted(self._waiting), []
        for arrived, _, topic, data in waiting:
            self._write(topic, arrived, data)

    def flush(self) -> None:
        """Write what still waits, with the time 0 if there was no tick at all."""
        for arrived, _, topic, data in sorted(self._waiting):
            self._write(topic, self._at(arrived) if self._ticks else 0, data)
        self._waiting.clear()


def message_class(message_type: str) -> Any:
    """The Python class of `package/msg/Name`; ImportError if it is not installed."""
    package, _, name = message_type.partition("/msg/")
    try:
        return getattr(importlib.import_module(f"{package}.msg"), name)
    except AttributeError as error:
        raise ImportError(f"no message {message_type}") from error


def stamp_of(message: bytes) -> int | None:
    """[ns] at the begin of a serialised message: a rosgraph_msgs/Clock, or one with a header.

    None if it is too short to have one, or before 1970: anyone may send that.
    """
    if len(message) < 12:
        return None
    order = "<" if message[1] & 1 else ">"
    seconds, nanoseconds = struct.unpack_from(f"{order}iI", message, 4)
    return int(seconds) * 1_000_000_000 + int(nanoseconds) if seconds >= 0 else None


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic to record.

    Attributes:
        name: Absolute or relative to the recording node.
        type: `package/msg/Name`.
        latched: Transient local: a late subscriber gets the last message.
    """

    name: str
    type: str
    latched: bool = False


class StampGaps:
    """Counts the messages that are missing on topics of a fixed rate, by their stamps."""

    FIRST = 20
    """Intervals whose shortest is the period of a topic."""
    PAUSE = 500_000_000
    """[ns] A longer gap may be a pause, as of sensors after a reset; the clock has none."""
    REGULAR = 0.8
    """Share of the first intervals that are the shortest one, on a topic of a fixed rate."""

    def __init__(self) -> None:
        self._last: dict[str, int] = {}
        self._intervals: dict[str, list[int]] = {}
        self.missing: dict[str, int] = {}

    def add(self, topic: str, stamp: int) -> None:
        """Take the stamp [ns] of the newest message."""
        last, self._last[topic] = self._last.get(topic), stamp
        if last is None or stamp <= last:
            return  # sent again, or another start
        known, interval = self._intervals.setdefault(topic, []), stamp - last
        if len(known) < self.FIRST:
            known.append(interval)
            return
        period = min(known)
        if interval < 1.5 * period or (interval > self.PAUSE and topic != "/clock"):
            return
        if known.count(period) >= self.REGULAR * len(known):
            self.missing[topic] = self.missing.get(topic, 0) + round(interval / period) - 1

    def text(self) -> str:
        """What is missing, for the last line of a recording."""
        total = sum(self.missing.values())
        if not total:
            return ""
        worst = max(self.missing, key=lambda topic: self.missing[topic])
        return f"; {total} missing by the stamps, most of {worst} ({self.missing[worst]})"


class TopicRecorder:
    """Writes topics to a bag.

    Args:
        node: Subscribes.
        writer: The bag.
        simulated_time: Whether messages get the time of /clock; None if it is not known yet: they
            are held until /clock ticks or `decide` is called.
    """

    DEPTH = 5000
    """Messages that may wait while the recorder is busy."""

    def __init__(
        self, node: "Node", writer: BagWriter, *, simulated_time: bool | None = None
    ) -> None:
        self._node = node
        self._writer = writer
        self._simulated = simulated_time
        self._order = ClockOrder(writer.write)
        if simulated_time is False:
            self._order.use_wall_time()
        self._subscriptions: dict[str, tuple[Any, Callable[[bytes, Any], None]]] = {}
        self._types: dict[str, Any] = {}
        self._refused = {UNTIL}
        self._gaps = StampGaps()
        self._acquaintance = _Acquaintance(node)

    @property
    def topics(self) -> tuple[str, ...]:
        """The recorded topics."""
        return tuple(self._subscriptions)

    def connected(self) -> bool:
        """Whether nothing is lost from now on; asked again and again while time stands still.

        Each subscription has found its publishers, their nodes know of each subscription, and each
        robot is controlled: a gait that starts late has publishers that are not found yet.
        """
        heard = self._simulated is False or self._order.now is not None
        return (
            heard
            and all(
                self._node.count_publishers(name)
                for name, _ in self._node.get_topic_names_and_types()
                if name.endswith("/joint_command")
            )
            and all(
                subscription.get_publisher_count() >= self._node.count_publishers(name)
                for name, (subscription, _) in self._subscriptions.items()
            )
            and self._acquaintance.complete(self.topics)
        )

    @property
    def missing(self) -> str:
        """What is missing by the stamps, as the end of a sentence; empty if nothing is."""
        return self._gaps.text()

    @property
    def now(self) -> float:
        """[s] the newest simulated time; 0 before the first tick of the clock."""
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
        if topic.type == CLOCK or cls.get_fields_and_field_types().get("header") == HEADER:
            handler = self._counting(name, handler)
        self._types[name] = cls
        self._subscriptions[name] = (
            self._node.create_subscription(cls, name, handler, qos, raw=True), handler
        )  # fmt: skip

    def add_new_topics(
        self, wanted: set[str] | None = None, *, images: bool = True
    ) -> list[tuple[str, str]]:
        """Subscribe to the topics that have appeared.

        Args:
            wanted: Only these; None for all.
            images: Whether images are recorded that are not in `wanted`.

        Returns:
            (topic, reason) for each topic that cannot be recorded; each one once.
        """
        from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

        refused = []
        found = self._node.get_topic_names_and_types()
        for name, types in sorted(found, key=lambda topic: topic[1][0] == CLOCK):
            if name in self._subscriptions or name in self._refused:
                continue
            if wanted is not None and name not in wanted:
                continue
            if wanted is None and not images and types[0] == IMAGE:
                self._refused.add(name)
                refused.append((name, "an image; --images records them"))
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
        def tick(data: bytes, info: Any) -> None:
            stamp = stamp_of(data)
            if stamp is not None:
                self._order.tick(name, _arrival(info), stamp, data)

        if is_clock and self._simulated is not False:
            return tick
        return lambda data, info: self._order.message(name, _arrival(info), data)

    def _counting(
        self, name: str, handler: Callable[[bytes, Any], None]
    ) -> Callable[[bytes, Any], None]:
        """The handler of messages that begin with a stamp, counting those that are missing."""

        def handle(data: bytes, info: Any) -> None:
            stamp = stamp_of(data)
            if stamp is not None:
                self._gaps.add(name, stamp)
            handler(data, info)

        return handle

    def decide(self, simulated_time: bool) -> None:
        """Choose the time if it was not given."""
        self._simulated = simulated_time
        if not simulated_time:
            self._order.use_wall_time()

    def close(self) -> None:
        """Take what has arrived and was not handled yet, then unsubscribe."""
        for name, (subscription, handle) in self._subscriptions.items():
            with subscription.handle:
                while (taken := subscription.handle.take_message(self._types[name], True)):
                    handle(*taken)
            self._node.destroy_subscription(subscription)
        self._subscriptions.clear()
        if self._simulated is None and self._order.now is None:
            self._order.use_wall_time()
        self._order.flush()


class _Acquaintance:
    """Whether the nodes that publish and this node know of each other.

    A node hears of another one's subscriptions and clients in the order in which they are made, and
    can answer only a client that it knows. So a client is made after the subscriptions, and asks.
    """

    def __init__(self, node: "Node") -> None:
        self._node = node
        self._topics: tuple[str, ...] = ()
        self._asked: dict[str, _Question] = {}

    def complete(self, topics: tuple[str, ...]) -> bool:
        """Ask who has not answered yet; whether all have since the last topic was added."""
        if topics != self._topics:
            self._topics = topics
            for question in self._asked.values():
                question.close()
            self._asked.clear()
        publishers = {
            (each.node_namespace, each.node_name)
            for topic in topics for each in self._node.get_publishers_info_by_topic(topic)
        }  # fmt: skip
        return all([self._knows(*each) for each in publishers])

    @property
    def waits(self) -> bool:
        """Whether a node that has answered is a simulator in lockstep."""
        return any(question.lockstep for question in self._asked.values())

    def _knows(self, namespace: str, name: str) -> bool:
        service = f"{namespace.rstrip('/')}/{name}/get_parameters"
        if service not in self._asked:
            self._asked[service] = _Question(self._node, service)
        return self._asked[service].answered(time.monotonic())


class _Question:
    """Asks a service that each ROS node has, unless it has no parameters, until it answers.

    A node whose service is not discovered within `ANSWER` is left out.
    """

    def __init__(self, node: "Node", service: str) -> None:
        from rcl_interfaces.srv import GetParameters

        self._node = node
        # The name of a node may be discovered later than its publishers.
        named = service.startswith("/")
        self._client = node.create_client(GetParameters, service) if named else None
        self._request = GetParameters.Request(names=[LOCKSTEP])
        self._answers: list[Any] = []
        self._end = time.monotonic() + ANSWER
        self._again = 0.0

    @property
    def lockstep(self) -> bool:
        """Whether the answer is that of a simulator in lockstep."""
        done = (answer.result() for answer in self._answers if answer.done())
        return any(value.bool_value for result in done if result for value in result.values)

    def answered(self, now: float) -> bool:
        """Whether it has, or is no longer waited for."""
        if any(answer.done() for answer in self._answers) or now > self._end:
            return True
        if now > self._again and self._client is not None and self._client.service_is_ready():
            self._end = self._end if self._answers else now + ANSWER_TIMEOUT
            self._again = now + DISCOVERY_PERIOD
            self._answers.append(self._client.call_async(self._request))  # an answer may be lost
        return False

    def close(self) -> None:
        """End it."""
        if self._client is not None:
            self._node.destroy_client(self._client)


def _arrival(info: Any) -> int:
    """[ns] wall time at which the middleware received a message."""
    return int(info["received_timestamp"]) or time.time_ns()


def command(bag: Path | None, out: Path, topics: Sequence[str], **options: Any) -> int:
    """Record; the exit status: success only with a message."""
    return EXIT_OK if record(bag or out, topics=tuple(topics), **options) else EXIT_FAILED


def record(
    out: Path,
    *,
    topics: tuple[str, ...] = (),
    duration: float | None = None,
    simulated_time: bool | None = None,
    storage: str = "mcap",
    images: bool = False,
    say: Callable[[str], None] = print,
) -> int:
    """Record until Ctrl-C or for a duration; the number of messages.

    Args:
        out: The new folder of the bag.
        topics: Only these; all that appear if empty.
        duration: [s] of wall time, from when it records; None for no limit.
        simulated_time: Whether to use the time of /clock; None to use it if it is published.
        storage: `mcap` or `sqlite3`.
        images: Images are recorded, too.
        say: Prints a line.

    Raises:
        NaoGaitError: A topic, the duration or the folder is refused.
    """
    import rclpy
    from rclpy.executors import SingleThreadedExecutor

    from gait_lab.ros_session import checked_topics

    topics = checked_topics(topics)
    start_rclpy()
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
            lockstep = LockstepPartner(node)
            say(f"recording to {out}; Ctrl-C ends")
            choice = ClockChoice(node, simulated_time)
            joined = records = False
            end = math.inf
            search = 0.0

            def subscribe() -> None:
                nonlocal search
                search = time.monotonic() + DISCOVERY_PERIOD
                for topic, reason in recorder.add_new_topics(wanted, images=images):
                    say(f"not recorded: {topic}: {reason}")

            def subscribed() -> bool:
                """Subscribe while the simulator waits; whether it may go on."""
                nonlocal records
                subscribe()
                records = recorder.connected()
                return records

            while not stop and (now := time.monotonic()) < end:
                if choice.update(now):
                    recorder.decide(bool(choice.simulated))
                    say(f"in {'simulated' if choice.simulated else 'wall'} time")
                if duration is not None and end == math.inf and (records or choice.in_vain(now)):
                    end = now + duration
                if lockstep.active and not joined:
                    joined, search = True, now + START_TIMEOUT
                    lockstep.hold(subscribed)
                elif now >= search and (joined or choice.may_subscribe(now)):
                    subscribe()
                    records = records or not joined
                executor.spin_once(timeout_sec=min(0.2, end - now))
                writer.sync()
            recorder.close()
            lockstep.leave()  # not sooner: a simulator that runs on outpaces a busy recorder
            total = sum(writer.counts.values())
    finally:
        rclpy.try_shutdown()
    say(f"{out}: {total} messages of {len(writer.counts)} topics, "
        f"{time.monotonic() - began:.0f} s of wall time{recorder.missing}")  # fmt: skip
    if not total:
        say("nothing was published in this ROS domain (ROS_DOMAIN_ID): does the robot run?")
    return total


class ClockChoice:
    """Chooses simulated time if /clock is published; it may be discovered after other topics."""

    def __init__(self, node: "Node", simulated: bool | None) -> None:
        self.simulated = simulated
        self._node = node
        self._simulator = _Acquaintance(node)
        self._decided = False
        self._created = time.monotonic()
        self._deadline = math.inf
        self._subscribe = math.inf

    def update(self, now: float) -> bool:
        """True in the call that decides."""
        if self._decided:
            return False
        if self.simulated is None:
            if self._node.count_publishers("/clock"):
                self.simulated = True
            elif now > self._deadline:
                self.simulated = False
            elif self._deadline == math.inf and _anything_else(self._node):
                self._deadline = now + CLOCK_TIMEOUT
        self._decided = self.simulated is not None
        return self._decided

    def may_subscribe(self, now: float) -> bool:
        """Whether to subscribe; not before a simulator in lockstep can be asked to wait."""
        if self._subscribe == math.inf and self._decided:
            if not self.simulated:
                self._subscribe = now
            elif self._node.count_publishers("/clock"):
                if self._simulator.complete(("/clock",)):
                    self._subscribe = now + (ANSWER_TIMEOUT if self._simulator.waits else 0.0)
            elif now > self._created + 2.0 * START_TIMEOUT:
                self._subscribe = now  # nobody publishes the clock that was asked for
        return now >= self._subscribe

    def in_vain(self, now: float) -> bool:
        """Whether the duration of the recording counts although nothing is recorded yet."""
        return now > self._created + (ANSWER_TIMEOUT if self._decided else START_TIMEOUT)


def _anything_else(node: "Node") -> bool:
    own = {topic for topic, _ in node.get_publisher_names_and_types_by_node(
        node.get_name(), node.get_namespace())}  # fmt: skip
    return any(
        node.count_publishers(topic) for topic, _ in node.get_topic_names_and_types()
        if topic not in own
    )  # fmt: skip
