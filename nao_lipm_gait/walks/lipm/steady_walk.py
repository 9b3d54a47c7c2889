"""The undisturbed walk on pendulums: durations and sizes of its steps for a velocity command."""

from math import sqrt

from nao_lipm_gait.walks.lipm.parameters import LipmParameters
from nao_lipm_gait.walks.pendulum import half_step_duration, natural_frequency
from nao_lipm_gait.walks.steps import (
    Stride,
    asked_stride,
    exchange_distances,
    exchange_leads,
    within_limits,
)
from robot_core.types import VelocityCommand

HARD, AGAINST, DIAGONAL = 4.0, 2.0, 1.0
"""Weights of products of two shares in the square of the whole share; with 2 two shares add up.
Hard are curves, in which each step sees part of the motion ahead as one to the side and ends too
early or too late, and diagonals back. Next are side steps with a turn against them, around
something ahead; then diagonals ahead."""
DURATION_MIN = 1e-3
"""Shortest nominal double step [s]; a pendulum as wide as its offset would need no time."""


def double_step_duration(side: float, parameters: LipmParameters) -> float:
    """Duration of an undisturbed double step [s], from eq (3).

    The CoM moves to each of the two exchange distances and back from it.

    Args:
        side: Distance per double step to either side [m], not negative.
        parameters: Parameters of the gait.

    Returns:
        The duration [s].
    """
    k = natural_frequency(parameters.pendulum_height)
    opening, closing = exchange_distances(side, parameters)
    width = parameters.pendulum_width
    return 2.0 * (half_step_duration(width, opening, k) + half_step_duration(width, closing, k))


def limit_share(stride: Stride, parameters: LipmParameters) -> float:
    """Share of the step limits that a stride uses; 1 = all.

    Without the extensions the limits form an ellipsoid. With them some pairs of directions count
    more, because they bear less together.
    """
    x, y, yaw = stride.used_shares(parameters)
    load = x * x + y * y + yaw * yaw
    if parameters.extensions:
        against = AGAINST if stride.y * stride.yaw < 0.0 else 0.0
        diagonal = DIAGONAL if stride.x >= 0.0 else HARD
        load += HARD * x * yaw + diagonal * x * y + against * y * yaw
    return sqrt(load)


def stride_for(
    command: VelocityCommand, parameters: LipmParameters, pace: float = 1.0
) -> Stride:
    """The stride that walks the commanded velocity, scaled into the step limits.

    Args:
        command: Commanded velocity.
        parameters: Parameters of the gait.
        pace: Measured duration of the steps as a share of the nominal one; see `Pace`.

    Returns:
        The stride.
    """
    side_limit = parameters.step_side_max
    side = 0.0
    double_step = pace * double_step_duration(side, parameters)
    for _ in range(4):
        # A wider side step takes longer, which makes it wider still.
        side = min(abs(command.y) * double_step, side_limit)
        double_step = pace * double_step_duration(side, parameters)
    stride = asked_stride(command, double_step, parameters)
    return within_limits(stride, limit_share(stride, parameters))


def passing_speed(stride: Stride, parameters: LipmParameters) -> float:
    """v_0 / k [m]: forward speed of the CoM over a pendulum origin in the undisturbed walk."""
    opening, closing = exchange_leads(abs(stride.y), parameters)
    leads = opening + closing
    return stride.x / leads if leads > 0.0 else 0.0


class Pace:
    """Measured duration of the steps as a share of the nominal duration.

    The feedback ends a step when the observed CoM is ready for it, usually a little early. Without
    this correction the robot would walk faster than commanded.

    Attributes:
        share: The share; 1 before the first double step.
    """

    SMOOTHING = 0.2  # weight of a new step in the mean
    LIMITS = (0.75, 1.25)

    def __init__(self) -> None:
        self.share = 1.0
        self._last: float | None = None

    def add(self, duration: float, stride: Stride, parameters: LipmParameters) -> None:
        """Add the measured duration [s] of a step of this stride."""
        if self._last is not None:
            nominal = max(double_step_duration(abs(stride.y), parameters), DURATION_MIN)
            share = (self._last + duration) / nominal
            share = min(max(share, self.LIMITS[0]), self.LIMITS[1])
            self.share += self.SMOOTHING * (share - self.share)
        self._last = duration
