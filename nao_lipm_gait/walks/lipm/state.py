"""The state of the walking pendulum in Q, and how committed motion advances it.

Q is the paper's coordinate system (section 2.1): one per single support, between both feet, x
forward. A bar marks the next one: Q-bar is Q moved by the step size s-bar.

The records of the tick are classes with slots: Python makes them faster than named tuples, and
mypyc makes C structs of them.
"""

from collections.abc import Iterable
from math import cosh, sinh
from typing import final

from robot_core.geometry import compose, relative, rotate_planar
from robot_core.types import Pose2


@final
class WalkState:
    """CoM in Q, and what defines Q.

    Attributes:
        x: CoM in Q, forward [m].
        y: CoM in Q, to the left [m].
        vx: Its velocity, forward [m/s].
        vy: Its velocity, to the left [m/s].
        sole_in_q: Pose of the supporting sole in Q.
        q_in_odom: Pose of Q by the planned steps.
        step_count: Number of support changes since the walk started.
    """

    __slots__ = ("q_in_odom", "sole_in_q", "step_count", "support", "vx", "vy", "x", "y")

    def __init__(
        self,
        support: int,
        x: float,
        y: float,
        vx: float,
        vy: float,
        sole_in_q: Pose2,
        q_in_odom: Pose2,
        step_count: int,
    ):
        self.support = support
        self.x = x
        self.y = y
        self.vx = vx
        self.vy = vy
        self.sole_in_q = sole_in_q
        self.q_in_odom = q_in_odom
        self.step_count = step_count

    def moved(self, x: float, y: float, vx: float, vy: float) -> "WalkState":
        """The same Q with another CoM.

        Args:
            x: CoM in Q, forward [m].
            y: CoM in Q, to the left [m].
            vx: Its velocity, forward [m/s].
            vy: Its velocity, to the left [m/s].

        Returns:
            The new state.
        """
        return WalkState(
            self.support, x, y, vx, vy, self.sole_in_q, self.q_in_odom, self.step_count
        )


@final
class NextSupport:
    """The next single support: Q-bar and the leg that supports in it.

    Attributes:
        step_size: Step size s-bar, the pose of Q-bar in Q.
        sole_in_next_q: Pose of the new supporting sole in Q-bar.
    """

    __slots__ = ("sole_in_next_q", "step_size")

    def __init__(self, step_size: Pose2, sole_in_next_q: Pose2):
        self.step_size = step_size
        self.sole_in_next_q = sole_in_next_q


@final
class Segment:
    """A piece of motion that has been sent to the joints and can no longer be changed.

    Attributes:
        duration: Its duration [s].
        origin_x: r_x, pendulum origin in Q, forward [m].
        origin_y: r_y, pendulum origin in Q, to the left [m].
    """

    __slots__ = ("duration", "next_support", "origin_x", "origin_y")

    def __init__(
        self,
        duration: float,
        origin_x: float,
        origin_y: float,
        next_support: NextSupport | None = None,
    ):
        self.duration = duration
        self.origin_x = origin_x
        self.origin_y = origin_y
        self.next_support = next_support


def follow(state: WalkState, segments: Iterable[Segment], k: float) -> WalkState:
    """The state at the end of committed segments: r + x(t), eq (10), and the changes to Q-bar.

    Args:
        state: State at their beginning.
        segments: The segments in order.
        k: Natural frequency of the pendulum [1/s].

    Returns:
        State at their end.
    """
    x, y, vx, vy = state.x, state.y, state.vx, state.vy
    last_duration, c, s = 0.0, 1.0, 0.0
    for segment in segments:
        duration, origin_x, origin_y = segment.duration, segment.origin_x, segment.origin_y
        change = segment.next_support
        # `pendulum.advance` written out: both axes, and mostly all segments, have one duration.
        if duration != last_duration:
            c = cosh(k * duration)
            s = sinh(k * duration)
            last_duration = duration
        dx = x - origin_x
        dy = y - origin_y
        x, vx = origin_x + (dx * c + vx * s / k), dx * k * s + vx * c
        y, vy = origin_y + (dy * c + vy * s / k), dy * k * s + vy * c
        if change is not None:
            state = enter_next_q(state.moved(x, y, vx, vy), change)
            x, y, vx, vy = state.x, state.y, state.vx, state.vy
    return state.moved(x, y, vx, vy)


def enter_next_q(state: WalkState, change: NextSupport) -> WalkState:
    """The same motion of the CoM, seen from Q-bar and supported by the other leg."""
    x, y, _ = relative((state.x, state.y, 0.0), change.step_size)
    vx, vy = rotate_planar(state.vx, state.vy, -change.step_size[2])
    return WalkState(
        -state.support,
        x,
        y,
        vx,
        vy,
        change.sole_in_next_q,
        compose(state.q_in_odom, change.step_size),
        state.step_count + 1,
    )
