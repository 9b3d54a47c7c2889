"""Robots of another size: the gait computes with their image at the NAO's size.

Two pendulums move alike if their lengths are as s to 1 and their times as sqrt(s) to 1 (Froude),
because gravity is the same for both. So the gait of a robot that is s times as high as the NAO
divides its lengths by s and its times by sqrt(s), computes with the numbers that hold for a NAO,
and gives back joint angles, which have no size. All lengths, times, speeds and rates of parameters
and constants are shares of the robot's own by that. What is left are proportions: `fitted` takes
the lengths that belong to the soles and the hips from the robot.
"""

import dataclasses
import xml.etree.ElementTree as ET
from functools import lru_cache
from itertools import pairwise
from math import sqrt
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from nao_lipm_gait.parameters import BY_NAME, GaitParameters
from robot_core.head_goals import Follow, Goal, LookAt
from robot_core.motion.joints import robot_tree
from robot_core.robot import JointLimit, RobotDescription
from robot_core.robot.derive import REFERENCE_HEIGHT
from robot_core.types import (
    GRAVITY,
    GaitStatus,
    Point2,
    Point3,
    Pose2,
    Pose6,
    PoseCovariance,
    SensorFrame,
    VelocityCommand,
)

HELD, ENOUGH = 0.15, 0.4
"""Torques of the weakest hip motor over weight and height of the CoM: what a leg that stands alone
takes about, and what is enough for a whole kick. A Booster T1 (0.25) falls with it, but not with
twice the torque."""
KNEE_LOAD = 0.45
"""Share of its motor's stall torque that the knee of a leg that carries the robot may need: that of
a T1. An iCub and a JVRC-1, whose knees would need 0.7 and 0.8, fell."""
SOLE_GAP = 0.035
"""[m] Smallest gap between the inner edges of the soles of an image with wide feet."""


class Size:
    """The size of a robot in NAOs, for what crosses the boundary of its gait.

    Args:
        length: Its lengths over those of its image.

    Attributes:
        length: The same.
        time: Its times over those of its image.
        same: It is as large as its image, so that nothing has to be converted.
    """

    def __init__(self, length: float) -> None:
        self.length = length
        self.time = sqrt(length)
        self.same = length == 1.0

    def frame(self, frame: SensorFrame) -> SensorFrame:
        """The sensors of the image: it turns faster."""
        if self.same:
            return frame
        mean = frame.mean_angular_velocity
        return frame._replace(
            angular_velocity=self.time * frame.angular_velocity,
            mean_angular_velocity=None if mean is None else self.time * mean,
        )

    def parameters(self, parameters: GaitParameters) -> GaitParameters:
        """The parameters of the image: only the delay of sensors and motors is the robot's own."""
        if self.same:
            return parameters
        return parameters.replace(feedback_delay=parameters.feedback_delay / self.time)

    def command(self, command: VelocityCommand) -> VelocityCommand:
        """The command for the image."""
        if self.same:
            return command
        speed = self.time / self.length
        return VelocityCommand(speed * command.x, speed * command.y, self.time * command.yaw)

    def goal(self, goal: Goal | None) -> Goal | None:
        """What the head of the image looks at."""
        if self.same or not isinstance(goal, LookAt | Follow):
            return goal
        x, y, z = (value / self.length for value in goal.point)
        return dataclasses.replace(goal, point=(x, y, z))

    def rates(self, rates: Point3) -> Point3:
        """Rates [rad/s] of the robot from those of the image."""
        x, y, z = rates
        return x / self.time, y / self.time, z / self.time

    def pose(self, pose: Pose6) -> Pose6:
        """A pose of the robot from that of the image."""
        x, y, z, roll, pitch, yaw = pose
        return self.length * x, self.length * y, self.length * z, roll, pitch, yaw

    def status(self, status: GaitStatus) -> GaitStatus:
        """The status of the robot from that of the image."""
        if self.same:
            return status
        length, time = self.length, self.time

        def point(p: Point3) -> Point3:
            return length * p[0], length * p[1], length * p[2]

        def planar(p: Pose2) -> Pose2:
            return length * p[0], length * p[1], p[2]

        c, speed = status.pose_covariance, length / time
        vx, vy, turn = status.velocity
        x, y = status.pendulum_origin_in_q
        return status._replace(
            com_expected_in_q=point(status.com_expected_in_q),
            com_measured_in_q=point(status.com_measured_in_q),
            com_estimated_in_q=point(status.com_estimated_in_q),
            pendulum_origin_in_q=(length * x, length * y),
            step_size=planar(status.step_size),
            time_to_support_change=time * status.time_to_support_change,
            q_in_odom=planar(status.q_in_odom),
            base_footprint_in_odom=planar(status.base_footprint_in_odom),
            velocity=(speed * vx, speed * vy, turn / time),
            left_sole_in_odom=self.pose(status.left_sole_in_odom),
            right_sole_in_odom=self.pose(status.right_sole_in_odom),
            ik_residual=length * status.ik_residual,
            pose_covariance=PoseCovariance(
                length * length * c.xx, length * length * c.xy, length * length * c.yy,
                length * c.x_yaw, length * c.y_yaw, c.yaw,
            ),
            yaw_rate_variance=status.yaw_rate_variance / (time * time),
        )  # fmt: skip


