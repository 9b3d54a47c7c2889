"""ROS parameters from fields of the schema: declared, checked at start and on every change."""

import difflib
import math
from collections.abc import Callable, Generator, Iterable
from typing import Any, TypeVar

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.qos import qos_profile_parameters

from robot_core.errors import NaoGaitError, is_number
from robot_core.robot import RobotDescription, load_robot
from robot_core.schema import Choice, Field, Kind, Number, Switch, Text

Value = bool | int | float | str
Loaded = TypeVar("Loaded")
_OF_RCLPY = frozenset({"use_sim_time", "start_type_description_service"})
"""Overrides that rclpy itself understands."""


def node_parameter(
    name: str,
    default: Value,
    meaning: str,
    unit: str = "",
    minimum: float = -math.inf,
    maximum: float = math.inf,
    choices: tuple[str, ...] = (),
) -> Field:
    """A parameter of a node beside the gait's own; its type is that of `default`.

    Args:
        name: Name of the ROS parameter.
        default: Value if none is given; an empty text is accepted only if it is the default.
        meaning: One sentence for the descriptor.
        unit: Unit of a number.
        minimum: Smallest value of a number.
        maximum: Largest value of a number.
        choices: The words that a text can be; empty = any.

    Returns:
        The field.
    """
    kind: Kind
    if isinstance(default, bool):
        kind = Switch()
    elif isinstance(default, str):
        kind = Choice(choices) if choices else Text(empty=not default)
    else:
        kind = Number(minimum, maximum, unit, whole=isinstance(default, int))
    return Field(name, default, kind, meaning)


URDF = node_parameter("urdf", "nao_h21_v33", "robot: a shipped name, or a URDF, MJCF or robot file")
ROBOT = node_parameter("robot", "", "the same as urdf; empty = that")
FRAME_PREFIX = Field(
    "frame_prefix", "",
    Text(empty=True, pattern=r"([^\s/]\S*)?", description="a name that does not begin with /"),
    "before the names of all frames, as of robot_state_publisher: robot1/",
)  # fmt: skip


def declare(
    node: Node, field: Field, default: Value | None = None, read_only: bool = True
) -> Any:
    """Declare a parameter and return its value.

    A whole number is accepted for a float: `real_time_factor:=0`.

    Args:
        node: Made with automatically_declare_parameters_from_overrides.
        field: The parameter.
        default: Replaces the default of the field.
        read_only: The parameter cannot be set later.

    Returns:
        The override if there is one, else the default; of the field's type.

    Raises:
        NaoGaitError: The override has the wrong type or is out of range.
    """
    value: object = field.default if default is None else default
    if node.has_parameter(field.name):
        value = node.get_parameter(field.name).value
        node.undeclare_parameter(field.name)
    checked = field.check(value)
    descriptor = ParameterDescriptor(
        description=f"{field.meaning} ({field.allowed})",
        read_only=read_only,
        # Types are checked here and in the node, with a message that says what is allowed.
        dynamic_typing=True,
    )
    if isinstance(field.kind, Number) and field.kind.whole:
        span = IntegerRange(from_value=int(field.minimum), to_value=int(field.maximum))
        descriptor.integer_range = [span]
    elif field.is_number:
        limits = FloatingPointRange(from_value=field.minimum, to_value=field.maximum)
        descriptor.floating_point_range = [limits]
    node.declare_parameter(field.name, checked, descriptor, ignore_override=True)
    return checked


def keep_types(node: Node, fields: Iterable[Field]) -> None:
    """Let a float parameter that is set to a whole number stay a float."""
    floats = {
        field.name
        for field in fields
        if isinstance(field.kind, Number) and not field.kind.whole
    }

    def converted(parameters: list[RosParameter]) -> list[RosParameter]:
        return [
            RosParameter(each.name, RosParameter.Type.DOUBLE, float(each.value))
            if each.name in floats
            and each.type_ is RosParameter.Type.INTEGER
            and is_number(each.value)
            else each
            for each in parameters
        ]

    node.add_pre_set_parameters_callback(converted)


MOST_AT_ONCE = 200
"""Parameters in a request; rclpy alone reads 3,000 for 20 ms, and sets them for 70."""


def _too_many(
    request: SetParameters.Request | SetParametersAtomically.Request,
) -> SetParametersResult | None:
    """The refusal of a request that would hold up the node; None if it does not."""
    count = len(request.parameters)
    if count <= MOST_AT_ONCE:
        return None
    error = NaoGaitError("parameters", f"{count} at once", f"at most {MOST_AT_ONCE} in a request")
    return SetParametersResult(successful=False, reason=str(error))


