"""Every topic that a node or tool subscribes to gets messages that nobody should send.

The messages are made from their types: each field in turn becomes hostile. Each is refused, or
taken, in at most one short line, without an exception, much time or much memory; and whatever is
published then is finite. So are the values of parameters, and services are called in any order.
"""

import array
import contextlib
import gc
import io
import math
import resource
import socket
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from robot_core.ros.process import DomainClaim

LONGEST = 3000
"""[characters] of a line of the log."""
MEMORY = 300 * 2**20
"""[bytes] that all messages together may add to the address space of the process."""
TICK, SLOW = 0.02, 2.0
"""[s] of processor time for one message: of a node that has a tick, and of any other."""
TEXT = "\x1b[2J\n" * 200_000
MANY = 100_000
FLOATS = (math.nan, math.inf, -math.inf, 1e308, -1e30)


def hostile(message: Any, kind: type) -> Iterator[tuple[str, Any]]:
    """Names of fields, and the message with something hostile in them; it is as before again."""
    yield "unchanged", message
    for field, type_name in kind.get_fields_and_field_types().items():
        before = getattr(message, field)
        if hasattr(before, "get_fields_and_field_types"):
            for name, _ in hostile(before, type(before)):
                yield f"{field}.{name}", message
            continue
        for number, value in enumerate(odd(before, type_name)):
            setattr(message, field, value)
            yield f"{field} {number}", message
        setattr(message, field, before)


def odd(value: Any, type_name: str) -> Iterator[Any]:
    """Hostile values of a field, by its type in the interface."""
    if isinstance(value, bool):
        yield not value
    elif isinstance(value, int):
        sign = 0 if type_name.startswith("u") or type_name in ("byte", "octet") else 1
        bits = int("".join(filter(str.isdigit, type_name)) or 8)
        yield from (0, 2 ** (bits - sign) - 1, -sign * 2 ** (bits - 1))
    elif isinstance(value, float):
        yield from FLOATS
    elif isinstance(value, str):
        yield from ("", TEXT, "a/../b")
    elif isinstance(value, np.ndarray):
        yield from (np.full_like(value, each) for each in FLOATS)
    elif isinstance(value, array.array):
        one = array.array(value.typecode, [0])
        yield from (one[:0], value[:-1], one * (10 * MANY))
        if value.typecode in "df":
            yield from (array.array(value.typecode, [each] * len(value)) for each in FLOATS)
    elif isinstance(value, list):
        yield []
        if value:
            yield from (value[:-1], value * 2, value[:1] * MANY)
        if type_name.startswith("sequence<string"):
            yield from ([TEXT] * 2, [str(n) for n in range(MANY)])


def valid(message: Any, topic: str, robot: Any) -> Any:
    """A message that the node would use, as far as that can be said for any type."""
    from builtin_interfaces.msg import Time
    from geometry_msgs.msg import Pose
    from sensor_msgs.msg import PointField

    from nao_soccer.ros.vision_messages import PERCEPT_FIELDS

    if hasattr(message, "header"):
        message.header.stamp = Time(sec=1)
    kind = type(message).__name__
    if kind == "JointState":
        message.name = list(robot.joint_names)
        message.position = robot.stand_pose.tolist()
    elif kind == "Image":
        message.width, message.height, message.encoding, message.step = 320, 240, "rgb8", 960
        message.data = array.array("B", bytes(960 * 240))
    elif kind == "CameraInfo":
        message.width, message.height = 320, 240
        message.k = [300.0, 0.0, 160.0, 0.0, 300.0, 120.0, 0.0, 0.0, 1.0]
        message.d = array.array("d", [0.0])
    elif kind == "PointCloud2":
        message.header.frame_id, message.height, message.width = "base_footprint", 1, 9
        message.point_step, message.row_step = 32, 288
        message.fields = [PointField(name=name, datatype=7, count=1) for name in PERCEPT_FIELDS]
        message.data = array.array("B", bytes(288))
    elif kind == "PoseArray":
        message.poses = [Pose()]
    elif kind == "MarkerArray":
        from visualization_msgs.msg import Marker

        message.markers = [Marker(ns="com")]
    elif kind == "DiagnosticArray":
        from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

        message.status = [DiagnosticStatus(name="gait", values=[KeyValue(key="a", value="b")])]
    elif topic.endswith("scene_description"):
        message.data = SCENE
    elif topic.endswith("robot_description"):
        message.data = robot.urdf
    return message


