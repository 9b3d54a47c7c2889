"""Checks joint limits, joint speeds and crossing legs of a motion before it runs."""

import math
import xml.etree.ElementTree as ET
from functools import lru_cache

import numpy as np
import pinocchio as pin

from robot_core.errors import NaoGaitError
from robot_core.joint_limits import JointLimits
from robot_core.motion.keyframes import Interpolation, Motion
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray

SPEED_SHARE = 0.95
"""Share of a joint's speed limit that a motion may use; the rest is left for gyro stabilisation."""
_ROUNDING = 1e-6
LEGS_DEPTH = 0.003
"""[m] by which the collision shapes of the legs, which are simple, may overlap."""
_LEGS_STEP, _LEGS_SAMPLES = 0.1, 32
"""[rad] of any joint between two poses in which the legs are compared; most poses of a movement."""


def check_motion(motion: Motion, robot: RobotDescription) -> None:
    """Raise NaoGaitError with motion, keyframe, joint, value and limit.

    The movement into the first keyframe starts at an unknown pose; the player extends its time if
    necessary. The same holds for movements from and to the gait's stand pose.
    """
    limits = JointLimits(robot)
    legs = None if motion.legs_press else _legs(robot)
    before: FloatArray | None = None
    for number, keyframe in enumerate(motion.keyframes, start=1):
        position = keyframe.position
        if position is None:
            before = None
            continue  # the stand of the gait, whose legs do not cross
        where = f"motion {motion.name}, keyframe {number} ({keyframe.pose})"
        _check_limits(where, position, robot, limits)
        if before is not None:
            _check_speed(where, position - before, keyframe.time, keyframe.interpolation, robot)
        if legs is not None:
            legs.check(where, before, position)
        before = position


def fastest(change: FloatArray, interpolation: Interpolation, robot: RobotDescription) -> float:
    """[s] The shortest time for a change of the joints (n,) [rad] within their speed limits."""
    speed = SPEED_SHARE * robot.velocity_limit
    times = interpolation.peak * np.abs(np.nan_to_num(change)) / speed
    return float(np.max(times))


def _check_limits(
    where: str, position: FloatArray, robot: RobotDescription, limits: JointLimits
) -> None:
    wanted = np.where(np.isnan(position), robot.stand_pose, position)
    possible = wanted.copy()
    limits.cut(possible)
    beyond = np.abs(wanted - possible)
    worst = int(np.argmax(beyond))
    if beyond[worst] > _ROUNDING:
        side = "at least" if possible[worst] > wanted[worst] else "at most"
        raise NaoGaitError(
            f"{where}, {robot.joint_names[worst]}", f"{wanted[worst]:.6g} rad",
            f"{side} {possible[worst]:.6g} rad (of {robot.lower[worst]:.6g} to "
            f"{robot.upper[worst]:.6g}; an ankle's roll also depends on its pitch)",
        )  # fmt: skip
    for leader, follower in robot.coupled_joints:
        first, second = (float(wanted[robot.index(name)]) for name in (leader, follower))
        if abs(first - second) > _ROUNDING:
            raise NaoGaitError(
                f"{where}, {follower}", f"{second:.6g} rad",
                f"{first:.6g} rad, as {leader}: one motor turns both",
            )  # fmt: skip


def _check_speed(
    where: str,
    change: FloatArray,
    time: float,
    interpolation: Interpolation,
    robot: RobotDescription,
) -> None:
    speed = interpolation.peak * np.abs(np.nan_to_num(change)) / time
    limit = SPEED_SHARE * robot.velocity_limit
    worst = int(np.argmax(speed / limit))
    if speed[worst] > limit[worst] * (1.0 + _ROUNDING):
        needed = time * float(speed[worst] / limit[worst])
        raise NaoGaitError(
            f"{where}, {robot.joint_names[worst]}", f"{speed[worst]:.4g} rad/s in {time:g} s",
            f"at most {limit[worst]:.4g} rad/s ({SPEED_SHARE:g} of the joint's), so {needed:.3f} s "
            "or more",
        )  # fmt: skip


class _Legs:
    """How close the collision shapes of one leg come to those of the other."""

    def __init__(self, robot: RobotDescription) -> None:
        root = ET.fromstring(robot.urdf)
        for link in root.findall("link"):
            for shape in link.findall("collision"):
                if shape.find("geometry/mesh") is not None:  # the file may not be there
                    link.remove(shape)
        text = ET.tostring(root, encoding="unicode")
        self._robot = robot
        self._model = pin.buildModelFromXML(text)
        self._shapes = pin.buildGeomFromUrdfString(self._model, text, pin.COLLISION)
        left, right = (self._of(leg.names) for leg in (robot.left_leg, robot.right_leg))
        for pair in ((a, b) for a in left for b in right):
            self._shapes.addCollisionPair(pin.CollisionPair(*pair))
        self._data = self._model.createData(), self._shapes.createData()
        model = self._model
        self._columns = [model.joints[model.getJointId(n)].idx_q for n in robot.joint_names]

    def _of(self, joints: tuple[str, ...]) -> list[int]:
        moved = {self._model.getJointId(name) for name in joints}
        shapes = self._shapes.geometryObjects
        return [n for n, shape in enumerate(shapes) if shape.parentJoint in moved]

    def check(self, where: str, before: FloatArray | None, position: FloatArray) -> None:
        """Refuse a movement (n,) [rad], NaN where the stand is meant, on which they cross."""
        if not len(self._shapes.collisionPairs):
            return
        stand = self._robot.stand_pose
        end = np.where(np.isnan(position), stand, position)
        start = end if before is None else np.where(np.isnan(before), stand, before)
        samples = math.ceil(float(np.abs(end - start).max()) / _LEGS_STEP)
        for share in np.linspace(1.0, 0.0, max(1, min(samples, _LEGS_SAMPLES)), endpoint=False):
            depth, first, second = self._overlap(start + share * (end - start))
            if depth > LEGS_DEPTH:
                raise NaoGaitError(
                    where, f"{first} {1e3 * depth:.0f} mm inside {second}",
                    "legs that do not cross (legs_press: true where they press on purpose)",
                )  # fmt: skip

    def _overlap(self, position: FloatArray) -> tuple[float, str, str]:
        """[m] by which a shape of one leg is inside one of the other, and their links."""
        configuration = pin.neutral(self._model)
        configuration[self._columns] = position
        model, shapes, (data, found) = self._model, self._shapes, self._data
        pin.updateGeometryPlacements(model, data, shapes, found, configuration)
        nearest = pin.computeDistances(shapes, found)
        pair = shapes.collisionPairs[nearest]
        first, second = (
            model.frames[shapes.geometryObjects[n].parentFrame].name
            for n in (pair.first, pair.second)
        )
        return -found.distanceResults[nearest].min_distance, first, second


@lru_cache(maxsize=8)
def _legs(robot: RobotDescription) -> _Legs:
    return _Legs(robot)
