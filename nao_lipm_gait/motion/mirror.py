"""The mirror law of a robot: which joint is the mirror image of which, and with what sign.

A mirror image about the x-z plane turns a rotation axis (x, y, z) into (-x, y, -z). A joint whose
partner turns about exactly that axis takes over the angle, one about the opposite axis its
negative. Both are read off the URDF in the zero pose.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import FloatArray

LEFT, RIGHT = "L", "R"
"""First letters of the joints that come in pairs."""
_ALIGNED = 0.99
"""Cosine from which on two axes count as the same."""


@dataclass(frozen=True, slots=True)
class MirrorLaw:
    """mirrored[i] = sign[i] * pose[partner[i]]."""

    partner: NDArray[np.intp]
    """(n,) index of the joint on the other side; a joint in the middle is its own."""
    sign: FloatArray
    """(n,) +1 or -1."""

    def mirrored(self, position: FloatArray) -> FloatArray:
        """The mirror image of joint angles (n,) [rad]; what is NaN stays NaN."""
        return self.sign * position[self.partner]

    def swapped(self, values: FloatArray) -> FloatArray:
        """Values (n,) without a direction, such as stiffness, with the sides exchanged."""
        return values[self.partner]


@lru_cache(maxsize=8)
def mirror_law(robot: RobotDescription) -> MirrorLaw:
    """NaoGaitError if a joint of one side has no mirror image on the other."""
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
