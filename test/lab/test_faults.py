"""Faults in the middle of a walk, through the code of the node, in lockstep."""

import math
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gait_lab.bench import running
from gait_lab.bench.suites.faults import classes_of
from gait_lab.faults.campaign import STOPPED, VIOLATED, WALKS, FaultRun, run_fault
from gait_lab.faults.channel import Channel, Command, Message
from gait_lab.faults.classes import CLASSES
from gait_lab.faults.fault import Fault, Late, LateCommand
from gait_lab.faults.fault_trial import World
from gait_lab.faults.harness import Harness
from gait_lab.faults.invariants import CommandCheck
from gait_lab.faults.robot_faults import motor_of
from gait_lab.faults.sensor_faults import ImuOutage
from gait_lab.trials.rollout import RolloutSpec, make_pair, walk
from gait_lab.trials.tasks import TASKS
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.robot import load_robot
from nao_lipm_gait.runtime.controller import GaitController
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput
from nao_lipm_gait.types import GaitState, JointTargets, VelocityCommand

pytest.importorskip("mujoco")
ROBOT = load_robot()
FORWARD = VelocityCommand(0.15, 0.0, 0.0)


def world(fault: Fault | None = None, seed: int = 3, command: VelocityCommand = FORWARD) -> World:
    simulation, _ = make_pair(RolloutSpec(TASKS["stand"], robot_seed=seed, engine="mujoco"))
    nothing = Fault(np.random.default_rng(0))
    return World(simulation, GaitParameters(), fault or nothing, command)


# -- the walk without faults -----------------------------------------------------------------------


def test_without_a_fault_the_entry_walks_as_a_rollout_does_bit_by_bit() -> None:
    """The guards of the node change nothing as long as nothing is wrong."""
    asked = world()
    spec = RolloutSpec(TASKS["stand"], robot_seed=3, engine="mujoco")
    simulation, gait = make_pair(spec)
    with asked.simulation, simulation:
        # The operator sends from 1 s on; its message comes behind the sensors of that tick.
        ticks = walk(simulation, gait, lambda t: FORWARD if t > 1.005 else VelocityCommand())
        next(ticks)
        for _ in range(400):
            asked.step()
            truth = next(ticks).truth
            assert np.array_equal(asked.truth.joint_position, truth.joint_position), asked.tick
    assert asked.gaits[0].entry.faults == 0
    assert not asked.gaits[0].entry.rejected
    assert asked.gaits[0].entry.state is GaitState.WALK


WALKS_ON = (
    "none", "nan", "repeated", "reordered", "stamp_outliers", "stamp_jitter", "stamp_jump",
    "two_drivers", "two_gaits", "parameters", "bad_commands", "bridge_reset", "bridge_restart",
    "joint_dropout", "loss",
)  # fmt: skip
"""Classes that do not stop the walk for good."""


@pytest.mark.parametrize("name", CLASSES)
def test_no_class_of_faults_is_a_violation_and_most_do_not_stop_the_walk(name: str) -> None:
    verdict = run_fault(FaultRun(name, 0))
    assert verdict.outcome != VIOLATED, verdict.violations
    assert verdict.outcome == WALKS or name not in WALKS_ON, verdict.explained


def test_silence_of_the_operator_stops_the_robot_and_says_so() -> None:
    verdict = run_fault(FaultRun("no_commands", 1))
    assert verdict.outcome == STOPPED
    assert any("no cmd_vel for" in text for text in verdict.explained)


def test_a_run_depends_on_its_seed_alone() -> None:
    first, again = (run_fault(FaultRun("loss", 5)) for _ in range(2))
    assert first == again


# -- one fault each --------------------------------------------------------------------------------


class ImuForEver(ImuOutage):
    def __init__(self) -> None:
        super().__init__(np.random.default_rng(0))
        self.begin, self.duration = 2.5, 100.0


def test_without_imu_the_robot_stops_stands_and_says_why() -> None:
    asked = world(ImuForEver())
    with asked.simulation:
        asked.run(600)
        entry = asked.gaits[0].entry
        assert entry.state is GaitState.STAND
        assert not asked.fallen
        assert any("imu/data: none for" in text for text in asked.judge.explained)
        assert not asked.judge.violations


