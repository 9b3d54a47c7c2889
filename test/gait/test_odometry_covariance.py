"""Covariance of the odometry's pose, against the scatter of many walks."""

import math

import numpy as np
import pytest

from nao_lipm_gait.estimation.odometry_covariance import WAY_NOISE, OdometryCovariance
from robot_core.types import Pose2

STEP = 0.1
CORNER = [(STEP, 0.0)] * 20 + [(0.0, STEP)] * 10
"""Steps [m] in odom: 2 m ahead, then 1 m to the left."""


def path() -> list[Pose2]:
    return [(float(x), float(y), 0.0) for x, y in np.cumsum(CORNER, axis=0)]


def test_the_covariance_is_that_of_many_walks_whose_heading_drifts() -> None:
    drift = 0.02  # rad per sqrt(step)
    covariance = OdometryCovariance()
    for number, pose in enumerate(path(), start=1):
        covariance.step(pose, drift**2 * number)
    random = np.random.default_rng(0)
    walks = 20000
    heading = np.cumsum(random.normal(0.0, drift, (walks, len(CORNER))), axis=1)
    before = np.column_stack([np.zeros(walks), heading[:, :-1]])
    way = random.normal(0.0, WAY_NOISE * math.sqrt(STEP), (walks, len(CORNER), 2))
    dx, dy = np.array(CORNER).T
    x = np.sum(-dy * before + way[:, :, 0], axis=1)
    y = np.sum(dx * before + way[:, :, 1], axis=1)
    scatter = np.cov(np.stack([x, y, heading[:, -1]]))
    found = covariance.pose.matrix
    assert found == pytest.approx(scatter, rel=0.05, abs=2e-4)


def test_it_stays_a_covariance_when_an_earlier_error_is_found() -> None:
    covariance = OdometryCovariance()
    for number, pose in enumerate(path()):
        covariance.step(pose, 0.01 * (number % 7))
        matrix = covariance.pose.matrix
        assert np.linalg.eigvalsh(matrix)[0] > -1e-12


def test_a_robot_that_stands_is_no_less_certain() -> None:
    covariance = OdometryCovariance()
    covariance.step((1.0, 0.0, 0.0), 0.04)
    before = covariance.pose
    covariance.step((1.0, 0.0, 0.0), 0.04)
    assert covariance.pose == pytest.approx(before)


def test_the_way_of_a_blocked_robot_counts_once() -> None:
    """Soles that slip again after one step add the way since then alone."""
    covariance = OdometryCovariance()
    slips = [False] * 10 + [True] * 10 + [False] + [True] * 2
    variances = []
    for number, blocked in enumerate(slips, start=1):
        covariance.step((number * STEP, 0.0, 0.0), 1e-6, blocked=blocked)
        variances.append(covariance.pose.xx)
    way = WAY_NOISE**2 * STEP
    added = np.diff(variances) - way
    assert sum(added[9:19]) == pytest.approx((13 * STEP) ** 2), "three steps unseen and ten seen"
    assert added[19:] == pytest.approx([0.0, STEP**2, 3 * STEP**2])
