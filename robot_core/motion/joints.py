"""Mirror images, signs and groups of joints.

A mirror image about the x-z plane turns a rotation axis (x, y, z) into (-x, y, -z). A joint whose
partner turns about exactly that axis gets the partner's angle, one about the opposite axis its
negative. Places and axes are read from the URDF in the zero pose.
"""

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.robot.derive import RobotTree, partners
from robot_core.types import FloatArray

HEAD, BODY = "head", "body"
"""Names of joint groups."""
_ALIGNED = 0.99
"""Two axes are taken as parallel if their cosine is at least this."""


@dataclass(frozen=True, slots=True)
class MirrorLaw:
    """mirrored[i] = sign[i] * pose[partner[i]].

    Attributes:
        partner: (n,) Index of the joint on the other side; a joint in the middle is its own.
        sign: (n,) +1 or -1.
    """

    partner: NDArray[np.intp]
    sign: FloatArray

    def mirrored(self, position: FloatArray) -> FloatArray:
        """The mirror image of joint angles (n,) [rad]; NaN stays NaN."""
        return self.sign * position[self.partner]

    def swapped(self, values: FloatArray) -> FloatArray:
        """Values (n,) without a sign, such as stiffness, with the sides exchanged."""
        return values[self.partner]


@lru_cache(maxsize=8)
def robot_tree(robot: RobotDescription) -> RobotTree:
    """The robot's joints in the zero pose."""
    return RobotTree(ET.fromstring(robot.urdf), robot.joint_names, robot.urdf_path)


@lru_cache(maxsize=8)
def joint_signs(robot: RobotDescription) -> tuple[float, ...]:
    """+1 or -1 by joint: whether it turns about its main axis (x, y or z) or against it."""
    joints = robot_tree(robot).joints
    axes = [joints[name].axis.tolist() for name in robot.joint_names]
    return tuple(1.0 if max(axis, key=abs) > 0.0 else -1.0 for axis in axes)


@lru_cache(maxsize=8)
def mirror_law(robot: RobotDescription) -> MirrorLaw:
    """The mirror law of a robot; NaoGaitError if a joint has no mirror image."""
    names, tree = robot.joint_names, robot_tree(robot)
    twins = partners(tree)
    partner = np.array([names.index(twins[name]) for name in names])
    sign = np.ones(len(names))
    for index, name in enumerate(names):
        x, y, z = tree.joints[name].axis
        along = float(np.dot((-x, y, -z), tree.joints[twins[name]].axis))
        if abs(along) < _ALIGNED:
            raise NaoGaitError(
                f"joint {name}", f"an axis {tree.joints[name].axis.round(3).tolist()}",
                "one in the middle about x, y or z, or one with a mirror image",
            )  # fmt: skip
        sign[index] = 1.0 if along > 0.0 else -1.0
    return MirrorLaw(partner, sign)


@lru_cache(maxsize=8)
def joint_groups(robot: RobotDescription) -> dict[str, list[int]]:
    """Indices of joints by the name of a group.

    The groups are all, head, body (all but the head), legs, arms, left_leg, right_leg, left_arm and
    right_arm. A joint in the middle that is not the head's belongs only to the body.
    """
    names = robot.joint_names
    law, joints = mirror_law(robot), robot_tree(robot).joints
    legs = {
        "left_leg": [names.index(joint) for joint in robot.left_leg.names],
        "right_leg": [names.index(joint) for joint in robot.right_leg.names],
    }
    of_legs = {*legs["left_leg"], *legs["right_leg"]}
    paired = [i for i in range(len(names)) if law.partner[i] != i and i not in of_legs]
    left = [i for i in paired if joints[names[i]].position[1] > 0.0]
    head = sorted(map(names.index, robot.head or ()))
    return {
        "all": list(range(len(names))),
        HEAD: head,
        BODY: [i for i in range(len(names)) if i not in head],
        "legs": sorted(of_legs),
        "arms": paired,
        **legs,
        "left_arm": left,
        "right_arm": [i for i in paired if i not in left],
    }
