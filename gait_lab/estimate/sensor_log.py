"""Recorded sensors of a walk: an .npz file or a bag."""

import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gait_lab.analysis.bag import open_bag
from gait_lab.analysis.recorded_topics import find_parts, topics_of
from robot_core.errors import NaoGaitError
from robot_core.geometry import rotation_from_rpy, rotation_matrix
from robot_core.types import FloatArray

IMU = "/imu/data"
SHORTEST = 50
"""Samples of the shortest log that is estimated."""


@dataclass(frozen=True, slots=True)
class Reference:
    """A pose of the robot that was measured otherwise, for judging only.

    Attributes:
        link: Link of the robot; empty = the root of its URDF.
        position: (t, 3) [m] in the world.
        rotation: (t, 3, 3), link to world.
    """

    link: str
    position: FloatArray
    rotation: FloatArray


@dataclass(frozen=True, slots=True)
class SensorLog:
    """Recorded sensors: t samples of one clock.

    Attributes:
        time: (t,) [s], increasing.
        joint_position: (t, j) [rad].
        angular_velocity: (t, 3) [rad/s] gyro in the frame of the IMU.
        specific_force: (t, 3) [m/s^2] accelerometer in the frame of the IMU.
        imu: Link of the IMU; empty = the one of the robot.
        load: (t, 2) [N] along the normals of the left and the right sole; None = not recorded.
        reference: None = there is none.
    """

    time: FloatArray
    joint_names: tuple[str, ...]
    joint_position: FloatArray
    angular_velocity: FloatArray
    specific_force: FloatArray
    imu: str
    load: FloatArray | None
    reference: Reference | None


def load_log(path: Path) -> SensorLog:
    """Read an .npz file or a bag.

    Raises:
        NaoGaitError: Names the file and what is missing or not allowed.
    """
    log = _from_npz(path) if path.suffix == ".npz" else _from_bag(path)
    if len(log.time) < SHORTEST:
        allowed = f"at least {SHORTEST} of joints and IMU"
        raise NaoGaitError(f"samples of {path}", len(log.time), allowed)
    if not np.all(np.diff(log.time) > 0.0):
        raise NaoGaitError(f"time of {path}", "does not increase", "increasing seconds")
    return log


def _from_npz(path: Path) -> SensorLog:
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise NaoGaitError(f"log {path}", str(error), "an .npz file of arrays, or a bag") from error

    def take(name: str, *shape: int) -> FloatArray:
        if name not in arrays:
            raise NaoGaitError(f"{name} in {path}", "missing", f"an array {('t', *shape)}")
        array = arrays[name]
        count = len(arrays["time"]) if np.ndim(arrays["time"]) else 0
        if array.shape != (count, *shape) or array.dtype.kind not in "fiu":
            got = f"{array.shape} of {array.dtype}"
            raise NaoGaitError(f"{name} in {path}", got, f"numbers {(count, *shape)}")
        if not np.isfinite(array).all():
            raise NaoGaitError(f"{name} in {path}", "not finite", "finite numbers")
        return array.astype(float)

    if "time" not in arrays or "joint_names" not in arrays:
        allowed = "arrays time (t,) and joint_names (j,)"
        raise NaoGaitError(f"log {path}", ", ".join(arrays) or "empty", allowed)
    names = tuple(str(name) for name in np.atleast_1d(arrays["joint_names"]))
    load = None
    if "left_force_z" in arrays or "right_force_z" in arrays:
        load = np.stack([take("left_force_z"), take("right_force_z")], axis=1)
    reference = None
    if "base_position" in arrays:
        rotation = np.array([rotation_from_rpy(*row) for row in take("base_rpy", 3).tolist()])
        reference = Reference("", take("base_position", 3), rotation)
    return SensorLog(
        take("time"), names, take("joint_position", len(names)), take("imu_angular_velocity", 3),
        take("imu_specific_force", 3), "", load, reference,
    )  # fmt: skip


def _from_bag(path: Path) -> SensorLog:
    bag = open_bag(path)
    prefix, topics = topics_of(bag.topics, "")
    parts = find_parts(topics)

    def stamped(topic: str) -> dict[int, Any]:
        rows = {}
        for _, message in bag.messages.get(topic, ()):
            rows[message.header.stamp.sec * 10**9 + message.header.stamp.nanosec] = message
        return rows

    imu_topic = prefix + IMU
    joints, imu = stamped(parts.get("joints", "/joint_states")), stamped(imu_topic)
    stamps = sorted(joints.keys() & imu.keys())
    if not stamps:
        allowed = f"joint_states and {imu_topic} of equal stamps"
        raise NaoGaitError(f"bag {path}", ", ".join(bag.topics) or "empty", allowed)
    names = tuple(joints[stamps[0]].name)
    sides = [stamped(parts.get(side, "")) for side in ("left_sole", "right_sole")]
    truth = stamped(parts.get("truth", ""))
    kept = [
        stamp for stamp in stamps
        if tuple(joints[stamp].name) == names
        and (not truth or stamp in truth)
        and all(not side or stamp in side for side in sides)
    ]  # fmt: skip
    reference = None
    if truth and kept:
        poses = [truth[stamp].pose.pose for stamp in kept]
        quaternions = [(q.x, q.y, q.z, q.w) for q in (pose.orientation for pose in poses)]
        reference = Reference(
            truth[kept[0]].child_frame_id,
            np.array([_xyz(pose.position) for pose in poses]),
            np.array([rotation_matrix(np.array(each)) for each in quaternions]),
        )
    load = None
    if all(sides) and kept:
        load = np.array([[side[stamp].wrench.force.z for side in sides] for stamp in kept])
    return SensorLog(
        time=np.array([1e-9 * (stamp - stamps[0]) for stamp in kept]),
        joint_names=names,
        joint_position=np.array([joints[stamp].position for stamp in kept]),
        angular_velocity=np.array([_xyz(imu[stamp].angular_velocity) for stamp in kept]),
        specific_force=np.array([_xyz(imu[stamp].linear_acceleration) for stamp in kept]),
        imu=imu[stamps[0]].header.frame_id,
        load=load,
        reference=reference,
    )


def _xyz(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z
