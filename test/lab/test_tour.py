"""The tour, its evaluation and its moving picture, on made-up recordings."""

import math
from dataclasses import astuple, fields
from typing import Any

import numpy as np
import pytest

from gait_lab.analysis.render import TILE_PERIOD
from gait_lab.demo.pictures import LENGTH, SHORTEST, PoseTrace, loop_rows
from gait_lab.demo.tour import (
    FULL_TOUR,
    SHORT_TOUR,
    TourPhase,
    duration,
    evaluate,
    fall_time,
    phase_at,
)
from robot_core.types import STANDSTILL, VelocityCommand
from sim_bridge.trials.trace import LEFT, Trace


def walk(speed: float, turn: float, seconds: float, tilt: float = 0.0) -> Trace:
    """A torso that walks at a constant speed in its own heading while it turns."""
    time = np.arange(0.0, seconds, 0.01)
    count, yaw = len(time), turn * time
    heading = np.stack([np.cos(yaw), np.sin(yaw)], axis=1)
    half = 0.5 * yaw
    columns: dict[str, Any] = {field.name: np.zeros(count) for field in fields(Trace)}
    columns |= {
        "stamp": np.round(time * 1e9).astype(np.int64),
        "torso_position": np.concatenate(
            [np.cumsum(heading, axis=0) * speed * 0.01, np.full((count, 1), 0.3)], axis=1
        ),
        "torso_quaternion": np.stack([0 * half, 0 * half, np.sin(half), np.cos(half)], axis=1),
        "torso_velocity": np.tile([speed, 0.0, 0.0], (count, 1)),
        "sole_position": np.zeros((count, 2, 3)),
        "com_expected_in_q": np.tile([0.0, 0.003, 0.26], (count, 1)),
        "com_measured_in_q": np.tile([0.0, 0.0, 0.26], (count, 1)),
        "support": np.full(count, LEFT),
        "status_stamp": np.round(time * 1e9).astype(np.int64),
    }
    for name in ("sole_yaw", "sole_force", "sole_slip"):
        columns[name] = np.full((count, 2), 20.0)
    for name in ("legs_touch", "alarm"):
        columns[name] = np.zeros(count, dtype=bool)
    for name in ("com", "support_sole_in_q"):
        columns[name] = np.zeros((count, 3))
    if tilt:
        tilted = [0.0, math.sin(tilt / 2), 0.0, math.cos(tilt / 2)]
        columns["torso_quaternion"] = np.tile(tilted, (count, 1))
    return Trace(**columns)


def test_every_moment_belongs_to_its_phase() -> None:
    assert phase_at(FULL_TOUR, 0.0) is FULL_TOUR[0]
    assert phase_at(FULL_TOUR, FULL_TOUR[0].duration) is FULL_TOUR[1]
    assert phase_at(FULL_TOUR, duration(FULL_TOUR)) is None


def test_speed_is_scored_in_the_robots_own_heading() -> None:
    # 0.2 m/s round a circle: the displacement over time would be far less.
    tour = (TourPhase("circle", 10.0, VelocityCommand(0.2, 0.0, 1.0), ("x", 0.19)),)
    (result,) = evaluate(walk(0.2, 1.0, 10.0), tour, 0.0)
    assert result.achieved.x == pytest.approx(0.2, abs=1e-6)
    assert result.achieved.y == pytest.approx(0.0, abs=1e-6)
    assert result.achieved.yaw == pytest.approx(1.0, abs=1e-6)
    assert result.reached is True
    assert result.com_error_y == pytest.approx(0.003)
    assert result.flight_share == 0.0


@pytest.mark.parametrize(("speed", "reached"), [(-0.21, True), (-0.19, False), (0.21, False)])
def test_a_speed_is_reached_only_in_its_direction(speed: float, reached: bool) -> None:
    tour = (TourPhase("back", 10.0, VelocityCommand(-0.2, 0.0, 0.0), ("x", -0.2)),)
    (result,) = evaluate(walk(speed, 0.0, 10.0), tour, 0.0)
    assert result.reached is reached


def test_an_interrupted_tour_has_results_only_for_completed_phases() -> None:
    results = evaluate(walk(0.2, 0.0, 4.0), SHORT_TOUR, 0.0)
    assert [result.phase.name for result in results] == ["stand"]


def test_a_fall_is_detected() -> None:
    assert fall_time(walk(0.2, 0.0, 2.0)) is None
    assert fall_time(walk(0.0, 0.0, 2.0, tilt=1.0)) == 0.0


def test_the_tour_commands_more_than_it_requires() -> None:
    for phase in FULL_TOUR:
        if phase.reach is not None:
            axis, speed = phase.reach
            assert 1.0 < getattr(phase.command, axis) / speed < 1.3


def test_the_moving_picture_ends_where_it_begins() -> None:
    time = np.arange(0.0, 6.0, 0.01)
    swing = np.sin(2.0 * np.pi * time / 0.5)
    position = np.stack([0.375 * time, 0.0 * time, 0.0 * time + 0.3], axis=1)
    motion = PoseTrace(time, position, np.zeros((len(time), 4)), np.tile(swing[:, None], (1, 22)))
    rows = loop_rows(motion)
    assert rows is not None
    end = rows[-1] + rows[1] - rows[0]
    assert abs(swing[end] - swing[rows[0]]) < 0.15
    tiles = (position[end, 0] - position[rows[0], 0]) / TILE_PERIOD
    assert abs(tiles - round(tiles)) < 0.1
    assert SHORTEST <= time[end] - time[rows[0]] <= LENGTH
    assert loop_rows(PoseTrace(*(column[:200] for column in astuple(motion)))) is None


def test_standing_needs_no_speed() -> None:
    tour = (TourPhase("stand", 2.0, STANDSTILL),)
    (result,) = evaluate(walk(0.0, 0.0, 2.0), tour, 0.0)
    assert result.reached is None
    assert math.isnan(result.com_error_y)
