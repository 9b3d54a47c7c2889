"""The gait behind a fence: whatever happens inside, only sane targets come out."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from nao_lipm_gait.robot_description import RobotDescription
from nao_lipm_gait.signals import FloatArray, JointTargets, SensorFrame, VelocityCommand

_ROUNDING = 1e-9
"""[rad] Not worth a word when a target is this little beyond a limit."""


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


class GuardedGait:
    def __init__(self, gait: Walker, robot: RobotDescription) -> None:
        self._gait = gait
        self._lower = robot.lower
        self._upper = robot.upper
        self._names = robot.joint_names
        self._good: JointTargets | None = None

    def step(self, frame: SensorFrame, command: VelocityCommand) -> Answer:
        """One tick of the gait. Never raises; holds the last good targets instead.

        Before the first good ones it holds the measured pose.
        """
        try:
            targets = self._gait.step(frame, command)
        except Exception as error:  # noqa: BLE001 - the robot needs an answer to every frame
            return self._hold(frame, f"Gait.step raised {type(error).__name__}: {error}")
        position = np.asarray(targets.position, dtype=float)
        if position.shape != self._lower.shape:
            return self._hold(frame, f"targets of shape {position.shape}")
        finite = np.isfinite(position)
        if not finite.all():
            bad = int(np.argmin(finite))
            return self._hold(frame, f"target {position[bad]} for {self._names[bad]}")
        fault = None
        inside = np.clip(position, self._lower, self._upper)
        beyond = np.abs(position - inside)
        worst = int(np.argmax(beyond))
        if beyond[worst] > _ROUNDING:
            fault = (
                f"target {position[worst]:.6g} rad for {self._names[worst]} cut to its limits "
                f"{self._lower[worst]:.6g} to {self._upper[worst]:.6g}"
            )
        stiffness = targets.stiffness
        if not 0.0 <= stiffness <= 1.0:
            return self._hold(frame, f"stiffness {stiffness}")
        each = targets.joint_stiffness
        if each is not None and (
            each.shape != inside.shape or not ((each >= 0.0) & (each <= 1.0)).all()
        ):
            return self._hold(frame, f"stiffness {each.tolist()}")
        self._good = JointTargets(frame.stamp, inside, stiffness, each)
        return Answer(self._good, held=False, fault=fault)

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
