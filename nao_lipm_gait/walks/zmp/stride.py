"""From a velocity command to the sizes of half strides of a fixed duration."""

from math import hypot, inf

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.types import VelocityCommand
from nao_lipm_gait.walks.steps import Stride


def stride_for(command: VelocityCommand, duration: float, parameters: GaitParameters) -> Stride:
    """The stride whose speed is the command, scaled into the ellipsoid of the limits.

    duration [s] of a full stride, two half strides.
    """
    stride = Stride(0.5 * command.x * duration, command.y * duration, command.yaw * duration)
    stride = stride.open_part(parameters)
    excess = limit_share(stride, parameters)
    return stride if excess <= 1.0 else stride.scaled(1.0 / excess)


def limit_share(stride: Stride, parameters: GaitParameters) -> float:
    """How much of the step limits a stride uses; 1 = all."""
    x_max, y_max, yaw_max = stride.limits(parameters)
    return hypot(_share(stride.x, x_max), _share(stride.y, y_max), _share(stride.yaw, yaw_max))


def _share(value: float, limit: float) -> float:
    if value == 0.0:
        return 0.0
    return value / limit if limit > 0.0 else inf
