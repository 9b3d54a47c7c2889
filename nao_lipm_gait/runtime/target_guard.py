"""The gait behind a fence: whatever happens inside, only sane targets come out."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import FloatArray, JointTargets, SensorFrame, VelocityCommand

_ROUNDING = 1e-9
"""[rad] Not worth a word when a target is this little beyond a limit."""
SPEED_SHARE = 4.0
"""Of a joint's speed limit: no target moves faster. The robot itself cuts at the limit; the walk
asks for up to twice as much for single ticks. What is beyond is no walk."""
_TICKS_MAX = 20
"""Periods since the last answer for which a target may have moved."""


class Walker(Protocol):
    """The part of `Gait` that is used here."""

    def step(self, frame: SensorFrame, command: VelocityCommand) -> JointTargets: ...


@dataclass(frozen=True, slots=True)
class Answer:
    """Targets that are finite and inside the joint limits, and what had to be done for that."""

    targets: JointTargets
    held: bool
    """The targets of an earlier tick, because this tick gave none that can be used."""
    fault: str | None
    """What went wrong, with its evidence; None when nothing did."""


class TargetGuard:
    def __init__(
        self, gait: Walker, robot: RobotDescription, control_period: float = 0.01
    ) -> None:
        """control_period [s]: the distance of two frames."""
        self._gait = gait
        self._lower = robot.lower
        self._upper = robot.upper
        self._names = robot.joint_names
        self._period = round(control_period * 1e9)
        self._stride = SPEED_SHARE * control_period * np.asarray(robot.velocity_limit, dtype=float)
        self._good: JointTargets | None = None
        self._was_stiff = False

    def begin_anew(self) -> None:
        """The robot may be anywhere now: the next targets need not go on from the last ones."""
        self._good = None

    def go_on_at(self, stamp: int) -> None:
        """The clock of the frames has changed and nothing else: the next one is of this stamp."""
        if self._good is not None:
            self._good = self._good._replace(stamp=stamp - self._period)

    def step(self, frame: SensorFrame, command: VelocityCommand) -> Answer:
        """One tick of the gait. Never raises; holds the last good targets instead.

        Before the first good ones it holds the measured pose.
        """
        try:
            targets = self._gait.step(frame, command)
        except Exception as error:
            return self._hold(frame, f"Gait.step raised {type(error).__name__}: {error}")
        position = np.asarray(targets.position, dtype=float)
        if position.shape != self._lower.shape:
            return self._hold(frame, f"targets of shape {position.shape}")
        finite = np.isfinite(position)
        if not finite.all():
            bad = int(np.argmin(finite))
            return self._hold(frame, f"target {position[bad]} for {self._names[bad]}")
        stiffness = targets.stiffness
        if not 0.0 <= stiffness <= 1.0:
            return self._hold(frame, f"stiffness {stiffness}")
        fault = None
        inside = np.clip(position, self._lower, self._upper)
        beyond = np.abs(position - inside)
        worst = int(np.argmax(beyond))
        if beyond[worst] > _ROUNDING:
            fault = (
                f"target {position[worst]:.6g} rad for {self._names[worst]} cut to its limits "
                f"{self._lower[worst]:.6g} to {self._upper[worst]:.6g}"
            )
        each = targets.joint_stiffness
        if each is not None and (
            each.shape != inside.shape or not ((each >= 0.0) & (each <= 1.0)).all()
        ):
            return self._hold(frame, f"stiffness {each.tolist()}")
        stiff = stiffness if each is None else float(np.max(each))
        if stiff > 0.0:
            inside, hurry = self._slowed(frame, inside)
            fault = fault or hurry
        self._good = JointTargets(frame.stamp, inside, stiffness, each)
        self._was_stiff = stiff > 0.0
        return Answer(self._good, held=False, fault=fault)

    def _slowed(self, frame: SensorFrame, position: FloatArray) -> tuple[FloatArray, str | None]:
        """Targets that no joint approaches faster than it may; a word where they would have."""
        good = self._good
        start = np.asarray(frame.joint_position, dtype=float)
        ticks = 1
        if good is not None and self._was_stiff:
            start = good.position
            ticks = max(1, min(_TICKS_MAX, round((frame.stamp - good.stamp) / self._period)))
        stride = ticks * self._stride
        change = position - start
        worst = int(np.argmax(np.abs(change) - stride))
        if abs(change[worst]) <= stride[worst]:
            return position, None
        slowed = np.clip(start + np.clip(change, -stride, stride), self._lower, self._upper)
        return slowed, (
            f"target for {self._names[worst]} moved by {change[worst]:.3g} rad in {ticks} tick(s); "
            f"allowed: {stride[worst]:.3g} rad, {SPEED_SHARE:g} times its speed limit; cut there"
        )

    def _hold(self, frame: SensorFrame, reason: str) -> Answer:
        good = self._good
        position: FloatArray
        if good is None:
            position, stiffness = np.clip(frame.joint_position, self._lower, self._upper), 1.0
            each = None
        else:
            position, stiffness, each = good.position, good.stiffness, good.joint_stiffness
        return Answer(
            JointTargets(frame.stamp, position, stiffness, each),
            held=True,
            fault=f"{reason}; frame {frame.stamp * 1e-9:.3f} s; holding the last good targets",
        )
