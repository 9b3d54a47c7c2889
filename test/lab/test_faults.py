"""Faults in the middle of a walk, through the code of both nodes, in lockstep."""

import math
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gait_lab.bench import registry
from gait_lab.bench.suites.faults import classes_of
from gait_lab.channel import Channel
from gait_lab.faults.campaign import (
    ALL_FAULTS,
    FAULTS,
    STOPPED,
    VIOLATED,
    WALKS,
    FaultRun,
    run_fault,
)
from gait_lab.faults.harness import Fault, Harness
from gait_lab.faults.healthy import Healthy
from gait_lab.faults.invariants import (
    FALL_GRACE,
    SILENT_STOP,
    START_GRACE,
    CommandCheck,
    Invariants,
)
from gait_lab.faults.messages import Command, Delivery, Message
from gait_lab.faults.robot_faults import PickedUp, motor_of
from gait_lab.faults.scopes import SCOPES
from gait_lab.faults.sensor_faults import ImuOutage
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.presets import preset_for
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput, LoadInput
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from robot_core.types import GaitState, JointTargets, VelocityCommand
from sim_bridge.trials.rollout import RolloutSpec, make_pair
from sim_bridge.trials.tasks import TASKS
from sim_bridge.trials.trial import TimedCommands, run

pytest.importorskip("mujoco")
ROBOT = load_robot()
FORWARD = VelocityCommand(0.15, 0.0, 0.0)


def harness_with(fault: Fault | None = None, seed: int = 3) -> Harness:
    """A harness whose operator commands 15 cm/s forward; the caller closes its simulation."""
    simulation, _ = make_pair(RolloutSpec(TASKS["stand"], robot_seed=seed, engine="mujoco"))
    return Harness(
        simulation, GaitParameters(), fault or Fault(np.random.default_rng(0)), FORWARD
    )


# -- the walk without faults -----------------------------------------------------------------------


def test_without_a_fault_the_harness_walks_as_a_rollout_does_bit_by_bit() -> None:
    """The validation of the node changes nothing as long as nothing is wrong."""
    harness = harness_with()
    spec = RolloutSpec(TASKS["stand"], robot_seed=3, engine="mujoco")
    simulation, gait = make_pair(spec)
    with harness.world, simulation:
        # The operator sends from 1 s on; a command arrives after the sensors of its tick.
        policy = TimedCommands(lambda t: FORWARD if t > 1.005 else VelocityCommand())
        ticks = run(simulation, gait, policy)
        next(ticks)
        for _ in range(400):
            harness.step()
            truth = next(ticks).truth
            assert np.array_equal(harness.truth.joint_position, truth.joint_position), harness.tick
    assert harness.gaits[0].controller.reporter.faults == 0
    assert not harness.gaits[0].controller.reporter.rejected
    assert harness.gaits[0].controller.state is GaitState.WALK


FAST = (
    "none", "frozen", "nan", "stamp_jump", "loss", "gait_restart", "two_gaits", "parameters",
    "no_commands", "limp_motor",
)  # fmt: skip
"""One or two faults of each kind; the other ones run among the slow tests."""
WALKS_ON = (
    "none", "nan", "repeated", "reordered", "stamp_outliers", "stamp_jitter", "stamp_jump",
    "two_drivers", "two_gaits", "parameters", "bad_commands", "bridge_reset", "bridge_restart",
    "joint_dropout", "loss",
)  # fmt: skip
"""Faults that do not stop the walk for good."""


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[] if name in FAST else pytest.mark.slow) for name in FAULTS],
)
def test_no_fault_violates_an_invariant_and_most_do_not_stop_the_walk(name: str) -> None:
    result = run_fault(FaultRun(name, 0))
    assert result.outcome != VIOLATED, result.violations
    assert result.outcome == WALKS or name not in WALKS_ON, result.explained


