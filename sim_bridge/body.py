"""The body of one individual: masses, joints and shapes, for the engines and the ground truth.

It is built once from the robot's URDF: masses are scaled for the individual, fixed joints merged,
joints that are not in the robot description held at zero. The true centre of mass comes from the
same numbers as the engine's model.
"""

import dataclasses
import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.robot.urdf_model import driven_model
from robot_core.types import FloatArray
from sim_bridge.individual import Individual
from sim_bridge.shapes import Color, Shape, half_height, read_colors, read_shapes
from sim_bridge.soles import SolePoints, corner_points

CONTACT_RADIUS = 0.005
"""[m] of the spheres that represent the contact points of a sole."""
SHOE = "_shoe"
"""Suffix of the name of a foot's link that only a ball meets."""
_PLATE_THICKNESS = 0.02
"""[m] of the box with which a foot meets the other leg."""


@dataclass(frozen=True, slots=True)
class Link:
    """A rigid body in the frame of the joint that moves it (the root: in the torso frame).

    Attributes:
        name: Name of the link.
        joint: Name of the joint that moves it; empty for the root.
        parent: Name of the parent link; empty for the root.
        position: (3,) [m] of the joint in the parent link.
        rotation: (3, 3) of the joint in the parent link.
        axis: (3,) of the joint.
        lower: [rad] lower end stop, true angle.
        upper: [rad] upper end stop, true angle.
        mass: [kg].
        com: (3,) [m] centre of mass.
        inertia: (3, 3) [kg m^2] about the centre of mass.
        side: `left` or `right` for the links of the legs, otherwise empty.
        collision: Shapes for contacts.
        visual: Shapes for pictures.
    """

    name: str
    joint: str
    parent: str
    position: FloatArray
    rotation: FloatArray
    axis: FloatArray
    lower: float
    upper: float
    mass: float
    com: FloatArray
    inertia: FloatArray
    side: str
    collision: tuple[Shape, ...]
    visual: tuple[Shape, ...]


@dataclass(frozen=True, slots=True)
class Sole:
    """A sole: a frame fixed to a foot, with its contact points.

    Attributes:
        name: Name of the sole frame.
        position: (3,) [m] in the foot link.
        rotation: (3, 3), sole to foot link.
        points: (3,) [m] centres of the contact spheres in the sole frame; the lowest points of the
            spheres are in its plane z = 0.
        plate: In the foot link; meets the other leg, never the floor.
    """

    name: str
    parent: str
    position: FloatArray
    rotation: FloatArray
    points: tuple[FloatArray, ...]
    plate: Shape


class BodyPose(NamedTuple):
    """Centre of mass and soles by forward kinematics.

    Attributes:
        com: (3,) [m] in the world.
        sole_position: left, right (3,) [m] in the world.
        sole_rotation: left, right (3, 3), sole to world.
    """

    com: FloatArray
    sole_position: tuple[FloatArray, FloatArray]
    sole_rotation: tuple[FloatArray, FloatArray]


