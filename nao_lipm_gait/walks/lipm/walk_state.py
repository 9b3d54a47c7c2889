"""The state of the walking pendulum in Q, and how a committed motion carries it on.

Q is the paper's coordinate system: one per single support phase, between both feet, x forward.
"""

from collections.abc import Iterable
from math import cosh, sinh
from typing import NamedTuple

from nao_lipm_gait.geometry import compose, relative, rotate_planar
from nao_lipm_gait.types import Pose2


class WalkState(NamedTuple):
    """CoM position [m] and velocity [m/s] in Q, and what defines Q."""

    support: int
    """LEFT or RIGHT."""
    x: float
    y: float
    vx: float
    vy: float
    sole_in_q: Pose2
    """The sole of the supporting foot (the point under its ankle)."""
    q_in_odom: Pose2
    step_count: int

    def moved(self, x: float, y: float, vx: float, vy: float) -> "WalkState":
        # Spelled out: several times a tick, and twice as fast as _replace.
        return WalkState(
            self.support, x, y, vx, vy, self.sole_in_q, self.q_in_odom, self.step_count
        )


class NextSupport(NamedTuple):
    """The next single support phase: Q-bar = Q moved by the step size, on the other leg."""

    step_size: Pose2
    """s-bar: x, y [m], yaw [rad] of Q-bar in Q."""
    sole_in_next_q: Pose2


class Segment(NamedTuple):
    """A piece of motion that has been sent to the joints and can no longer be changed."""

    duration: float
    """[s]"""
    origin_x: float
    origin_y: float
    """r, the pendulum origin in Q [m]."""
    next_support: NextSupport | None = None
    """The support change at the end of this piece."""


def follow(state: WalkState, segments: Iterable[Segment], k: float) -> WalkState:
    """The state at the end of segments: r + x(t), eq (10), and the change to Q-bar where due."""
    x, y, vx, vy = state.x, state.y, state.vx, state.vy
    shared, c, s = 0.0, 1.0, 0.0
    for segment in segments:
        duration, origin_x, origin_y = segment.duration, segment.origin_x, segment.origin_y
        change = segment.next_support
        # `pendulum.advance` written out: both axes, and mostly all segments, share the time.
        if duration != shared:
            c = cosh(k * duration)
            s = sinh(k * duration)
            shared = duration
        dx = x - origin_x
        dy = y - origin_y
        x, vx = origin_x + (dx * c + vx * s / k), dx * k * s + vx * c
        y, vy = origin_y + (dy * c + vy * s / k), dy * k * s + vy * c
        if change is not None:
            state = enter_next_q(state.moved(x, y, vx, vy), change)
            x, y, vx, vy = state.x, state.y, state.vx, state.vy
    return state.moved(x, y, vx, vy)


def velocity_gained(before: WalkState, after: WalkState) -> tuple[float, float]:
    """By which the CoM got faster in x and y [m/s] from one state to a later one, in its axes."""
    vx, vy, turn = before.vx, before.vy, after.q_in_odom[2] - before.q_in_odom[2]
    if turn != 0.0:
        vx, vy = rotate_planar(vx, vy, -turn)
    return after.vx - vx, after.vy - vy


def enter_next_q(state: WalkState, change: NextSupport) -> WalkState:
    """The same motion of the CoM, seen from Q-bar and carried by the other leg."""
    x, y, _ = relative((state.x, state.y, 0.0), change.step_size)
    vx, vy = rotate_planar(state.vx, state.vy, -change.step_size[2])
    return WalkState(
        support=-state.support,
        x=x,
        y=y,
        vx=vx,
        vy=vy,
        sole_in_q=change.sole_in_next_q,
        q_in_odom=compose(state.q_in_odom, change.step_size),
        step_count=state.step_count + 1,
    )
