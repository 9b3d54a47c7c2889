"""The transforms that the gait publishes put its base link where the simulated robot's is."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest
from geometry_msgs.msg import TransformStamped
from scipy.spatial.transform import Rotation

from nao_lipm_gait.ros.messages import StatusWriter, footsteps
from robot_core.types import VelocityCommand
from sim_bridge.trials.rollout import RolloutSpec, make_pair
from sim_bridge.trials.tasks import TASKS
from sim_bridge.trials.trial import Action, Policy, Tick, run

WALK = VelocityCommand(0.1, 0.0, 0.2)


class _Walk(Policy):
    """A curve after a second of standing."""

    def command(self, time: float, tick: Tick | None) -> Action:
        return None if time > 4.0 else WALK if time > 1.0 else VelocityCommand(0.0, 0.0, 0.0)


def matrix(message: TransformStamped) -> np.ndarray:
    """(4, 4) of a transform, child to parent."""
    t, r = message.transform.translation, message.transform.rotation
    result = np.eye(4)
    result[:3, :3] = Rotation.from_quat((r.x, r.y, r.z, r.w)).as_matrix()
    result[:3, 3] = t.x, t.y, t.z
    return result


def test_the_transforms_are_a_chain_that_ends_at_the_torso() -> None:
    pytest.importorskip("mujoco")
    world, gait = make_pair(RolloutSpec(TASKS["stand"], robot_seed=-1, engine="mujoco"))
    writer = StatusWriter(gait.robot.base_frame)
    truths, chains = {}, {}
    with world:
        for tick in run(world, gait, _Walk()):
            truth = np.eye(4)
            truth[:3, :3] = Rotation.from_quat(tick.truth.torso_quaternion).as_matrix()
            truth[:3, 3] = tick.truth.torso_position
            truths[tick.truth.stamp] = truth
            if tick.status is None:
                continue
            foot = writer.transform(tick.status)
            base = writer.base_transform(tick.status.stamp, gait.torso_pose)
            assert foot.header.stamp == base.header.stamp
            assert (foot.header.frame_id, foot.child_frame_id) == ("odom", "base_footprint")
            assert base.header.frame_id == foot.child_frame_id
            assert matrix(foot)[2, 3] == 0.0
            chains[tick.status.stamp] = matrix(foot) @ matrix(base)
    # robot_state_publisher continues the tree from the root link of the URDF.
    model = ET.fromstring(gait.robot.urdf)
    children = {joint.find("child").get("link") for joint in model.iter("joint")}  # type: ignore[union-attr]
    roots = [link.get("name") for link in model.findall("link") if link.get("name") not in children]
    assert roots == [base.child_frame_id]
    stamps = sorted(chains.keys() & truths.keys())
    start = truths[stamps[50]] @ np.linalg.inv(chains[stamps[50]])
    assert len(stamps) > 300
    for stamp in stamps[50::10]:
        error = np.linalg.inv(truths[stamp]) @ start @ chains[stamp]
        assert np.linalg.norm(error[:3, 3]) < 0.05
        assert abs(error[2, 3]) < 0.015
        assert Rotation.from_matrix(error[:3, :3]).magnitude() < np.radians(8.0)


def test_the_prefix_is_before_every_frame() -> None:
    pytest.importorskip("mujoco")
    world, gait = make_pair(RolloutSpec(TASKS["stand"], robot_seed=-1, engine="mujoco"))
    writer = StatusWriter(gait.robot.base_frame, "robot1/")
    with world:
        status = next(t.status for t in run(world, gait, _Walk()) if t.status is not None)
    odometry, foot = writer.odometry(status), writer.transform(status)
    base = writer.base_transform(0, gait.torso_pose)
    frames = [
        odometry.header.frame_id, odometry.child_frame_id, foot.header.frame_id,
        foot.child_frame_id, base.header.frame_id, base.child_frame_id,
        writer.torso_pose(0, gait.torso_pose).header.frame_id,
        writer.point_in_q((0.0, 0.0, 0.0), 0).header.frame_id,
        *(marker.header.frame_id for marker in footsteps(status, "robot1/").markers),
    ]  # fmt: skip
    assert len(frames) == 12
    assert all(frame.startswith("robot1/") and frame != "robot1/" for frame in frames)