@lru_cache(maxsize=8)
def image_of(robot: RobotDescription) -> RobotDescription:
    """The robot at the NAO's size: lengths and speeds of its joints, but its own masses."""
    size = Size(robot.size)
    if size.same:
        return robot
    root = ET.fromstring(robot.urdf)
    for origin in root.iter("origin"):
        words = origin.get("xyz", "0 0 0").split()
        origin.set("xyz", " ".join(repr(float(word) / size.length) for word in words))
    limits = {
        name: JointLimit(each.lower, each.upper, size.time * each.velocity, each.effort)
        for name, each in robot.limits.items()
    }
    return dataclasses.replace(
        robot,
        size=1.0,
        urdf=ET.tostring(root, encoding="unicode"),
        limits=limits,
        sole_outline=_shrunk(robot.sole_outline, size.length),
        sole_corners=_shrunk(robot.sole_corners, size.length),
    )


def _shrunk(points: tuple[Point2, ...], length: float) -> tuple[Point2, ...]:
    return tuple((x / length, y / length) for x, y in points)


class Proportions(NamedTuple):
    """Lengths of a robot's image, by which the NAO's parameters fit another robot [m].

    Attributes:
        sole_middle: Middle of the sole ahead of its frame.
        sole_inside: From the sole's frame to its inner edge.
        pace: Lowest no-load speed of hip pitch, knee and ankle pitch [rad/s].
        arm_swing: Swing of the arms whose yaw momentum is that of a leg, per metre of its foot
            [rad/m]; None without arms.
        hip_torque: Stall torque of the weakest hip motor over weight and size [m].
        com_height: Height of the CoM at which the knees can carry the robot [m].
    """

    sole_length: float
    sole_middle: float
    sole_width: float
    sole_inside: float
    hip: float
    pace: float
    arm_swing: float | None
    hip_torque: float
    com_height: float


def proportions(robot: RobotDescription) -> Proportions:
    """The proportions of a robot."""
    image = image_of(robot)
    tree = robot_tree(image)
    (x0, x1), (y0, y1) = (
        (min(p[axis] for p in image.sole_outline), max(p[axis] for p in image.sole_outline))
        for axis in (0, 1)
    )
    hip = abs(float(tree.joints[image.left_leg.hip_roll].position[1]))
    leg = robot.left_leg
    speeds = [
        robot.motors[name].no_load_speed
        for name in (leg.hip_pitch, leg.knee_pitch, leg.ankle_pitch)
    ]
    pace = Size(robot.size).time * min(speeds)
    weight = GRAVITY * sum(each.mass for each in pin.buildModelFromXML(image.urdf).inertias)
    hip_pitch, hip_roll, knee = (
        robot.motors[name].stall_torque / (weight * robot.size)
        for name in (leg.hip_pitch, leg.hip_roll, leg.knee_pitch)
    )
    places = [tree.joints[n].position for n in (leg.hip_pitch, leg.knee_pitch, leg.ankle_pitch)]
    thigh, shank = (float(np.linalg.norm(a - b)) for a, b in pairwise(places))
    return Proportions(
        x1 - x0, 0.5 * (x0 + x1), y1 - y0, -y0, hip, pace, _balancing_arm_swing(image),
        min(hip_pitch, hip_roll), _height_for_knees(thigh, shank, KNEE_LOAD * knee),
    )  # fmt: skip


