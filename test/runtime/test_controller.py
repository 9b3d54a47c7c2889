"""What the entry reports: deadlines, other senders, old commands. Plain data, no ROS."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.robot import load_robot
from nao_lipm_gait.runtime.controller import HELD_MAX, GaitController, Settings
from nao_lipm_gait.runtime.diagnostics import Level, Others, Report, reports
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput, TwistInput
from nao_lipm_gait.runtime.sole_loads import SoleLoads
from nao_lipm_gait.runtime.validation import JointBelief
from nao_lipm_gait.runtime.warm_up import warm_up
from nao_lipm_gait.types import (
    GaitState,
    GaitStatus,
    JointTargets,
    SensorFrame,
    VelocityCommand,
)
from sim_bridge.command_input import TAKE_OVER, CommandInput

ROBOT = load_robot()
NAMES = list(ROBOT.joint_names)
MS = 1_000_000


class Robot:
    """Follows its targets at once; its clock is the test's."""

    def __init__(self) -> None:
        self.now = 0.0
        self.stamp = 1_000 * MS
        self.pose = ROBOT.stand_pose.tolist()
        self.sent: list[JointTargets] = []
        self.said: list[str] = []
        self.pull = 9.81
        """[m/s^2] that the IMU shows."""
        self.imu_behind: int | None = 0
        """[ms] that its stamps are behind the joints'; None = it sends nothing."""
        self.work = 0.0
        """[s] that the next tick takes."""
        self.entry = GaitController(ROBOT, GaitParameters(), Settings(), self, lambda: self.now)

    def command(self, targets: JointTargets) -> None:
        self.sent.append(targets)
        self.pose = targets.position.tolist()
        self.now += self.work

    def status(self, status: GaitStatus) -> None:
        pass

    def log(self, level: Level, text: str) -> None:
        self.said.append(text)

    def tick(self, count: int = 1, period: float = 10) -> None:
        """Period [ms]"""
        for _ in range(count):
            self.stamp += round(period * MS)
            self.send()

    def send(self) -> None:
        self.now += 0.01
        sec, nanosec = divmod(self.stamp, 1_000 * MS)
        if self.imu_behind is not None:
            stamp = divmod(self.stamp - self.imu_behind * MS, 1_000 * MS)
            imu = ImuInput(*stamp, (0.0, 0.0, 0.0), (0.0, 0.0, self.pull))
            self.entry.receive("imu/data", lambda imu=imu: imu)  # type: ignore[misc]
        joints = JointInput(sec, nanosec, NAMES, self.pose, [])
        self.entry.receive("joint_states", lambda joints=joints: joints)  # type: ignore[misc]

    def drive(self, x: float) -> None:
        self.entry.receive("cmd_vel", lambda: TwistInput((x, 0.0, 0.0), (0.0, 0.0, 0.0)))

    def report(self) -> dict[str, Report]:
        return {report.name: report for report in reports(self.entry.health())}


def test_a_tick_that_takes_too_long_is_counted_and_reported() -> None:
    robot = Robot()
    robot.tick(20)
    assert robot.report()["walk"].values["deadline misses"] == "0"
    robot.work = 0.011
    robot.tick(3)
    report = robot.report()["walk"]
    assert report.values["deadline misses"] == "3"
    assert report.level == Level.WARN
    assert "took longer than 0.01 s" in report.message
    robot.work = 0.0
    robot.tick(5)
    report = robot.report()["walk"]
    assert report.level == Level.OK
    assert report.values["deadline misses"] == "3"


def test_healthy_reports_are_quiet() -> None:
    robot = Robot()
    robot.tick(100)
    said = robot.report()
    assert {report.level for report in said.values()} == {Level.OK}
    assert (said["sensors"].message, said["commands"].message) == (
        "sensors arrive", "no cmd_vel so far",
    )  # fmt: skip
    assert robot.said == []


@pytest.mark.parametrize(
    ("others", "report", "text", "level"),
    [(Others(cmd_vel=2), "commands", "2 publishers on cmd_vel; the newest", Level.WARN),
     (Others(joint_command=2), "walk", "2 publishers on joint_command", Level.ERROR),
     (Others(joint_states=3), "sensors", "3 publishers on joint_states", Level.ERROR)],
)  # fmt: skip
def test_others_on_our_topics_are_reported(
    others: Others, report: str, text: str, level: Level
) -> None:
    robot = Robot()
    robot.tick(10)
    robot.entry.see_others(others)
    found = robot.report()[report]
    assert text in found.message
    assert found.level == level
    robot.entry.see_others(Others())
    assert robot.report()[report].level == Level.OK


def test_a_command_that_grew_old_is_why_the_robot_stops() -> None:
    robot = Robot()
    robot.tick(100)
    robot.drive(0.1)
    robot.tick(20)
    assert robot.entry.state is GaitState.WALK
    robot.tick(60)
    found = robot.report()["commands"]
    assert found.level == Level.WARN
    assert "the robot stops" in found.message
    robot.drive(0.0)
    robot.tick(5)
    assert robot.report()["commands"].level == Level.OK


