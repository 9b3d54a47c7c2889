"""config/ekf.yaml: its parameters are those of robot_localization, what it fuses is published."""

import re

import numpy as np
import pytest
import yaml

from nao_lipm_gait.ros.messages import StatusWriter
from robot_core.resources import share
from robot_core.types import VelocityCommand
from sim_bridge.trials.rollout import RolloutSpec, make_pair
from sim_bridge.trials.tasks import TASKS
from sim_bridge.trials.trial import Action, Policy, Tick, run

NAMES = {
    "frequency", "sensor_timeout", "two_d_mode", "reset_on_time_jump", "publish_tf", "map_frame",
    "odom_frame", "base_link_frame", "world_frame",
}  # fmt: skip
"""Declared by robot_localization's src/ros_filter.cpp (jazzy)."""
OF_SENSORS = re.compile(r"(odom|imu)\d+(_config|_queue_size)?")
VELOCITY = (6, 7, 11)
"""vx, vy, vyaw among the 15 values of a sensor."""


def settings() -> dict[str, object]:
    text = share("config", "ekf.yaml").read_text(encoding="utf-8")
    return yaml.safe_load(text)["ekf_filter_node"]["ros__parameters"]


def test_it_has_the_parameters_of_robot_localization_and_the_frames_of_the_gait() -> None:
    given = settings()
    sensors = {name for name in given if OF_SENSORS.fullmatch(name)}
    assert given.keys() == NAMES | sensors
    odometry = StatusWriter()._odometry
    assert given["odom_frame"] == given["world_frame"] == odometry.header.frame_id
    assert given["base_link_frame"] == odometry.child_frame_id
    assert given["publish_tf"] is False
    assert (given["odom0"], given["imu0"]) == ("odom", "imu/data")
    for name, used in (("odom0_config", VELOCITY), ("imu0_config", (11,))):
        config = given[name]
        assert len(config) == 15
        assert np.flatnonzero(config).tolist() == list(used)


class _Walk(Policy):
    def command(self, time: float, tick: Tick | None) -> Action:
        return None if time > 4.0 else VelocityCommand(0.1 if time > 1.0 else 0.0, 0.0, 0.0)


def test_the_covariances_that_it_uses_are_those_of_a_filter() -> None:
    pytest.importorskip("mujoco")
    world, gait = make_pair(RolloutSpec(TASKS["stand"], robot_seed=1, engine="mujoco"))
    writer, seen = StatusWriter(), 0
    with world:
        for tick in run(world, gait, _Walk()):
            if tick.status is None:
                continue
            message, seen = writer.odometry(tick.status), seen + 1
            for covariance in (message.pose.covariance, message.twist.covariance):
                matrix = np.array(covariance).reshape(6, 6)
                assert np.all(np.isfinite(matrix))
                assert np.allclose(matrix, matrix.T)
                assert np.linalg.eigvalsh(matrix).min() > 0.0
    assert seen > 300
