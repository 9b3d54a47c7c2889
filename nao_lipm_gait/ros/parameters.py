"""ROS parameters with a range, a unit and a meaning; one rule checks them at start and later."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from nao_lipm_gait.errors import NaoGaitError, is_number
from nao_lipm_gait.schema import Field

Value = bool | int | float | str
AnyValue = TypeVar("AnyValue")
Loaded = TypeVar("Loaded")
_OURS_NOT = ("use_sim_time", "start_type_description_service")
"""Overrides that rclpy itself understands."""


@dataclass(frozen=True, slots=True)
class NodeParameter:
    """A parameter of a node that is not in the table of the gait. Its type is that of `default`."""

    name: str
    default: Value
    meaning: str
    unit: str = ""
    minimum: float = -math.inf
    maximum: float = math.inf
    choices: tuple[str, ...] = ()

    @property
    def allowed(self) -> str:
        if isinstance(self.default, bool):
            return "true or false"
        if isinstance(self.default, str):
            return f"one of {', '.join(self.choices)}" if self.choices else "a text"
        kind = "a whole number" if isinstance(self.default, int) else "a number"
        return f"{kind} from {self.minimum:.10g} to {self.maximum:.10g} {self.unit}".rstrip()

    def check(self, value: object) -> Value:
        """The value in its own type; NaoGaitError when it is of the wrong type or out of range."""
        if isinstance(self.default, bool):
            if isinstance(value, bool):
                return value
        elif isinstance(self.default, str):
            # Where nothing is the default, nothing may be said.
            said = isinstance(value, str) and (value or not self.default)
            if said and (not self.choices or value in self.choices):
                return str(value)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            fits = is_number(value) and self.minimum <= value <= self.maximum
            if fits and isinstance(self.default, float):
                return float(value)
            if fits and isinstance(value, int):
                return value
        raise NaoGaitError(self.name, value, self.allowed)


def declare(
    node: Node,
    parameter: NodeParameter | Field,
    default: Value | None = None,
    read_only: bool = True,
) -> Value:
    """Declare a parameter and return its value: the override from outside, or the default.

    The node must have been made with automatically_declare_parameters_from_overrides.
    Raises NaoGaitError for an override of the wrong type or out of range. A whole number will do
    for a float: `real_time_factor:=0` should not need a decimal point.
    """
    value: object = parameter.default if default is None else default
    if node.has_parameter(parameter.name):
        value = node.get_parameter(parameter.name).value
        node.undeclare_parameter(parameter.name)
    checked = parameter.check(value)
    descriptor = ParameterDescriptor(
        description=f"{parameter.meaning}; {parameter.allowed}",
        read_only=read_only,
        # Types are checked here and in `refusal`, with a message that says what is allowed.
        dynamic_typing=True,
    )
    is_number = not isinstance(parameter.default, bool | str)
    if is_number and isinstance(parameter.default, int):
        descriptor.integer_range = [
            IntegerRange(from_value=int(parameter.minimum), to_value=int(parameter.maximum))
        ]
    elif is_number:
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=parameter.minimum, to_value=parameter.maximum)
        ]
    node.declare_parameter(parameter.name, checked, descriptor, ignore_override=True)
    return checked


def unknown_overrides(node: Node, known: frozenset[str]) -> tuple[str, ...]:
    """Names given from outside that this node does not have: most likely a slip of the pen."""
    given = node.get_parameters_by_prefix("")
    return tuple(
        sorted(
            name
            for name in given
            if name not in known and name not in _OURS_NOT and not name.startswith("qos_overrides.")
        )
    )


def used_as(parameter: NodeParameter, load: Callable[[str], Loaded], value: str) -> Loaded:
    """What `load` makes of a parameter's value; its errors name the parameter first."""
    try:
        return load(value)
    except NaoGaitError as error:
        field = f"parameter {parameter.name}: {error.field}"
        raise NaoGaitError(field, error.value, error.allowed) from error


def of_type(value: Value, kind: type[AnyValue]) -> AnyValue:
    """`value`, for the type checker; its type has been checked by `declare`."""
    if not isinstance(value, kind):
        raise TypeError(f"{value!r} is not {kind.__name__}")
    return value


def accepted() -> SetParametersResult:
    return SetParametersResult(successful=True)


def refused(error: NaoGaitError) -> SetParametersResult:
    return SetParametersResult(successful=False, reason=str(error))


def as_mapping(parameters: list[RosParameter]) -> dict[str, object]:
    return {parameter.name: parameter.value for parameter in parameters}
