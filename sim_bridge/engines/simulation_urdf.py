"""The body of one individual as a URDF, for engines that load URDF files."""

import dataclasses
import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin

from robot_core.types import FloatArray
from sim_bridge.body import CONTACT_RADIUS, SHOE, Body, Link, Sole
from sim_bridge.shapes import Shape


def simulation_urdf(
    body: Body, *, visual: bool = False, shoes: tuple[Shape, ...] = ()
) -> str:
    """The body as a URDF of revolute joints.

    The contact points of a sole are a massless link. Inertias are given about their principal axes,
    so that no engine has to rotate them.

    Args:
        body: The body.
        visual: With visual shapes.
        shoes: left, right: shapes in the foot links that only a ball meets; they become the
            massless links `<sole>_shoe`. Empty = none.
    """
    robot = ET.Element("robot", name="simulated")
    for link in body.links:
        element = ET.SubElement(robot, "link", name=link.name)
        _write_inertial(element, link)
        for shape in link.collision:
            _write_shape(element, "collision", shape)
        for sole in body.soles:
            if sole.parent == link.name:
                _write_shape(element, "collision", sole.plate)
        if visual:
            for shape in link.visual:
                _write_shape(element, "visual", shape)
        if link.joint:
            joint = _write_joint(robot, link.joint, "revolute", link)
            ET.SubElement(joint, "axis", xyz=_text(link.axis))
            # Torque and speed limits come from the plant.
            ET.SubElement(
                joint,
                "limit",
                lower=repr(link.lower),
                upper=repr(link.upper),
                effort="1000",
                velocity="1000",
            )
            ET.SubElement(joint, "dynamics", damping="0", friction="0")
    for sole in body.soles:
        points = [Shape("sphere", (CONTACT_RADIUS,), point, np.eye(3)) for point in sole.points]
        _add_massless(robot, sole, points)
    for sole, shape in zip(body.soles, shoes, strict=bool(shoes)):
        foot = dataclasses.replace(
            sole, name=f"{sole.name}{SHOE}", position=np.zeros(3), rotation=np.eye(3)
        )
        _add_massless(robot, foot, [shape])
    ET.indent(robot)  # PyBullet cannot read lines of more than 1024 characters
    return ET.tostring(robot, encoding="unicode")


def _add_massless(robot: ET.Element, frame: Sole, shapes: list[Shape]) -> None:
    element = ET.SubElement(robot, "link", name=frame.name)
    inertial = ET.SubElement(element, "inertial")
    ET.SubElement(inertial, "mass", value="0")
    ET.SubElement(inertial, "inertia", ixx="0", iyy="0", izz="0", ixy="0", ixz="0", iyz="0")
    for shape in shapes:
        _write_shape(element, "collision", shape)
    _write_joint(robot, f"{frame.name}_fixed", "fixed", frame)


def _text(values: FloatArray) -> str:
    return " ".join(repr(float(v)) for v in values)


def _write_origin(element: ET.Element, position: FloatArray, rotation: FloatArray) -> None:
    rpy = pin.rpy.matrixToRpy(np.asarray(rotation))
    ET.SubElement(element, "origin", xyz=_text(position), rpy=_text(rpy))


def _write_joint(robot: ET.Element, name: str, kind: str, child: Link | Sole) -> ET.Element:
    joint = ET.SubElement(robot, "joint", name=name, type=kind)
    _write_origin(joint, child.position, child.rotation)
    ET.SubElement(joint, "parent", link=child.parent)
    ET.SubElement(joint, "child", link=child.name)
    return joint


def _write_inertial(element: ET.Element, link: Link) -> None:
    moments, axes = np.linalg.eigh(link.inertia)
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] = -axes[:, 0]
    inertial = ET.SubElement(element, "inertial")
    _write_origin(inertial, link.com, axes)
    ET.SubElement(inertial, "mass", value=repr(link.mass))
    ixx, iyy, izz = (repr(float(v)) for v in moments)
    ET.SubElement(inertial, "inertia", ixx=ixx, iyy=iyy, izz=izz, ixy="0", ixz="0", iyz="0")


def _write_shape(element: ET.Element, tag: str, shape: Shape) -> None:
    outer = ET.SubElement(element, tag)
    _write_origin(outer, shape.position, shape.rotation)
    geometry = ET.SubElement(outer, "geometry")
    if shape.kind == "box":
        ET.SubElement(geometry, "box", size=_text(np.array(shape.size)))
    elif shape.kind == "sphere":
        ET.SubElement(geometry, "sphere", radius=repr(shape.size[0]))
    else:
        radius, length = shape.size
        ET.SubElement(geometry, "cylinder", radius=repr(radius), length=repr(length))
    if tag == "visual":
        name = "color_" + "_".join(f"{round(255 * v)}" for v in shape.color)
        material = ET.SubElement(outer, "material", name=name)
        ET.SubElement(material, "color", rgba=_text(np.array(shape.color)))
