"""The controller answers each joint state, whatever happens, and reports what happened."""

import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.motion.scheduler import ATTEMPTS
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.runtime.controller import ControllerSettings, GaitController, Output
from nao_lipm_gait.runtime.inputs import (
    ImuInput,
    JointInput,
    LoadInput,
    TemperatureInput,
    TwistInput,
)
from nao_lipm_gait.runtime.reporter import PublisherCounts
from nao_lipm_gait.runtime.supervisor import HELD_MAX
from nao_lipm_gait.runtime.target_guard import COAST_MAX
from robot_core.errors import NaoGaitError
from robot_core.log import Level, Report
from robot_core.motion import loader
from robot_core.motion.keyframes import Motion
from robot_core.motion.motion_file import load_motions
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import GaitState, JointTargets, SensorFrame

ROBOT = load_robot()
NAMES = list(ROBOT.joint_names)
MS = 1_000_000


class Robot:
    """Follows its targets at once; its clock is the test's.

    Attributes:
        now: Wall time [s].
        stamp: Stamp of the last sensors [ns].
        pose: (n,) [rad].
        imu_stuck: The IMU repeats its last values.
        imu_behind: Time [ms] by which its stamps are behind the joints'; None = it sends nothing.
        sent: All targets.
        log: All log lines.
        results: All outcomes of motions.
        gyro_noise: Amplitude of the roll rate [rad/s].
        joints_waited: Time [s] for which each joint state has waited until it is taken.
        imu_force: What the accelerometer measures [m/s^2]; None = that of an upright robot.
    """

    def __init__(self, settings: ControllerSettings | None = None) -> None:
        self.now = 0.0
        self.stamp = 1_000 * MS
        self.pose = ROBOT.stand_pose.tolist()
        self.imu_stuck = False
        self._noise = 0.0
        self.gyro_noise = 0.0
        self.imu_behind: int | None = 0
        self.joints_waited = 0.0
        self.sent: list[JointTargets] = []
        self.log: list[str] = []
        self.results: list[str] = []
        self.imu_force: tuple[float, float, float] | None = None
        self.controller = GaitController(
            ROBOT, GaitParameters(), settings or ControllerSettings(), lambda: self.now
        )

    def take(self, output: Output) -> None:
        for answer in output.answers:
            self.sent.append(answer.targets)
            self.pose = answer.targets.position.tolist()
        self.log += [line.text for line in output.log]
        self.results += output.motion_results

    def tick(self, count: int = 1, period: float = 10) -> None:
        """Frames that are `period` [ms] apart."""
        for _ in range(count):
            self.stamp += round(period * MS)
            self.send()

    def send(self) -> None:
        self.now += 0.01
        sec, nanosec = divmod(self.stamp, 1_000 * MS)
        if self.imu_behind is not None:
            stamp = divmod(self.stamp - self.imu_behind * MS, 1_000 * MS)
            if not self.imu_stuck:
                self.gyro_noise = -self.gyro_noise
                self._noise = 1e-6 - self._noise  # a working IMU never repeats itself for long
            x, y, z = self.imu_force or (0.0, 0.0, 9.81)
            rate = (self.gyro_noise, 0.0, 0.0)
            imu = ImuInput(*stamp, rate, (x, y, z + self._noise))
            self.take(self.controller.receive("imu/data", lambda: imu))
        joints = JointInput(sec, nanosec, NAMES, self.pose, waited=self.joints_waited)
        self.take(self.controller.receive("joint_states", lambda: joints))

    def drive(self, x: float) -> None:
        twist = TwistInput((x, 0.0, 0.0), (0.0, 0.0, 0.0))
        self.take(self.controller.receive("cmd_vel", lambda: twist))

    def request(self, motion: str) -> None:
        self.take(self.controller.run("~/motion", lambda: self.controller.request_motion(motion)))

    def reports(self) -> dict[str, Report]:
        return {report.name: report for report in self.controller.reports()}


def standing() -> Robot:
    """A robot that has stood for a second."""
    robot = Robot()
    robot.tick(100)
    return robot


