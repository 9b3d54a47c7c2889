"""From a velocity command to the sizes of the steps.

Forward, every step covers the same distance. Sideways and in turning the two feet differ: the
leading foot (the one on the side of the motion) opens, the trailing foot closes, and only the sum
over both is what was asked for.
"""

from math import sqrt, tan
from typing import NamedTuple

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.types import Pose2, VelocityCommand
from nao_lipm_gait.walks.pendulum import half_step_duration, natural_frequency


class Stride(NamedTuple):
    """What both feet do: x per step, on average [m]; y [m] and yaw [rad] per double step."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    @property
    def is_zero(self) -> bool:
        return self.x == 0.0 and self.y == 0.0 and self.yaw == 0.0

    def limits(self, parameters: GaitParameters) -> tuple[float, float, float]:
        """The largest x [m], y [m] and yaw [rad] into the directions of this stride."""
        p = parameters
        x_limit = p.step_forward_max if self.x >= 0.0 else p.step_backward_max
        return x_limit, p.step_side_max, p.step_turn_max

    def open_part(self, parameters: GaitParameters) -> "Stride":
        """What is left of it where a limit of 0 closes an axis: the others are walked all the same,
        also when it is the heading hold that asks for a turn.
        """
        x_max, y_max, yaw_max = self.limits(parameters)
        return Stride(
            self.x if x_max > 0.0 else 0.0,
            self.y if y_max > 0.0 else 0.0,
            self.yaw if yaw_max > 0.0 else 0.0,
        )

    def scaled(self, share: float) -> "Stride":
        return Stride(self.x * share, self.y * share, self.yaw * share)

    def of_step(self, swing: int, parameters: GaitParameters) -> Pose2:
        """The share of the step in which the leg `swing` (LEFT = 1, RIGHT = -1) moves."""
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


def exchange_distances(side: float, parameters: GaitParameters) -> tuple[float, float]:
    """Distance [m] of the CoM from both origins where the opening and the closing step end.

    With equal pendulum widths the support changes half-way between the two origins; side >= 0 [m]
    per double step.
    """
    opening = parameters.pendulum_offset_y + 0.5 * parameters.step_side_share * side
    closing = parameters.pendulum_offset_y - 0.5 * (1.0 - parameters.step_side_share) * side
    return opening, closing


def exchange_leads(side: float, parameters: GaitParameters) -> tuple[float, float]:
    """How far the CoM is ahead of both origins where the opening and the closing step end, as a
    share of v0 / k, v0 being its speed where it passes an origin at the lateral turning point.

    That is sinh(k t) for the time t to the exchange distance d, where cosh(k t) = d / w.
    """
    opening, closing = exchange_distances(side, parameters)
    width = parameters.pendulum_width
    return _lead(opening / width), _lead(closing / width)


def _lead(cosh_kt: float) -> float:
    return sqrt(max(cosh_kt * cosh_kt - 1.0, 0.0))


def opening_share(side: float, parameters: GaitParameters) -> float:
    """The share of the way forward that belongs to the opening step of a walk that also goes
    sideways, so that the CoM passes both origins with the same speed.
    """
    opening, closing = exchange_leads(side, parameters)
    return opening / (opening + closing) if opening > 0.0 else 0.5


def passing_speed(stride: Stride, parameters: GaitParameters) -> float:
    """v0 / k [m] of the steady walk with this stride: its CoM's speed where it passes an origin."""
    opening, closing = exchange_leads(abs(stride.y), parameters)
    leads = opening + closing
    return stride.x / leads if leads > 0.0 else 0.0


def double_step_duration(side: float, parameters: GaitParameters) -> float:
    """Duration [s] of a steady double step that covers `side` >= 0 [m] sideways.

    Each of the two exchange distances is run up to by one foot and away from by the other.
    """
    k = natural_frequency(parameters.pendulum_height)
    opening, closing = exchange_distances(side, parameters)
    width = parameters.pendulum_width
    return 2.0 * (half_step_duration(width, opening, k) + half_step_duration(width, closing, k))


SHORTEST = 1e-3
"""[s]"""
FAR = 1e75
"""Times a limit: its power by the largest `step_limit_norm` is still a number."""


class Pace:
    """How long steps really last, as a share of what the undisturbed pendulum would take.

    The feedback ends steps when the observed CoM is ready for it, mostly a little early. Without
    this share the robot would walk faster than it was asked to.
    """

    SMOOTHING = 0.2
    """Share of a new step in the mean."""
    LIMITS = (0.75, 1.25)

    def __init__(self) -> None:
        self.share = 1.0
        self._last: float | None = None

    def add(self, duration: float, stride: Stride, parameters: GaitParameters) -> None:
        """A step of this stride has lasted `duration` [s]."""
        if self._last is not None:
            # A pendulum as wide as its offset would need no time at all.
            nominal = max(double_step_duration(abs(stride.y), parameters), SHORTEST)
            share = (self._last + duration) / nominal
            share = min(max(share, self.LIMITS[0]), self.LIMITS[1])
            self.share += self.SMOOTHING * (share - self.share)
        self._last = duration


def stride_for(
    command: VelocityCommand, parameters: GaitParameters, pace: float = 1.0
) -> Stride:
    """The steady stride whose speed is the command, scaled into the limits.

    pace: real duration of steps as a share of the nominal one.
    """
    side_limit = parameters.step_side_max
    side = 0.0
    double_step = pace * double_step_duration(side, parameters)
    for _ in range(4):
        # A wider side step takes longer, which makes it wider still.
        side = min(abs(command.y) * double_step, side_limit)
        double_step = pace * double_step_duration(side, parameters)
    # In the direction of the command, also where it is too fast: all three are scaled together.
    asked = Stride(0.5 * command.x, command.y, command.yaw).scaled(double_step)
    stride = asked.open_part(parameters)
    excess = limit_share(stride, parameters)
    return stride if excess <= 1.0 else stride.scaled(1.0 / excess)


def limit_share(stride: Stride, parameters: GaitParameters) -> float:
    """How much of the step limits a stride uses; 1 = all."""
    norm = parameters.step_limit_norm
    x_max, y_max, yaw_max = stride.limits(parameters)
    used = _share(stride.x, x_max) ** norm + _share(stride.y, y_max) ** norm
    return (used + _share(stride.yaw, yaw_max) ** norm) ** (1.0 / norm)


def _share(value: float, limit: float) -> float:
    if value == 0.0:
        return 0.0
    return min(abs(value / limit), FAR) if limit > 0.0 else float("inf")


def approach(current: Stride, wanted: Stride, parameters: GaitParameters) -> Stride:
    """One step's worth of change from `current` towards `wanted`, inside the rate limits."""
    return Stride(
        _toward(current.x, wanted.x, parameters.step_forward_rate),
        _toward(current.y, wanted.y, parameters.step_side_rate),
        _toward(current.yaw, wanted.yaw, parameters.step_turn_rate),
    )


def _toward(current: float, wanted: float, rate: float) -> float:
    return min(max(wanted, current - rate), current + rate)
