"""Step sizes from velocity commands: what all walk engines share.

Forward, every step covers the same distance. Sideways and in turns the feet differ: the leading
foot (on the side of the motion) opens, the trailing foot closes, and only the sum of both steps is
what the command asks for.
"""

from math import hypot, sqrt, tan
from typing import NamedTuple

from nao_lipm_gait.parameters import GaitParameters
from robot_core.rate_limiter import limited_step
from robot_core.types import LEFT, RIGHT, Pose2, VelocityCommand

SHARE_MAX = 1e75
"""Cap on the used share of one step limit, so that a power of it is finite."""
SIDE_RATE = 0.03
"""Largest change of the side step size from step to step [m]."""


class Stride(NamedTuple):
    """Motion of both feet together.

    Attributes:
        x: Forward distance per step, as the mean of both feet [m].
        y: Distance to the left per double step [m].
        yaw: Turn per double step [rad].
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    @property
    def is_zero(self) -> bool:
        """Whether it is a step in place."""
        return self.x == 0.0 and self.y == 0.0 and self.yaw == 0.0

    def limits(self, parameters: GaitParameters) -> tuple[float, float, float]:
        """Largest x [m], y [m] and yaw [rad] in the directions of this stride."""
        p = parameters
        x_limit = p.step_forward_max if self.x >= 0.0 else p.step_backward_max
        return x_limit, p.step_side_max, p.step_turn_max

    def used_shares(self, parameters: GaitParameters) -> tuple[float, float, float]:
        """Share of each limit that this stride uses; infinite where the limit is 0."""
        x_max, y_max, yaw_max = self.limits(parameters)
        return _share(self.x, x_max), _share(self.y, y_max), _share(self.yaw, yaw_max)

    def open_part(self, parameters: GaitParameters) -> "Stride":
        """This stride without the axes whose limit is 0; the other axes are walked."""
        x_max, y_max, yaw_max = self.limits(parameters)
        return Stride(
            self.x if x_max > 0.0 else 0.0,
            self.y if y_max > 0.0 else 0.0,
            self.yaw if yaw_max > 0.0 else 0.0,
        )

    def scaled(self, share: float) -> "Stride":
        """All three components times `share`."""
        return Stride(self.x * share, self.y * share, self.yaw * share)

    def of_step(self, swing: int, parameters: GaitParameters) -> Pose2:
        """Step size of the step in which the leg `swing` (LEFT or RIGHT) moves, as a pose of Q."""
        side_share = parameters.step_side_share
        turn_share = parameters.step_turn_share
        if swing * self.y < 0.0:
            side_share = 1.0 - side_share
        if swing * self.yaw < 0.0:
            turn_share = 1.0 - turn_share
        forward_share = opening_share(abs(self.y), parameters)
        if swing * self.y < 0.0:
            forward_share = 1.0 - forward_share
        x, y, yaw = 2.0 * forward_share * self.x, side_share * self.y, turn_share * self.yaw
        # A curve is an arc: its chord points half a turn to the side.
        half = tan(0.5 * yaw)
        return x - half * y, y + half * x, yaw


STEP_IN_PLACE = Stride()


def _share(value: float, limit: float) -> float:
    if value == 0.0:
        return 0.0
    return min(abs(value / limit), SHARE_MAX) if limit > 0.0 else float("inf")


# -- limits ----------------------------------------------------------------------------------------


def ellipsoid_share(stride: Stride, parameters: GaitParameters) -> float:
    """Share of the step limits that a stride uses if they form an ellipsoid; 1 = all."""
    return hypot(*stride.used_shares(parameters))


def asked_stride(
    command: VelocityCommand, double_step: float, parameters: GaitParameters
) -> Stride:
    """The stride that walks the commanded velocity in double steps of this duration [s]."""
    asked = Stride(0.5 * command.x, command.y, command.yaw).scaled(double_step)
    return asked.open_part(parameters)


def within_limits(stride: Stride, share: float) -> Stride:
    """A stride that uses `share` of the step limits, scaled into them with its direction kept."""
    return stride if share <= 1.0 else stride.scaled(1.0 / share)


def approach(current: Stride, wanted: Stride, parameters: GaitParameters) -> Stride:
    """The stride one step after `current` on the way to `wanted`, within the rate limits."""
    return Stride(
        limited_step(current.x, wanted.x, parameters.step_forward_rate),
        limited_step(current.y, wanted.y, SIDE_RATE),
        limited_step(current.yaw, wanted.yaw, parameters.step_turn_rate),
    )


# -- feet ------------------------------------------------------------------------------------------


def home_sole(side: int, parameters: GaitParameters) -> Pose2:
    """Pose of a sole in its Q: the optimal origin (r_x = 0) is ahead of the ankle."""
    return -parameters.foot_reference_x, side * 0.5 * parameters.foot_spacing, 0.0


def closer_soles(left: Pose2, right: Pose2, inward: float) -> tuple[Pose2, Pose2]:
    """Two soles in Q, each moved by `inward` [m] towards the other one."""
    return (left[0], left[1] - inward, left[2]), (right[0], right[1] + inward, right[2])


def first_support(command: VelocityCommand) -> int:
    """The leg that supports before the first step: the foot that leads the motion steps first."""
    return LEFT if command.y > 0.0 or (command.y == 0.0 and command.yaw > 0.0) else RIGHT


def exchange_distances(side: float, parameters: GaitParameters) -> tuple[float, float]:
    """Distances of the CoM from the pendulum origin at the end of an opening and a closing step.

    With pendulums of equal width, the support changes half-way between two origins.

    Args:
        side: Distance per double step to either side [m], not negative.
        parameters: Parameters of the gait.

    Returns:
        Lateral distances at the end of the opening and of the closing step [m].
    """
    opening = parameters.pendulum_offset_y + 0.5 * parameters.step_side_share * side
    closing = parameters.pendulum_offset_y - 0.5 * (1.0 - parameters.step_side_share) * side
    return opening, closing


def exchange_leads(side: float, parameters: GaitParameters) -> tuple[float, float]:
    """How far the CoM is ahead of the pendulum origin at the end of both steps of a double step.

    It is sinh(k t) for the time t from the lateral turning point to the exchange at the distance d,
    where cosh(k t) = d / width; eqs (1) and (3).

    Args:
        side: Distance per double step to either side [m], not negative.
        parameters: Parameters of the gait.

    Returns:
        Leads at the end of the opening and of the closing step, as multiples of v_0 / k; v_0 is the
        forward speed of the CoM over the origin.
    """
    opening, closing = exchange_distances(side, parameters)
    width = parameters.pendulum_width
    return _lead(opening / width), _lead(closing / width)


def _lead(cosh_kt: float) -> float:
    return sqrt(max(cosh_kt * cosh_kt - 1.0, 0.0))


def opening_share(side: float, parameters: GaitParameters) -> float:
    """Share of the forward distance that the opening step of a diagonal walk covers.

    With this share the CoM passes both origins with the same speed.

    Args:
        side: Distance per double step to either side [m], not negative.
        parameters: Parameters of the gait.

    Returns:
        The share, 0 to 1; 0.5 without side motion.
    """
    opening, closing = exchange_leads(side, parameters)
    return opening / (opening + closing) if opening > 0.0 else 0.5