@pytest.mark.parametrize(
    ("waited", "level"),
    [pytest.param(0.0, Level.OK, id="lockstep"), pytest.param(0.02, Level.WARN, id="in time")],
)
def test_a_tick_that_takes_too_long_is_reported_unless_the_robot_waits_for_it(
    waited: float, level: Level, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = Robot()
    robot.joints_waited = waited
    robot.tick(20)
    assert robot.reports()["walk"].values["deadline misses"] == "0"
    step = Gait.step

    def slow(*arguments: object) -> JointTargets:
        robot.now += 0.011
        return step(*arguments)  # type: ignore[arg-type]

    with monkeypatch.context() as patched:
        patched.setattr(Gait, "step", slow)
        robot.tick(3)
    report = robot.reports()["walk"]
    assert report.values["deadline misses"] == "3"
    assert report.level == level
    assert ("took longer than 0.01 s" in report.message) == (level == Level.WARN)
    robot.tick(1)
    robot.reports()
    robot.tick(5)
    report = robot.reports()["walk"]
    assert report.level == Level.OK
    assert report.values["deadline misses"] == "3"


def test_healthy_reports_are_quiet() -> None:
    robot = standing()
    said = robot.reports()
    assert {report.level for report in said.values()} == {Level.OK}
    assert (said["sensors"].message, said["commands"].message) == (
        "sensors arrive", "no cmd_vel so far",
    )  # fmt: skip
    assert robot.log == []


@pytest.mark.parametrize(
    ("counts", "report", "text", "level"),
    [(PublisherCounts(cmd_vel=2), "commands", "2 publishers on cmd_vel; the newest", Level.WARN),
     (PublisherCounts(joint_command=2), "walk", "2 publishers on joint_command", Level.ERROR),
     (PublisherCounts(joint_states=3), "sensors", "3 publishers on joint_states", Level.ERROR)],
)  # fmt: skip
def test_publishers_that_are_one_too_many_are_reported(
    counts: PublisherCounts, report: str, text: str, level: Level
) -> None:
    robot = Robot()
    robot.tick(10)
    robot.controller.note_publishers(counts)
    found = robot.reports()[report]
    assert text in found.message
    assert found.level == level
    robot.controller.note_publishers(PublisherCounts())
    assert robot.reports()[report].level == Level.OK


def test_a_command_that_is_too_old_is_reported_as_the_reason_of_the_stop() -> None:
    robot = standing()
    robot.drive(0.1)
    robot.tick(20)
    assert robot.controller.state is GaitState.WALK
    robot.tick(60)
    found = robot.reports()["commands"]
    assert found.level == Level.WARN
    assert "the robot stops" in found.message
    robot.drive(0.0)
    robot.tick(5)
    assert robot.reports()["commands"].level == Level.OK


@pytest.mark.parametrize("relaxed", [False, True])
def test_a_gait_that_cannot_go_on_restarts(relaxed: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = standing()
    if relaxed:
        robot.controller.relax()
        robot.tick(5)
    step: Callable[..., JointTargets] = Gait.step
    failures = iter(range(HELD_MAX))

    def fails(*arguments: object) -> JointTargets:
        if next(failures, None) is None:
            return step(*arguments)
        raise ZeroDivisionError("spoilt")

    monkeypatch.setattr(Gait, "step", fails)
    sent = len(robot.sent)
    robot.tick(HELD_MAX + 5)
    assert len(robot.sent) == sent + HELD_MAX + 5, "every frame is answered"
    assert len(robot.controller.reporter.crashes) == HELD_MAX
    assert robot.controller.state is (GaitState.RELAXED if relaxed else GaitState.STAND)
    assert robot.controller.last_status is not None
    assert robot.reports()["walk"].level == Level.ERROR


def test_reports_do_not_grow_with_a_flood() -> None:
    robot = Robot()
    robot.tick(2)
    for _ in range(5000):
        robot.drive(float("nan"))
    assert robot.controller.reporter.rejected["cmd_vel"] == 5000
    assert len(robot.reports()["commands"].message) < 1000
    assert len(robot.log) < 10


# -- sensors ---------------------------------------------------------------------------------------


def test_a_robot_in_lockstep_with_a_stuck_imu_is_answered() -> None:
    robot = standing()
    robot.drive(0.1)
    robot.imu_stuck = True
    for _ in range(300):
        answered, asked = len(robot.sent), 0
        robot.stamp += 10 * MS
        while len(robot.sent) == answered:  # the next frame comes after the answer
            assert asked < 3
            robot.send()
            asked += 1
        assert robot.sent[-1].stamp == robot.stamp
    assert any("the same numbers while joints move" in text for text in robot.log)
    assert robot.controller.state is GaitState.STAND


@pytest.mark.parametrize(
    "steps", [(5,), (4.9, 5.0, 5.1), (5.2, 4.8), (2,), (1,), (14, 6, 6, 14), (10, 4, 16)]
)
def test_joint_states_that_come_too_soon_are_answered_and_do_not_stop_the_walk(
    steps: tuple[float, ...],
) -> None:
    robot = standing()
    for n in range(600):
        if n % 10 == 0:
            robot.drive(0.1)
        answered = len(robot.sent)
        robot.tick(1, steps[n % len(steps)])
        assert len(robot.sent) > answered
        assert robot.sent[-1].stamp == robot.stamp
    assert robot.controller.state is GaitState.WALK
    if min(steps) < 6:
        assert any("allowed: steps of control_period, 0.01 s" in text for text in robot.log)
    if sum(steps) / len(steps) in (5.0, 10.0):
        assert not any("on average" in text for text in robot.log)


def test_a_rate_that_is_not_the_control_period_is_named() -> None:
    robot = Robot()
    robot.tick(300)
    assert not robot.log
    robot.tick(300, 8)
    assert any("steps of 0.00" in text and "on average" in text for text in robot.log)
    assert "1.2 times as fast" in robot.reports()["sensors"].message
    robot.tick(400)
    assert robot.log[-1] == "joint_states arrive at the control period again"
    assert len(robot.log) == 2


def test_a_reset_of_the_robot_is_one_line() -> None:
    robot = standing()
    robot.drive(0.1)
    robot.tick(30)
    robot.now += 0.6
    robot.stamp += 600 * MS
    robot.pose = ROBOT.stand_pose.tolist()
    robot.take(robot.controller.watch())
    robot.tick(100)
    robot.take(robot.controller.watch())
    assert robot.log == ["joint_states after a pause of 0.62 s: restarting from a stand"]
    assert robot.controller.state is GaitState.STAND


def test_a_stamp_from_which_nothing_continues_is_reported() -> None:
    robot = standing()
    right = robot.stamp
    robot.stamp += 900 * MS
    robot.send()
    assert robot.controller.reporter.rejected["joint_states"] == 1
    robot.stamp = right
    robot.tick(100)
    assert len(robot.log) == 1
    assert "got '2.900 s, doubtful'" in robot.log[0]
    assert robot.log[0].endswith("message ignored")


@pytest.mark.parametrize("silent", [0.0, 1.0])
@pytest.mark.parametrize("jump", [1_000, -500, 5_000, 250, 4])
def test_a_relaxed_robot_stays_relaxed_whatever_the_clock_does(jump: int, silent: float) -> None:
    robot = standing()
    robot.controller.relax()
    robot.tick(20)
    robot.stamp += jump * MS
    robot.now += silent
    robot.tick(50)
    assert robot.controller.state is GaitState.RELAXED
    assert robot.sent[-1].stiffness == 0.0


@pytest.mark.parametrize("change", [{"feedback_delay": 0.05}, {"walk": "zmp"}])
def test_a_relaxed_robot_stays_relaxed_when_parameters_change(change: dict[str, object]) -> None:
    robot = standing()
    robot.controller.relax()
    robot.tick(20)
    robot.controller.change_parameters(change)
    robot.tick(20)
    assert robot.controller.state is GaitState.RELAXED
    assert robot.sent[-1].stiffness == 0.0


def test_a_motion_file_is_loaded_beside_the_ticks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    may_load, threads = threading.Event(), []

    def load(path: Path, of: RobotDescription) -> tuple[Motion, ...]:
        may_load.wait()
        threads.append(threading.get_ident())
        return load_motions(path, of)

    monkeypatch.setattr(loader, "load_motions", load)
    nod, broken = tmp_path / "nod.yaml", tmp_path / "broken.yaml"
    text = "meaning: nods\nposes: {down: {HeadPitch: 0.3}}\nkeyframes: [{pose: down, time: 1.0}]\n"
    nod.write_text(text)
    broken.write_text("[")
    robot = Robot()
    robot.tick(200)
    robot.request(str(broken))
    robot.request(str(nod))
    answers = len(robot.sent)
    robot.tick(50)
    assert len(robot.sent) == answers + 50, "answered while the file waits"
    assert robot.controller.state is GaitState.STAND
    may_load.set()
    while robot.controller.loads_file:
        robot.tick()
    robot.tick(200)
    may_load.clear()
    robot.request(str(nod))
    robot.controller.stand()
    robot.request(str(broken))
    may_load.set()
    while robot.controller.loads_file:
        robot.tick()
    assert threading.get_ident() not in threads
    (replaced, done, stopped, refused) = robot.results
    assert replaced == f"{broken}: replaced by {nod}"
    assert done == "nod: done"
    assert stopped == f"{nod}: replaced by a stand"
    assert refused.startswith(f"{broken}: refused, motion file {broken}: got")
    robot.tick(100)
    assert robot.controller.state is GaitState.STAND


def test_a_seated_robot_stays_seated_through_a_gap_and_refuses_a_restart() -> None:
    robot = Robot()
    robot.tick(200)
    robot.controller.request_motion("sit")
    robot.tick(400)
    seat = robot.sent[-1].position
    with pytest.raises(NaoGaitError, match=r"feedback_delay: got 0\.05; allowed: no change while"):
        robot.controller.change_parameters({"feedback_delay": 0.05})
    for fault in ("clock", "gap", "IMU gone", "IMU gone and gap"):
        if "IMU" in fault:
            robot.imu_behind = None
            robot.tick(30)
            robot.imu_behind = 0
        if fault == "clock" or "gap" in fault:
            robot.stamp += 250 * MS
            robot.now += 0.25 if "gap" in fault else 0.0
        robot.tick(100)
        assert robot.controller.state is GaitState.MOTION, fault
        np.testing.assert_allclose(robot.sent[-1].position, seat, atol=1e-3, err_msg=fault)
    robot.controller.stand()
    robot.tick(600)
    assert robot.controller.state is GaitState.STAND


def test_a_robot_without_an_imu_whose_clock_goes_back_still_takes_commands() -> None:
    robot = standing()
    robot.imu_behind = None
    robot.tick(100)
    robot.stamp -= 1_800 * MS
    answered = len(robot.sent)
    robot.tick(100)
    assert len(robot.sent) - answered >= 95
    robot.controller.relax()
    robot.tick(5)
    assert robot.sent[-1].stiffness == 0.0


def test_an_imu_on_another_clock_is_named() -> None:
    robot = Robot()
    robot.imu_behind = 1_000
    robot.tick(100)
    told = "imu/data header.stamp: 1.000 s before joint_states; allowed: at most 0.05 s"
    assert any(told in text for text in robot.log)
    robot.imu_behind = None
    robot.tick(600)
    assert any("imu/data: none for" in text for text in robot.log)


# -- the log ---------------------------------------------------------------------------------------


def test_what_the_robot_does_is_logged_once_each() -> None:
    robot = standing()
    robot.drive(0.1)
    robot.tick(200)
    robot.drive(0.1)
    robot.tick(200)
    robot.controller.relax()
    robot.tick(50)
    robot.controller.stand()
    robot.tick(100)
    assert robot.log == [
        "no cmd_vel for 0.5 s: the robot stops",
        "cmd_vel arrives again",
        "no cmd_vel for 0.5 s: the robot stops",
        "relaxed: no torque on the joints",
        "upright, standing",
    ]


def test_a_fall_is_logged() -> None:
    robot = standing()
    robot.imu_force = (9.8, 0.0, 0.0)
    robot.tick(200)
    assert robot.controller.state is GaitState.FALLEN
    assert robot.log[-1] == "fallen, relaxed"


def test_silent_sensors_are_logged_when_they_fall_silent_and_when_they_return() -> None:
    robot = Robot()
    for _ in range(80):
        robot.now += 0.25
        robot.take(robot.controller.watch())
    assert robot.log == ["no joint_states in the first 10 s; is a robot running?"]
    robot.tick(10)
    for _ in range(80):
        robot.now += 0.25
        robot.take(robot.controller.watch())
    robot.tick(10)
    assert robot.log[1:] == [
        "joint_states arrive",
        "no joint_states for over 1 s: the robot holds its last targets",
        "joint_states arrive",
    ]


def test_joint_states_that_are_refused_are_not_silent() -> None:
    robot = Robot()
    robot.pose = robot.pose[1:]
    for _ in range(60):
        robot.tick(25)
        robot.take(robot.controller.watch())
    assert robot.reports()["sensors"].message.startswith("no usable joint_states so far; ")
    assert "no usable joint_states in the first 10 s: they are refused" in robot.log
    robot.pose = ROBOT.stand_pose.tolist()
    robot.tick(25)
    robot.pose = robot.pose[1:]
    robot.stamp += 2_000 * MS
    robot.tick(200)
    robot.take(robot.controller.watch())
    expected = "no usable joint_states for over 1 s: the robot holds its last targets"
    assert robot.log[-1] == expected
    assert not any("is a robot running" in text for text in robot.log)


def test_ticks_that_take_too_long_for_half_an_hour_are_few_lines(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot = Robot()
    robot.joints_waited = 0.5

    def slow(_gait: Gait, frame: SensorFrame, _command: object) -> JointTargets:
        robot.now += 1.0
        return JointTargets(frame.stamp, ROBOT.stand_pose)

    monkeypatch.setattr(Gait, "step", slow)
    robot.tick(1800)
    assert 1 <= len([text for text in robot.log if "took longer" in text]) < 10


def test_repeated_joint_states_are_answered_and_are_few_lines() -> None:
    robot = Robot()
    robot.tick(10)
    for _ in range(50):
        robot.send()
    assert len(robot.sent) == 60
    assert len(robot.log) == 1
    assert "again'; allowed: a later stamp" in robot.log[0]


def test_a_robot_that_asks_for_its_answer_again_is_no_fault() -> None:
    robot = Robot()
    robot.tick(10)
    for _ in range(20):
        robot.now += 0.25
        robot.send()
    assert len(robot.sent) == 30
    assert robot.log == []
    assert robot.reports()["sensors"].values["rejected joint_states"] == "20"


def test_when_a_robot_asks_again_is_when_its_message_arrived() -> None:
    robot = Robot()
    robot.tick(10)
    robot.joints_waited = 0.3
    robot.tick(1)
    robot.joints_waited = 0.05  # it came 0.26 s after the last one and is taken right after it
    robot.send()
    assert robot.log == []


def test_a_driver_that_is_late_again_and_again_is_few_lines() -> None:
    robot = standing()
    for _ in range(40):
        robot.drive(0.1)
        robot.tick(60)
        robot.take(robot.controller.watch())
    stops = [text for text in robot.log if "the robot stops" in text]
    assert 2 <= len(stops) < 6
    assert sum(text == "cmd_vel arrives again" for text in robot.log) in (
        len(stops), len(stops) - 1,
    )  # fmt: skip


def test_only_the_last_get_up_that_fails_is_a_warning() -> None:
    robot = Robot()
    robot.imu_force = (-9.81, 0.0, 0.0)  # it never gets off the floor
    robot.tick(100)
    robot.request("get_up")
    for _ in range(100):
        if not robot.results:
            robot.tick(100)
    tries = [text for text in robot.log if text.startswith("getting up: ")]
    assert len(tries) == ATTEMPTS
    assert robot.log.count("not up yet, going on") == ATTEMPTS - 1
    assert robot.log.count("getting up has failed, relaxed") == 1


def test_an_outage_of_the_imu_is_logged_when_it_begins_and_ends() -> None:
    robot = standing()
    robot.imu_behind = None
    robot.tick(500)
    robot.imu_behind = 0
    robot.tick(100)
    assert robot.log == [
        "imu/data: none for 0.1 s; the robot stops", "the sensors are complete again",
    ]  # fmt: skip


def test_an_idle_robot_is_no_warning() -> None:
    robot = standing()
    robot.drive(0.1)
    robot.tick(300)
    assert robot.reports()["commands"].level == Level.WARN
    robot.tick(1000)
    assert {report.level for report in robot.reports().values()} == {Level.OK}


# -- motions ---------------------------------------------------------------------------------------


def test_the_outcome_of_a_motion_is_returned() -> None:
    robot = Robot()
    robot.tick(200)
    robot.request("fly")
    assert robot.results[0].startswith("fly: refused, motion: got 'fly'")
    robot.request("sit")
    robot.tick(400)
    assert robot.results[1:] == ["sit: done"]
    assert robot.log[-1] == "motion sit: done"


# -- the gyro's bias -------------------------------------------------------------------------------


def test_a_robot_that_is_driven_from_the_start_first_learns_the_bias_of_its_gyro() -> None:
    """A walk with an unknown bias turns."""

    def ticks_until_it_walks(bias_wait: float) -> int:
        robot = Robot(ControllerSettings(bias_wait=bias_wait))
        for tick in range(1000):
            robot.drive(0.1)
            robot.tick()
            if robot.controller.state is GaitState.WALK:
                logs.append(robot.log)
                return tick
        raise AssertionError("does not walk")

    logs: list[list[str]] = []
    at_once, learned = ticks_until_it_walks(0.0), ticks_until_it_walks(10.0)
    assert at_once + 30 < learned < 1000
    assert logs == [
        [],
        ["standing until the gyro's bias is known, for 10 s of sensor time at most",
         "the gyro's bias is known"],
    ]  # fmt: skip


def test_the_wait_for_the_bias_is_bounded() -> None:
    robot = Robot(ControllerSettings(bias_wait=2.0))
    robot.gyro_noise = 0.1  # never at rest
    for _ in range(300):
        robot.drive(0.1)
        robot.tick()
    assert robot.controller.state is GaitState.WALK
    assert "not known after 2 s" in robot.log[-1]


def test_a_bias_that_was_learned_outlives_a_reset() -> None:
    robot = Robot(ControllerSettings(bias_wait=10.0))
    robot.tick(800)
    for _ in range(3):
        robot.now += 0.6
        robot.stamp += 600 * MS
        robot.pose = ROBOT.stand_pose.tolist()
        for _ in range(100):
            robot.drive(0.1)
            robot.tick()
        assert robot.controller.state is GaitState.WALK
    assert not any("standing until" in line for line in robot.log)


def test_a_robot_whose_motors_are_not_ready_does_not_step() -> None:
    robot = Robot()
    robot.take(robot.controller.run("motors_ready", lambda: robot.controller.note_motors(False)))
    states = []
    for ready in (False, True, False):
        robot.take(
            robot.controller.run("motors_ready", lambda r=ready: robot.controller.note_motors(r))
        )
        for _ in range(400):
            robot.drive(0.1)
            robot.tick()
        states.append(robot.controller.state)
    assert states == [GaitState.STAND, GaitState.WALK, GaitState.STAND]
    assert [line for line in robot.log if "motors" in line] == [
        "standing until the motors are ready", "the motors are ready",
        "standing until the motors are ready",
    ]  # fmt: skip


def heat(robot: Robot, joint: str, degrees: float) -> None:
    message = TemperatureInput(1, 0, joint, degrees)
    robot.take(robot.controller.receive("temperature", lambda: message))


def test_a_hot_knee_ends_a_walk_and_the_robot_sits_until_it_is_told_to_stand() -> None:
    robot = Robot()
    robot.tick(200)
    standing = robot.pose
    robot.drive(0.2)
    robot.tick(30)
    assert robot.controller.state is GaitState.WALK
    heat(robot, "LKneePitch", 72.0)
    assert any("LKneePitch is hot: 72 deg C" in line for line in robot.log)
    heat(robot, "LKneePitch", 79.0)
    robot.tick(600)
    assert any("LKneePitch at 79 deg C: sitting down" in line for line in robot.log)
    assert robot.pose[ROBOT.index("LKneePitch")] > 1.8
    heat(robot, "LKneePitch", 60.0)
    robot.controller.stand()
    robot.tick(400)
    assert robot.pose == pytest.approx(standing, abs=0.02)


@pytest.mark.parametrize("stamp", [1, 10**9, 1_700_000_000])
def test_a_temperature_counts_for_ten_seconds_whatever_the_clock_does(stamp: int) -> None:
    robot = Robot(ControllerSettings(hot_speed=0.5))
    heat(robot, "LElbowRoll", 75.0)  # before the first joint state
    robot.stamp = 1_000_000 * MS
    robot.tick(900)
    assert "heat" in hot_reports(robot)
    robot.stamp = stamp * 1_000 * MS  # a simulation that was started again, or a clock that was set
    robot.tick(990)
    assert "heat" in hot_reports(robot)
    robot.tick(20)
    assert hot_reports(robot) == "silence"


def hot_reports(robot: Robot) -> str:
    message = robot.reports()["walk"].message
    return "heat" * ("LElbowRoll is hot" in message) + "silence" * ("no temperature" in message)


def test_a_temperature_that_is_no_number_is_refused() -> None:
    robot = Robot()
    heat(robot, "LKneePitch", float("nan"))
    assert robot.controller.reporter.rejected["temperature"] == 1


def test_a_walk_goes_on_for_a_few_periods_without_sensors() -> None:
    robot = Robot()
    robot.tick(150)
    assert robot.controller.overdue().answers == (), "a robot that stands can wait"
    for _ in range(100):
        robot.drive(0.1)
        robot.tick()
    assert robot.controller.state is GaitState.WALK
    stamps = []
    for _ in range(COAST_MAX + 3):
        output = robot.controller.overdue()
        robot.take(output)
        stamps += [answer.targets.stamp for answer in output.answers]
    assert stamps == [robot.stamp + n * 10 * MS for n in range(1, COAST_MAX + 1)]
    sent = len(robot.sent)
    robot.tick()
    assert len(robot.sent) == sent + 1, "the frame that was late"
    assert robot.sent[-1].stamp == robot.stamp
    assert (robot.controller.reporter.faults, robot.controller.reporter.unexpected) == (0, 0)


def test_joints_whose_imu_sample_is_overdue_are_used_without_it() -> None:
    robot = Robot()
    robot.tick(20)
    robot.imu_behind = None
    sent = len(robot.sent)
    robot.tick()
    assert len(robot.sent) == sent
    (answer,) = robot.controller.overdue().answers
    assert answer.targets.stamp == robot.stamp
    assert answer.status is not None


@pytest.mark.parametrize(("right", "answered"), [(0.0, True), (25.0, False), (None, True)])
def test_lockstep_goes_on_with_a_robot_that_is_found_in_the_middle_of_a_step(
    right: float | None, answered: bool
) -> None:
    robot = Robot()
    robot.pose = np.array(robot.pose).tolist()
    robot.pose[ROBOT.index("RKneePitch")] += (
        0.6  # the right foot is lifted, if the joints are right
    )
    robot.tick()
    assert not robot.sent
    for _ in range(3):  # the same frame again, as nothing was answered
        for side, force in enumerate((25.0, right)):
            if force is not None:
                load = LoadInput(*divmod(robot.stamp, 1_000 * MS), side, force)
                robot.take(robot.controller.receive("wrench", lambda load=load: load))
        robot.send()
    assert bool(robot.sent) == answered
    assert any("joint_states position: " in line for line in robot.log)


def test_a_repeated_frame_does_not_take_a_walk_back_that_went_on_without_sensors() -> None:
    robot = Robot()
    robot.tick(150)
    for _ in range(100):
        robot.drive(0.1)
        robot.tick()
    for _ in range(COAST_MAX):
        robot.take(robot.controller.overdue())
    sent = len(robot.sent)
    robot.send()
    assert [targets.stamp for targets in robot.sent[sent:]] == []


@pytest.mark.parametrize(("delay", "warned"), [(0.1, False), (0.12, True)])
def test_a_delay_with_which_robots_fall_is_a_warning(delay: float, warned: bool) -> None:
    robot = Robot()
    robot.controller.change_parameters({"feedback_delay": delay})
    walk = next(report for report in robot.controller.reports() if report.name == "walk")
    assert ("feedback_delay" in walk.message) == warned
