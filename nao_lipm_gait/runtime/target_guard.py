"""The last check of the targets before they are sent: finite, inside the limits, not too fast."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from robot_core.joint_limits import SPEED_SHARE
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray, JointTargets, SensorFrame, VelocityCommand

_ROUNDING = 1e-9
"""[rad] Targets this little beyond a limit are clipped without a report."""
_TICKS_MAX = 20
"""Periods since the last targets for which a target may have moved."""
COAST_MAX = 3
"""Control periods in a row for which the robot walks on without sensors."""


class Stepper(Protocol):
    """The part of `Gait` that is guarded."""

    def step(self, frame: SensorFrame, command: VelocityCommand) -> JointTargets:
        """See `Gait.step`."""

    def coast(self) -> JointTargets | None:
        """See `Gait.coast`."""


@dataclass(frozen=True, slots=True)
class GuardedTargets:
    """Targets that can be sent.

    Attributes:
        held: They are the ones of an earlier tick, because this tick gave none that can be used.
        fault: What was wrong, with its evidence; None if nothing was.
    """

    targets: JointTargets
    held: bool
    fault: str | None


class TargetGuard:
    """Runs the gait's tick so that every exception and every bad target ends here."""

    def __init__(
        self, gait: Stepper, robot: RobotDescription, control_period: float = 0.01
    ) -> None:
        self._gait = gait
        self._lower = robot.lower
        self._upper = robot.upper
        self._names = robot.joint_names
        self._period = round(control_period * 1e9)
        self._stride = SPEED_SHARE * control_period * np.asarray(robot.velocity_limit, dtype=float)
        self._good: JointTargets | None = None
        self._was_stiff = False
        self._coasted = 0

    def restart(self) -> None:
        """Forget the last targets: the robot may be anywhere."""
        self._good = None

    def shift_clock(self, stamp: int) -> None:
        """Continue although only the clock has changed; the next frame has this stamp [ns]."""
        if self._good is not None:
            self._good = self._good._replace(stamp=stamp - self._period)

    def step(self, frame: SensorFrame, command: VelocityCommand) -> GuardedTargets:
        """One tick of the gait; never raises.

        If the gait gives no usable targets, the last good ones are held; before the first ones the
        measured pose is.
        """
        self._coasted = 0
        try:
            targets = self._gait.step(frame, command)
        except Exception as error:
            reason = f"Gait.step raised {type(error).__name__}: {error}"
            return self._hold(frame.stamp, frame.joint_position, reason)
        return self._checked(targets, frame.stamp, frame.joint_position)

    def coast(self) -> GuardedTargets | None:
        """Targets for a control period without a frame; never raises.

        None for a robot that does not walk, and after `COAST_MAX` periods in a row.
        """
        good = self._good
        if good is None or not self._was_stiff or self._coasted >= COAST_MAX:
            return None
        try:
            targets = self._gait.coast()
        except Exception as error:
            reason = f"Gait.coast raised {type(error).__name__}: {error}"
            self._coasted += 1
            return self._hold(good.stamp, good.position, reason)
        if targets is None:
            return None
        self._coasted += 1
        return self._checked(targets, targets.stamp, good.position)

    def _checked(
        self, targets: JointTargets, stamp: int, measured: FloatArray
    ) -> GuardedTargets:
        """The targets if they can be sent, else the last good ones; `measured` (n,) [rad]."""
        position = np.asarray(targets.position, dtype=float)
        if position.shape != self._lower.shape:
            return self._hold(stamp, measured, f"targets of shape {position.shape}")
        finite = np.isfinite(position)
        if not finite.all():
            bad = int(np.argmin(finite))
            return self._hold(stamp, measured, f"target {position[bad]} for {self._names[bad]}")
        stiffness = targets.stiffness
        if not 0.0 <= stiffness <= 1.0:
            return self._hold(stamp, measured, f"stiffness {stiffness}; allowed: 0 to 1")
        fault = None
        inside = np.clip(position, self._lower, self._upper)
        beyond = np.abs(position - inside)
        worst = int(np.argmax(beyond))
        if beyond[worst] > _ROUNDING:
            fault = (
                f"target {position[worst]:.6g} rad for {self._names[worst]}; allowed: "
                f"{self._lower[worst]:.6g} to {self._upper[worst]:.6g}; clipped"
            )
        each = targets.joint_stiffness
        if each is not None and (
            each.shape != inside.shape or not ((each >= 0.0) & (each <= 1.0)).all()
        ):
            return self._hold(stamp, measured, f"stiffness {each.tolist()}; allowed: 0 to 1 each")
        stiff = stiffness if each is None else float(np.max(each))
        if stiff > 0.0:
            inside, too_fast = self._slowed(stamp, measured, inside)
            fault = fault or too_fast
        self._good = JointTargets(stamp, inside, stiffness, each, targets.lead)
        self._was_stiff = stiff > 0.0
        return GuardedTargets(self._good, held=False, fault=fault)

    def _slowed(
        self, stamp: int, measured: FloatArray, position: FloatArray
    ) -> tuple[FloatArray, str | None]:
        """The targets (n,) [rad], no faster than allowed, and a description of one that was."""
        good = self._good
        start = np.asarray(measured, dtype=float)
        ticks = 1
        if good is not None:
            if self._was_stiff:
                start = good.position
            else:
                # Joints without torque may be beyond the limits, at which their targets are.
                nearer = np.abs(position - good.position) < np.abs(position - start)
                start = np.where(nearer, good.position, start)
            ticks = max(1, min(_TICKS_MAX, round((stamp - good.stamp) / self._period)))
        else:
            start = np.clip(start, self._lower, self._upper)
        stride = ticks * self._stride
        change = position - start
        worst = int(np.argmax(np.abs(change) - stride))
        if abs(change[worst]) <= stride[worst] + _ROUNDING:
            return position, None
        slowed = np.clip(start + np.clip(change, -stride, stride), self._lower, self._upper)
        return slowed, (
            f"target for {self._names[worst]} moved by {change[worst]:.3g} rad in {ticks} tick(s); "
            f"allowed: {stride[worst]:.3g} rad, {SPEED_SHARE:g} times its speed limit; clipped"
        )

    def _hold(self, stamp: int, measured: FloatArray, reason: str) -> GuardedTargets:
        good = self._good
        if good is None:
            targets = JointTargets(stamp, np.clip(measured, self._lower, self._upper))
        else:
            targets = good._replace(stamp=stamp)
        fault = f"{reason}; frame {stamp * 1e-9:.3f} s; the last good targets are held"
        return GuardedTargets(targets, held=True, fault=fault)