def test_a_blind_robot_that_is_pushed_over_relaxes_and_wakes_up_lying() -> None:
    """Without an IMU only the soles tell that nothing carries the robot any more."""
    fault = ImuForEver()
    fault.duration = 6.0
    asked = world(fault)
    with asked.simulation:
        asked.run(500)
        asked.simulation.push(np.array([0.0, 90.0, 0.0]), 0.1)
        asked.run(150)
        entry = asked.gaits[0].entry
        assert asked.fallen
        assert entry.state is GaitState.FALLEN
        asked.run(300)  # the IMU is back
        assert asked.fallen
        assert entry.state is GaitState.FALLEN
    assert not asked.judge.violations


class Stuck(Fault):
    """All joints stand still from 2.5 s on."""

    def __init__(self) -> None:
        super().__init__(np.random.default_rng(0))
        self._kept: JointInput | None = None

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        content = message.content
        if isinstance(content, JointInput) and 2.5 <= stage.seconds() < 4.5:
            self._kept = self._kept or content
            content = replace(self._kept, sec=content.sec, nanosec=content.nanosec)
        yield 0, replace(message, content=content)


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_stuck_joints_stop_the_walk_and_it_goes_on_when_they_move_again(seed: int) -> None:
    asked = world(Stuck(), seed)
    with asked.simulation:
        asked.run(430)
        assert asked.gaits[0].entry.state is GaitState.STAND, "and nothing is believed of them yet"
        assert any("stuck while the robot walks" in text for text in asked.judge.explained)
        asked.run(300)
        assert asked.gaits[0].entry.state is GaitState.WALK
        assert not asked.fallen
    assert not asked.judge.violations


def test_two_gaits_the_robot_obeys_the_first_and_the_second_when_it_ends() -> None:
    asked = world()
    with asked.simulation:
        asked.run(250)
        second = asked.start_gait()
        asked.run(100)
        assert not asked.fallen
        assert asked.gaits[0].entry.state is GaitState.WALK
        assert asked._ear._sender == "gait_1"
        asked.kill_gait()
        asked.run(40)
        assert asked._ear._sender == second.name
        asked.run(400)
    assert not asked.judge.violations


def test_parameters_are_taken_over_where_the_support_changes() -> None:
    asked = world()
    with asked.simulation:
        asked.run(250)
        entry, before = asked.gaits[0].entry, GaitParameters()
        gait = entry._gait
        entry.change_parameters({"swing_lift": 0.031})
        assert entry.parameters.swing_lift == 0.031, "what was asked for is seen at once"
        assert gait._parameters == before, "and walks from the next step on"
        sides = set()
        while gait._parameters == before:
            sides.add(gait._walk.predicted.support)
            asked.step()
            assert asked.seconds() < 4.0
        assert len(sides) == 1
        assert gait._walk.predicted.support not in sides
        with pytest.raises(NaoGaitError, match="feedback_delay.*stand first"):
            entry.change_parameters({"feedback_delay": 0.05})
        with pytest.raises(NaoGaitError, match="swing_lift: got 9.0"):
            entry.change_parameters({"swing_lift": 9.0, "arm_swing": 1.0})
        assert entry.parameters.arm_swing == before.arm_swing, "all or none"


def test_parameters_of_a_standing_robot_change_at_once() -> None:
    gait = Gait(ROBOT, GaitParameters())
    gait.set_parameters(GaitParameters().replace(swing_lift=0.031))
    assert gait._parameters.swing_lift == 0.031


# -- the judge can tell ----------------------------------------------------------------------------


class Broken(Fault):
    """A gait that does what it must not."""

    def __init__(self, what: str) -> None:
        super().__init__(np.random.default_rng(0))
        self.what = what

    def act(self, stage: Harness) -> None:
        entry = stage.gaits[0].entry
        if stage.tick != 200:
            return
        if self.what == "crash":
            entry._gait.step = self._raise  # type: ignore[method-assign]
        elif self.what == "exception":
            entry._senses.joints = self._raise  # type: ignore[method-assign]
        elif self.what == "silent":
            entry._velocity.at = lambda stamp: VelocityCommand()  # type: ignore[method-assign]
        elif self.what == "stiff":
            entry._gait._senses.falls = lambda: False  # type: ignore[method-assign]
            stage.simulation.push(np.array([0.0, 120.0, 0.0]), 0.1)

    @staticmethod
    def _raise(*_: Any) -> Any:
        raise ZeroDivisionError("on purpose")


@pytest.mark.parametrize(
    ("what", "kind"),
    [("crash", "exception"), ("exception", "exception"), ("silent", "silent stop"),
     ("stiff", "stiff after a fall")],
)  # fmt: skip
def test_the_judge_finds_a_gait_that_does_what_it_must_not(what: str, kind: str) -> None:
    asked = world(Broken(what))
    with asked.simulation:
        asked.run(700)
    assert kind in asked.judge.violations


