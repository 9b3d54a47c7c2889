"""The parameters of the running gait, read and set by a command.

rclpy is imported inside the functions: the ROS wheels restart the interpreter at the first import.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from robot_core.errors import NaoGaitError
from robot_core.ros.patience import ANSWER

if TYPE_CHECKING:
    from rclpy.node import Node

AGAIN = 1.0
"""Wall time [s] after which a request is sent again: it or its answer may be lost."""


class GaitParameters:
    """Reads and sets parameters of the node `gait` of a namespace.

    Args:
        node: The node of the command.
        spin: Lets the node take what has come; it may raise what ends the command.
    """

    def __init__(self, node: "Node", spin: Callable[[], None]) -> None:
        from rcl_interfaces.srv import GetParameters, SetParametersAtomically

        self._reader = node.create_client(GetParameters, "gait/get_parameters")
        self._writer = node.create_client(
            SetParametersAtomically, "gait/set_parameters_atomically"
        )
        self._spin = spin

    def read(self, names: Sequence[str]) -> list[float | str]:
        """Numbers and texts by name; NaoGaitError if the gait does not answer."""
        from rcl_interfaces.srv import GetParameters
        from rclpy.parameter import parameter_value_to_python

        answer = self._ask(self._reader, GetParameters.Request(names=list(names)))
        return [parameter_value_to_python(value) for value in answer.values]

    def write(self, values: Mapping[str, float]) -> None:
        """Set numbers; NaoGaitError if the gait refuses them, or does not answer."""
        from rcl_interfaces.srv import SetParametersAtomically
        from rclpy.parameter import Parameter

        messages = [Parameter(name, value=value).to_parameter_msg()
                    for name, value in values.items()]  # fmt: skip
        request = SetParametersAtomically.Request(parameters=messages)
        result = self._ask(self._writer, request).result
        if not result.successful:
            raise NaoGaitError("parameters of the gait", dict(values), result.reason)

    def _ask(self, client: Any, request: Any) -> Any:
        end, again = time.monotonic() + ANSWER, 0.0
        answers: list[Any] = []
        while time.monotonic() < end:
            if time.monotonic() > again and client.service_is_ready():
                again = time.monotonic() + AGAIN
                answers.append(client.call_async(request))
            self._spin()
            done = [answer.result() for answer in answers if answer.done()]
            if done:
                return done[0]
        raise NaoGaitError(client.srv_name, "nothing", f"an answer within {ANSWER:g} s")
