"""What the gait gets in a tick: the command, or what motors, sensors and hands allow."""

import numpy as np
import pytest

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.runtime.diagnostics import Diagnostics
from nao_lipm_gait.runtime.inputs import LoadInput, TemperatureInput, TwistInput
from nao_lipm_gait.runtime.intake import Gaps, NewTime
from nao_lipm_gait.runtime.supervisor import HELD_MAX, ControllerSettings, Supervisor
from nao_lipm_gait.runtime.watches import JOINT_PATIENCE, LIFT_TIME
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from robot_core.types import (
    GRAVITY,
    ON_THE_WAY,
    STANDSTILL,
    GaitState,
    SensorFrame,
    VelocityCommand,
)

ROBOT = load_robot("nao_v6")
MS = 1_000_000
FORWARD = VelocityCommand(0.2)
COMPLETE = Gaps()


class Supervised:
    """A gait in the stand and its supervisor; a tick is 10 ms."""

    def __init__(self, *, bias_wait: float = 0.0, hot_speed: float = 1.0) -> None:
        self.stamp = 1_000 * MS
        self.say = Diagnostics(lambda: 0.0)
        self.gait = Gait(ROBOT, GaitParameters())
        settings = ControllerSettings(bias_wait=bias_wait, hot_speed=hot_speed)
        self.supervisor = Supervisor(self.gait, settings, self.say)

    def drive(self) -> None:
        self.supervisor.receive(TwistInput((0.2, 0.0, 0.0), (0.0, 0.0, 0.0)), self.stamp)

    def load(self, force: float) -> None:
        for side in (0, 1):
            load = LoadInput(*divmod(self.stamp, 1_000 * MS), side, force)
            self.supervisor.receive(load, self.stamp)

    def decide(
        self, gaps: Gaps = COMPLETE, *, turn: float = 0.0
    ) -> tuple[SensorFrame, VelocityCommand]:
        """turn: Pitch rate [rad/s]."""
        self.stamp += 10 * MS
        force = np.array((0.0, 0.0, GRAVITY))
        frame = SensorFrame(self.stamp, ROBOT.stand_pose, np.array((0.0, turn, 0.0)), force)
        frame, command = self.supervisor.decide(frame, gaps)
        self.gait.step(frame, command)
        self.supervisor.follow(self.gait.status)
        return frame, command

    def command(self, gaps: Gaps = COMPLETE) -> VelocityCommand:
        """What a robot that is driven gets."""
        self.drive()
        return self.decide(gaps)[1]


def test_a_command_counts_until_it_times_out_or_the_robot_is_told_to_stand() -> None:
    robot = Supervised()
    robot.drive()
    assert [robot.decide()[1] for _ in range(60)].count(FORWARD) == 50
    assert robot.command() == FORWARD
    robot.supervisor.stand()
    assert robot.decide()[1] == STANDSTILL


def test_a_robot_without_an_imu_stands_and_is_down_only_if_its_soles_carry_nothing() -> None:
    for force, state in ((30.0, GaitState.STAND), (0.0, GaitState.FALLEN)):
        robot = Supervised()
        for _ in range(10):
            robot.load(30.0)
            assert robot.command() == FORWARD
        robot.supervisor.stand()
        since = robot.stamp
        commands = []
        for _ in range(40):
            robot.load(force)
            commands.append(robot.command(Gaps(blind_since=since)))
        assert commands[5] == FORWARD, "a short outage is bridged"
        assert set(commands[20:]) == {STANDSTILL}
        assert (robot.gait.state is GaitState.FALLEN) == (state is GaitState.FALLEN)


@pytest.mark.parametrize(
    ("turn", "state"),
    [(0.0, GaitState.STAND), (0.2, GaitState.STAND), (2.0, GaitState.FALLEN)],
    ids=["still", "sways", "falls"],
)
def test_a_robot_that_fell_without_an_imu_stands_once_it_is_put_up(
    turn: float, state: GaitState
) -> None:
    robot = Supervised()
    since = robot.stamp
    for _ in range(40):
        robot.load(0.0)
        robot.command(Gaps(blind_since=since))
    assert robot.gait.state is GaitState.FALLEN
    robot.stamp += 600 * MS
    robot.supervisor.new_time(NewTime(robot.stamp, first=False, steady=False))
    robot.decide(turn=turn)
    assert robot.gait.state is state