def test_the_robot_stops_without_velocity_commands_and_reports_why() -> None:
    result = run_fault(FaultRun("no_commands", 1))
    assert result.outcome == STOPPED
    assert any("no cmd_vel for" in text for text in result.explained)


class _InG(Healthy):
    """The first walk of a robot whose accelerometer measures in g."""

    end = 4.0

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        if isinstance(message.content, ImuInput):
            x, y, z = message.content.linear_acceleration
            content = replace(message.content, linear_acceleration=(x / 9.81, y / 9.81, z / 9.81))
            message = replace(message, content=content)
        yield Delivery(0, message)


def test_what_is_said_of_right_sensors_is_a_false_alarm(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Healthy, "end", 4.0)
    assert run_fault(FaultRun("healthy", 40)).outcome != VIOLATED
    monkeypatch.setitem(ALL_FAULTS, "healthy", _InG)  # type: ignore[misc]
    found = run_fault(FaultRun("healthy", 40))
    assert any("false alarm" in text and "linear_acceleration" in text for text in found.violations)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40, 44))
@pytest.mark.parametrize("urdf", ["nao_h21_v33", "nao_v6", "bruno"])
@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
def test_a_healthy_robot_gives_no_alarm(engine: str, urdf: str, seed: int) -> None:
    parameters = preset_for(load_robot(urdf), "default")
    found = run_fault(FaultRun("healthy", seed, engine=engine, urdf=urdf, parameters=parameters))
    assert found.violations == ()


def test_a_bridge_that_was_restarted_executes_commands_at_once() -> None:
    assert run_fault(FaultRun("bridge_restart", 5)).outcome == WALKS


def test_a_gait_that_starts_on_a_leaning_robot_notices_that_it_falls() -> None:
    assert run_fault(FaultRun("gait_restart", 246)).violations == ()


@pytest.mark.parametrize(("fault", "seed"), [("silence", 79), ("gait_restart", 88)])
def test_a_gait_that_begins_on_a_swaying_robot_does_not_see_a_fall(fault: str, seed: int) -> None:
    assert run_fault(FaultRun(fault, seed)).outcome == WALKS


@pytest.mark.parametrize("seed", [188, 207])
def test_a_clock_that_is_set_back_by_half_a_second_fells_no_robot(seed: int) -> None:
    assert run_fault(FaultRun("stamp_jump", seed)).outcome == WALKS


def test_a_run_depends_on_its_seed_alone() -> None:
    first, again = (run_fault(FaultRun("loss", 5)) for _ in range(2))
    assert first == again


# -- one fault each --------------------------------------------------------------------------------


class LongImuOutage(ImuOutage):
    """No IMU messages from 2.5 s on."""

    def __init__(self, duration: float) -> None:
        super().__init__(np.random.default_rng(0))
        self.begin, self.duration = 2.5, duration


def test_without_imu_the_robot_stops_stands_and_reports_why() -> None:
    harness = harness_with(LongImuOutage(100.0))
    with harness.world:
        harness.run(600)
        assert harness.gaits[0].controller.state is GaitState.STAND
        assert not harness.fallen
        assert any("imu/data: none for" in text for text in harness.invariants.explained)
        assert not harness.invariants.violations


@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
def test_a_robot_that_is_lifted_stands_in_the_air_and_walks_on_once_it_is_put_down(
    engine: str,
) -> None:
    pytest.importorskip(engine)
    fault = PickedUp(np.random.default_rng(0))
    fault.begin, fault.duration = 2.0, 1.0
    simulation, _ = make_pair(RolloutSpec(TASKS["stand"], robot_seed=3, engine=engine))
    harness = Harness(simulation, GaitParameters(), fault, FORWARD)
    states = []
    with simulation:
        for _ in range(700):
            harness.step()
            state = harness.gaits[0].controller.state
            if not states or states[-1] is not state:
                states.append(state)
    stand, walk, lifted = GaitState.STAND, GaitState.WALK, GaitState.LIFTED
    assert states == [stand, walk, lifted, stand, walk]
    assert "walk: lifted" in harness.invariants.explained
    assert not harness.fallen


