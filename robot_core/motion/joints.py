"""Mirror images and groups of joints.

A mirror image about the x-z plane turns a rotation axis (x, y, z) into (-x, y, -z). A joint whose
partner turns about exactly that axis gets the partner's angle, one about the opposite axis its
negative. Both are read from the URDF in the zero pose.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray

LEFT, RIGHT = "L", "R"
"""First letters of the names of paired joints."""
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
def mirror_law(robot: RobotDescription) -> MirrorLaw:
    """The mirror law of a robot; NaoGaitError if a joint has no mirror image."""
    names = robot.joint_names
    axes = _axes(robot)
    partner = np.arange(len(names))
    sign = np.ones(len(names))
    for index, name in enumerate(names):
        other = {LEFT: RIGHT, RIGHT: LEFT}.get(name[:1])
        twin = f"{other}{name[1:]}"
        if other is not None and twin in names:
            partner[index] = names.index(twin)
        x, y, z = axes[index]
        along = float(np.dot((-x, y, -z), axes[partner[index]]))
        if abs(along) < _ALIGNED:
            raise NaoGaitError(
                f"joint {name}", f"an axis {axes[index].round(3).tolist()}",
                f"one that is the mirror image of {names[partner[index]]}'s",
            )  # fmt: skip
        sign[index] = 1.0 if along > 0.0 else -1.0
    return MirrorLaw(partner, sign)


def _axes(robot: RobotDescription) -> list[FloatArray]:
    """(3,) axis of each joint in the world, in the zero pose."""
    model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
    data = model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    axes = []
    for name in robot.joint_names:
        joint = model.getJointId(name)
        jacobian = pin.getJointJacobian(model, data, joint, pin.ReferenceFrame.WORLD)
        axes.append(np.array(jacobian[3:, model.joints[joint].idx_v]))
    return axes


@lru_cache(maxsize=8)
def joint_groups(robot: RobotDescription) -> dict[str, list[int]]:
    """Indices of joints by the name of a group.

    The groups are all, head, body (all but the head), legs, arms, left_leg, right_leg, left_arm and
    right_arm. A joint in the middle belongs to the head if its name begins with head or neck, and
    otherwise only to the body.
    """
    names = robot.joint_names
    law = mirror_law(robot)
    legs = {
        "left_leg": [names.index(joint) for joint in robot.left_leg.names],
        "right_leg": [names.index(joint) for joint in robot.right_leg.names],
    }
    of_legs = {*legs["left_leg"], *legs["right_leg"]}
    paired = [i for i in range(len(names)) if law.partner[i] != i and i not in of_legs]
    head = [i for i, name in enumerate(names) if name.lower().startswith(("head", "neck"))]
    return {
        "all": list(range(len(names))),
        HEAD: head,
        BODY: [i for i in range(len(names)) if i not in head],
        "legs": sorted(of_legs),
        "arms": paired,
        **legs,
        "left_arm": [i for i in paired if names[i].startswith(LEFT)],
        "right_arm": [i for i in paired if names[i].startswith(RIGHT)],
    }
