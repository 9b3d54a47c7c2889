"""Sole levelling: the law on a model of tilted soles on springs, and simulated robots."""

import math
from dataclasses import replace

import numpy as np
import pytest

from nao_lipm_gait.calibration import NOT_CALIBRATED
from nao_lipm_gait.estimation.com_measurement import level_frame
from nao_lipm_gait.estimation.sole_levelling import (
    KNOWN_SIGMA,
    ZMP_SHARE,
    SoleLevelling,
    SoleSprings,
    sole_springs,
)
from nao_lipm_gait.parameters import load_preset
from nao_lipm_gait.whole_body.body_model import SolePose
from robot_core.geometry import rotation_from_rpy
from robot_core.types import GRAVITY, LEFT, VelocityCommand
from sim_bridge.trials.calibration import Levelled, calibrate, levelling, true_tilt
from sim_bridge.trials.calibration_procedure import STEP_ON_THE_SPOT
from sim_bridge.trials.tasks import STAND_TIME
from sim_bridge.trials.trial import Push, TrialSpec, make_gait, make_world

DT = 0.01
STEP_TICKS = 24
SPRINGS = SoleSprings(pitch=0.3, roll=0.9, center_y=0.005)
HEIGHT = 0.24


def test_springs_tilt_as_much_as_the_moment_of_the_zmp_bends_them() -> None:
    """A sole of four corners: stiffness times tilt, summed with its arms, is the moment."""
    corners, mass, measured = ((0.1, 0.03), (0.1, -0.05), (-0.06, 0.03), (-0.06, -0.05)), 5.0, 0.01
    springs = sole_springs(corners, mass)
    distance = ZMP_SHARE * measured
    moment = sum(1e4 * 0.08**2 * springs.pitch * measured for _ in corners)
    assert moment == pytest.approx(mass * GRAVITY * distance)
    moment = sum(1e4 * 0.04**2 * springs.roll * measured for _ in corners)
    assert moment == pytest.approx(mass * GRAVITY * distance)