def _height_for_knees(thigh: float, shank: float, lever: float) -> float:
    """Height of the CoM [m] over a leg whose knee is a lever [m] ahead of hip and ankle."""
    lever = min(lever, thigh, shank)
    bent = sqrt(thigh**2 - lever**2) + sqrt(shank**2 - lever**2)
    return REFERENCE_HEIGHT - (thigh + shank - bent)


def _balancing_arm_swing(image: RobotDescription) -> float | None:
    if not image.shoulder_pitch:
        return None
    model = pin.buildModelFromXML(image.urdf, pin.JointModelFreeFlyer())
    data, q = model.createData(), pin.neutral(model)
    joints = {name: model.joints[model.getJointId(name)] for name in image.joint_names}
    for name, angle in zip(image.joint_names, image.stand_pose, strict=True):
        q[joints[name].idx_q] = angle
    momentum = pin.computeCentroidalMap(model, data, q)[5]
    frame = model.getFrameId(image.sole_frames[0], pin.FrameType.BODY)
    foot = pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL_WORLD_ALIGNED)[0]
    hip, arm = joints[image.left_leg.hip_pitch].idx_v, joints[image.shoulder_pitch[0]].idx_v
    of_leg, of_arm = abs(float(momentum[hip] / foot[hip])), abs(float(momentum[arm]))
    return of_leg / of_arm if of_arm > 0.0 else None


def fitted(
    parameters: GaitParameters, robot: RobotDescription, reference: RobotDescription
) -> GaitParameters:
    """Parameters for a robot that has none of its own, from those of another one.

    Args:
        parameters: Parameters of `reference`.
        robot: The robot.
        reference: The robot for which they were chosen.

    Returns:
        The parameters with the lengths of soles and hips that the robot has, with shorter steps if
        its motors are slower, and with a lower lift if they are or if the soles are shorter: their
        ends reach less far down when they tilt. Lighter arms swing more. Weaker hips kick less,
        weaker knees bend less.
    """
    own, other = proportions(robot), proportions(reference)
    p = parameters
    along = own.sole_length / other.sole_length
    across = own.sole_width / other.sole_width
    spacing = max(p.foot_spacing * own.hip / other.hip, 2.0 * own.sole_inside + SOLE_GAP)
    stance = spacing / p.foot_spacing
    changes = {
        "foot_reference_x": own.sole_middle + along * (p.foot_reference_x - other.sole_middle),
        "foot_spacing": spacing,
        "com_height": max(p.com_height, own.com_height),
        "pendulum_height": max(p.pendulum_height, own.com_height),
    }
    pace = min(1.0, own.pace / other.pace)
    spare = (own.hip_torque / p.com_height - HELD) / (ENOUGH - HELD)
    arms = own.arm_swing / other.arm_swing if own.arm_swing and other.arm_swing else 1.0
    for name, share in (
        ("swing_lift", min(pace, along)), ("step_forward_max", pace),
        ("step_backward_max", pace), ("step_side_max", pace),
        ("pendulum_width", stance), ("pendulum_offset_y", stance),
        ("pendulum_shift_max", along), ("pendulum_shift_back_max", along),
        ("pendulum_shift_side_max", across), ("arm_swing", arms),
        ("kick_reach", min(max(spare, 0.0), 1.0)),
    ):  # fmt: skip
        if name in p.as_dict():
            changes[name] = share * getattr(p, name)
    inside = {name: _inside(name, value) for name, value in changes.items()}
    return p.replace(**inside)


def _inside(name: str, value: float) -> float:
    field = BY_NAME[name]
    return float(np.clip(value, field.minimum, field.maximum))