def test_a_robot_that_is_pushed_over_without_imu_relaxes_and_stays_fallen() -> None:
    """Without an IMU only the load of the soles shows the fall."""
    harness = harness_with(LongImuOutage(6.0))
    with harness.world:
        harness.run(500)
        harness.world.robot.push(np.array([0.0, 90.0, 0.0]), 0.1)
        harness.run(150)
        assert harness.fallen
        assert harness.gaits[0].controller.state is GaitState.FALLEN
        harness.run(300)  # the IMU is back
        assert harness.fallen
        assert harness.gaits[0].controller.state is GaitState.FALLEN
    assert not harness.invariants.violations


class FrozenJoints(Fault):
    """All joint readings freeze from 2.5 s to 4.5 s."""

    def __init__(self) -> None:
        super().__init__(np.random.default_rng(0))
        self._first: JointInput | None = None

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Replace the readings by the first ones."""
        content = message.content
        if isinstance(content, JointInput) and 2.5 <= harness.seconds() < 4.5:
            self._first = self._first or content
            content = replace(self._first, sec=content.sec, nanosec=content.nanosec)
        yield Delivery(0, replace(message, content=content))


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_frozen_joints_stop_the_walk_and_it_continues_when_they_move_again(seed: int) -> None:
    harness = harness_with(FrozenJoints(), seed)
    with harness.world:
        harness.run(430)
        assert harness.gaits[0].controller.state is GaitState.STAND
        assert any("stuck while the robot walks" in text for text in harness.invariants.explained)
        harness.run(300)
        assert harness.gaits[0].controller.state is GaitState.WALK
        assert not harness.fallen
    assert not harness.invariants.violations


def test_the_robot_obeys_the_first_of_two_gaits_and_the_second_when_the_first_ends() -> None:
    harness = harness_with()
    with harness.world:
        harness.run(250)
        second = harness.start_gait()
        harness.run(100)
        assert not harness.fallen
        assert harness.gaits[0].controller.state is GaitState.WALK
        assert harness.obeyed == "gait_1"
        harness.kill_gait()
        harness.run(40)
        assert harness.obeyed == second.name
        harness.run(400)
    assert not harness.invariants.violations


@pytest.mark.parametrize("seed", [57, 63])
def test_a_second_gait_walks_on_when_the_first_ends(seed: int) -> None:
    assert run_fault(FaultRun("two_gaits", seed)).outcome == WALKS


@pytest.mark.parametrize("seed", [43, 81])
def test_an_imu_that_is_stuck_together_with_the_joints_is_noticed(seed: int) -> None:
    found = run_fault(FaultRun("frozen", seed))
    assert found.outcome == WALKS
    assert any("an IMU that is not stuck" in each for each in found.explained)


def test_parameters_take_effect_at_the_next_support_change() -> None:
    changed, unchanged = harness_with(), harness_with()
    with changed.world, unchanged.world:
        for harness in (changed, unchanged):
            harness.run(250)
        changed.gaits[0].controller.change_parameters({"swing_lift": 0.031})
        assert changed.gaits[0].controller.parameters.swing_lift == 0.031, "readable at once"

        def step_both() -> bool:
            """Step both robots; whether their soles are still at the same place."""
            for harness in (changed, unchanged):
                harness.step()
            soles = zip(changed.truth.soles, unchanged.truth.soles, strict=True)
            return all(np.array_equal(a.position, b.position) for a, b in soles)

        def steps() -> int:
            status = changed.gaits[0].controller.last_status
            assert status is not None
            return status.step_count

        before = steps()
        while steps() == before:
            assert step_both(), "the running step keeps its height"
        assert not all(step_both() for _ in range(60)), "the next step has the new height"


def test_a_refused_change_of_parameters_changes_nothing() -> None:
    harness = harness_with()
    with harness.world:
        harness.run(250)
        controller, before = harness.gaits[0].controller, GaitParameters()
        with pytest.raises(NaoGaitError, match=r"feedback_delay.*stand first"):
            controller.change_parameters({"feedback_delay": 0.05})
        with pytest.raises(NaoGaitError, match=r"swing_lift: got 9\.0"):
            controller.change_parameters({"swing_lift": 9.0, "arm_swing": 1.0})
        assert controller.parameters == before


def test_the_gait_does_not_start_without_an_imu() -> None:
    harness = harness_with(LongImuOutage(100.0))
    harness.fault.begin = 0.0
    with harness.world:
        harness.run(100)
        controller = harness.gaits[0].controller
        assert controller.last_status is None
        assert controller.reporter.rejected["joint_states"] > 0


def test_a_stamp_far_from_zero_makes_no_difference() -> None:
    """Stamps are integers: neither 2^31 seconds nor the precision of a float is special."""

    class Shifted(Fault):
        def __init__(self, shift: int) -> None:
            super().__init__(np.random.default_rng(0))
            self.shift = shift

        def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
            content = message.content
            assert isinstance(content, ImuInput | JointInput | LoadInput)
            content = replace(content, sec=content.sec + self.shift)
            yield Delivery(0, replace(message, content=content))

    def positions(shift: int) -> bytes:
        harness = harness_with(Shifted(shift))
        with harness.world:
            harness.run(200)
            assert harness.gaits[0].controller.state is GaitState.WALK
            return harness.truth.joint_position.tobytes()

    assert positions(0) == positions(2**31 - 10)


# -- the invariants --------------------------------------------------------------------------------


class Clock:
    """A clock that the test sets."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def gait(state: GaitState, unexpected: int = 0, crashes: Iterable[str] = ()) -> Any:
    """The part of a gait at which the invariants look."""
    reporter = SimpleNamespace(unexpected=unexpected, crashes=list(crashes))
    return SimpleNamespace(state=state, reporter=reporter)


