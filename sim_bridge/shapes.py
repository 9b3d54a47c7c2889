"""Shapes of the links: boxes, spheres and cylinders of a URDF."""

import dataclasses
import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from robot_core.types import FloatArray

Color = tuple[float, float, float]
"""Red, green and blue, 0 to 1."""


@dataclass(frozen=True, slots=True)
class Shape:
    """A primitive in the frame of its link.

    Attributes:
        kind: `box`, `sphere` or `cylinder`.
        size: [m] box: edges x, y, z; sphere: radius; cylinder: radius, length along z.
        position: (3,) [m] of its centre.
        rotation: (3, 3), shape to link.
        color: Red, green, blue, alpha; for pictures.
    """

    kind: str
    size: tuple[float, ...]
    position: FloatArray
    rotation: FloatArray
    color: tuple[float, ...] = (0.8, 0.8, 0.8, 1.0)


def read_colors(tree: ET.Element) -> dict[str, tuple[float, ...]]:
    """Red, green, blue, alpha by name of the material."""
    materials = ((each.attrib.get("name", ""), _color(each)) for each in tree.iter("material"))
    return {name: color for name, color in materials if color is not None}


def _color(material: ET.Element) -> tuple[float, ...] | None:
    """Red, green, blue, alpha; None if the material only names another one."""
    color = material.find("color")
    return None if color is None else tuple(float(v) for v in color.attrib["rgba"].split())


def read_shapes(
    link: ET.Element, tag: str, placement: pin.SE3, colors: dict[str, tuple[float, ...]]
) -> list[Shape]:
    """Read the primitives of a link; meshes are left out.

    Args:
        link: Element of the URDF.
        tag: `collision` or `visual`.
        placement: Of the link in the frame in which the shapes are wanted.
        colors: By name of the material.
    """
    shapes = []
    for element in link.findall(tag):
        geometry = element.find("geometry")
        primitive = None if geometry is None or not len(geometry) else geometry[0]
        if primitive is None:
            continue
        if primitive.tag == "box":
            size = tuple(float(v) for v in primitive.attrib["size"].split())
        elif primitive.tag == "sphere":
            size = (float(primitive.attrib["radius"]),)
        elif primitive.tag == "cylinder":
            size = (float(primitive.attrib["radius"]), float(primitive.attrib["length"]))
        else:
            continue
        origin = element.find("origin")
        attributes = {} if origin is None else origin.attrib
        xyz, rpy = (
            np.array([float(v) for v in attributes.get(key, "0 0 0").split()])
            for key in ("xyz", "rpy")
        )
        pose = placement * pin.SE3(pin.rpy.rpyToMatrix(rpy), xyz)
        color, material = None, element.find("material")
        if material is not None:
            color = _color(material) or colors.get(material.attrib.get("name", ""))
        shape = Shape(primitive.tag, size, pose.translation.copy(), pose.rotation.copy())
        shapes.append(shape if color is None else dataclasses.replace(shape, color=color))
    return shapes


def half_height(shape: Shape, up: FloatArray) -> float:
    """[m] from the centre of a shape to its lowest point; `up` (3,) is in the axes of the shape."""
    if shape.kind == "sphere":
        return shape.size[0]
    if shape.kind == "box":
        return float(np.abs(up) @ np.array(shape.size)) / 2.0
    radius, length = shape.size
    return radius * math.hypot(up[0], up[1]) + length / 2.0 * abs(float(up[2]))
