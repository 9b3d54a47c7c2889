"""Teach-in: poses of the robot, moved by hand, become a motion file; a file is played by the gait.

The pure part is `Lesson`; `record` and `play` put it between a terminal and the running nodes.
"""

import math
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.motion.check import fastest
from nao_lipm_gait.motion.joints import HEAD, joint_groups
from nao_lipm_gait.motion.keyframes import Interpolation, Motion, Posture
from nao_lipm_gait.motion.library import shipped_library
from nao_lipm_gait.motion.motion_file import STAND, load_motions
from nao_lipm_gait.robot import RobotDescription, load_robot
from nao_lipm_gait.ros.process import stay_local, stop_on_signal
from nao_lipm_gait.schema import is_name
from nao_lipm_gait.types import FloatArray
from nao_lipm_gait.whole_body.joint_limits import JointLimits

if TYPE_CHECKING:
    from rclpy.node import Node

TIME = 1.0
"""[s] to a pose, unless the teacher says otherwise."""
WAIT = 10.0
"""[s] of wall time for a first answer of the running nodes."""
PLAY_FACTOR = 20.0
"""A motion may take this many times its own time on the wall clock."""
HELP = """\
Move the robot and press Enter for each pose:   [NAME] [SECONDS]
  an empty line: the next pose, 1 s after the one before; q: write the file and end"""


@dataclass(slots=True)
class Lesson:
    """The poses that were shown so far."""

    robot: RobotDescription
    with_head: bool = False
    poses: dict[str, FloatArray] = field(default_factory=dict)
    """Name -> (n,) [rad]."""
    order: list[tuple[str, float]] = field(default_factory=list)
    """Names with the time [s] to get there."""

    def show(self, line: str, position: FloatArray) -> str:
        """Take a pose (n,) [rad], under what the line says; what was understood, in words.

        A name that was shown before is shown anew: one pose, twice in the motion.
        """
        words = line.split()
        name, seconds = f"pose_{len(self.order) + 1}", TIME
        if words and not _is_number(words[0]):
            name = words.pop(0)
        if words:
            seconds = float(words.pop(0)) if _is_number(words[0]) else math.nan
        if words or not is_name(name) or name == STAND or not 0.02 <= seconds <= 60.0:
            raise NaoGaitError("pose", line, "[a name of small letters] [seconds, 0.02 to 60]")
        self.poses[name] = self._possible(position)
        self.order.append((name, seconds))
        return f"{name}, {seconds:g} s"

    def document(self, meaning: str, starts: Posture, ends: Posture) -> str:
        """The motion file; times that are too short for a joint are made long enough."""
        if not self.order:
            raise NaoGaitError("poses", "none", "at least one pose")
        rows: list[dict[str, Any]] = []
        before: FloatArray | None = None
        for name, seconds in self.order:
            pose = self.poses[name]
            if before is not None:
                needed = fastest(pose - before, Interpolation.CUBIC, self.robot)
                seconds = max(seconds, math.ceil(needed * 100.0 + 1.0) / 100.0)
            rows.append({"pose": name, "time": round(seconds, 2)})
            before = pose
        if ends is Posture.STANDING:
            rows.append({"pose": STAND, "time": TIME})
        head = {"meaning": meaning, "starts": starts.value, "ends": ends.value}
        poses = {name: self._named(pose) for name, pose in self.poses.items()}
        return yaml.safe_dump(
            {**head, "poses": poses, "keyframes": rows}, sort_keys=False,
            default_flow_style=None, width=100,
        )  # fmt: skip

    def _possible(self, position: FloatArray) -> FloatArray:
        """Encoders may say a little more than a limit allows, and two legs of one motor differ."""
        robot = self.robot
        pose = np.clip(np.asarray(position, dtype=float), robot.lower, robot.upper)
        inwards = pose > 0.5 * (robot.lower + robot.upper)
        pose = np.where(inwards, np.floor(pose * 1000.0), np.ceil(pose * 1000.0)) / 1000.0
        JointLimits(robot).cut(pose)  # the ankle's roll limit depends on its pitch
        for leader, follower in robot.coupled_joints:
            pose[robot.index(follower)] = pose[robot.index(leader)]
        return pose

    def _named(self, pose: FloatArray) -> dict[str, float]:
        left_out = () if self.with_head else joint_groups(self.robot)[HEAD]
        return {
            name: round(float(pose[index]), 6)
            for index, name in enumerate(self.robot.joint_names) if index not in left_out
        }  # fmt: skip


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def listing(urdf: str) -> str:
    """All shipped motions of a robot."""
    robot = load_robot(urdf)
    motions = shipped_library(robot).motions
    lines = [f"motions of {robot.name}:"]
    lines += [
        f"  {name:22} {motion.starts.value:12} {motion.time:5.1f} s  {motion.meaning}"
        for name, motion in sorted(motions.items())
    ]
    return "\n".join(lines if motions else [*lines, "  none"])


def check(path: Path, urdf: str) -> tuple[Motion, ...]:
    """The motions of a file; NaoGaitError if it could not run."""
    return load_motions(path, load_robot(urdf))


# -- with the running nodes ------------------------------------------------------------------------


