"""Extension of the paper, which ignores rotation: steps that turn.

If Q-bar is turned against Q, it sees part of the motion in x as motion in y, and the other way
round. The support change and the next pendulum origin account for both.
"""

from math import tan
from typing import final


@final
class TurnOfView:
    """What a turning step changes in y when Q-bar takes over.

    Attributes:
        nearer: Distance by which the CoM is nearer to the next origin [m].
        faster: Speed by which it is faster towards it [m/s].
    """

    __slots__ = ("faster", "nearer")

    def __init__(self, nearer: float, faster: float):
        self.nearer = nearer
        self.faster = faster


STRAIGHT = TurnOfView(0.0, 0.0)


def turn_of_view(swing: int, yaw: float, x_from_next: float, vx: float) -> TurnOfView:
    """The view from Q-bar for a step that turns.

    Args:
        swing: The swing leg, LEFT or RIGHT.
        yaw: Turn of the step [rad].
        x_from_next: CoM ahead of the next origin at the support change, along x of Q [m].
        vx: Its velocity then, along x of Q [m/s].

    Returns:
        The changes in y.
    """
    tan_yaw = tan(yaw)
    return TurnOfView(-swing * tan_yaw * x_from_next, -swing * tan_yaw * vx)


def longer_step(yaw: float, next_tanh: float, k: float, y_from_next: float, vy: float) -> float:
    """Length that a straight step has to be longer to meet x-bar_0 = 0 like the turning step [m].

    Args:
        yaw: Turn of the step [rad].
        next_tanh: tanh(k t_b-bar) of the next pendulum.
        k: Natural frequency [1/s].
        y_from_next: CoM at the support change along y of Q, from Q-bar [m].
        vy: Its velocity then, along y of Q [m/s].

    Returns:
        The length [m].
    """
    return tan(yaw) * (next_tanh / k * vy - y_from_next)