class SteppingTorso:
    """A torso that sways over soles on springs, whose joint angles have constant errors.

    Args:
        pitch: Pitch [rad] of the left sole relative to the right one by the joint errors.
        roll: The same for the roll [rad].
        softness: Softness of the ground.
        bias: Bias [rad/s] of the gyro, about x and y.
        ahead: How much further ahead [m] the ZMP is on the left sole.
        lean: Roll [rad] of the torso over level soles by the joint errors.
    """

    def __init__(
        self,
        pitch: float,
        roll: float,
        softness: float = 1.0,
        bias: tuple[float, float] = (0.0, 0.0),
        ahead: float = 0.0,
        lean: float = 0.0,
    ) -> None:
        self.levelling = SoleLevelling(SPRINGS)
        self._tilt = roll, pitch
        self._softness = softness
        self._bias = bias
        self._ahead = ahead
        self._lean = lean
        self.velocity = (0.0, 0.0, 0.0)
        self.on_edges: float | None = None  # roll that is measured whatever is applied
        self._tick = 0
        self._last: tuple[float, float] | None = None
        self._sole_pitch = 0.0
        self._noise = np.random.default_rng(0)

    def walk(self, seconds: float) -> None:
        """Step on the spot."""
        for _ in range(round(seconds / DT)):
            self._step()

    def _step(self) -> None:
        support = LEFT if (self._tick // STEP_TICKS) % 2 == 0 else -LEFT
        phase = (self._tick % STEP_TICKS) / STEP_TICKS
        self._tick += 1
        # The ZMP moves along the sole and back, and lies inside of its springs' center.
        zmp_x = 0.03 * math.cos(2.0 * math.pi * phase) + (self._ahead if support == LEFT else 0.0)
        zmp_y = support * (SPRINGS.center_y - 0.01)
        # In mirrored steps it moves to opposite sides, by the lean to the same one.
        sways = support * 0.004 + 0.4 * (self._lean - self.levelling.applied_lean)
        zmp_y += sways * math.sin(2.0 * math.pi * phase)
        stance_pitch = self._softness * SPRINGS.pitch * zmp_x
        # As the estimator assumes it: the sole follows the ZMP with a lag while it rocks.
        self._sole_pitch += min(1.0, DT / 0.025) * (stance_pitch - self._sole_pitch)
        if phase == 0.0:
            self._sole_pitch = stance_pitch
        stance_roll = -self._softness * SPRINGS.roll * (zmp_y - support * SPRINGS.center_y)
        roll = 0.03 * math.sin(math.pi * self._tick / STEP_TICKS)
        pitch = 0.05 + 0.01 * math.sin(0.7 * self._tick * DT)
        rate = (0.0, 0.0)
        if self._last is not None:
            rate = ((roll - self._last[0]) / DT, (pitch - self._last[1]) / DT)
        self._last = roll, pitch
        left = self.levelling
        left_roll = self._tilt[0] - left.applied_roll if self.on_edges is None else self.on_edges
        error_roll = 0.5 * support * left_roll
        error_pitch = 0.5 * support * (self._tilt[1] - left.applied_pitch)
        sole = _sole(roll - stance_roll + error_roll, pitch - self._sole_pitch + error_pitch)
        level = level_frame(sole, _sole(roll, pitch).normal)
        noise = self._noise.normal(0.0, 0.005, 2)
        gyro = (rate[0] + self._bias[0] + noise[0], rate[1] + self._bias[1] + noise[1], 0.0)
        self.levelling.update(
            support, sole, (zmp_x, zmp_y, HEIGHT), (0.0, 0.0, GRAVITY), level.torso_yaw, gyro,
            self.velocity, DT,
        )  # fmt: skip


def _sole(roll: float, pitch: float) -> SolePose:
    """A sole below a torso that has this tilt [rad] over it."""
    rows = rotation_from_rpy(roll, pitch, 0.0)
    # The torso turned over the sole: the sole's axes in the torso frame are the rows.
    return SolePose((0.0, 0.0, -0.3), rows[0], rows[2])


@pytest.mark.parametrize("softness", [0.7, 1.0, 1.4])
@pytest.mark.parametrize(("pitch", "roll"), [(0.02, -0.015), (-0.03, 0.01), (0.0, 0.0)])
def test_the_tilt_of_a_model_is_learned(pitch: float, roll: float, softness: float) -> None:
    torso = SteppingTorso(pitch, roll, softness, bias=(0.01, -0.008), ahead=0.01)
    torso.walk(15.0)
    # The softness is not learned to the end; the roll is less certain by it.
    assert torso.levelling.pitch == pytest.approx(pitch, abs=0.003)
    assert torso.levelling.roll == pytest.approx(roll, abs=0.005)
    assert torso.levelling.applied_pitch == pytest.approx(torso.levelling.pitch, abs=0.002)


def test_the_roll_is_left_alone_where_the_torso_rolls_with_its_motors() -> None:
    torso = SteppingTorso(0.02, -0.015)
    torso.levelling = SoleLevelling(SPRINGS, learns_roll=False)
    torso.walk(15.0)
    assert torso.levelling.pitch == pytest.approx(0.02, abs=0.003)
    assert torso.levelling.roll == torso.levelling.applied_roll == 0.0
    assert torso.levelling.lean == torso.levelling.applied_lean == 0.0
    assert torso.levelling.known


def test_without_a_roll_the_soles_are_known_after_fewer_steps() -> None:
    needed = []
    for learns_roll in (True, False):
        torso = SteppingTorso(0.02, -0.015)
        torso.levelling = SoleLevelling(SPRINGS, learns_roll=learns_roll)
        steps = 0
        while not torso.levelling.known:
            torso.walk(STEP_TICKS * DT)
            steps += 1
        needed.append(steps)
        # What is known is right within the deviation that counts as known.
        assert torso.levelling.pitch == pytest.approx(0.02, abs=KNOWN_SIGMA)
    assert needed[1] < needed[0]


@pytest.mark.parametrize("lean", [0.02, -0.01])
def test_the_lean_of_a_model_is_learned_and_no_gyro_bias_is_taken_for_one(lean: float) -> None:
    torso = SteppingTorso(0.0, 0.0, bias=(0.01, -0.008), lean=lean)
    torso.walk(12.0)
    assert torso.levelling.lean == pytest.approx(lean, abs=0.002)
    assert torso.levelling.applied_lean == pytest.approx(torso.levelling.lean, abs=0.001)


def test_the_mirrored_model_has_the_mirrored_tilt() -> None:
    """Mirrored at the middle plane: the pitch changes its sign, the roll does not."""
    one = SteppingTorso(0.02, 0.01, ahead=0.01, lean=0.01)
    other = SteppingTorso(-0.02, 0.01, ahead=-0.01, lean=-0.01)
    one.walk(8.0)
    other.walk(8.0)
    assert one.levelling.pitch == pytest.approx(-other.levelling.pitch, abs=0.002)
    assert one.levelling.roll == pytest.approx(other.levelling.roll, abs=0.002)
    assert one.levelling.lean == pytest.approx(-other.levelling.lean, abs=0.002)


def test_what_is_applied_changes_slowly_and_stays_in_bounds() -> None:
    torso = SteppingTorso(0.5, -0.5)
    before = (0.0, 0.0)
    for _ in range(1500):
        torso.walk(DT)
        after = torso.levelling.applied_pitch, torso.levelling.applied_roll
        assert max(abs(a - b) for a, b in zip(after, before, strict=True)) < 2e-4
        assert max(map(abs, after)) <= 0.06 + 1e-12
        before = after


def test_soles_on_their_edges_in_steps_to_the_side_do_not_mislead_it() -> None:
    """There the measured tilt follows the applied one: learning would run to its limit."""
    torso = SteppingTorso(0.02, 0.01)
    torso.walk(8.0)
    learned = torso.levelling.roll
    torso.velocity, torso.on_edges = (0.0, 0.2, 0.0), -0.02
    torso.walk(20.0)
    assert torso.levelling.roll == pytest.approx(learned, abs=0.002)


def test_a_pause_keeps_what_was_learned() -> None:
    torso = SteppingTorso(0.02, 0.01)
    torso.walk(6.0)
    learned = torso.levelling.pitch, torso.levelling.roll
    torso.levelling.pause()
    assert (torso.levelling.pitch, torso.levelling.roll) == learned


# -- simulated robots ------------------------------------------------------------------------------

ROBOT_2 = TrialSpec(robot_seed=2, noise_seed=2, engine="mujoco")
"""Its left sole is tilted by 2.4 deg in pitch and 1.3 deg in roll against the right one."""


def after_steps(spec: TrialSpec, seconds: float, pushes: tuple[Push, ...] = ()) -> Levelled:
    """The state after steps on the spot."""
    *_, last = levelling(spec, STEP_ON_THE_SPOT, seconds, pushes)
    assert not last.fallen
    return last


def test_a_simulated_robot_that_leans_stands_up_straight() -> None:
    """Robot 103 leans to the left by 1.4 deg over level soles, robot 15 to the right by 1.1."""
    pytest.importorskip("mujoco")
    for robot in (103, 15):
        spec = TrialSpec(robot_seed=robot, noise_seed=robot, engine="mujoco")
        with make_world(spec) as world:
            assert abs(math.degrees(true_tilt(world.robot).lean)) > 1.0
        assert abs(math.degrees(after_steps(spec, 9.0).left.lean)) < 0.5


def test_a_simulated_robot_levels_its_soles() -> None:
    pytest.importorskip("mujoco")
    with make_world(ROBOT_2) as world:
        truth = true_tilt(world.robot)
    assert math.degrees(truth.pitch) > 2.0
    last = after_steps(ROBOT_2, 9.0)
    assert abs(math.degrees(last.left.pitch)) < 0.25
    assert abs(math.degrees(last.left.roll)) < 0.6


def test_pushes_do_not_mislead_it() -> None:
    pytest.importorskip("mujoco")
    pushes = tuple(
        Push(STAND_TIME + 2.0 * n, 1.0, direction)
        for n, direction in enumerate((0.0, 1.5, 3.0, 4.5), start=1)
    )
    pushed = after_steps(ROBOT_2, 10.0, pushes)
    assert abs(math.degrees(pushed.left.pitch)) < 0.3
    assert abs(math.degrees(pushed.left.roll)) < 0.7
    assert abs(math.degrees(pushed.left.lean)) < 0.5


def test_a_slope_does_not_mislead_it() -> None:
    """Over several robots: the roll of a single one that walks is good to half a degree."""
    pytest.importorskip("mujoco")
    tilts = []
    for robot in range(6):
        slope = TrialSpec(
            robot_seed=robot, noise_seed=robot, engine="mujoco",
            plant_options=(("terrain.kind", "ramp"),),
        )  # fmt: skip
        *_, uphill = levelling(slope, VelocityCommand(0.1, 0.0, 0.0), 10.0)
        assert not uphill.fallen
        tilts.append((math.degrees(uphill.left.pitch), math.degrees(uphill.left.roll)))
    pitch, roll = np.sqrt(np.mean(np.square(tilts), axis=0))
    assert pitch < 0.4
    assert roll < 0.8


def test_one_parameter_switches_it_off() -> None:
    pytest.importorskip("mujoco")
    spec = replace(ROBOT_2, parameters=load_preset("default").replace(level_soles=False))
    last = after_steps(spec, 3.0)
    first = next(iter(levelling(spec, STEP_ON_THE_SPOT, 0.1)))
    assert last.left == first.left


def test_short_steps_until_the_soles_are_known_and_none_after_a_calibration() -> None:
    """The same command: a calibrated robot takes its full step sooner."""
    pytest.importorskip("mujoco")
    fast = VelocityCommand(0.46, 0.0, 0.0)
    calibration = calibrate(ROBOT_2)
    assert calibration is not None
    steps = []
    for known in (NOT_CALIBRATED, calibration):
        spec = replace(ROBOT_2, calibration=known)
        gait = make_gait(spec)
        longest = 0.0
        with make_world(spec) as world:
            for frames in range(round((STAND_TIME + 2.5) / DT)):
                frame = world.robot.sense()
                if frame is not None:
                    command = fast if frames * DT > STAND_TIME else VelocityCommand()
                    world.robot.command(gait.step(frame, command))
                    longest = max(longest, gait.status.step_size[0])
                world.step()
        steps.append(longest)
    assert steps[0] + 0.01 < steps[1]


def test_a_calibration_is_applied_at_once_and_outlives_a_reset() -> None:
    calibration = NOT_CALIBRATED.replace(sole_pitch=0.02, sole_roll=-0.01, lean=0.015)
    gait = make_gait(replace(ROBOT_2, calibration=calibration))
    soles = gait.levelling
    assert (soles.applied_pitch, soles.applied_roll, soles.applied_lean) == (0.02, -0.01, 0.015)
    gait.reset()
    assert (soles.applied_pitch, soles.applied_roll, soles.applied_lean) == (0.02, -0.01, 0.015)
