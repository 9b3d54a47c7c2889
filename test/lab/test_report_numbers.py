"""The report of a bag and the benchmark of the same walk give the same numbers."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytest.importorskip("mujoco")

from gait_lab.analysis.recorded_walk import Table
from gait_lab.report.analysis import SETTLE, Analysis, Paths, analyse, find_stretches
from gait_lab.report.signals import autocorrelation
from gait_lab.report.verdict import BAD, FAIR, GOOD, NOTE, findings, number, stretch_table
from nao_lipm_gait.parameters import GaitParameters
from sim_bridge.trials.metrics import measure
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import STAND_TIME, TASKS
from sim_bridge.trials.trace import LEFT, RIGHT
from walk_bag import WrittenWalk, write_walk

# Without slip in the odometry Q stands still in odom, so that the two can be compared exactly.
SPEC = RolloutSpec(
    task=TASKS["forward"].lasting(4.0), engine="mujoco", robot_seed=1,
    parameters=GaitParameters(yaw_from_lean=False),
)  # fmt: skip


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> WrittenWalk:
    return write_walk(tmp_path_factory.mktemp("walk") / "bag", SPEC)


@pytest.fixture(scope="module")
def analysis(written: WrittenWalk) -> Analysis:
    return analyse(written.bag)


def test_the_bag_is_of_the_walk_that_the_benchmark_walks(written: WrittenWalk) -> None:
    assert rollout(SPEC).metrics == written.metrics


def test_report_and_benchmark_agree(written: WrittenWalk, analysis: Analysis) -> None:
    assert analysis.trace is not None
    ours = measure(analysis.trace, SPEC.task.start, SPEC.task.end)
    theirs = written.metrics
    assert abs(theirs.speed_x) > 0.15, "it walks"
    for name in ("duration", "fell", "fall_time", "speed_x", "speed_y", "turn_rate",
                 "flight_share", "com_error_x_measured", "com_error_y_measured",
                 "support_changes"):  # fmt: skip
        assert getattr(ours, name) == pytest.approx(getattr(theirs, name), abs=1e-9), name
    # The true sole is only known through encoders with zero errors: 0.5 deg over 0.3 m of leg.
    for name in ("com_error_x", "com_error_y"):
        assert getattr(ours, name) == pytest.approx(getattr(theirs, name), abs=5e-3), name


def test_the_table_shows_the_numbers_of_its_stretch(analysis: Analysis) -> None:
    (stretch,) = (s for s in analysis.stretches if s.name == "forward")
    assert stretch.command is not None
    assert stretch.command.x == SPEC.task.asked
    assert analysis.trace is not None
    # By their words, because NaN is not NaN.
    assert str(stretch.metrics) == str(measure(analysis.trace, stretch.start, stretch.end))
    table = stretch_table(analysis)
    assert table is not None
    (row,) = (row for row in table.rows if row[0] == "forward")
    assert row[table.head.index("measured x [cm/s]")] == number(100 * stretch.metrics.speed_x)
    assert row[2] == number(100 * SPEC.task.asked)


def test_a_robot_that_stands_for_its_gyro_is_measured_once_it_walks(analysis: Analysis) -> None:
    """A command that is sent long before the first step, as to a robot without a yaw gyro."""
    walk, trace = analysis.walk, analysis.trace
    assert trace is not None
    known = walk.command
    asked = np.tile(known.value[np.argmax(known.value[:, 0])], (len(known) + 40, 1))
    early = known.stamp[0] - np.arange(40, 0, -1) * 100_000_000
    stamp = np.concatenate([early, known.stamp])
    early_walk = dataclasses.replace(walk, command=Table(stamp, stamp, asked))
    (stretch,) = find_stretches(early_walk, analysis.phases, trace)
    assert analysis.walked is not None
    assert stretch.stood == pytest.approx(analysis.walked[0] + 4.0 - walk.seconds(known.stamp)[0])
    assert stretch.start == pytest.approx(analysis.walked[0] + SETTLE)
    assert analysis.stretches[-1].stood == 0.0
    unsure = (int(known.stamp[0]), {"gyro bias deviation [rad/s]": "0.004"})
    for diagnostics, why in (((unsure,), True), ((), False)):
        told = dataclasses.replace(early_walk, diagnostics=diagnostics)
        found = findings(dataclasses.replace(analysis, walk=told, stretches=(stretch,)))
        (finding,) = (each for each in found if "stood for" in each.text)
        assert finding.grade == NOTE
        assert ("until the gyro's bias" in finding.text) == why
    assert not any("stood for" in each.text for each in findings(analysis))


def test_support_changes_are_sharp_to_the_tick(analysis: Analysis) -> None:
    result = rollout(dataclasses.replace(SPEC, keep_trace=True))
    assert result.trace is not None
    assert analysis.trace is not None
    walking = analysis.trace.time > STAND_TIME + 0.5
    assert np.array_equal(analysis.trace.support[walking], result.trace.support[walking])
    ours = analysis.trace.support_sole_in_q[walking]
    known = np.isfinite(ours).all(axis=1)
    assert known.mean() > 0.95, "all but a phase that is cut off by the end"
    np.testing.assert_allclose(
        ours[known], result.trace.support_sole_in_q[walking][known], atol=1e-6
    )


def test_they_are_so_too_where_odometry_turns_with_a_slipping_foot(tmp_path: Path) -> None:
    spec = dataclasses.replace(SPEC, parameters=GaitParameters(), robot_seed=0, keep_trace=True)
    ours = analyse(write_walk(tmp_path / "bag", spec).bag).trace
    theirs = rollout(spec).trace
    assert ours is not None
    assert theirs is not None
    walking = ours.time > STAND_TIME + 0.5
    assert np.array_equal(ours.support[walking], theirs.support[walking])


def test_steps_are_as_long_as_the_speed_needs(analysis: Analysis) -> None:
    steps = [step for step in analysis.steps if step.time > STAND_TIME + 4.5]
    assert len(steps) > 10
    assert {step.support for step in steps} == {LEFT, RIGHT}
    way = sum(step.size[0] for step in steps if step.size)
    speed = way / sum(step.duration for step in steps)
    assert analysis.walking is not None
    # Step sizes are measured by the feet, which slip a little.
    (stretch,) = (s for s in analysis.stretches if s.name == "forward")
    assert speed == pytest.approx(stretch.metrics.speed_x, rel=0.15)


def test_pendulum_origins_lie_under_the_soles(analysis: Analysis) -> None:
    for points in analysis.origins:
        late = points[points[:, 0] > STAND_TIME + 4.0]
        assert len(late) > 10
        assert np.all(np.abs(late[:, 1] - 0.02) < 0.08)
        assert np.all(np.abs(late[:, 2]) < 0.05)


def test_timing_is_that_of_the_simulation(analysis: Analysis) -> None:
    timing = analysis.timing
    assert timing is not None
    assert timing.period == pytest.approx(0.01)
    assert timing.missed == 0
    assert timing.age == pytest.approx(0.04), "the sensor delay of the plant"
    assert timing.tick.shape[0] >= 5
    assert np.all(timing.tick == 150.0)


@pytest.mark.parametrize(("share", "grade"), [(0.0, NOTE), (0.002, NOTE), (1.0, BAD)])
def test_slow_ticks_are_no_fault_where_the_simulation_waits(
    analysis: Analysis, share: float, grade: str
) -> None:
    """In lockstep a few answers seem a period late, because messages overtake the clock."""
    timing = analysis.timing
    assert timing is not None
    late = timing.period * (np.arange(len(timing.answer)) < share * len(timing.answer))
    slow = dataclasses.replace(timing, tick=timing.tick * 100.0, answer=timing.answer + late)
    found = findings(dataclasses.replace(analysis, timing=slow))
    (finding,) = (each for each in found if "longer than a period" in each.text)
    assert finding.grade == grade
    assert ("simulation waited" in finding.text) == (grade == NOTE)


def test_one_slow_tick_is_no_fault_where_many_answers_seem_a_period_late(
    analysis: Analysis,
) -> None:
    """As in the demo, whose first ticks take long."""
    timing = analysis.timing
    assert timing is not None
    late = timing.period * (np.arange(len(timing.answer)) % 10 == 0)
    tick = timing.tick.copy()
    tick[0, 1] = 277e3
    for worst, grade in ((timing.period, NOTE), (0.277, BAD)):
        answer = late.copy()
        answer[0] = worst
        slow = dataclasses.replace(timing, tick=tick, answer=answer)
        found = findings(dataclasses.replace(analysis, timing=slow))
        (finding,) = (each for each in found if "longer than a period" in each.text)
        assert finding.grade == grade


def test_odometry_is_compared_with_the_truth(analysis: Analysis) -> None:
    paths = analysis.paths
    assert paths is not None
    assert len(paths.truth) == len(paths.odometry)
    assert np.all(paths.truth[0] == 0.0)
    assert np.all(paths.odometry[0] == 0.0)
    assert paths.truth[-1, 0] == pytest.approx(paths.length, rel=0.15)
    assert 0.0 < np.hypot(*paths.error[-1, :2]) < 0.3 * paths.length


@pytest.mark.parametrize(
    ("distance", "heading", "grade"),
    [(0.05, 5.0, GOOD), (0.05, 53.0, BAD), (0.05, -20.0, FAIR), (0.2, 0.0, FAIR), (0.5, 0.0, BAD)],
)  # fmt: skip
def test_odometry_is_judged_by_distance_and_by_heading(
    analysis: Analysis, distance: float, heading: float, grade: str
) -> None:
    """The errors at the end: a share of the path, and an angle [deg]."""
    truth = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    error = np.array([0.0, distance, math.radians(heading)])
    paths = Paths(np.array([0, 1]), truth, truth + [[0.0], [1.0]] * error, length=1.0)
    found = findings(dataclasses.replace(analysis, paths=paths))
    (odometry,) = [finding for finding in found if finding.text.startswith("Odometry")]
    assert odometry.grade == grade
    assert f"{heading:+.0f}°" in odometry.text


def test_innovation_of_a_walk_is_not_white_and_noise_is(analysis: Analysis) -> None:
    innovation = analysis.innovation
    assert innovation is not None
    assert innovation.inside[1] < 0.8
    noise = np.random.default_rng(1).normal(size=5000)
    correlation = autocorrelation(noise, 100)
    assert correlation[0] == pytest.approx(1.0)
    assert np.mean(np.abs(correlation[1:]) <= 1.96 / math.sqrt(5000)) > 0.85
    wave = autocorrelation(np.sin(np.arange(5000) * 2 * math.pi / 40), 100)
    assert wave[40] > 0.95
    assert wave[20] < -0.95
    direct = [np.dot(noise[: 5000 - k] - noise.mean(), noise[k:] - noise.mean()) for k in (0, 7)]
    assert correlation[7] == pytest.approx(direct[1] / direct[0])


def test_a_motor_that_stalls_is_at_its_limit(analysis: Analysis) -> None:
    assert analysis.motors is not None
    assert analysis.robot is not None
    names = [joint.name for joint in analysis.motors.joints]
    assert "RHipYawPitch" not in names, "shares the motor of LHipYawPitch"
    knee = analysis.motors.joints[names.index("LKneePitch")]
    assert knee.torque_share > 0.3
    assert 0.0 < knee.speed_share <= 1.05
    assert 0.0 <= knee.lag <= 0.05, "the motors of the plant lag by 15 ms"
    assert 0.0 <= analysis.motors.saturated_share <= 1.0
