"""Commands from outside: velocity with its timeout, goals of the head, changes of parameters."""

from collections.abc import Mapping, Sequence

from nao_lipm_gait.head.gaze import PAN, TILT
from nao_lipm_gait.parameters import BY_NAME, NEEDS_RESET, GaitParameters
from nao_lipm_gait.runtime.inputs import TwistInput
from robot_core.errors import NaoGaitError
from robot_core.head_goals import Angles, Follow, Frame, Goal, LookAt, Search
from robot_core.message_checks import finite
from robot_core.robot import RobotDescription
from robot_core.types import STANDSTILL, Point3, VelocityCommand

SPEED_ABSURD = 10.0
"""[m/s] No command for a small humanoid: a wrong unit or a broken sender."""
TURN_ABSURD = 100.0
"""[rad/s]"""
DISTANCE_ABSURD = 1000.0
"""[m]"""
ANGLE_ABSURD = 100.0
"""[rad]"""
HEAD_MODES = ("search", "free")

# -- velocity --------------------------------------------------------------------------------------


def read_velocity(message: TwistInput) -> VelocityCommand:
    """Take the planar part of a twist.

    The other three components are ignored, but must be finite: a sender that has a NaN anywhere is
    broken.

    Raises:
        NaoGaitError: With the component that is refused.
    """
    for axis, value in zip("xyz", message.linear, strict=True):
        finite(value, f"cmd_vel linear.{axis}", SPEED_ABSURD, "m/s")
    for axis, value in zip("xyz", message.angular, strict=True):
        finite(value, f"cmd_vel angular.{axis}", TURN_ABSURD, "rad/s")
    return VelocityCommand(x=message.linear[0], y=message.linear[1], yaw=message.angular[2])


class VelocityInput:
    """Holds the last velocity command until it times out, on the clock of the sensor stamps.

    That clock stands still when the robot does, so a paused simulation does not time out, and runs
    are reproducible. With several senders the newest command counts.

    Args:
        timeout: [s].

    Attributes:
        timed_out: The last command was to move, and it is too old.
    """

    def __init__(self, timeout: float) -> None:
        self._timeout = round(timeout * 1e9)
        self.clear()

    def clear(self) -> None:
        """Forget the command."""
        self._command = STANDSTILL
        self._received: int | None = None
        self.timed_out = False

    def receive(self, command: VelocityCommand, now: int | None) -> None:
        """Keep a command.

        Args:
            command: The command.
            now: The newest sensor stamp [ns]; None before the first, the command's time then begins
                with the first frame.
        """
        self._command = command
        self._received = now
        self.timed_out = False

    def at(self, stamp: int) -> VelocityCommand:
        """The command for the frame of this stamp [ns]; standstill if the last one is too old."""
        if self._command.is_zero:
            return STANDSTILL
        if self._received is None:
            self._received = stamp
        if stamp - self._received > self._timeout:
            self._command = STANDSTILL
            self.timed_out = True
        return self._command

    def age(self, stamp: int) -> float | None:
        """Time [s] since the last command at `stamp` [ns]; None without one."""
        return None if self._received is None else (stamp - self._received) * 1e-9


# -- head ------------------------------------------------------------------------------------------


def head_angles(
    names: Sequence[str], position: Sequence[float], robot: RobotDescription
) -> Angles:
    """Read `~/head`: pan and tilt by the names of their joints, clipped to the joint limits.

    Raises:
        NaoGaitError: For other joints, or an angle that is not finite.
    """
    if sorted(names) != sorted((PAN, TILT)) or len(position) != 2:
        got = f"{', '.join(names)} with {len(position)} positions"
        raise NaoGaitError("~/head", got, f"{PAN} and {TILT} with a position each")
    found = dict(zip(names, position, strict=True))
    angles = []
    for name in (PAN, TILT):
        limit = robot.limits.get(name)
        if limit is None:
            raise NaoGaitError("~/head", name, f"a joint of {robot.name}")
        angle = finite(found[name], f"~/head position[{name}]", ANGLE_ABSURD, "rad")
        angles.append(min(max(angle, limit.lower), limit.upper))
    return Angles(*angles)


def head_point(topic: str, point: Point3, frame_id: str, robot: RobotDescription) -> LookAt:
    """Read `~/look_at` or `~/follow`.

    Args:
        topic: Name of the topic, for errors.
        point: x, y, z [m] in the frame of the header.
        frame_id: Frame of the header: one of the torso, `base_footprint` or `odom`.
        robot: Names its frames.

    Returns:
        The point to look at.

    Raises:
        NaoGaitError: For another frame, or a number that is not finite.
    """
    x, y, z = (
        finite(value, f"{topic} point.{axis}", DISTANCE_ABSURD, "m")
        for axis, value in zip("xyz", point, strict=True)
    )
    frames = {
        robot.torso_frame: Frame.TORSO,
        robot.base_frame: Frame.TORSO,
        Frame.FOOTPRINT.value: Frame.FOOTPRINT,
        Frame.ODOM.value: Frame.ODOM,
    }
    if frame_id not in frames:
        raise NaoGaitError(f"{topic} header.frame_id", frame_id, f"one of {', '.join(frames)}")
    return LookAt((x, y, z), frames[frame_id])


def head_follow(point: Point3, frame_id: str, robot: RobotDescription) -> Follow:
    """Read `~/follow`; see `head_point`."""
    seen = head_point("~/follow", point, frame_id, robot)
    return Follow(seen.point, seen.frame)


def head_mode(text: str) -> Goal | None:
    """Read `~/head_mode`.

    Returns:
        A search, or None to give the head back to the gait.

    Raises:
        NaoGaitError: For another text.
    """
    if text not in HEAD_MODES:
        raise NaoGaitError("~/head_mode", text, f"one of {', '.join(HEAD_MODES)}")
    return Search() if text == "search" else None


# -- parameters ------------------------------------------------------------------------------------


def with_changes(
    parameters: GaitParameters, changes: Mapping[str, object], busy: bool
) -> GaitParameters:
    """Apply changes to the gait's parameters, all or none.

    Args:
        parameters: Those of now.
        changes: Value by name; names of other parameters are left out.
        busy: The robot walks, or a motion moves or holds it.

    Returns:
        The changed parameters.

    Raises:
        NaoGaitError: For a bad value, or a change that needs a robot that stands still.
    """
    checked = {
        name: BY_NAME[name].check(value) for name, value in changes.items() if name in BY_NAME
    }
    changed = parameters.replace(**checked)
    needing = needing_restart(parameters, changed)
    if needing and busy:
        allowed = "no change while walking or in a motion; stand first"
        raise NaoGaitError(needing[0], getattr(changed, needing[0]), allowed)
    return changed


def needing_restart(before: GaitParameters, after: GaitParameters) -> list[str]:
    """Names of the changed parameters that take effect only when the gait restarts."""
    return [name for name in NEEDS_RESET if getattr(after, name) != getattr(before, name)]