@pytest.mark.parametrize("limp", [False, True])
def test_a_gait_that_cannot_go_on_begins_anew(limp: bool) -> None:
    robot = Robot()
    robot.tick(100)
    if limp:
        robot.entry.relax()
        robot.tick(5)
    gait = robot.entry._gait
    step: Callable = gait.step
    failures = iter(range(HELD_MAX))

    def fails(*given: object) -> JointTargets:
        if next(failures, None) is None:
            return step(*given)
        raise ZeroDivisionError("spoilt")

    gait.step = fails  # type: ignore[method-assign]
    sent = len(robot.sent)
    robot.tick(HELD_MAX + 5)
    assert len(robot.sent) == sent + HELD_MAX + 5, "every frame is answered"
    assert len(robot.entry.crashes) == HELD_MAX
    assert robot.entry.state is (GaitState.RELAXED if limp else GaitState.STAND)
    assert robot.entry.last_status is not None
    assert robot.report()["walk"].level == Level.ERROR


def test_reports_do_not_grow_with_a_flood() -> None:
    robot = Robot()
    robot.tick(2)
    for _ in range(5000):
        robot.drive(float("nan"))
    assert robot.entry.rejected["cmd_vel"] == 5000
    assert len(robot.report()["commands"].message) < 1000
    assert len(robot.said) < 10


# -- what the entry is made of ---------------------------------------------------------------------


def test_a_robot_in_lockstep_with_a_stuck_imu_is_answered() -> None:
    robot = Robot()
    robot.tick(100)
    robot.drive(0.1)
    robot.pull = 9.82  # and so it stays
    for _ in range(300):
        answered, asked = len(robot.sent), 0
        robot.stamp += 10 * MS
        while len(robot.sent) == answered:  # it has no next frame before the answer
            assert asked < 3
            robot.send()
            asked += 1
        assert robot.sent[-1].stamp == robot.stamp
    assert any("the same numbers while joints move" in text for text in robot.said)
    assert robot.entry.state is GaitState.STAND


def test_joints_are_believed_where_they_were_told_to_be_a_delay_ago() -> None:
    belief = JointBelief()
    assert belief.at(100 * MS, 60 * MS) is None
    for ms in range(0, 200, 10):
        belief.told(JointTargets(ms * MS, np.full(2, float(ms))))
    found = belief.at(150 * MS, 60 * MS)
    assert found is not None
    assert found[0] == 90.0
    assert belief.at(900 * MS, 60 * MS) is None, "too old to say anything"
    belief.told(JointTargets(200 * MS, np.zeros(2), stiffness=0.0))
    assert belief.at(260 * MS, 60 * MS) is None, "limp joints are anywhere"


def test_soles_that_carry_nothing_for_a_while_tell_a_fall() -> None:
    loads = SoleLoads(mass=5.0)
    assert not loads.carry_nothing(0), "nobody has said anything"

    def see(ms: int, left: float, right: float) -> bool:
        loads.see(0, ms * MS, left)
        loads.see(1, ms * MS, right)
        return loads.carry_nothing(ms * MS)

    assert not any(see(ms, 25.0, 24.0) for ms in range(0, 200, 10))
    assert not any(see(ms, 0.0, 0.0) for ms in range(200, 250, 10)), "in the air between two steps"
    assert not see(250, 49.0, 0.0)
    assert [see(ms, 3.0, 2.0) for ms in range(260, 380, 10)].count(True) == 2
    assert not loads.carry_nothing(2_000 * MS), "old loads say nothing"


def obeyed(
    ear: CommandInput, sender: str, now: float, stamp: int = 1, angle: float = 0.0
) -> bool:
    """Whether the robot takes a command of this sender; of a head that shall look to `angle`."""
    ear.admit(sender, now)
    return ear.read(sender, now, stamp, ["HeadYaw"], [angle], [])[0] is not None


def test_the_robot_obeys_one_gait_until_it_is_silent() -> None:
    ear = CommandInput(ROBOT)
    obeyed(ear, "first", 0.0)
    for now in (0.05, 0.1, 0.15):
        with pytest.raises(NaoGaitError, match="frame_id: got 'second'.*obeys 'first'"):
            obeyed(ear, "second", now)
        obeyed(ear, "first", now)
    obeyed(ear, "second", 0.16 + TAKE_OVER)
    with pytest.raises(NaoGaitError, match="obeys 'second'"):
        obeyed(ear, "first", 0.4)


def test_who_sends_nothing_but_nonsense_does_not_command() -> None:
    ear = CommandInput(ROBOT)
    for now in (0.0, 0.05, 0.1):
        with pytest.raises(NaoGaitError, match="position"):
            obeyed(ear, "garbage", now, angle=math.nan)
    assert obeyed(ear, "gait", 0.11)
    with pytest.raises(NaoGaitError, match="obeys 'gait'"):
        obeyed(ear, "garbage", 0.12)


def test_answers_to_what_was_before_a_reset_do_not_count() -> None:
    ear = CommandInput(ROBOT)
    ear.reset(500 * MS)
    assert not obeyed(ear, "gait", 0.0, 490 * MS)
    assert not obeyed(ear, "gait", 0.0, 500 * MS), "without a delay, of the old world too"
    assert obeyed(ear, "gait", 0.0, 510 * MS)