class _Turn:
    """Awaited, it lets the executor serve what is ready."""

    def __init__(self, node: Node) -> None:
        if node.executor is not None:
            node.executor.create_task(int)  # wakes it: it would wait for a message

    def __await__(self) -> Generator[None, None, None]:
        yield


def set_in_turns(node: Node) -> None:
    """Let `set_parameters` serve what is ready after each parameter; refuse too many of them.

    rclpy sets all parameters of a request in one callback; a file of them would hold up a tick. The
    service has a group of its own, because a group is blocked until a callback has ended.
    """
    name = f"{node.get_name()}/set_parameters"
    at_once = f"{name}_atomically"

    async def set_each(
        request: SetParameters.Request, response: SetParameters.Response
    ) -> SetParameters.Response:
        refusal = _too_many(request)
        if refusal is not None:
            response.results = [refusal]
            return response
        for message in request.parameters:
            try:
                result = node.set_parameters_atomically([RosParameter.from_parameter_msg(message)])
            except ParameterNotDeclaredException as error:
                result = SetParametersResult(successful=False, reason=str(error))
            response.results.append(result)
            await _Turn(node)
        return response

    def set_all(
        request: SetParametersAtomically.Request, response: SetParametersAtomically.Response
    ) -> SetParametersAtomically.Response:
        refusal = _too_many(request)
        try:
            response.result = refusal or node.set_parameters_atomically(
                [RosParameter.from_parameter_msg(each) for each in request.parameters]
            )
        except ParameterNotDeclaredException as error:
            response.result = SetParametersResult(successful=False, reason=str(error))
        return response

    for service in tuple(node.services):
        if service.srv_name.endswith((name, at_once)):
            node.destroy_service(service)
    node.create_service(
        SetParametersAtomically, at_once, set_all, qos_profile=qos_profile_parameters
    )
    node.create_service(
        SetParameters, name, set_each, qos_profile=qos_profile_parameters,
        callback_group=MutuallyExclusiveCallbackGroup(),
    )  # fmt: skip


def warn_of_unknown_overrides(node: Node, known: Iterable[str]) -> None:
    """Log the overrides that this node does not have, which are probably misspelled."""
    given = node.get_parameters_by_prefix("").keys()
    for name in sorted(given - set(known) - _OF_RCLPY):
        if not name.startswith("qos_overrides."):
            node.get_logger().warning(
                f"parameter {name}: unknown and ignored{_meant(name, known)}"
            )


def _meant(name: str, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(name, known, 1)
    return f"; did you mean {near[0]}?" if near else "; see docs/ros.md"


def load_parameter_file(node: Node, field: Field, load: Callable[[str], Loaded]) -> Loaded:
    """Declare a parameter that names a file and load it; errors name the parameter first."""
    return load_from(field, load, declare(node, field))


def load_robot_parameter(node: Node) -> RobotDescription:
    """Declare `URDF` and `ROBOT`, and load the robot that one of them names.

    Raises:
        NaoGaitError: Both are given and differ, or the robot cannot be loaded.
    """
    given = node.has_parameter(URDF.name)
    asked, model = declare(node, ROBOT), declare(node, URDF)
    if not asked:
        return load_from(URDF, load_robot, model)
    if given and asked != model:
        raise NaoGaitError(ROBOT.name, asked, f"one of robot and urdf, which is {model}")
    return load_from(ROBOT, load_robot, asked)


def load_from(field: Field, load: Callable[[str], Loaded], value: str) -> Loaded:
    """Load the file that a declared parameter names; a NaoGaitError names the parameter first."""
    try:
        return load(value)
    except NaoGaitError as error:
        path = f"parameter {field.name}"
        if error.value != value:  # of something in the file
            path += f": {error.field}"
        raise NaoGaitError(path, error.value, error.allowed) from error


def accepted() -> SetParametersResult:
    """The answer to a change that is taken."""
    return SetParametersResult(successful=True)


def refused(error: NaoGaitError) -> SetParametersResult:
    """The answer to a change that is refused; the reason names parameter, value and range."""
    return SetParametersResult(successful=False, reason=str(error))


def as_mapping(parameters: list[RosParameter]) -> dict[str, object]:
    """Values by name."""
    return {parameter.name: parameter.value for parameter in parameters}
