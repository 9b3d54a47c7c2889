"""Teach-in: poses of the robot, moved by hand, become a motion file; the gait plays such a file.

`Lesson` is the part without ROS; `record` and `play` connect it to a terminal and to the nodes.
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

from gait_lab.ros_session import ros_node
from robot_core.errors import NaoGaitError
from robot_core.joint_limits import JointLimits
from robot_core.motion.check import fastest
from robot_core.motion.joints import HEAD, joint_groups
from robot_core.motion.keyframes import Interpolation, Posture
from robot_core.motion.library import shipped_library
from robot_core.motion.motion_file import STAND, load_motions
from robot_core.robot import RobotDescription, load_robot
from robot_core.ros.patience import ANSWER
from robot_core.ros.process import stop_on_signal
from robot_core.schema import is_name
from robot_core.types import IN_MOTION, FloatArray, GaitState, state_of

if TYPE_CHECKING:
    from rclpy.node import Node

POSE_TIME = 1.0
"""Default time to a pose [s]."""
PLAY_FACTOR = 20.0
"""Limit of the wall time of a motion, as a multiple of its duration."""
HELP = """\
Move the robot and press Enter for each pose:   [NAME] [SECONDS]
  an empty line: the next pose, 1 s after the one before; q: write the file and end"""


@dataclass(slots=True)
class Lesson:
    """The poses that were taught so far.

    Attributes:
        poses: Joint angles (n,) [rad] by the name of the pose.
        order: Names of the poses in their order, with the time to each [s].
    """

    robot: RobotDescription
    with_head: bool = False
    poses: dict[str, FloatArray] = field(default_factory=dict)
    order: list[tuple[str, float]] = field(default_factory=list)

    def show(self, line: str, position: FloatArray) -> str:
        """Add a pose.

        A name that was used before replaces that pose; the motion then contains it twice.

        Args:
            line: Optional name and optional time [s], as typed.
            position: Joint angles (n,) [rad].

        Raises:
            NaoGaitError: If the line is not understood.
        """
        words = line.split()
        name, seconds = f"pose_{len(self.order) + 1}", POSE_TIME
        if words and not _is_number(words[0]):
            name = words.pop(0)
        if words:
            seconds = float(words.pop(0)) if _is_number(words[0]) else math.nan
        if words or not is_name(name) or name == STAND or not 0.02 <= seconds <= 60.0:
            raise NaoGaitError("pose", line, "[a name of lowercase letters] [seconds, 0.02 to 60]")
        self.poses[name] = self._within_limits(position)
        self.order.append((name, seconds))
        return f"{name}, {seconds:g} s"

    def document(self, meaning: str, starts: Posture, ends: Posture) -> str:
        """Return the text of the motion file, with times long enough for every joint.

        Raises:
            NaoGaitError: If no pose was taught.
        """
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
            rows.append({"pose": STAND, "time": POSE_TIME})
        head = {"meaning": meaning, "starts": starts.value, "ends": ends.value}
        poses = {name: self._named(pose) for name, pose in self.poses.items()}
        return yaml.safe_dump(
            {**head, "poses": poses, "keyframes": rows}, sort_keys=False,
            default_flow_style=None, width=100,
        )  # fmt: skip

    def _within_limits(self, position: FloatArray) -> FloatArray:
        """Clip to the joint limits, which encoders may exceed; one angle for a shared motor."""
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


def listing(urdf: str, say: Callable[[str], None]) -> None:
    """List all shipped motions of a robot."""
    robot = load_robot(urdf)
    motions = shipped_library(robot).motions
    lines = [f"motions of {robot.name}:"]
    lines += [
        f"  {name:22} {motion.starts.value:12} {motion.time:5.1f} s  {motion.meaning}"
        for name, motion in sorted(motions.items())
    ]
    say("\n".join(lines if motions else [*lines, "  none"]))


def check(path: Path, urdf: str, say: Callable[[str], None]) -> None:
    """List the motions of a file; NaoGaitError if the robot cannot execute them."""
    for motion in load_motions(path, load_robot(urdf)):
        say(f"{motion.name}: {len(motion.keyframes)} keyframes, {motion.time:.2f} s")


# -- with the running nodes ------------------------------------------------------------------------


class _RobotClient:
    """Joint states and the gait's state in, requests out."""

    def __init__(self, node: "Node", robot: RobotDescription) -> None:
        from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
        from sensor_msgs.msg import JointState
        from std_msgs.msg import String
        from std_srvs.srv import Trigger

        self._node, self._robot = node, robot
        self._text, self._trigger = String, Trigger
        node.create_subscription(JointState, "joint_states", self._on_joints,
                                 qos_profile_sensor_data)  # fmt: skip
        # Not only the newest: a short motion may be over before its begin is looked at.
        states = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        node.create_subscription(String, "gait/support", self._on_state, states)
        self._motion = node.create_publisher(String, "gait/motion", 10)
        self.position: FloatArray | None = None
        self.state: GaitState | None = None
        self.states: list[GaitState] = []

    def _on_joints(self, message: Any) -> None:
        found = dict(zip(message.name, message.position, strict=False))
        if all(name in found for name in self._robot.joint_names):
            self.position = np.array([found[name] for name in self._robot.joint_names])

    def _on_state(self, message: Any) -> None:
        state = state_of(message.data)
        if state is not None:
            self.state = state
            self.states.append(state)

    def spin_until(self, done: Callable[[], bool], seconds: float) -> bool:
        """Process messages until `done`, for at most `seconds` of wall time; return `done`."""
        import rclpy

        end = time.monotonic() + seconds
        with stop_on_signal() as stop:
            while not (stop or done()) and time.monotonic() < end:
                rclpy.spin_once(self._node, timeout_sec=0.05)
        if stop:
            raise KeyboardInterrupt
        return done()

    def relax(self) -> None:
        """Take the torque off the joints."""
        client = self._node.create_client(self._trigger, "gait/relax")
        if not self.spin_until(client.service_is_ready, ANSWER):
            raise NaoGaitError("gait/relax", "no answer", "a running gait")
        future = client.call_async(self._trigger.Request())
        self.spin_until(future.done, ANSWER)

    def ask_for(self, motion: str) -> None:
        """Request a motion by name or file."""
        if not self.spin_until(lambda: self._motion.get_subscription_count() > 0, ANSWER):
            raise NaoGaitError("gait/motion", "no subscriber", "a running gait")
        self._motion.publish(self._text(data=motion))


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
    """Teach poses until q or the end of the input, and write them as a motion.

    Args:
        path: File to write, named as the motion.
        urdf: Name or file of the robot.
        meaning: What the motion is for.
        starts: Posture before the motion.
        ends: Posture after the motion.
        stiff: Whether the joints stay stiff; by default the robot is relaxed.
        head: Whether the motion moves the head.
        namespace: Namespace of the robot; "" for none.
        lines: Input, one line per pose.
        say: Prints a line.

    Raises:
        NaoGaitError: If the name of the file or a posture is invalid, if no robot answers, or if
            the motion cannot be executed.
    """
    if not is_name(path.stem) or path.suffix != ".yaml":
        raise NaoGaitError(
            "file", str(path), "a name of lowercase letters, digits and _ with .yaml"
        )
    postures = _posture("starts", starts), _posture("ends", ends)
    lesson = Lesson(load_robot(urdf), with_head=head)
    with ros_node("nao_gait_teach", namespace) as node:
        client = _RobotClient(node, lesson.robot)
        if not client.spin_until(lambda: client.position is not None, ANSWER):
            raise NaoGaitError("joint_states", "none", f"all joints of {lesson.robot.name}")
        if not stiff:
            client.relax()
            say("The robot is limp: hold it.")
        say(HELP)
        for line in lines:
            if line.strip() == "q":
                break
            client.spin_until(lambda: False, 0.2)  # queued messages are older than the pose
            try:
                if client.position is not None:
                    say(lesson.show(line, client.position))
            except NaoGaitError as error:
                say(str(error))
        path.parent.mkdir(parents=True, exist_ok=True)
        text = lesson.document(meaning or f"taught on {lesson.robot.name}", *postures)
        path.write_text(text, encoding="utf-8")
        load_motions(path, lesson.robot)  # refuses what the robot cannot execute
        say(f"wrote {path}: {len(lesson.order)} poses")


