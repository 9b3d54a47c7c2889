"""Publishers that are one too many are logged once they are certain."""

import pytest

from nao_lipm_gait.runtime.diagnostics import Diagnostics
from nao_lipm_gait.runtime.publisher_watch import PublisherCounts, PublisherWatch


def watched(*counts: PublisherCounts, seconds: int) -> list[str]:
    """Log lines, if each of the counts lasts so long."""
    now = 0.0
    diagnostics = Diagnostics(lambda: now)
    watch = PublisherWatch(diagnostics, lambda: now)
    for each in counts:
        for _ in range(seconds):
            watch.update(each)
            now += 1.0
    return [line.text for line in diagnostics.take_log()]


def test_a_publisher_that_discovery_still_keeps_after_its_end_is_not_logged() -> None:
    assert watched(PublisherCounts(joint_states=2), PublisherCounts(), seconds=20) == []


@pytest.mark.parametrize("topic", ["cmd_vel", "joint_states", "joint_command"])
def test_a_second_publisher_is_logged_once_and_when_it_leaves(topic: str) -> None:
    said = watched(PublisherCounts(**{topic: 2}), PublisherCounts(), seconds=120)
    assert len(said) == 2
    assert said[0].startswith(f"2 publishers on {topic}")
    assert said[1] == f"one publisher on {topic} again"


def test_a_sender_of_another_message_type_is_logged_once() -> None:
    wrong = PublisherCounts(mismatched="cmd_vel: got TwistStamped")
    assert watched(wrong, PublisherCounts(), seconds=5) == [
        "cmd_vel: got TwistStamped", "every sender of cmd_vel uses the right type",
    ]  # fmt: skip
