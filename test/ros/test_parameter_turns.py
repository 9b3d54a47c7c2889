"""A request for many parameters lets the node do its other work after each of them."""

from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("rclpy")

from rcl_interfaces.msg import Parameter, ParameterValue, SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.exceptions import ParameterNotDeclaredException

from robot_core.ros.parameters import MOST_AT_ONCE, set_in_turns


class Node:
    """What is used of a node.

    Attributes:
        given: Names of the parameters that were set, in order.
        callback: Of the service `set_parameters`.
        at_once: Of the service `set_parameters_atomically`.
        woken: Times that the executor was asked to go on.
    """

    def __init__(self) -> None:
        names = ("other", "set_parameters", "set_parameters_atomically")
        self.services = [SimpleNamespace(srv_name=f"gait/{name}") for name in names]
        self.given: list[str] = []
        self.callback: Any = None
        self.at_once: Any = None
        self.woken = 0
        self.executor = self

    def get_name(self) -> str:
        return "gait"

    def destroy_service(self, service: SimpleNamespace) -> None:
        self.services.remove(service)

    def create_service(self, kind: type, name: str, callback: Any, **_: object) -> None:
        if kind is SetParametersAtomically:
            assert name == "gait/set_parameters_atomically"
            self.at_once = callback
        else:
            assert (kind, name) == (SetParameters, "gait/set_parameters")
            self.callback = callback

    def create_task(self, callback: Any) -> None:
        callback()
        self.woken += 1

    def set_parameters_atomically(self, parameters: list[Any]) -> SetParametersResult:
        for parameter in parameters:
            if parameter.name == "unknown":
                raise ParameterNotDeclaredException(parameter.name)
            self.given.append(parameter.name)
        return SetParametersResult(successful=True)


def test_one_parameter_is_set_in_each_turn() -> None:
    node = Node()
    set_in_turns(node)  # type: ignore[arg-type]
    assert [service.srv_name for service in node.services] == ["gait/other"]
    names = ["a", "unknown", "b", "c"]
    value = ParameterValue(type=3, double_value=1.0)
    request = SetParameters.Request(parameters=[Parameter(name=n, value=value) for n in names])
    answer = node.callback(request, SetParameters.Response())
    for turn in range(1, len(names) + 1):
        answer.send(None)
        assert node.woken == turn
        assert node.given == [name for name in names[:turn] if name != "unknown"]
    with pytest.raises(StopIteration) as end:
        answer.send(None)
    assert [result.successful for result in end.value.value.results] == [True, False, True, True]


def test_too_many_parameters_at_once_are_refused() -> None:
    node = Node()
    set_in_turns(node)  # type: ignore[arg-type]
    many = [Parameter(name="a", value=ParameterValue(type=3))] * (MOST_AT_ONCE + 1)
    with pytest.raises(StopIteration) as end:
        node.callback(SetParameters.Request(parameters=many), SetParameters.Response()).send(None)
    (result,) = end.value.value.results
    request, response = SetParametersAtomically.Request(), SetParametersAtomically.Response()
    request.parameters = many
    for refused in (result, node.at_once(request, response).result):
        assert not refused.successful
        assert "201 at once" in refused.reason
    assert node.given == []
    request.parameters = many[:2]
    assert node.at_once(request, response).result.successful
    request.parameters = [Parameter(name="unknown", value=ParameterValue(type=3))]
    assert "unknown" in node.at_once(request, response).result.reason
    assert node.given == ["a", "a"]
