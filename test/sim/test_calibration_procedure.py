"""The procedure of a calibration: its phases, and what ends it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from gait_lab import cli
from nao_lipm_gait.estimation.sole_levelling import TILT_MAX
from nao_lipm_gait.parameters import BY_NAME, GaitParameters
from nao_lipm_gait.presets import preset_for
from nao_lipm_gait.runtime.calibration_monitor import Measurement
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from robot_core.types import STANDSTILL, VelocityCommand
from sim_bridge.trials.calibration import find_zeros
from sim_bridge.trials.calibration_procedure import (
    LONGEST_STEP_TIME,
    PHASE_LIMIT,
    PLACE,
    POSE_REST_TIME,
    POSE_STEP_TIME,
    POSED,
    REST_TIME,
    STAND_TIME,
    STEADY_TIME,
    STEP_ON_THE_SPOT,
    STEP_TIME,
    CalibrationError,
    Phase,
    Procedure,
    calibration_poses,
)
from sim_bridge.trials.trial import TrialSpec

UNKNOWN = Measurement(sole_pitch_deviation=0.02, sole_roll_deviation=0.02, steps_measure=True)
LEVEL = Measurement(
    sole_pitch=0.01, sole_pitch_applied=0.01,
    sole_pitch_deviation=0.0025, sole_roll_deviation=0.0025, steps_measure=True,
)  # fmt: skip


class Robot:
    """Tells the procedure what happens, at 10 Hz of its own time [s]."""

    def __init__(self) -> None:
        self.procedure = Procedure()
        self.time = 100.0
        self.procedure.see_state("stand both")
        self.procedure.see_odometry(self.time, 0.0, 0.0)

    def wait(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.1)):
            self.time += 0.1
            self.procedure.see_odometry(self.time, 0.0, 0.0)

    def measure(self, measured: Measurement, **changes: Any) -> None:
        self.procedure.see_measurement(self.time, attrs.evolve(measured, **changes))

    def stands(self) -> None:
        self.wait(STAND_TIME + 3.0)
        self.measure(UNKNOWN, stand_time=STAND_TIME)

    def steps(self) -> None:
        self.stands()
        self.procedure.see_state("walk left")
        self.level()

    def level(self) -> None:
        """Step for the least duration, with the same tilt at its end."""
        self.wait(STEP_TIME - STEADY_TIME)
        self.measure(LEVEL)
        self.wait(STEADY_TIME + 0.5)
        self.measure(LEVEL)

    @property
    def phase(self) -> Phase:
        return self.procedure.phase


@pytest.fixture
def robot() -> Robot:
    return Robot()


def test_it_stands_steps_and_stands(robot: Robot) -> None:
    assert robot.procedure.command is None
    robot.stands()
    assert robot.phase is Phase.STEP
    assert robot.procedure.command == STEP_ON_THE_SPOT
    robot.procedure.see_state("walk left")
    robot.level()
    assert robot.phase is Phase.REST
    assert robot.procedure.command == STANDSTILL
    robot.procedure.see_state("stop left")
    robot.procedure.see_state("stand both")
    robot.wait(1.0)
    robot.measure(LEVEL, stand_time=0.5 * REST_TIME)
    assert robot.phase is Phase.REST
    robot.measure(LEVEL, stand_time=REST_TIME, imu_roll=0.02)
    assert robot.phase is Phase.DONE
    assert robot.procedure.measured is not None
    assert robot.procedure.measured.imu_roll == 0.02


def test_a_robot_that_does_not_walk_has_not_measured(robot: Robot) -> None:
    robot.stands()
    robot.wait(STEP_TIME + 1.0)
    robot.measure(LEVEL)  # known from its calibration file
    assert robot.phase is Phase.STEP


def test_it_steps_until_the_soles_are_level(robot: Robot) -> None:
    robot.stands()
    robot.procedure.see_state("walk left")
    robot.wait(STEP_TIME + 5.0)
    robot.measure(UNKNOWN)
    assert robot.phase is Phase.STEP
    robot.measure(LEVEL, sole_pitch_applied=0.0)
    robot.wait(STEADY_TIME + 0.5)
    robot.measure(LEVEL, sole_pitch_applied=0.0)
    assert robot.phase is Phase.STEP, "known, but not corrected yet"
    robot.measure(LEVEL)
    assert robot.phase is Phase.REST


def test_a_report_from_before_a_phase_does_not_end_it(robot: Robot) -> None:
    robot.steps()
    robot.procedure.see_state("stand both")
    robot.procedure.see_measurement(robot.time - 1.0, attrs.evolve(LEVEL, stand_time=30.0))
    assert robot.phase is Phase.REST


@pytest.mark.parametrize("begin", [lambda robot: None, Robot.stands, Robot.steps])
@pytest.mark.parametrize("state", ["fallen both", "motion both", "getting_up both", "relaxed both"])
def test_a_fall_or_a_request_of_somebody_else_ends_it(
    robot: Robot, begin: Callable[[Robot], None], state: str
) -> None:
    begin(robot)
    reason = "has fallen" if state.startswith("fallen") else f"the gait is in {state.split()[0]}"
    with pytest.raises(CalibrationError, match=reason):
        robot.procedure.see_state(state)


def test_a_robot_that_walks_already_is_refused(robot: Robot) -> None:
    with pytest.raises(CalibrationError, match="the gait is in walk"):
        robot.procedure.see_state("walk left")


def test_commands_of_somebody_else_end_it(robot: Robot) -> None:
    see = robot.procedure.see_command
    other = VelocityCommand(0.1, 0.0, 0.0)
    see(STANDSTILL)
    for command in (other, STEP_ON_THE_SPOT):
        with pytest.raises(CalibrationError, match="somebody else"):
            see(command)
    robot.stands()
    see(STEP_ON_THE_SPOT)
    for command in (other, STANDSTILL):
        with pytest.raises(CalibrationError, match="somebody else"):
            see(command)


def test_the_own_commands_may_arrive_late(robot: Robot) -> None:
    robot.steps()
    robot.procedure.see_command(STEP_ON_THE_SPOT)
    robot.procedure.see_command(STANDSTILL)
    with pytest.raises(CalibrationError, match="somebody else"):
        robot.procedure.see_command(VelocityCommand(0.0, 0.0, 0.2))


def test_a_robot_that_leaves_its_place_ends_it(robot: Robot) -> None:
    robot.stands()
    robot.procedure.see_odometry(robot.time + 0.1, 0.9 * PLACE, 0.0)
    with pytest.raises(CalibrationError, match="left its place"):
        robot.procedure.see_odometry(robot.time + 0.2, PLACE, 0.5 * PLACE)


@pytest.mark.parametrize(
    ("begin", "reason"),
    [
        (lambda robot: None, "not come to rest"),
        (Robot.stands, "tilt of the soles is not known"),
        (Robot.steps, "not come to rest after its steps"),
    ],
)
def test_no_phase_lasts_forever(
    robot: Robot, begin: Callable[[Robot], None], reason: str
) -> None:
    begin(robot)
    with pytest.raises(CalibrationError, match=reason):
        robot.wait(PHASE_LIMIT + 1.0)


def test_a_clock_that_goes_back_ends_it(robot: Robot) -> None:
    with pytest.raises(CalibrationError, match="clock"):
        robot.procedure.see_odometry(robot.time - 1.0, 0.0, 0.0)


def test_a_gait_that_does_not_measure_is_refused(robot: Robot) -> None:
    with pytest.raises(NaoGaitError, match="level_soles"):
        robot.measure(attrs.evolve(UNKNOWN, steps_measure=False))


@pytest.mark.parametrize(("tilt", "joints"), [
    ({"sole_roll": -TILT_MAX}, r"rolled by -3.4 deg or more .*hip roll or ankle roll"),
    ({"sole_pitch": TILT_MAX}, r"pitched by \+3.4 deg or more .* hip pitch, knee or ankle pitch"),
])  # fmt: skip
def test_a_tilt_at_the_limit_of_what_is_learned_names_the_joints(
    robot: Robot, tilt: dict[str, float], joints: str
) -> None:
    robot.stands()
    robot.procedure.see_state("walk left")
    robot.wait(STEP_TIME + 0.5)
    with pytest.raises(CalibrationError, match=joints):
        robot.measure(LEVEL, **tilt)


def test_a_tilt_that_still_rises_is_no_result(robot: Robot) -> None:
    robot.stands()
    robot.procedure.see_state("walk left")
    robot.wait(STEP_TIME)
    for step in range(20):
        robot.wait(0.5)
        tilt = 0.002 * step
        robot.measure(LEVEL, sole_pitch=tilt, sole_pitch_applied=tilt)
        assert robot.procedure.phase is Phase.STEP


USUAL = {name: BY_NAME[name].default for name in POSED}


def test_the_poses_differ_from_that_of_the_walk_within_the_ranges() -> None:
    poses = calibration_poses(USUAL)
    assert poses[0] == USUAL
    assert len({tuple(pose.values()) for pose in poses}) == len(poses) == 4
    for wide in (USUAL, {**USUAL, "torso_pitch": 0.28, "foot_spacing": 0.19}):
        for pose in calibration_poses(wide):
            GaitParameters().replace(**pose)  # refuses what is out of range


def test_with_poses_it_steps_and_stands_in_each_of_them() -> None:
    robot = Robot()
    poses = calibration_poses(USUAL)
    robot.procedure = Procedure(poses)
    robot.procedure.see_state("stand both")
    robot.procedure.see_odometry(robot.time, 0.0, 0.0)
    see = robot.procedure.see_sensors

    def sense(seconds: float, number: float) -> None:
        for _ in range(round(seconds / 0.1)):
            robot.wait(0.1)
            see(np.array((number, 0.0)), np.array((0.0, 0.0, 9.81)))

    robot.wait(3.0)
    robot.measure(UNKNOWN, stand_time=10.0)  # it has stood for long, but was not watched
    assert robot.phase is Phase.STAND
    sense(STAND_TIME, 7.0)
    robot.measure(UNKNOWN, stand_time=12.0)
    assert robot.phase is Phase.STEP
    taken = []
    for number, pose in enumerate(poses):
        assert robot.phase is Phase.STEP
        taken.append(robot.procedure.parameters)
        robot.procedure.see_command(STEP_ON_THE_SPOT)
        if number > 0:
            robot.procedure.see_command(STANDSTILL)  # of the stand before, late
        robot.procedure.see_state("walk left")
        sense(LONGEST_STEP_TIME + 0.5 if number == 0 else POSE_STEP_TIME + 0.5, float(number))
        robot.measure(UNKNOWN, sole_pitch=-TILT_MAX)
        assert robot.phase is Phase.REST, "also if the soles cannot be levelled"
        assert robot.procedure.parameters == pose
        robot.procedure.see_state("stand both")
        sense(0.5, 50.0)  # it still moves
        robot.measure(UNKNOWN, sole_pitch=-TILT_MAX, stand_time=0.1, imu_roll=0.01 * number)
        sense(REST_TIME, 10.0 + number)
        enough = REST_TIME if number == 0 else POSE_REST_TIME
        robot.measure(UNKNOWN, sole_pitch=-TILT_MAX, stand_time=enough, imu_roll=0.01 * number)
    assert robot.phase is Phase.DONE
    assert taken == poses
    first, *seen = robot.procedure.seen
    assert first.stand is not None
    assert first.steps is None
    assert first.stand.position[0] == pytest.approx(7.0)
    for number, pose in enumerate(seen):
        assert pose.steps is not None
        assert pose.stand is not None
        assert pose.steps.position[0] == pytest.approx(number)
        assert pose.stand.position[0] == pytest.approx(10.0 + number)
        assert pose.tilt == (-TILT_MAX, 0.0)
    assert robot.procedure.level is not None
    assert robot.procedure.level.imu_roll == 0.0, "the first pose is that of the walk"


def test_a_simulated_robot_names_its_wrong_knee_and_corrects_it() -> None:
    pytest.importorskip("mujoco")
    wrong = (("variation.wrong_joint", "RKneePitch"), ("variation.wrong_zero", 0.07))
    spec = TrialSpec(robot_seed=43, urdf="nao_v6", engine="mujoco", plant_options=wrong,
                     parameters=preset_for(load_robot("nao_v6"), "default"))  # fmt: skip
    found, calibration = find_zeros(spec)
    assert found[0].joint == "RKneePitch"
    ((joint, zero),) = calibration.joint_zero
    assert joint == "RKneePitch"
    assert zero == pytest.approx(0.07, abs=0.03)


def test_a_file_that_cannot_be_written_is_refused_before_the_robot_moves(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["calibrate", "--out", str(tmp_path)]) == 2
    assert "out: got" in capsys.readouterr().err