TEXTS = ("[" * 100_000, "<robot>" * 50_000, "a: &a [*a]", "walk left " * 10_000, "/dev/zero")
"""More of what a String may hold."""


SCENE = (
    "{name: one, field: {}, goals: {}, ball: {}, robots: "
    "[{name: red1, team: red, number: 1, urdf: nao_h21_v33, pose: [-1.0, 0.0, 0.0]}]}"
)


def subjects(folder: Path, robot: Any) -> Iterator[tuple[str, Any, float, Callable[[], object]]]:
    """Name, node, [s] for a message, and what the process does after each message."""
    import rclpy
    from std_msgs.msg import String

    from gait_lab.analysis.bag import BagWriter
    from gait_lab.drive import calibrate, teach, teleop
    from gait_lab.record.recorder import TopicRecorder
    from gait_lab.view.viewer import Viewer, serve
    from lola_bridge.ros.node import LolaBridgeNode
    from nao_lipm_gait.ros.node import GaitNode
    from nao_soccer.ros.player_node import PlayerNode
    from nao_soccer.ros.referee_node import RefereeNode
    from nao_soccer.ros.vision_node import VisionNode
    from sim_bridge.lola.node import LolaServerNode
    from sim_bridge.ros.node import BridgeNode
    from sim_bridge.trials.calibration_procedure import Procedure

    def nothing() -> None:
        pass

    yield "gait", GaitNode(), TICK, nothing
    bridge = BridgeNode()
    yield "sim_bridge", bridge, TICK, bridge.advance
    yield "vision", VisionNode(), SLOW, nothing
    yield "player", PlayerNode(), SLOW, nothing
    yield "referee", RefereeNode(), SLOW, nothing
    server_node = LolaServerNode()
    yield "lola_server", server_node, TICK, server_node.begin
    driver, link = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with driver, patch.object(LolaBridgeNode, "_connect", lambda _: link):
        yield "lola_bridge", LolaBridgeNode(), TICK, nothing
    tool = rclpy.create_node("tool")
    calibrate._RobotClient(tool, Procedure())
    teach._RobotClient(tool, robot)
    teleop._RobotClient(tool, stamped=False)
    yield "tools", tool, SLOW, nothing
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    page = rclpy.create_node("page")
    server = serve(port)
    viewer = Viewer(page, server)

    def drawn() -> None:
        viewer._next_frame = viewer._next_text = 0.0
        viewer.step()

    yield "view", page, SLOW, drawn
    viewer._on_scene(String(data=SCENE))
    yield "view of a scene", page, SLOW, drawn
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()
    recorded = rclpy.create_node("recorded")
    with BagWriter(folder / "bag") as writer:
        recorder = TopicRecorder(recorded, writer)
        recorder.add_new_topics()
        yield "record", recorded, SLOW, nothing
        recorder.close()


def inputs(node: Any, robot: Any) -> Iterator[tuple[str, Callable[[], None]]]:
    """Names of hostile messages for each subscription of a node, and the calls with them."""
    for subscription in list(node.subscriptions):
        info = [{"received_timestamp": 1, "source_timestamp": 1}]
        extra = info * subscription._callback_type.value
        for field, message in messages(subscription, robot):
            call = partial(subscription.callback, message, *extra)
            yield f"{subscription.topic_name}, {field}", call


def messages(subscription: Any, robot: Any) -> Iterator[tuple[str, Any]]:
    """Hostile messages for a subscription; as bytes for one that takes bytes."""
    from rclpy.serialization import serialize_message

    kind, topic = subscription.msg_type, subscription.topic_name
    for name, message in hostile(valid(kind(), topic, robot), kind):
        yield name, serialize_message(message) if subscription.raw else message
    if kind.__name__ == "String":
        for text in TEXTS:
            yield f"text {text[:9]}", serialize_message(kind(data=text)) if subscription.raw else (
                kind(data=text)
            )
    if subscription.raw:
        for length in range(9):
            yield f"{length} bytes", bytes(length)


def not_finite(message: Any) -> Iterator[str]:
    """Fields of a message, and of those in it, whose numbers are not finite."""
    for field in message.get_fields_and_field_types():
        value = getattr(message, field)
        parts = value if isinstance(value, list) else [value]
        if parts and hasattr(parts[0], "get_fields_and_field_types"):
            yield from (f"{field}.{name}" for part in parts for name in not_finite(part))
        elif isinstance(value, float | np.ndarray | array.array) and len(np.atleast_1d(value)):
            numbers = np.atleast_1d(value)
            if numbers.dtype.kind == "f" and not np.isfinite(numbers).all():
                yield field


