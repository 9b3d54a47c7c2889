"""What is said of publishers that are one too many, of measured soles, and of failures."""

import math

import pytest

from nao_lipm_gait.calibration import NOT_CALIBRATED, Calibration
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.runtime.reporter import PublisherCounts, Reporter
from robot_core.errors import NaoGaitError
from robot_core.log import Level
from robot_core.robot import load_robot

ROBOT = load_robot()


class Reported:
    """A reporter of a gait that does not move; its clock is the test's."""

    def __init__(self, calibration: Calibration = NOT_CALIBRATED) -> None:
        self.now = 0.0
        gait = Gait(ROBOT, GaitParameters(), calibration=calibration)
        self.reporter = Reporter(gait, 0.01, lambda: self.now)

    def log(self) -> list[str]:
        return [line.text for line in self.reporter.say.take_log()]


def watched(*counts: PublisherCounts, seconds: int) -> list[str]:
    """Log lines, if each of the counts lasts so long."""
    reported = Reported()
    for each in counts:
        for _ in range(seconds):
            reported.reporter.note_publishers(each)
            reported.now += 1.0
    return reported.log()


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
        "cmd_vel: got TwistStamped", "every sender of an input is received",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("clock", "level", "why"),
    [(0, Level.ERROR, ""), (1, Level.WARN, "the simulation stands still or sends none; ")],
)
def test_a_simulation_that_stands_still_is_no_error(clock: int, level: Level, why: str) -> None:
    reported = Reported()
    reported.reporter.joints_arrived(reported.now, 0.0, repeated=False)
    reported.reporter.note_publishers(PublisherCounts(clock=clock))
    reported.now += 2.0
    reported.reporter.watch()
    (line,) = reported.reporter.say.take_log()
    text = f"no joint_states for over 1 s: {why}the robot holds its last targets"
    assert (line.level, line.text) == (level, text)


def test_a_sender_is_named_as_soon_as_its_name_is_discovered() -> None:
    senders = [f"imu/data: got best effort from {name}" for name in ("_UNKNOWN_", "driver")]
    counts = (PublisherCounts(mismatched=sender) for sender in senders)
    assert watched(*counts, PublisherCounts(), seconds=3) == [
        *senders, "every sender of an input is received",
    ]  # fmt: skip


def test_the_log_says_once_that_the_soles_are_known() -> None:
    known = Calibration(sole_pitch=math.radians(1.25), sole_roll=math.radians(-0.5))
    for calibration, lines in ((known, 1), (NOT_CALIBRATED, 0)):
        reported = Reported(calibration)
        for _ in range(3):
            reported.reporter.watch()
        log = reported.log()
        assert len(log) == lines
        assert all("pitched by +1.25 deg and rolled by -0.50 deg" in text for text in log)


@pytest.mark.parametrize(
    ("error", "level", "unexpected"),
    [(NaoGaitError("x", 1, "2"), Level.WARN, 0), (KeyError("x"), Level.ERROR, 1)],
)
def test_work_that_fails_is_counted_and_said(
    error: Exception, level: Level, unexpected: int
) -> None:
    def fails() -> None:
        raise error

    reporter = Reported().reporter
    reporter.attempt("imu/data", fails, "; message ignored")
    (line,) = reporter.say.take_log()
    assert line.level is level
    assert line.text.endswith("; message ignored")
    assert dict(reporter.rejected) == {"imu/data": 1}
    assert reporter.unexpected == unexpected
