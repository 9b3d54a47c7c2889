"""Where the joints should be, by what they were told: for moments in which they cannot be read."""

from collections import deque

from nao_lipm_gait.signals import FloatArray, JointTargets

OLDEST = 300_000_000
"""[ns] Targets that are older say nothing about now."""


class JointBelief:
    """Keeps the targets of the last moments by the stamp that they answered."""

    def __init__(self) -> None:
        self._told: deque[JointTargets] = deque(maxlen=64)

    def begin_anew(self) -> None:
        self._told.clear()

    def told(self, targets: JointTargets) -> None:
        """Targets that were sent."""
        if self._told and targets.stamp <= self._told[-1].stamp:
            self._told.clear()  # another time
        self._told.append(targets)

    def at(self, stamp: int, delay: int) -> FloatArray | None:
        """(n,) [rad] at `stamp` [ns], if targets need `delay` [ns] to show in the sensors.

        None where nothing was told, or the joints are limp.
        """
        for targets in reversed(self._told):
            age = stamp - delay - targets.stamp
            if age >= 0:
                return targets.position if age < OLDEST and targets.stiffness > 0.0 else None
        return None