def test_the_check_of_commands_finds_each_breach() -> None:
    pose = ROBOT.stand_pose
    assert CommandCheck(ROBOT).see(JointTargets(0, pose)) is None
    nan = pose.copy()
    nan[4] = math.nan
    for bad in (JointTargets(0, nan), JointTargets(0, pose + 9.0), JointTargets(0, pose, 1.5)):
        assert CommandCheck(ROBOT).see(bad) is not None
    check = CommandCheck(ROBOT)
    check.see(JointTargets(0, pose))
    jump = pose.copy()
    jump[ROBOT.index("LKneePitch")] += 0.5
    assert "speed limit" in (check.see(JointTargets(10_000_000, jump)) or "")


# -- the machinery ---------------------------------------------------------------------------------


def test_a_channel_keeps_the_order_of_one_tick() -> None:
    channel: Channel[str] = Channel()
    for due, text in ((2, "a"), (1, "b"), (2, "c"), (1, "d")):
        channel.put(due, text)
    assert channel.take(0) == []
    assert channel.take(1) == ["b", "d"]
    assert channel.take(5) == ["a", "c"]


@pytest.mark.parametrize("name", CLASSES)
def test_a_fault_does_nothing_before_it_begins(name: str) -> None:
    """Whatever it does to the rest, the first second of the walk is untouched."""
    fault = CLASSES[name](np.random.default_rng(1))
    assert 2.0 <= fault.begin <= 3.0
    asked = world(fault)
    with asked.simulation:
        message = Message("imu/data", ImuInput(1, 0, (0.0, 0.0, 0.0), (0.0, 0.0, 9.81)))
        command = Command("gait_1", JointTargets(0, ROBOT.stand_pose))
        assert list(fault.sensors(asked, message)) == [(0, message)]
        assert list(fault.drive(asked, message)) == [(0, message)]
        passed: list[LateCommand] = list(fault.commands(asked, command))
        assert passed == [(0, command)]


def test_classes_are_named_or_refused() -> None:
    assert classes_of(()) == tuple(CLASSES)
    with pytest.raises(NaoGaitError, match="fault: got 'gremlins'"):
        classes_of(("gremlins",))


def test_the_suite_writes_a_row_for_each_outcome(tmp_path: Path) -> None:
    said: list[str] = []
    asked = {"runs": 2, "faults": ("nan", "no_commands"), "jobs": 1, "show": False}
    running.run("faults", asked, json_file=tmp_path / "rows.json", out=said.append)
    assert "no commands" in said[0]
    assert "VIOLATED" not in said[0]
    rows = (tmp_path / "rows.json").read_text()
    assert '"all_violated"' in rows
    assert '"nan_walks"' in rows


def test_a_stamp_far_from_zero_makes_no_difference() -> None:
    """Stamps are whole numbers: neither 2^31 seconds nor the size of a float is special."""

    class Shifted(Fault):
        def __init__(self, shift: int) -> None:
            super().__init__(np.random.default_rng(0))
            self.shift = shift

        def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
            content = message.content
            assert isinstance(content, ImuInput | JointInput)
            yield 0, replace(message, content=replace(content, sec=content.sec + self.shift))

    def positions(shift: int) -> bytes:
        asked = world(Shifted(shift))
        with asked.simulation:
            asked.run(200)
            assert asked.gaits[0].entry.state is GaitState.WALK
            return asked.truth.joint_position.tobytes()

    assert positions(0) == positions(2**31 - 10)


def test_the_entry_refuses_to_start_without_an_imu() -> None:
    class NoImu(Fault):
        def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
            if not isinstance(message.content, ImuInput):
                yield 0, message

    asked = world(NoImu(np.random.default_rng(0)))
    with asked.simulation:
        asked.run(100)
        entry: GaitController = asked.gaits[0].entry
        assert entry.last_status is None
        assert entry.rejected["joint_states"] > 0


@pytest.mark.parametrize("name", ["nao_h21_v33", "bruno"])
def test_a_motor_that_fails_is_one_that_there_is(name: str) -> None:
    robot = load_robot(name)
    failing = {motor_of(robot, number) for number in range(12)}
    assert not failing & {follower for _, follower in robot.coupled_joints}
    assert len(failing) == 12 - len(robot.coupled_joints)
