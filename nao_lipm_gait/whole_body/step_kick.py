"""Kicks in the walk: in its next step a foot swings through the ball, and lands a little farther.

A kick is a longer step, as far as the pendulum allows, whose foot swings out still farther and is
back before it lands: what is left of the swing at the landing would pull the support foot from
under the robot. The foot is lifted as high as usual where feet are kept low, since a low one gives
the ball half of its way. The placement of the CoM answers the moving leg. So a kick needs no stop.
"""

from collections.abc import Sequence
from math import cos, remainder, sin, tau

from nao_lipm_gait.walks.base import BodyTargets, SoleTarget
from nao_lipm_gait.walks.swing_foot import raised_cosine
from robot_core.geometry import relative
from robot_core.types import LEFT, Point2, Pose2

BEGIN, END = 0.3, 0.7
"""Shares of the step between which the foot swings out and back: it is up, and joints that lag by a
fifth of a step are back at its end."""
LONGER = 0.3
"""Extra length of the step, as a share of the reach of the swing."""
BALL = 0.05
"""[m] Radius of a ball that the request does not give, about."""
BEFORE, BEYOND = 0.05, 0.075
"""[m] from a ball that touches the foot to the nearest and the farthest one that it hits."""
BESIDE = 0.035
"""[m] from the ball to the line on which the middle of the foot swings."""
OUTWARDS, INWARDS = 1.6, 0.25
"""[rad] Largest angles of that line from straight ahead."""
HOLD = 0.5
"""[s] for which a request waits for a step that fits: a little more than both feet need."""


class StepKick:
    """Adds a kick to the targets of a walk.

    Args:
        outline: Corners x, y [m] of the left sole.
    """

    def __init__(self, outline: Sequence[Point2]) -> None:
        self._outline = outline
        self._goal: Pose2 | None = None
        self._radius = BALL
        self._waited = 0.0
        self._way: Point2 = (0.0, 0.0)
        self._lift = 0.0
        self._phase = 1.0

    def ask(self, ball: Pose2, radius: float) -> None:
        """Kick a ball; place and radius [m], direction of its way [rad] are those of the image."""
        self._goal, self._radius, self._waited = ball, radius, 0.0

    def begin_step(
        self, foot: int, base_footprint_in_odom: Pose2, spacing: float, reach: float,
        lift: float,
    ) -> float:  # fmt: skip
        """A foot, LEFT or RIGHT, begins to swing: kick, if the ball lies on its way.

        `spacing` [m] is the distance between the ankles; the foot swings by `reach` [m] beyond its
        way, and is lifted by `lift` [m] at least. Returns by how much [m] longer the step has to
        be; 0 without a kick.
        """
        self._phase, self._way, self._lift = 0.0, (0.0, 0.0), lift
        if self._goal is None:
            return 0.0
        x, y, direction = relative(self._goal, base_footprint_in_odom)
        side = 1.0 if foot == LEFT else -1.0
        y, outwards = side * y - 0.5 * spacing, side * remainder(direction, tau)
        outwards = min(max(outwards, -INWARDS), OUTWARDS)
        ux, uy = cos(outwards), sin(outwards)
        touching = self._radius + max(ux * px + uy * py for px, py in self._outline)
        along, across = x * ux + y * uy - touching, x * uy - y * ux
        if -BEFORE < along < BEYOND and abs(across) < BESIDE:
            self._goal, self._way = None, (reach * ux, side * reach * uy)
            return max(0.0, LONGER * self._way[0])
        return 0.0

    def apply(
        self, targets: BodyTargets, support: int, time_left: float, dt: float
    ) -> BodyTargets:
        """The targets of one tick with the kick.

        Args:
            targets: Those of the walk.
            support: Supporting leg, LEFT or RIGHT.
            time_left: [s] after this tick until the support changes.
            dt: [s] since the last tick that the walk moved on; 0 if it did not.
        """
        self._waited += dt
        if self._waited > HOLD:
            self._goal = None
        phase = self._phase
        if dt > 0.0:
            self._phase += (1.0 - phase) * dt / (dt + time_left)
        if self._way == (0.0, 0.0):
            return targets
        share = raised_cosine(2.0 * min(phase - BEGIN, END - phase) / (END - BEGIN))
        x, y = share * self._way[0], share * self._way[1]
        z = self._lift * raised_cosine(2.0 * min(phase, 1.0 - phase))
        left, right = targets.left_sole, targets.right_sole
        if support == LEFT:
            right = _moved(right, x, y, z)
        else:
            left = _moved(left, x, y, z)
        return targets.on_soles(targets.com_in_q, left, right)


def _moved(sole: SoleTarget, x: float, y: float, z: float) -> SoleTarget:
    return SoleTarget(sole.x + x, sole.y + y, max(sole.z, z), sole.yaw, sole.pitch, sole.roll)
