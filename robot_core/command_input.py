"""From the numbers of `joint_command` and `push` messages to joint targets and forces.

Plain data in and out, no ROS types. Everything that is refused raises NaoGaitError.
"""

from collections.abc import Sequence

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.message_checks import finite, repeated, some
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray, JointTargets

PUSH_ABSURD = 2000.0
"""[N] Largest force of a push; more is a wrong unit or a broken sender."""
TAKE_OVER = 0.2
"""[s] of simulated time without a command from the gait in control, after which another gait may
take control."""
_LIMIT_ROUNDING = 1e-6
"""[rad] by which a target may exceed a joint limit without a warning."""


class CommandInput:
    """Joint targets from the commands of one gait at a time.

    Commands of two gaits mixed make the robot fall, so only one gait is in control. It loses
    control after `TAKE_OVER` without a command.
    """

    def __init__(self, robot: RobotDescription) -> None:
        self._robot = robot
        self._index = {name: index for index, name in enumerate(robot.joint_names)}
        self._position = robot.stand_pose.copy()
        self._stiffness = np.ones(len(robot.joint_names))
        self._names: list[str] | None = None
        self._places = np.zeros(0, dtype=np.intp)
        self._sender: str | None = None
        self._last_command = 0.0
        self._valid_from = 0

    def reset(self, stamp: int) -> None:
        """Go back to the stand pose; commands for sensors up to `stamp` [ns] no longer count."""
        self._position = self._robot.stand_pose.copy()
        self._stiffness = np.ones(len(self._position))
        self._valid_from = stamp

    def release(self) -> None:
        """Take control from the gait that has it; the next command gives it to its sender."""
        self._sender = None

    def admit(self, sender: str, now: float) -> None:
        """Check that this gait may command the robot.

        Args:
            sender: header.frame_id of the command; each gait has its own.
            now: Time [s] of the robot's clock, in a simulation the simulated time.

        Raises:
            NaoGaitError: Another gait is in control.
        """
        owner = self._sender
        if owner not in (None, sender) and now - self._last_command < TAKE_OVER:
            raise NaoGaitError(
                "joint_command header.frame_id",
                sender[:40],
                f"one gait at a time; {owner[:40]!r} is in control until it sends nothing for "
                f"{TAKE_OVER:g} s",
            )

    def read(
        self,
        sender: str,
        now: float,
        stamp: int,
        names: Sequence[str],
        position: Sequence[float],
        effort: Sequence[float],
    ) -> tuple[JointTargets | None, str | None]:
        """Read a command that was admitted; if it is usable, its sender is in control.

        Args:
            sender: As for `admit`.
            now: As for `admit`.
            stamp: [ns] of the sensors that the command answers; 0 = of none.
            names: Joints in any order; joints that are not named keep target and stiffness.
            position: [rad], one for each name.
            effort: Share of the motor torque that may be used, 0 to 1, one for each name; empty =
                1 for all.

        Returns:
            The targets of all joints; None for an answer to sensors from before a reset.
            A warning if a target is outside its joint limits, where the robot will stop.

        Raises:
            NaoGaitError: The command is not usable; the last targets stay.
        """
        if 0 < stamp <= self._valid_from:
            return None, None
        places, count = self._places_of(names), len(names)
        if len(position) != count:
            allowed = f"{count}, one for each name"
            raise NaoGaitError("joint_command position", f"{len(position)} values", allowed)
        if len(effort) not in (0, count):
            allowed = f"{count}, one for each name, or none"
            raise NaoGaitError("joint_command effort", f"{len(effort)} values", allowed)
        angles = np.asarray(position, dtype=float)
        _check(names, angles, np.isfinite(angles), "position", "a finite angle [rad]")
        shares = np.asarray(effort, dtype=float)
        inside = (shares >= 0.0) & (shares <= 1.0)
        _check(names, shares, inside, "effort", "a share of the torque, 0 to 1")
        self._position = self._position.copy()
        self._position[places] = angles
        self._stiffness = self._stiffness.copy()
        self._stiffness[places] = shares if len(shares) else 1.0
        self._sender, self._last_command = sender, now
        lowest = float(np.min(self._stiffness))
        each = None if lowest == float(np.max(self._stiffness)) else self._stiffness
        targets = JointTargets(stamp, self._position, lowest, each)
        return targets, self._limit_warning(names, angles, places)

    def _limit_warning(
        self, names: Sequence[str], angles: FloatArray, places: np.ndarray
    ) -> str | None:
        lower, upper = self._robot.lower[places], self._robot.upper[places]
        excess = np.maximum(lower - angles, angles - upper)
        worst = int(np.argmax(excess))
        if excess[worst] <= _LIMIT_ROUNDING:
            return None
        return (
            f"joint_command position[{names[worst]}]: got {angles[worst]:.6g}; allowed: "
            f"{lower[worst]:.6g} to {upper[worst]:.6g} rad; the joint stops at its limit"
        )

    def _places_of(self, names: Sequence[str]) -> np.ndarray:
        """Index of each named joint; of the same names again without a check."""
        if names == self._names:
            return self._places
        if not names:
            raise NaoGaitError("joint_command name", "no joints", "at least one joint")
        unknown = [name for name in names if name not in self._index]
        if unknown:
            allowed = f"joints of {self._robot.name}"
            raise NaoGaitError("joint_command name", some(unknown), allowed)
        if len(set(names)) != len(names):
            twice = f"{repeated(names)} more than once"
            raise NaoGaitError("joint_command name", twice, "each joint once")
        self._places = np.array([self._index[name] for name in names], dtype=np.intp)
        self._names = list(names)
        return self._places


def read_push(force: Sequence[float], torque: Sequence[float], frame: str) -> FloatArray:
    """Read a push.

    Args:
        force: x, y, z [N] in the world frame.
        torque: x, y, z [N m]; must be zero.
        frame: header.frame_id; `world` or empty.

    Returns:
        (3,) [N] in the world frame.

    Raises:
        NaoGaitError: The push is not usable.
    """
    if frame not in ("", "world"):
        raise NaoGaitError("push header.frame_id", frame, "world, or empty")
    for axis, value in zip("xyz", force, strict=True):
        finite(value, f"push wrench.force.{axis}", PUSH_ABSURD, "N")
    if any(value != 0.0 for value in torque):
        raise NaoGaitError("push wrench.torque", tuple(torque), "zero: a push is a force only")
    return np.array(force, dtype=float)


def _check(
    names: Sequence[str], values: FloatArray, good: np.ndarray, field: str, allowed: str
) -> None:
    """Raise NaoGaitError for the first joint whose value is not `good`."""
    if not good.all():
        bad = int(np.argmin(good))
        raise NaoGaitError(f"joint_command {field}[{names[bad]}]", float(values[bad]), allowed)
