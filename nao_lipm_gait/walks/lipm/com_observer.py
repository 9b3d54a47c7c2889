"""The interface of a CoM observer: what the walk calls at a measurement.

To use another observer, write it in a file of its own, with a function that makes it from the
parameters, and name that function as the default of `make_observer` in `LipmWalk`.
"""

from typing import Protocol, final

from nao_lipm_gait.walks.lipm.state import WalkState


@final
class ComCorrection:
    """What an observer adds to the expected state of the CoM: K_i Delta x_i of eq (14).

    Attributes:
        x: Position in Q, forward [m].
        y: Position in Q, to the left [m].
        vx: Velocity in Q, forward [m/s].
        vy: Velocity in Q, to the left [m/s].
    """

    __slots__ = ("vx", "vy", "x", "y")

    def __init__(self, x: float, y: float, vx: float, vy: float):
        self.x = x
        self.y = y
        self.vx = vx
        self.vy = vy


class ComObserver(Protocol):
    """Estimates position and velocity of the CoM; each measurement calls both methods in turn."""

    def predict(self, expected: WalkState, dt: float) -> None:
        """Take over the predicted state.

        Args:
            expected: The state that the pendulum predicts for the time of the measurement.
            dt: Time since the last tick [s].
        """

    def correct(self, dx: float, dy: float) -> ComCorrection:
        """Use one measurement.

        Args:
            dx: Innovation, measured minus expected CoM, forward in Q [m].
            dy: The same to the left [m].

        Returns:
            The filtered state minus the expected one.
        """
