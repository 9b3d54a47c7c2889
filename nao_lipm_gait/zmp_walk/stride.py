"""From a velocity command to the sizes of half strides of a fixed duration."""

from math import hypot, inf

from nao_lipm_gait.lipm_walk.step_size import Stride
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.signals import VelocityCommand


def stride_for(command: VelocityCommand, duration: float, parameters: GaitParameters) -> Stride:
    """The stride whose speed is the command, scaled into the ellipsoid of the limits.

    duration [s] of a full stride, two half strides.
    """
    stride = Stride(0.5 * command.x * duration, command.y * duration, command.yaw * duration)
    excess = limit_share(stride, parameters)
    scale = 1.0 if excess <= 1.0 else 1.0 / excess
    return Stride(stride.x * scale, stride.y * scale, stride.yaw * scale)


def limit_share(stride: Stride, parameters: GaitParameters) -> float:
    """How much of the step limits a stride uses; 1 = all."""
    p = parameters
    return hypot(
        _share(stride.x, p.step_forward_max if stride.x >= 0.0 else p.step_backward_max),
        _share(stride.y, p.step_side_max),
        _share(stride.yaw, p.step_turn_max),
    )


def _share(value: float, limit: float) -> float:
    if value == 0.0:
        return 0.0
    return value / limit if limit > 0.0 else inf
