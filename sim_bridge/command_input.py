"""What the robot does with commands: who may command it, and which answers still count.

From the numbers of a command to joint targets and pushes. Plain data, no ROS types.
"""

from collections.abc import Sequence

import numpy as np

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.runtime.inputs import finite, repeated, some
from nao_lipm_gait.types import FloatArray, JointTargets

PUSH_ABSURD = 2000.0
"""[N]"""
_LIMIT_ROUNDING = 1e-6
"""[rad] A target this little beyond a limit is not worth a warning."""


class CommandReader:
    """Keeps the whole set of targets; a command may set all of them or only some."""

    def __init__(self, robot: RobotDescription) -> None:
        self._robot = robot
        self._index = {name: index for index, name in enumerate(robot.joint_names)}
        self._position = robot.stand_pose.copy()
        self._shares = np.ones(len(robot.joint_names))
        self._names: list[str] | None = None
        self._places = np.zeros(0, dtype=np.intp)

    def reset(self) -> None:
        self._position = self._robot.stand_pose.copy()
        self._shares = np.ones(len(self._position))

    def read(
        self,
        stamp: int,
        names: Sequence[str],
        position: Sequence[float],
        effort: Sequence[float],
    ) -> tuple[JointTargets, str | None]:
        """The targets, and a remark when some of them lay beyond a limit and were cut.

        Args:
            stamp: of the sensors that are answered [ns].
            names: joints in any order; joints that are not named keep targets and torque.
            position: [rad], one for each name.
            effort: share of the motor torque that may be used, 0 to 1, one for each name, or
                empty for all of it.

        Raises NaoGaitError, and keeps the last targets, for anything else.
        """
        places = self._places_of(names)
        count = len(names)
        if len(position) != count:
            raise NaoGaitError(
                "joint_command position", f"{len(position)} values", f"{count}, one for each name"
            )
        if len(effort) not in (0, count):
            raise NaoGaitError(
                "joint_command effort",
                f"{len(effort)} values",
                f"{count}, one for each name, or none",
            )
        values = np.asarray(position, dtype=float)
        self._check(names, values, np.isfinite(values), "position", "a finite angle [rad]")
        shares = np.asarray(effort, dtype=float)
        inside = (shares >= 0.0) & (shares <= 1.0)
        self._check(names, shares, inside, "effort", "a share of the torque, 0 to 1")
        lower, upper = self._robot.lower[places], self._robot.upper[places]
        cut = np.clip(values, lower, upper)
        remark = None
        beyond = np.abs(values - cut)
        if count and beyond.max() > _LIMIT_ROUNDING:
            worst = int(np.argmax(beyond))
            remark = (
                f"joint_command position[{names[worst]}]: got {values[worst]:.6g}; allowed: "
                f"{lower[worst]:.6g} to {upper[worst]:.6g} rad; cut there"
            )
        self._position = self._position.copy()
        self._position[places] = cut
        self._shares = self._shares.copy()
        self._shares[places] = shares if len(shares) else 1.0
        lowest = float(np.min(self._shares))
        each = None if lowest == float(np.max(self._shares)) else self._shares
        return JointTargets(stamp, self._position, lowest, each), remark

    def _places_of(self, names: Sequence[str]) -> np.ndarray:
        if names == self._names:
            return self._places
        if not names:
            raise NaoGaitError("joint_command name", "no joints", "at least one joint")
        unknown = [name for name in names if name not in self._index]
        if unknown:
            raise NaoGaitError(
                "joint_command name", some(unknown), f"joints of {self._robot.name}"
            )
        if len(set(names)) != len(names):
            raise NaoGaitError(
                "joint_command name", f"{repeated(names)} more than once", "each joint once"
            )
        self._places = np.array([self._index[name] for name in names], dtype=np.intp)
        self._names = list(names)
        return self._places

    @staticmethod
    def _check(
        names: Sequence[str], values: FloatArray, good: np.ndarray, field: str, allowed: str
    ) -> None:
        if not good.all():
            bad = int(np.argmin(good))
            raise NaoGaitError(f"joint_command {field}[{names[bad]}]", float(values[bad]), allowed)


def read_push(force: Sequence[float], torque: Sequence[float], frame: str) -> FloatArray:
    """(3,) [N] in the world frame."""
    if frame not in ("", "world"):
        raise NaoGaitError("push header.frame_id", frame, "world, or empty")
    for axis, value in zip("xyz", force, strict=True):
        finite(value, f"push wrench.force.{axis}", PUSH_ABSURD, "N")
    if any(value != 0.0 for value in torque):
        raise NaoGaitError("push wrench.torque", tuple(torque), "zero: a push is a force only")
    return np.array(force, dtype=float)


TAKE_OVER = 0.2
"""[s] of silence of the one who commands, after which another one may."""


class CommandInput:
    """One commander at a time: of two gaits the robot obeys the one that came first.

    Commands of two gaits mixed would make a fall certain; each believes that its own are carried
    out. A gait that ended is replaced as soon as it has been silent for a moment.
    """

    def __init__(self, robot: RobotDescription) -> None:
        self._reader = CommandReader(robot)
        self._sender: str | None = None
        self._heard = 0.0
        self._commands_from = 0

    def reset(self, stamp: int) -> None:
        """Answers to sensors up to `stamp` [ns] no longer count."""
        self._reader.reset()
        self._commands_from = stamp

    def admit(self, sender: str, now: float) -> None:
        """Raises NaoGaitError when another one commands.

        Args:
            sender: header.frame_id of the command; each gait has its own.
            now: any monotonic time [s].
        """
        if sender != self._sender and self._sender is not None and now - self._heard < TAKE_OVER:
            raise NaoGaitError(
                "joint_command header.frame_id",
                sender[:40],
                f"one gait; the robot obeys {self._sender[:40]!r} until it is silent for "
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
        """As `CommandReader.read`; no targets for an answer to what was before a reset.

        Who sends what can be carried out commands from then on.
        """
        if 0 < stamp <= self._commands_from:
            return None, None
        read = self._reader.read(stamp, names, position, effort)
        self._sender, self._heard = sender, now
        return read