def test_joints_that_cannot_be_read_for_long_stop_the_robot_until_they_can() -> None:
    robot = Supervised()
    since = robot.stamp
    commands = [robot.command(Gaps(unread_since=since)) for _ in range(60)]
    assert commands.count(FORWARD) == JOINT_PATIENCE // (10 * MS)
    assert commands[-1] == STANDSTILL
    assert robot.command() == FORWARD
    assert [line.text for line in robot.say.take_log()] == [
        "joint_states: none readable for 0.3 s; the robot stops", "the sensors are complete again",
    ]  # fmt: skip


def test_motors_that_are_not_ready_hold_the_robot() -> None:
    robot = Supervised()
    robot.supervisor.note_motors(False)
    assert robot.command() == STANDSTILL
    robot.supervisor.note_motors(True)
    assert robot.command() == FORWARD


def test_the_wait_for_the_bias_begins_again_with_a_restart() -> None:
    robot = Supervised(bias_wait=0.1)
    assert [robot.command() for _ in range(15)].count(FORWARD) > 0
    robot.gait.request_relax()
    robot.supervisor.restart()
    robot.gait.request_stand()
    assert robot.command() == STANDSTILL


def test_a_hot_motor_slows_the_robot_down_and_a_hot_leg_makes_it_sit() -> None:
    robot = Supervised(hot_speed=0.5)
    for degrees, motion in ((72.0, ""), (79.0, "sit")):
        heat = TemperatureInput(1, 0, "LKneePitch", degrees)
        robot.supervisor.receive(heat, robot.stamp)
        commands = {robot.command() for _ in range(200)}
        assert commands == {VelocityCommand(0.1)}
        assert robot.gait.status.motion == motion


def test_a_robot_that_is_lifted_is_so_for_the_gait() -> None:
    robot = Supervised()
    assert robot.supervisor.needs_loads
    found = []
    for tick in range(60):
        robot.load(30.0 if tick < 20 else 0.0)
        found.append(robot.decide()[0].lifted)
    assert found.index(True) * 10 * MS > 200 * MS + LIFT_TIME - 10 * MS
    assert all(found[-10:])


@pytest.mark.parametrize("steady", [False, True])
def test_on_a_new_time_the_robot_stops(steady: bool) -> None:
    robot = Supervised()
    for _ in range(100):
        robot.command()
    assert robot.gait.state is GaitState.WALK
    robot.stamp = 0
    robot.supervisor.new_time(NewTime(10 * MS, first=False, steady=steady))
    assert robot.decide()[1] == STANDSTILL
    assert (robot.gait.state in ON_THE_WAY) == steady, "only the clock has jumped"
    for _ in range(150):
        robot.decide()
    assert robot.gait.state is GaitState.STAND


def test_ticks_that_fail_restart_the_gait() -> None:
    robot = Supervised()
    for _ in range(100):
        robot.command()
    for _ in range(HELD_MAX):
        assert robot.gait.state is GaitState.WALK
        robot.supervisor.follow(None)
    assert robot.gait.state is GaitState.STAND


def test_each_requested_motion_has_a_result() -> None:
    robot = Supervised()
    robot.decide()
    with pytest.raises(NaoGaitError, match="fly"):
        robot.supervisor.request_motion("fly")
    robot.supervisor.request_motion("sit")
    robot.supervisor.request_motion("sit")
    for _ in range(500):
        robot.decide()
    refused, replaced, done = robot.supervisor.take_results()
    assert refused.startswith("fly: refused, motion: got 'fly'")
    assert (replaced, done) == ("sit: replaced by sit", "sit: done")
    assert robot.supervisor.take_results() == ()


def test_a_limp_motor_ends_the_walk_in_this_tick() -> None:
    robot = Supervised()
    for _ in range(100):
        robot.command()
    assert robot.gait.state is GaitState.WALK
    for _ in range(150):
        assert robot.command(Gaps(limp=True)) == STANDSTILL
        assert robot.gait.state is GaitState.STAND
