"""The SROS2 policy allows all that the nodes publish, subscribe to and serve."""

from collections.abc import Iterable
from fnmatch import fnmatchcase
from pathlib import Path

import pytest

from robot_core.ros.process import REFUSED
from ros_probe import Probe
from sros_policy import rights


def relative(names: Iterable[tuple[str, list[str]]], node: str) -> set[str]:
    """As in the policy: without the slash, and the node's own below `~`."""
    found = set()
    for name, _ in names:
        own = f"/{node}/"
        found.add(f"~/{name.removeprefix(own)}" if name.startswith(own) else name.lstrip("/"))
    return found


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("gait", {"use_sim_time": True}),
        ("sim_bridge", {"cameras": True}),
        ("sim_bridge", {"scene": "pitch_small", "cameras": True}),
        ("vision", {"use_sim_time": True}),
        ("player", {"use_sim_time": True}),
        ("referee", {"use_sim_time": True}),
        ("lola_bridge", {"socket": "lola", "sit_time": 0.5}),
        ("lola_server", {"socket": "lola"}),
    ],
    ids=["gait", "bridge", "scene", "vision", "player", "referee", "lola_bridge", "lola_server"],
)
def test_the_policy_covers_what_the_node_does(
    probe: Probe, name: str, parameters: dict[str, object], tmp_path: Path
) -> None:
    if "socket" in parameters:
        parameters = {**parameters, "socket": tmp_path / "lola"}
    if name in ("player", "referee"):
        parameters = parameters | probe.udp_ports
    probe.start(name, **parameters)
    node = probe.node
    probe.wait(lambda: name in node.get_node_names(), f"the node {name}")
    allowed = {key: {each.lstrip("/") for each in names} for key, names in rights(name).items()}
    # Services are discovered last.
    last = {"gait": "~/relax", "sim_bridge": "~/reset"}.get(name, "~/get_type_description")
    probe.wait(
        lambda: last in relative(node.get_service_names_and_types_by_node(name, "/"), name), last
    )
    probe.wait(
        lambda: len(node.get_publisher_names_and_types_by_node(name, "/")) > 3
        and len(node.get_subscriber_names_and_types_by_node(name, "/")) > 0,
        "publishers and subscriptions",
    )
    published = relative(node.get_publisher_names_and_types_by_node(name, "/"), name)
    subscribed = relative(node.get_subscriber_names_and_types_by_node(name, "/"), name)
    served = relative(node.get_service_names_and_types_by_node(name, "/"), name)
    assert not forbidden(published, allowed["topic", "publish"])
    assert not forbidden(subscribed, allowed["topic", "subscribe"])
    assert not forbidden(served, allowed["service", "reply"])


def forbidden(names: set[str], allowed: set[str]) -> set[str]:
    """Names that match no expression of the policy; `*` stands for any text, as in DDS."""
    return {name for name in names if not any(fnmatchcase(name, each) for each in allowed)}


def test_a_node_that_must_encrypt_and_cannot_does_not_run(
    probe: Probe, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Without keys, or without security in the middleware: it must not run open."""
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Enforce")
    monkeypatch.setenv("ROS_SECURITY_KEYSTORE", str(tmp_path))
    gait = probe.start("gait")
    assert gait.wait() == REFUSED
    assert gait.says(r"(?m)^gait: .+ecurity")