VALUES = (
    *FLOATS, -1, 0, 2**63 - 1, True, "", TEXT, "a/../b", "/dev/zero", [1.0, math.nan], ["a"] * 1000,
)  # fmt: skip
"""Hostile values of a parameter."""


def requests(node: Any) -> Iterator[tuple[str, Callable[[], str]]]:
    """Names of services without arguments and of parameters, and calls that return what is said."""
    from rclpy.parameter import Parameter
    from std_srvs.srv import Trigger

    def set_and_back(name: str, value: Any) -> str:
        before = node.get_parameter(name)
        result = node.set_parameters_atomically([Parameter(name, value=value)])
        if result.successful:
            node.set_parameters_atomically([before])
        return str(result.reason)

    def called(service: Any) -> str:
        return str(service.callback(Trigger.Request(), Trigger.Response()).message)

    for service in node.services:
        if service.srv_type is Trigger:
            yield service.srv_name, partial(called, service)
    for name in sorted(node._parameters):
        for number, value in enumerate(VALUES):
            yield f"{name} {number}", partial(set_and_back, name, value)


def send_all(folder: Path, every: int) -> int:
    """Send each `every`-th message; prints what is wrong and the slowest, returns the number."""
    import rclpy
    from rclpy.impl.rcutils_logger import RcutilsLogger
    from rclpy.publisher import Publisher

    from robot_core.robot import load_robot
    from sim_bridge.trials.calibration_procedure import CalibrationError

    gc.disable()  # the nodes collect after their answers, what they made since their start
    lines: list[str] = []
    RcutilsLogger.log = lambda _, message, *__, **___: lines.append(message)
    Publisher.publish = lambda self, message: published.append((self.topic_name, message))
    published: list[tuple[str, Any]] = []
    parameters = (
        "sim_bridge:engine:=mujoco", "sim_bridge:ball:=true", "referee:scene:=pitch_small",
        "lola_server:engine:=mujoco", f"lola_server:socket:={folder}/lola",
    )  # fmt: skip
    rclpy.init(args=["--ros-args", *(word for each in parameters for word in ("-p", each))])
    robot, number, count, slowest = load_robot(), 0, 0, (0.0, "")
    for name, node, seconds, step in subjects(folder, robot):
        gc.freeze()
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, resource.RLIM_INFINITY))
        for what, call in chain(inputs(node, robot), requests(node)):
            number += 1
            if number % every:
                continue
            count += 1
            where = f"{name}, {what}"
            began, spent = time.thread_time(), 0.0
            try:
                lines.append(call() or "")
                spent = time.thread_time() - began
                step()
            except CalibrationError as error:  # `nao_gait calibrate` ends with this line
                lines.append(str(error))
            except Exception as error:
                last = traceback.extract_tb(error.__traceback__)[-1]
                print(f"{where}: {type(error).__name__} {error} {last.name}"[:300])
            slowest = max(slowest, (spent / seconds, where))
            if spent > seconds:
                print(f"{where}: {1e3 * spent:.0f} ms")
            for line in lines:
                if len(line) > LONGEST or not line.isprintable():
                    print(f"{where}: {line[:80]!r}")
            lines.clear()
            for topic, message in published:
                for field in not_finite(message):
                    print(f"{where}: {topic} {field} is not finite")
            published.clear()
        resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    print(f"the slowest message took {100 * slowest[0]:.0f} % of its time: {slowest[1]}")
    return count


@pytest.mark.parametrize("every", [11, pytest.param(1, marks=pytest.mark.slow)])
def test_hostile_messages_to_every_input_are_at_most_a_line_of_the_log(
    tmp_path: Path, every: int
) -> None:
    claim = DomainClaim()
    done = subprocess.run(
        [sys.executable, "-W", "error::RuntimeWarning", __file__, str(tmp_path), str(every)],
        env=claim.environment(), capture_output=True, text=True, check=False,
    )  # fmt: skip
    claim.release()
    *wrong, _slowest, count = done.stdout.splitlines() or ["", "0"]
    assert (wrong, done.returncode) == ([], 0), done.stderr
    assert int(count) * every > 2000


if __name__ == "__main__":
    print(send_all(Path(sys.argv[1]), int(sys.argv[2])))