def test_a_warm_up_walks_and_leaves_nothing_behind() -> None:
    before = Gait.step
    steps = []

    def counted(gait: Gait, frame: SensorFrame, command: VelocityCommand) -> JointTargets:
        steps.append(gait)
        return before(gait, frame, command)

    Gait.step = counted  # type: ignore[method-assign]
    try:
        warm_up(ROBOT, GaitParameters(), Settings())
    finally:
        Gait.step = before  # type: ignore[method-assign]
    assert len(steps) > 50
    assert steps[-1].state is GaitState.WALK
    robot = Robot()
    robot.tick(3)
    assert robot.entry.state is GaitState.STAND


@pytest.mark.parametrize(
    "steps", [(5,), (4.9, 5.0, 5.1), (5.2, 4.8), (2,), (1,), (14, 6, 6, 14), (10, 4, 16)]
)
def test_joint_states_that_come_too_soon_are_answered_and_do_not_stop_the_walk(
    steps: tuple[float, ...],
) -> None:
    robot = Robot()
    robot.tick(100)
    for n in range(600):
        if n % 10 == 0:
            robot.drive(0.1)
        answered = len(robot.sent)
        robot.tick(1, steps[n % len(steps)])
        assert len(robot.sent) > answered
        assert robot.sent[-1].stamp == robot.stamp
    assert robot.entry.state is GaitState.WALK
    if min(steps) < 6:
        assert any("allowed: steps of control_period, 0.01 s" in text for text in robot.said)
    if sum(steps) / len(steps) in (5.0, 10.0):
        assert robot.entry._stamps.mean_step == pytest.approx(10 * MS, rel=0.02)


def test_a_rate_that_is_not_the_control_period_is_named() -> None:
    robot = Robot()
    robot.tick(300)
    assert not robot.said
    robot.tick(300, 8)
    assert any("steps of 0.008" in text and "1.2 times as fast" in text for text in robot.said)


@pytest.mark.parametrize("silent", [0.0, 1.0])
@pytest.mark.parametrize("jump", [1_000, -500, 5_000, 250, 4])
def test_a_limp_robot_stays_limp_whatever_the_clock_does(jump: int, silent: float) -> None:
    robot = Robot()
    robot.tick(100)
    robot.entry.relax()
    robot.tick(20)
    robot.stamp += jump * MS
    robot.now += silent  # [s] without a message: then it is no mere jump of the clock
    robot.tick(50)
    assert robot.entry.state is GaitState.RELAXED
    assert robot.sent[-1].stiffness == 0.0


@pytest.mark.parametrize("change", [{"feedback_delay": 0.05}, {"walk": "zmp"}])
def test_a_limp_robot_stays_limp_when_its_parameters_change(change: dict[str, object]) -> None:
    robot = Robot()
    robot.tick(100)
    robot.entry.relax()
    robot.tick(20)
    robot.entry.change_parameters(change)
    robot.tick(20)
    assert robot.entry.state is GaitState.RELAXED
    assert robot.sent[-1].stiffness == 0.0


def test_a_seated_robot_remains_seated_through_a_gap_and_refuses_what_would_begin_anew() -> None:
    robot = Robot()
    robot.tick(200)
    robot.entry.request_motion("sit")
    robot.tick(400)
    seat = robot.sent[-1].position
    with pytest.raises(NaoGaitError, match="feedback_delay: got 0.05; allowed: no change while"):
        robot.entry.change_parameters({"feedback_delay": 0.05})
    for fault in ("clock", "gap", "IMU gone", "IMU gone and gap"):
        if "IMU" in fault:
            robot.imu_behind = None
            robot.tick(30)
            robot.imu_behind = 0
        if fault == "clock" or "gap" in fault:
            robot.stamp += 250 * MS
            robot.now += 0.25 if "gap" in fault else 0.0
        robot.tick(100)
        assert robot.entry.state is GaitState.MOTION, fault
        np.testing.assert_allclose(robot.sent[-1].position, seat, atol=1e-3, err_msg=fault)
    robot.entry.stand()
    robot.tick(600)
    assert robot.entry.state is GaitState.STAND


def test_a_clock_that_goes_back_without_an_imu_leaves_a_robot_that_obeys() -> None:
    robot = Robot()
    robot.tick(100)
    robot.imu_behind = None
    robot.tick(100)
    robot.stamp -= 1_800 * MS
    answered = len(robot.sent)
    robot.tick(100)
    assert len(robot.sent) - answered >= 95
    robot.entry.relax()
    robot.tick(5)
    assert robot.sent[-1].stiffness == 0.0


def test_an_imu_on_another_clock_is_named() -> None:
    robot = Robot()
    robot.imu_behind = 1_000
    robot.tick(100)
    told = "imu/data header.stamp: 1.000 s before joint_states; allowed: at most 0.05 s"
    assert any(told in text for text in robot.said)
    robot.imu_behind = None
    robot.tick(600)
    assert any("imu/data: none for" in text for text in robot.said)
