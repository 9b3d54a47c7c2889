"""Nodes that hold simulated time in lockstep, without ROS processes."""

from std_msgs.msg import Header

from robot_core.ros.lockstep import LockstepPartners
from robot_core.ros.messages import to_time

MS = 1_000_000


def until(name: str, milliseconds: int) -> Header:
    return Header(frame_id=name, stamp=to_time(milliseconds * MS))


def test_time_runs_up_to_the_smallest_time_that_was_given() -> None:
    partners = LockstepPartners(())
    assert partners.reach(10 * MS), "nobody takes part yet"
    partners.receive(until("recorder", 50))
    partners.receive(until("driver", 30))
    assert partners.reach(20 * MS)
    assert not partners.reach(30 * MS)
    assert partners.missing(30 * MS) == ["driver"]
    assert not partners.receive(until("recorder", 90))
    assert partners.receive(until("driver", 60))
    assert partners.held is None


def test_a_named_node_holds_time_before_its_first_message() -> None:
    partners = LockstepPartners(("driver",))
    assert not partners.reach(10 * MS)
    assert not partners.forget_vanished(0), "it has not started yet"
    assert partners.receive(until("driver", 20))


def test_a_named_node_may_add_its_process_to_its_name() -> None:
    partners = LockstepPartners(("recorder",))
    assert not partners.reach(10 * MS)
    assert partners.receive(until("recorder (123)", 20))
    partners.receive(until("recorder (456)", 30))
    assert partners.missing(25 * MS) == ["recorder (123)"], "each process counts"


def test_a_node_that_has_ended_holds_time_no_longer() -> None:
    partners = LockstepPartners(())
    partners.receive(until("recorder", 10))
    assert not partners.reach(10 * MS)
    assert not partners.forget_vanished(1)
    assert partners.forget_vanished(0)