class _Link:
    """Joint states and the gait's state in, requests out."""

    def __init__(self, node: "Node", robot: RobotDescription) -> None:
        from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
        from sensor_msgs.msg import JointState
        from std_msgs.msg import String
        from std_srvs.srv import Trigger

        self._node, self._robot = node, robot
        self._text, self._trigger = String, Trigger
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        node.create_subscription(JointState, "joint_states", self._on_joints,
                                 qos_profile_sensor_data)  # fmt: skip
        node.create_subscription(String, "gait/support", self._on_state, latched)
        self._motion = node.create_publisher(String, "gait/motion", 10)
        self.position: FloatArray | None = None
        self.state = ""
        self.states: list[str] = []

    def _on_joints(self, message: Any) -> None:
        found = dict(zip(message.name, message.position, strict=False))
        if all(name in found for name in self._robot.joint_names):
            self.position = np.array([found[name] for name in self._robot.joint_names])

    def _on_state(self, message: Any) -> None:
        self.state = message.data.split()[0]
        self.states.append(self.state)

    def spin_until(self, done: Callable[[], bool], seconds: float) -> bool:
        import rclpy

        end = time.monotonic() + seconds
        with stop_on_signal() as stop:
            while not (stop or done()) and time.monotonic() < end:
                rclpy.spin_once(self._node, timeout_sec=0.05)
        if stop:
            raise KeyboardInterrupt
        return done()

    def relax(self) -> None:
        client = self._node.create_client(self._trigger, "gait/relax")
        if not self.spin_until(client.service_is_ready, WAIT):
            raise NaoGaitError("gait/relax", "no answer", "a running gait")
        future = client.call_async(self._trigger.Request())
        self.spin_until(future.done, WAIT)

    def ask_for(self, motion: str) -> None:
        if not self.spin_until(lambda: self._motion.get_subscription_count() > 0, WAIT):
            raise NaoGaitError("gait/motion", "no subscriber", "a running gait")
        self._motion.publish(self._text(data=motion))


def _with_nodes(namespace: str, urdf: str, work: Callable[[_Link], None]) -> None:
    import rclpy
    from rclpy.signals import SignalHandlerOptions

    from gait_lab.drive.ros_names import checked_namespace

    stay_local()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = rclpy.create_node("nao_gait_teach", namespace=checked_namespace(namespace))
        work(_Link(node, load_robot(urdf)))
    finally:
        rclpy.try_shutdown()


def record(
    path: Path,
    *,
    urdf: str = "nao_h21_v33",
    meaning: str = "",
    starts: str = "standing",
    ends: str = "standing",
    stiff: bool = False,
    head: bool = False,
    namespace: str = "",
    lines: Iterable[str] = sys.stdin,
    say: Callable[[str], None] = print,
) -> None:
    """Show poses until q or the end of the input, and write them as a motion."""
    if not is_name(path.stem) or path.suffix != ".yaml":
        raise NaoGaitError("file", str(path), "a name of small letters, digits and _ with .yaml")
    postures = _posture("starts", starts), _posture("ends", ends)

    def work(link: _Link) -> None:
        lesson = Lesson(load_robot(urdf), with_head=head)
        if not link.spin_until(lambda: link.position is not None, WAIT):
            raise NaoGaitError("joint_states", "none", f"all joints of {lesson.robot.name}")
        if not stiff:
            link.relax()
            say("The robot is limp: hold it.")
        say(HELP)
        for line in lines:
            if line.strip() == "q":
                break
            link.spin_until(lambda: False, 0.2)  # what lies in the queue is older than the pose
            try:
                if link.position is not None:
                    say(lesson.show(line, link.position))
            except NaoGaitError as error:
                say(str(error))
        path.parent.mkdir(parents=True, exist_ok=True)
        text = lesson.document(meaning or f"taught on {lesson.robot.name}", *postures)
        path.write_text(text, encoding="utf-8")
        check(path, urdf)
        say(f"wrote {path}: {len(lesson.order)} poses")

    _with_nodes(namespace, urdf, work)


def play(
    path: Path,
    *,
    urdf: str = "nao_h21_v33",
    namespace: str = "",
    say: Callable[[str], None] = print,
) -> None:
    """Check a file, have the running gait play it, and wait until it is over."""
    motion = check(path, urdf)[0]

    def work(link: _Link) -> None:
        if not link.spin_until(lambda: bool(link.state), WAIT):
            raise NaoGaitError("gait/support", "nothing", "a running gait with sensors")
        link.states.clear()
        link.ask_for(str(path.resolve()))
        moving = ("motion", "getting_up")
        if not link.spin_until(lambda: any(s in moving for s in link.states), WAIT):
            raise NaoGaitError(
                "motion", motion.name, f"one that starts {motion.starts} (the gait is in "
                f"{link.state}; its log says why)",
            )  # fmt: skip
        say(f"{motion.name}: {motion.time:.1f} s ...")
        held = motion.ends is Posture.SITTING

        def over() -> bool:
            return link.state not in moving

        ended = link.spin_until(over, motion.time if held else PLAY_FACTOR * motion.time + WAIT)
        if not (ended or held):
            raise NaoGaitError("motion", motion.name, "an end in time")
        if link.state == "fallen":
            raise NaoGaitError("motion", motion.name, "a robot that does not fall")
        say(f"{motion.name}: done, the gait is in {link.state}")

    _with_nodes(namespace, urdf, work)


def _posture(name: str, text: str) -> Posture:
    try:
        return Posture(text)
    except ValueError:
        allowed: Sequence[str] = [posture.value for posture in Posture]
        raise NaoGaitError(name, text, f"one of {', '.join(allowed)}") from None
