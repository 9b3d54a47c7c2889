"""Walking to a pose around obstacles: a potential field, and the speeds that a robot can walk.

All poses and points are in base_footprint. Nothing is remembered between two updates.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import attrs

from robot_core.geometry import rotate_planar
from robot_core.schema import Settings, number
from robot_core.types import STANDSTILL, Point2, Pose2, VelocityCommand

DISTANCE_GAIN = 1.2
"""[1/s] Speed over the distance that is left: the robot slows down before its target."""
TURN_GAIN = 1.5
"""[1/s] Turning speed over the angle that is left."""
FACING = (0.25, 0.6)
"""[m] Nearer to the target, the robot has the target's heading; farther, it faces its way."""


@attrs.frozen
class WalkLimits(Settings):
    """The largest speeds that behaviour asks for; the gait reaches more, but not at once."""

    forward: float = number(0.35, 0.01, 1.0, "m/s", "Forward.")
    backward: float = number(0.15, 0.01, 1.0, "m/s", "Backward.")
    side: float = number(0.18, 0.01, 1.0, "m/s", "To the side.")
    turn: float = number(1.5, 0.05, 4.0, "rad/s", "Turning on the spot.")

    def command(self, x: float, y: float, yaw: float) -> VelocityCommand:
        """The command [m/s, m/s, rad/s] in this direction within the limits, an ellipsoid."""
        along = self.forward if x > 0.0 else self.backward
        load = math.hypot(x / along, y / self.side, yaw / self.turn)
        scale = 1.0 / max(1.0, load)
        return VelocityCommand(scale * x, scale * y, scale * yaw)


APART_FROM = 0.5
"""[m] beyond the distance to keep, from which on another robot limits the speed."""
APART_RETREAT = 0.15
"""[m/s] Speed away from a robot that is too near."""

APART_TURN = 0.6
"""[rad/s] at most at this distance from another robot: arms and feet of a fast turn hit it."""
APART_STILL = 0.1
"""[m] nearer, the robot neither turns nor walks past; so much farther, it may turn twice as
fast."""


class Round(NamedTuple):
    """What the robot walks around.

    Attributes:
        position: x, y [m].
        radius: [m] that the middle of the robot keeps from it.
        influence: [m] beyond `radius` over which it turns the robot away.
        gain: [1/s] Speed towards it over the room that is left.
    """

    position: Point2
    radius: float
    influence: float = 0.25
    gain: float = 0.5


def walk_to(
    target: Pose2,
    limits: WalkLimits,
    obstacles: Sequence[Round] = (),
    *,
    facing: tuple[float, float] = FACING,
) -> VelocityCommand:
    """The velocity that leads to a pose; at the target it is nearly 0.

    Args:
        target: x, y [m], yaw [rad] in base_footprint.
        limits: Largest speeds.
        obstacles: What to walk around.
        facing: [m] up to which the robot has the target's heading, and from which on it faces its
            way; in between it turns from one to the other.
    """
    x, y, yaw = target
    far = math.hypot(x, y)
    way = _around((x, y), obstacles)
    direction = math.atan2(way[1], way[0])
    near, beyond = facing
    share = min(max((far - near) / (beyond - near), 0.0), 1.0)
    turn = yaw + share * math.remainder(direction - yaw, math.tau)
    turn = TURN_GAIN * math.remainder(turn, math.tau)
    size = DISTANCE_GAIN * far
    if share > 0.0:  # a robot that looks elsewhere turns first
        size *= 1.0 - share + share * max(0.0, math.cos(direction)) ** 2
    top = math.hypot(way[0], way[1])
    if top > 0.0:
        # The ellipsoid keeps the direction; a far target asks for all the speed there is.
        size = min(size, 2.0 * limits.forward)
    vx, vy = (size * way[0] / top, size * way[1] / top) if top else (0.0, 0.0)
    # Far away the turn comes first, instead of side steps.
    first = min(max((far - beyond) / (beyond - near), 0.0), 1.0)
    vx, vy, _ = limits.command(vx, (1.0 - first) * vy, 0.0)
    left = 1.0 - first + first * math.sqrt(1.0 - min(1.0, abs(turn) / limits.turn) ** 2)
    return limits.command(left * vx, left * vy, turn)


def _around(target: Point2, obstacles: Sequence[Round]) -> Point2:
    """Direction of the potential field at the robot, not normalised.

    The target attracts with 1. An obstacle on the way pushes away and, more so, to the side on
    which the target is seen past it: alone, the push away has points where the sum is 0.
    """
    far = math.hypot(target[0], target[1])
    if far == 0.0:
        return 0.0, 0.0
    ux, uy = target[0] / far, target[1] / far
    fx, fy = ux, uy
    for position, radius, influence, _ in obstacles:
        gap = math.hypot(position[0], position[1])
        if gap == 0.0 or gap > radius + influence:
            continue
        ox, oy = position[0] / gap, position[1] / gap
        ahead = ux * ox + uy * oy
        if far < gap - radius and ahead > 0.0:
            continue  # the target is in front of it
        weight = min(1.0, (radius + influence - gap) / influence)
        if ahead > -0.2:  # it is beside or ahead
            side = 1.0 if ox * uy - oy * ux >= 0.0 else -1.0
            tx, ty = rotate_planar(ox, oy, side * math.pi / 2.0)
            # Along the circle, as far as the way would lead into it.
            into = max(0.0, fx * ox + fy * oy)
            fx += weight * (into * 1.5 * tx - into * ox)
            fy += weight * (into * 1.5 * ty - into * oy)
        if gap < radius:
            push = 1.5 * (radius - gap) / radius
            fx -= push * ox
            fy -= push * oy
    return fx, fy


def kept_apart(
    command: VelocityCommand, robots: Sequence[Round], limits: WalkLimits
) -> VelocityCommand:
    """The command without what would lead into another robot.

    The nearer a robot, the slower this one walks towards it and turns; from one that is too near it
    walks straight away before it does anything else.
    """
    if command.is_zero:
        return command
    x, y, yaw = command.x, command.y, command.yaw
    for place, radius, influence, gain in robots:
        gap = math.hypot(*place)
        if not 0.0 < gap < radius + influence:
            continue
        share = max(0.0, 1.0 + (gap - radius) / APART_STILL)
        yaw = min(max(yaw, -APART_TURN * share), APART_TURN * share)
        ox, oy = place[0] / gap, place[1] / gap
        towards, across = x * ox + y * oy, x * oy - y * ox
        towards = min(towards, max(gain * (gap - radius), -APART_RETREAT))
        if share < 1.0:
            across = min(max(across, -APART_RETREAT * share), APART_RETREAT * share)
        x, y = towards * ox + across * oy, towards * oy - across * ox
    return limits.command(x, y, yaw)


def turn_by(angle: float, limits: WalkLimits) -> VelocityCommand:
    """The velocity that turns on the spot by an angle [rad]."""
    if angle == 0.0:
        return STANDSTILL
    return limits.command(0.0, 0.0, TURN_GAIN * angle)