def test_an_exception_or_a_crash_of_the_gait_is_a_violation() -> None:
    for broken in (gait(GaitState.STAND, unexpected=1), gait(GaitState.STAND, crashes=["why"])):
        invariants = Invariants(ROBOT, Clock())
        invariants.check_tick(False, [broken], asked_to_walk=False)
        assert "exception" in invariants.violations


def test_an_exception_on_the_tick_ends_up_as_a_violation(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: Any) -> Any:
        raise ZeroDivisionError("on purpose")

    harness = harness_with()
    with harness.world:
        harness.run(50)
        monkeypatch.setattr(Gait, "step", fails)
        harness.run(10)
    assert "on purpose" in harness.invariants.violations["exception"]


def test_a_robot_that_does_not_walk_as_commanded_has_to_report_why() -> None:
    clock = Clock()
    invariants = Invariants(ROBOT, clock)
    standing = [gait(GaitState.STAND)]
    invariants.check_tick(False, standing, asked_to_walk=True)
    clock.now = SILENT_STOP - 0.01
    invariants.check_tick(False, standing, asked_to_walk=True)
    assert not invariants.violations
    clock.now = SILENT_STOP + 0.01
    invariants.check_tick(False, standing, asked_to_walk=True)
    assert "silent stop" in invariants.violations


def test_a_stiff_command_after_a_fall_is_a_violation_unless_the_gait_knows_of_the_fall() -> None:
    stiff = JointTargets(0, ROBOT.stand_pose)
    for state, violated in ((GaitState.WALK, True), (GaitState.GETTING_UP, False)):
        clock = Clock()
        invariants = Invariants(ROBOT, clock)
        invariants.check_tick(True, [gait(state)], asked_to_walk=False)
        for now in np.arange(0.0, FALL_GRACE + 0.05, 0.02):
            clock.now = float(now)
            invariants.check_command("gait_1", state, stiff)
        assert ("stiff after a fall" in invariants.violations) is violated