class Body:
    """The whole body of one individual.

    Attributes:
        links: Parents come first; the root is the torso.
        soles: left, right.
        mass: [kg].
        imu_position: (3,) [m] in the torso frame.
        imu_rotation: (3, 3), IMU frame to torso.
    """

    def __init__(
        self,
        robot: RobotDescription,
        individual: Individual,
        soles: SolePoints | None = None,
        color: Color | None = None,
    ) -> None:
        """Read the URDF.

        Args:
            robot: URDF, joint names and frames.
            individual: Masses and encoder offsets.
            soles: Contact points; None = the corners of the robot's own soles.
            color: Of the upper body in pictures; None = those of the URDF.

        Raises:
            NaoGaitError: The URDF lacks a frame, or the torso or IMU is not fixed to the root.
        """
        tree = ET.fromstring(robot.urdf)
        for link in tree.findall("link"):
            _scale_inertial(link, individual.mass_scale.get(link.attrib["name"], 1.0))
        self._model = model = driven_model(tree, robot.joint_names, robot.urdf_path)
        self._data = model.createData()
        self._configuration = pin.neutral(model)
        self._q_index = np.array(
            [model.joints[model.getJointId(joint)].idx_q for joint in robot.joint_names]
        )
        self._torso_in_root = self._frame(robot, robot.torso_frame, root=True)
        self._root_in_torso = self._torso_in_root.inverse()
        self._root_is_torso = bool(self._root_in_torso.isIdentity())
        self._sole_frames = tuple(
            model.getFrameId(name, pin.FrameType.BODY) for name in robot.sole_frames
        )
        placements = [self._data.oMf[frame] for frame in self._sole_frames]
        # Views of Pinocchio's own memory: every update changes them.
        self._sole_views = [(each.translation, each.rotation) for each in placements]
        imu = self._root_in_torso * self._frame(robot, robot.imu_frame, root=True)
        self.imu_position: FloatArray = imu.translation.copy()
        self.imu_rotation: FloatArray = imu.rotation.copy()
        self._zero = dict(zip(robot.joint_names, individual.joint_zero.tolist(), strict=True))
        self.mass = float(sum(inertia.mass for inertia in model.inertias))
        self.links: tuple[Link, ...] = self._read_links(robot, tree, color)
        self.soles: tuple[Sole, Sole] = self._read_soles(robot, soles or corner_points(robot))

    def pose(
        self, torso_position: FloatArray, torso_rotation: FloatArray, joints: FloatArray
    ) -> BodyPose:
        """Forward kinematics.

        Args:
            torso_position: (3,) [m] in the world.
            torso_rotation: (3, 3), torso to world.
            joints: (n,) [rad] true angles.
        """
        self._configure(torso_position, torso_rotation, joints)
        com = pin.centerOfMass(self._model, self._data, self._configuration, False)
        for frame in self._sole_frames:
            pin.updateFramePlacement(self._model, self._data, frame)
        (left, left_rotation), (right, right_rotation) = self._sole_views
        return BodyPose(
            com=np.array(com),
            sole_position=(left.copy(), right.copy()),
            sole_rotation=(left_rotation.copy(), right_rotation.copy()),
        )

    def link_poses(
        self, torso_position: FloatArray, torso_rotation: FloatArray, joints: FloatArray
    ) -> list[tuple[FloatArray, FloatArray]]:
        """Position (3,) [m] and rotation (3, 3) in the world of each of `links`.

        Args:
            torso_position: (3,) [m] in the world.
            torso_rotation: (3, 3), torso to world.
            joints: (n,) [rad] true angles.
        """
        self._configure(torso_position, torso_rotation, joints)
        pin.forwardKinematics(self._model, self._data, self._configuration)
        poses = []
        for link in self.links:
            placement = self._placement(link)
            poses.append((placement.translation.copy(), placement.rotation.copy()))
        return poses

    def bounds(
        self, torso_rotation: FloatArray, joints: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Box around all shapes, along the axes of the world, with the torso's origin at 0.

        Args:
            torso_rotation: (3, 3), torso to world.
            joints: (n,) [rad] true angles.

        Returns:
            (3,) [m] smallest and (3,) [m] largest x, y, z.
        """
        low, high = np.full(3, math.inf), np.full(3, -math.inf)
        self._configure(np.zeros(3), torso_rotation, joints)
        pin.forwardKinematics(self._model, self._data, self._configuration)
        for link in self.links:
            placement = self._placement(link)
            for shape in link.collision:
                axes = placement.rotation @ shape.rotation
                centre = placement.act(shape.position)
                half = np.array([half_height(shape, axis) for axis in axes])
                low, high = np.minimum(low, centre - half), np.maximum(high, centre + half)
        for sole, frame in zip(self.soles, self._sole_frames, strict=True):
            placement = pin.updateFramePlacement(self._model, self._data, frame)
            for point in map(placement.act, sole.points):
                low = np.minimum(low, point - CONTACT_RADIUS)
                high = np.maximum(high, point + CONTACT_RADIUS)
        return low, high

    def _placement(self, link: Link) -> pin.SE3:
        """Of a link in the world, after forward kinematics."""
        if not link.joint:
            return self._data.oMi[1] * self._torso_in_root
        return self._data.oMi[self._model.getJointId(link.joint)]

    def _configure(
        self, torso_position: FloatArray, torso_rotation: FloatArray, joints: FloatArray
    ) -> None:
        q = self._configuration
        if self._root_is_torso:
            q[:3] = torso_position
            q[3:7] = pin.Quaternion(torso_rotation).coeffs()
        else:
            root = pin.SE3(torso_rotation, torso_position) * self._root_in_torso
            q[:3] = root.translation
            q[3:7] = pin.Quaternion(root.rotation).coeffs()
        q[self._q_index] = joints

    def _frame(self, robot: RobotDescription, name: str, *, root: bool = False) -> pin.SE3:
        """Placement of a frame in the joint that moves it; `root`: it must be fixed to the root."""
        if not self._model.existFrame(name, pin.FrameType.BODY):
            raise NaoGaitError(str(robot.urdf_path), f"no link {name}", f"a link {name}")
        frame = self._model.frames[self._model.getFrameId(name, pin.FrameType.BODY)]
        if root and frame.parentJoint != 1:
            raise NaoGaitError(str(robot.urdf_path), f"moving {name}", f"{name} fixed to the root")
        return frame.placement

    def _read_links(
        self, robot: RobotDescription, tree: ET.Element, color: Color | None
    ) -> tuple[Link, ...]:
        model = self._model
        colors = read_colors(tree)
        collision: dict[int, list[Shape]] = {}
        visual: dict[int, list[Shape]] = {}
        for element in tree.findall("link"):
            frame = model.frames[model.getFrameId(element.attrib["name"], pin.FrameType.BODY)]
            placement = frame.placement
            if frame.parentJoint == 1:
                placement = self._root_in_torso * placement
            for kind, shapes in (("collision", collision), ("visual", visual)):
                shapes.setdefault(frame.parentJoint, []).extend(
                    read_shapes(element, kind, placement, colors)
                )
        elements = {joint.attrib["name"]: joint for joint in tree.findall("joint")}
        sides = {joint: "left" for joint in robot.left_leg.names}
        sides |= {joint: "right" for joint in robot.right_leg.names}
        carrier = model.getFrameId(robot.upper_body_frame, pin.FrameType.BODY)
        upper_body = model.frames[carrier].parentJoint
        feet = {model.frames[frame].parentJoint for frame in self._sole_frames}
        names: dict[int, str] = {}
        links: list[Link] = []
        for index in range(1, model.njoints):
            inertia, placement = model.inertias[index], model.jointPlacements[index]
            parent = model.parents[index]
            if index == 1:
                name, joint, axis = robot.torso_frame, "", np.zeros(3)
                lower = upper = 0.0
                inertia = self._root_in_torso.act(inertia)
            else:
                joint = model.names[index]
                name = elements[joint].find("child").attrib["link"]  # type: ignore[union-attr]
                axis = _axis(elements[joint])
                # End stops move with the encoder offset: a joint at its limit must not touch them.
                q, zero = model.joints[index].idx_q, self._zero[joint]
                lower = float(model.lowerPositionLimit[q]) + zero
                upper = float(model.upperPositionLimit[q]) + zero
                if parent == 1:
                    placement = self._root_in_torso * placement
            names[index] = name
            seen = visual.get(index, ())
            if index == upper_body and color is not None:
                seen = [dataclasses.replace(shape, color=(*color, 1.0)) for shape in seen]
            links.append(
                Link(
                    name=name,
                    joint=joint,
                    parent=names.get(parent, ""),
                    position=placement.translation.copy(),
                    rotation=placement.rotation.copy(),
                    axis=axis,
                    lower=lower,
                    upper=upper,
                    mass=float(inertia.mass),
                    com=inertia.lever.copy(),
                    inertia=np.array(inertia.inertia),
                    side=sides.get(joint, ""),
                    collision=() if index in feet else tuple(collision.get(index, ())),
                    visual=tuple(seen),
                )
            )
        return tuple(links)

    def _read_soles(self, robot: RobotDescription, outline: SolePoints) -> tuple[Sole, Sole]:
        model = self._model
        soles = []
        for mirror, name in zip((1.0, -1.0), robot.sole_frames, strict=True):
            placement = self._frame(robot, name)
            frame = model.getFrameId(name, pin.FrameType.BODY)
            parent_joint = model.names[model.frames[frame].parentJoint]
            parent = next(link.name for link in self.links if link.joint == parent_joint)
            corners = [(x, mirror * y) for x, y in outline.corners]
            points = [(x, mirror * y) for x, y in outline.points]
            # the largest rectangle between the corners that is nowhere outside the sole
            xs, ys = (sorted(corner[axis] for corner in corners) for axis in (0, 1))
            size = (xs[2] - xs[1], ys[2] - ys[1], _PLATE_THICKNESS)
            centre = np.array([xs[1] + xs[2], ys[1] + ys[2], size[2]]) / 2.0
            soles.append(
                Sole(
                    name=name,
                    parent=parent,
                    position=placement.translation.copy(),
                    rotation=placement.rotation.copy(),
                    points=tuple(np.array([x, y, CONTACT_RADIUS]) for x, y in points),
                    plate=Shape("box", size, placement.act(centre), placement.rotation.copy()),
                )
            )
        return soles[0], soles[1]


def _scale_inertial(link: ET.Element, scale: float) -> None:
    """A heavier link is denser, not larger: the inertia scales with the mass."""
    inertial = link.find("inertial")
    if inertial is None or scale == 1.0:
        return
    for tag in ("mass", "inertia"):
        element = inertial.find(tag)
        if element is not None:
            for key, value in element.attrib.items():
                element.set(key, repr(float(value) * scale))


def _axis(joint: ET.Element) -> FloatArray:
    element = joint.find("axis")
    text = "1 0 0" if element is None else element.attrib["xyz"]
    axis = np.array([float(v) for v in text.split()])
    return axis / np.linalg.norm(axis)
