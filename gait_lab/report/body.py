"""The recorded joints as a body: where the soles, the CoM and every link were."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from gait_lab.report.walk import IntArray, Walk
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import RobotDescription, load_robot
from nao_lipm_gait.types import FloatArray


def robot_of(walk: Walk) -> tuple[RobotDescription | None, str]:
    """The robot of a bag, from its own URDF or the shipped one, and a word about which.

    None with the reason where its joints are not those of the robot.
    """
    if not walk.joint_names:
        return None, "no joint states"
    if walk.urdf is not None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "robot.urdf")
            path.write_text(walk.urdf, encoding="utf-8")
            try:
                return _knowing(walk, load_robot(path)), "from the bag's robot_description"
            except NaoGaitError as error:
                reason = f"the bag's robot_description: {error}"
    else:
        reason = "no robot_description in the bag"
    try:
        return _knowing(walk, load_robot()), f"{reason}; the shipped NAO H21 instead"
    except NaoGaitError as error:
        return None, str(error)


def _knowing(walk: Walk, robot: RobotDescription) -> RobotDescription:
    unknown = [name for name in robot.joint_names if name not in walk.joint_names]
    if unknown:
        raise NaoGaitError("joint_states", f"no {', '.join(unknown)}", "the joints of the robot")
    return robot


@dataclass(frozen=True, slots=True)
class BodyTrack:
    """The body at t joint states. Pairs are left, right."""

    stamp: IntArray
    torso: FloatArray
    """(t, 4, 4) pose in the world (or odom, without ground truth); NaN where unknown."""
    sole: FloatArray
    """(t, 2, 4, 4) pose in the world."""
    com: FloatArray
    """(t, 3) [m] in the world, from the joints and the model's masses."""
    link_names: tuple[str, ...]
    links: FloatArray
    """(t, l, 4, 4) pose of each link that is drawn, in the world."""
    from_truth: bool


def follow_body(
    walk: Walk, robot: RobotDescription, links: tuple[str, ...] = (), every: int = 1
) -> BodyTrack:
    """Put every `every`-th recorded joint state on its place in the world.

    With ground truth that is the torso's true pose; without, odometry and a stance sole flat on the
    ground.
    """
    stamps = walk.position.stamp[::every]
    columns = [walk.joint_names.index(name) for name in robot.joint_names]
    angles = walk.position.value[::every][:, columns]
    model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
    data = model.createData()
    q = pin.neutral(model)
    index = [model.joints[model.getJointId(name)].idx_q for name in robot.joint_names]
    frame = {
        name: model.getFrameId(name, pin.FrameType.BODY)
        for name in (robot.torso_frame, *robot.sole_frames, *links)
    }
    count = len(stamps)
    torso_in_root = np.empty((count, 4, 4))
    sole_in_root = np.empty((count, 2, 4, 4))
    com_in_root = np.empty((count, 3))
    link_in_root = np.empty((count, len(links), 4, 4))
    for row in range(count):
        q[index] = angles[row]
        com_in_root[row] = pin.centerOfMass(model, data, q, False)
        pin.updateFramePlacements(model, data)
        torso_in_root[row] = data.oMf[frame[robot.torso_frame]].homogeneous
        for side, name in enumerate(robot.sole_frames):
            sole_in_root[row, side] = data.oMf[frame[name]].homogeneous
        for column, name in enumerate(links):
            link_in_root[row, column] = data.oMf[frame[name]].homogeneous
    root_in_torso = inverse_pose(torso_in_root)
    sole_in_torso = root_in_torso[:, None] @ sole_in_root
    from_truth = bool(len(walk.truth))
    if from_truth:
        torso = _true_torso(walk, stamps)
    else:
        torso = _torso_by_odometry(walk, stamps, sole_in_torso)
    root = torso @ root_in_torso
    return BodyTrack(
        stamp=stamps,
        torso=torso,
        sole=torso[:, None] @ sole_in_torso,
        com=np.einsum("tij,tj->ti", root[:, :3, :3], com_in_root) + root[:, :3, 3],
        link_names=links,
        links=root[:, None] @ link_in_root,
        from_truth=from_truth,
    )


def yaw_of_pose(pose: FloatArray) -> FloatArray:
    """(...,) [rad] heading of the x axis of (..., 4, 4) poses."""
    return np.arctan2(pose[..., 1, 0], pose[..., 0, 0])


def inverse_pose(pose: FloatArray) -> FloatArray:
    """Of (..., 4, 4) poses."""
    result = np.zeros_like(pose)
    result[..., :3, :3] = np.swapaxes(pose[..., :3, :3], -1, -2)
    result[..., :3, 3] = -np.einsum("...ij,...j->...i", result[..., :3, :3], pose[..., :3, 3])
    result[..., 3, 3] = 1.0
    return result


def _true_torso(walk: Walk, stamps: IntArray) -> FloatArray:
    rows = walk.truth.at(stamps)
    return pose_of(rows[:, 0:3], rows[:, 3:7])


def pose_of(position: FloatArray, quaternion: FloatArray) -> FloatArray:
    """(t, 4, 4) from (t, 3) [m] and (t, 4) xyzw."""
    x, y, z, w = quaternion.T
    pose = np.zeros((len(position), 4, 4))
    pose[:, 0, :3] = np.stack(
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], axis=1
    )
    pose[:, 1, :3] = np.stack(
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], axis=1
    )
    pose[:, 2, :3] = np.stack(
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=1
    )
    pose[:, :3, 3] = position
    pose[:, 3, 3] = 1.0
    return pose


def _torso_by_odometry(walk: Walk, stamps: IntArray, sole_in_torso: FloatArray) -> FloatArray:
    odometry = walk.odometry.at(stamps) if len(walk.odometry) else np.zeros((len(stamps), 3))
    return torso_over_soles(odometry, sole_in_torso)


def torso_over_soles(odometry: FloatArray, sole_in_torso: FloatArray) -> FloatArray:
    """(t, 4, 4) pose of the torso in odom, without knowing its tilt.

    The lower sole lies flat on the ground; the middle between the soles is base_footprint, where
    odometry (t, 3) has it. Soles (t, 2, 4, 4) in the torso frame.
    """
    # "Lower" is decided with an upright torso, which is what a walking robot has.
    side = np.argmin(sole_in_torso[:, :, 2, 3], axis=1)
    torso_in_sole = inverse_pose(sole_in_torso[np.arange(len(side)), side])
    # base_footprint in the frame of the stance sole, inverted and put where odometry says.
    footprint = planar_pose(*footprint_of(torso_in_sole[:, None] @ sole_in_torso).T)
    return planar_pose(*odometry.T) @ inverse_pose(footprint) @ torso_in_sole


def footprint_of(soles: FloatArray) -> FloatArray:
    """(t, 3) x, y [m], yaw [rad] of the middle between soles (t, 2, 4, 4)."""
    heading = np.unwrap(yaw_of_pose(soles), axis=1).mean(axis=1)
    return np.column_stack([soles[:, :, :2, 3].mean(axis=1), heading])


def planar_pose(x: FloatArray, y: FloatArray, yaw: FloatArray) -> FloatArray:
    """(t, 4, 4) on the ground."""
    pose = np.zeros((len(x), 4, 4))
    pose[:, 0, 0] = pose[:, 1, 1] = np.cos(yaw)
    pose[:, 1, 0] = np.sin(yaw)
    pose[:, 0, 1] = -pose[:, 1, 0]
    pose[:, 2, 2] = pose[:, 3, 3] = 1.0
    pose[:, 0, 3], pose[:, 1, 3] = x, y
    return pose