def test_a_gait_has_a_moment_to_notice_a_fall_that_it_could_not_see() -> None:
    """It gets no sensors, sends nothing, and begins again when the robot lies."""
    clock = Clock()
    invariants = Invariants(ROBOT, clock)
    stiff = JointTargets(0, ROBOT.stand_pose)
    invariants.check_command("gait_1", GaitState.WALK, stiff)
    invariants.check_tick(True, [gait(GaitState.WALK)], asked_to_walk=False)
    for now, violated in ((1.0, False), (0.99 + START_GRACE, False), (1.01 + START_GRACE, True)):
        clock.now = now
        invariants.check_command("gait_1", GaitState.STAND, stiff)
        assert ("stiff after a fall" in invariants.violations) is violated


def test_the_check_of_commands_finds_each_breach() -> None:
    pose = ROBOT.stand_pose
    assert CommandCheck(ROBOT).check(JointTargets(0, pose)) is None
    nan = pose.copy()
    nan[4] = math.nan
    for bad in (JointTargets(0, nan), JointTargets(0, pose + 9.0), JointTargets(0, pose, 1.5)):
        assert CommandCheck(ROBOT).check(bad) is not None
    check = CommandCheck(ROBOT)
    check.check(JointTargets(0, pose))
    jump = pose.copy()
    jump[ROBOT.index("LKneePitch")] += 0.5
    assert "speed limit" in (check.check(JointTargets(10_000_000, jump)) or "")


# -- the parts -------------------------------------------------------------------------------------


def test_a_channel_keeps_the_order_of_one_tick() -> None:
    channel: Channel[str] = Channel()
    for due, text in ((2, "a"), (1, "b"), (2, "c"), (1, "d")):
        channel.send(due, text)
    assert channel.receive(0) == []
    assert channel.receive(1) == ["b", "d"]
    assert channel.receive(5) == ["a", "c"]


def test_no_fault_does_anything_before_it_begins() -> None:
    message = Message("imu/data", ImuInput(1, 0, (0.0, 0.0, 0.0), (0.0, 0.0, 9.81)))
    command = Command("gait_1", JointTargets(0, ROBOT.stand_pose))
    harness = harness_with()
    with harness.world:
        for name, make in FAULTS.items():
            fault = make(np.random.default_rng(1))
            assert 2.0 <= fault.begin <= 3.0, name
            assert list(fault.on_sensor(harness, message)) == [Delivery(0, message)], name
            assert list(fault.on_velocity(harness, message)) == [Delivery(0, message)], name
            assert list(fault.on_command(harness, command)) == [Delivery(0, command)], name


def test_faults_are_named_or_refused() -> None:
    for scope in SCOPES.values():
        assert classes_of(scope, ()) == tuple(scope.classes)
        with pytest.raises(NaoGaitError, match="fault: got 'gremlins'"):
            classes_of(scope, ("gremlins",))
    assert classes_of(SCOPES["gait"], ("imu_gone", "imu_gone")) == ("imu_gone",)


def test_the_suite_writes_a_row_for_each_outcome(tmp_path: Path) -> None:
    said: list[str] = []
    asked = {"runs": 2, "faults": ("nan", "no_commands"), "jobs": 1, "show": False}
    registry.run("faults", asked, json_file=tmp_path / "rows.json", out=said.append)
    assert "no commands" in said[0]
    assert "VIOLATED" not in said[0]
    rows = (tmp_path / "rows.json").read_text()
    assert '"all_violated"' in rows
    assert '"nan_walks"' in rows


@pytest.mark.parametrize("name", ["nao_h21_v33", "bruno"])
def test_a_weak_motor_is_never_a_joint_that_follows_another(name: str) -> None:
    robot = load_robot(name)
    failing = {motor_of(robot, number) for number in range(12)}
    assert not failing & {follower for _, follower in robot.coupled_joints}
    assert len(failing) == 12 - len(robot.coupled_joints)
