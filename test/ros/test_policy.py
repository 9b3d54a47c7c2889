"""The SROS2 policy allows all that the nodes publish, subscribe to and serve."""

from collections.abc import Iterable

import pytest

from ros_probe import Probe
from sros_policy import rights


def relative(names: Iterable[tuple[str, list[str]]], node: str) -> set[str]:
    """As in the policy: without the slash, and the node's own below `~`."""
    found = set()
    for name, _ in names:
        own = f"/{node}/"
        found.add(f"~/{name.removeprefix(own)}" if name.startswith(own) else name.lstrip("/"))
    return found


@pytest.mark.parametrize("name", ["gait", "sim_bridge"])
def test_the_policy_covers_what_the_node_does(probe: Probe, name: str) -> None:
    probe.start(name, **({"use_sim_time": True} if name == "gait" else {"cameras": True}))
    node = probe.node
    probe.wait(lambda: name in node.get_node_names(), f"the node {name}")
    allowed = {
        key: {each.lstrip("/") for each in names} for key, names in rights(name).items()
    }
    # Services are discovered last.
    last = "~/relax" if name == "gait" else "~/reset"
    probe.wait(
        lambda: last in relative(node.get_service_names_and_types_by_node(name, "/"), name), last
    )
    published = relative(node.get_publisher_names_and_types_by_node(name, "/"), name)
    subscribed = relative(node.get_subscriber_names_and_types_by_node(name, "/"), name)
    served = relative(node.get_service_names_and_types_by_node(name, "/"), name)
    assert published <= allowed["topic", "publish"]
    assert subscribed <= allowed["topic", "subscribe"]
    assert served <= allowed["service", "reply"]
    assert len(published) > 5
    assert len(subscribed) > 1
    assert len(served) > 5