def play(
    path: Path,
    *,
    urdf: str = "nao_h21_v33",
    namespace: str = "",
    say: Callable[[str], None] = print,
) -> None:
    """Check a file, have the running gait play it, and wait for its end.

    Args:
        path: The motion file.
        urdf: Name or file of the robot.
        namespace: Namespace of the robot; "" for none.
        say: Prints a line.

    Raises:
        NaoGaitError: If the file is invalid, if no gait answers, or if the gait refuses the motion,
            does not end it in time, or falls.
    """
    robot = load_robot(urdf)
    motion = load_motions(path, robot)[0]
    with ros_node("nao_gait_teach", namespace) as node:
        client = _RobotClient(node, robot)
        if not client.spin_until(lambda: bool(client.state), ANSWER):
            raise NaoGaitError("gait/support", "nothing", "a running gait with sensors")
        client.states.clear()
        client.ask_for(str(path.resolve()))

        def began() -> bool:
            return any(state in IN_MOTION for state in client.states)

        if not client.spin_until(began, ANSWER):
            raise NaoGaitError(
                "motion", motion.name, f"one that starts {motion.starts} (the gait is in "
                f"{client.state}; its log says why)",
            )  # fmt: skip
        say(f"{motion.name}: {motion.time:.1f} s ...")
        held = motion.ends is Posture.SITTING

        def over() -> bool:
            return client.state not in IN_MOTION

        limit = motion.time if held else PLAY_FACTOR * motion.time + ANSWER
        ended = client.spin_until(over, limit)
        if not (ended or held):
            raise NaoGaitError("motion", motion.name, "a motion that ends within its time limit")
        if client.state is GaitState.FALLEN:
            raise NaoGaitError("motion", motion.name, "a motion that does not make the robot fall")
        say(f"{motion.name}: done, the gait is in {client.state}")


def _posture(name: str, text: str) -> Posture:
    try:
        return Posture(text)
    except ValueError:
        allowed: Sequence[str] = [posture.value for posture in Posture]
        raise NaoGaitError(name, text, allowed) from None
