"""Extension of the paper: shorter strides if the motors are weak.

Motors that are weak or hot let the swing foot arrive late, and the robot falls in its first long
strides. So a walk begins with short strides, which grow to a length that weak motors bear, too.
They grow further once the hips have shown that they follow (`estimation/hip_lag.py`).
"""

from math import inf

START = 0.013
"""Longest step ahead [m] of the first strides."""
GROWTH = 0.0146
"""By which it grows in a second [m/s]."""
WEAK = 0.063
"""Step ahead [m] that weak motors bear."""
STRONG_GROWTH = 0.043
"""By which it grows in a second [m/s] once the motors have shown to be strong."""


class MotorLimit:
    """The longest step ahead that the motors are known to bear.

    Args:
        hip_lag_max: Lag of the hips [s] up to which motors count as strong; 0 = all are.

    Attributes:
        step_max: The step [m].
    """

    def __init__(self, hip_lag_max: float) -> None:
        self.step_max = inf
        self.set_limit(hip_lag_max)
        self.begin(None)

    def set_limit(self, hip_lag_max: float) -> None:
        """Use another limit [s]."""
        self._hip_lag_max = hip_lag_max
        if hip_lag_max <= 0.0:
            self.step_max = inf

    def begin(self, hip_lag: float | None) -> None:
        """Begin a walk; `hip_lag` as in `update`."""
        if not self._strong(hip_lag):
            self.step_max = START

    def update(self, hip_lag: float | None, dt: float) -> None:
        """One tick.

        Args:
            hip_lag: How much longer the hips lag than the knees [s]; None while it is not known.
            dt: Time since the last tick [s].
        """
        if self._strong(hip_lag):
            self.step_max += STRONG_GROWTH * dt
        else:
            self.step_max = min(WEAK, self.step_max + GROWTH * dt)

    def _strong(self, hip_lag: float | None) -> bool:
        return self._hip_lag_max <= 0.0 or (hip_lag is not None and hip_lag < self._hip_lag_max)
