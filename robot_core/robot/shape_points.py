"""The lowest points of a URDF's collision shapes: of primitives, and of meshes that are found."""

import math
import os
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.robot.mjcf import LARGEST_MESH
from robot_core.schema import read_bytes
from robot_core.types import FloatArray

FLAT = 0.004
"""[m] Points up to this far above the lowest one belong to the sole."""
ROUND = 12
"""Points of a circle."""


def lowest_points(
    element: ET.Element, placement: Mapping[str, Any], path: Path
) -> FloatArray:
    """(n, 3) [m] points that touch the ground.

    Args:
        element: The URDF.
        placement: Pose (an SE3) of each link whose shapes count; in that frame z is up.
        path: Its file, near which its meshes are.

    Raises:
        NaoGaitError: All shapes are meshes and one is not found, or a mesh cannot be read.
    """
    links = [link for link in element.findall("link") if link.get("name") in placement]
    points, lost = [], ""
    for link in links:
        place = placement[link.get("name", "")]
        for collision in link.findall("collision"):
            corners = _corners(collision, path)
            if isinstance(corners, str):
                lost = corners
            else:
                points.append(corners @ place.rotation.T + place.translation)
    if not points:
        if lost:
            allowed = "a path from the URDF, or package:// of a folder above it or of a sourced ROS"
            raise NaoGaitError(f"mesh {lost} of {path}", "not found", allowed)
        return np.zeros((0, 3))
    found = np.concatenate(points)
    return np.asarray(found[found[:, 2] < found[:, 2].min() + FLAT])


def _corners(collision: ET.Element, path: Path) -> FloatArray | str:
    """(n, 3) [m] corners of one shape in the frame of its link; the name of a mesh not found."""
    import pinocchio as pin

    geometry = collision.find("geometry")
    shape = None if geometry is None or not len(geometry) else geometry[0]
    if shape is None:
        return np.zeros((0, 3))
    origin = collision.find("origin")
    xyz, rpy = (
        np.zeros(3) if origin is None else _numbers(origin, key, "0 0 0") for key in ("xyz", "rpy")
    )
    points = np.zeros((0, 3))
    if shape.tag == "box":
        signs = np.array(list(np.ndindex(2, 2, 2)))
        points = (signs - 0.5) * _numbers(shape, "size", "0 0 0")
    elif shape.tag == "cylinder":
        radius, length = float(shape.get("radius", 0)), float(shape.get("length", 0))
        angles = np.arange(ROUND) * math.tau / ROUND
        rim = radius * np.cos(angles), radius * np.sin(angles)
        points = np.concatenate(
            [np.stack((*rim, np.full(ROUND, end * length)), axis=1) for end in (-0.5, 0.5)]
        )
    elif shape.tag == "sphere":
        return (xyz - (0.0, 0.0, float(shape.get("radius", 0))))[None]
    elif shape.tag == "mesh":
        name = shape.get("filename", "")
        file = _mesh_file(name, path)
        if file is None:
            return name
        points = _vertices(file, _numbers(shape, "scale", "1 1 1"))
    return np.asarray(points @ pin.rpy.rpyToMatrix(rpy).T + xyz)


def _numbers(element: ET.Element, key: str, default: str) -> FloatArray:
    return np.array([float(word) for word in element.get(key, default).split()])


def _mesh_file(name: str, path: Path) -> Path | None:
    """The file of a mesh that a URDF names; None if there is none."""
    scheme, _, rest = name.rpartition("://")
    if scheme == "package":
        prefixes = [Path(each) / "share" for each in _prefixes()]
        folders = [*path.resolve().parents, *prefixes]
    else:
        folders = [path.resolve().parent]
    return next((file for folder in folders if (file := folder / rest).is_file()), None)


def _prefixes() -> list[str]:
    return [each for each in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if each]


def _vertices(file: Path, scale: FloatArray) -> FloatArray:
    """(n, 3) [m] vertices of a mesh."""
    import coal  # comes with Pinocchio

    read_bytes(file, "mesh", LARGEST_MESH)
    try:
        mesh = coal.MeshLoader().load(str(file), scale)
    except (ValueError, RuntimeError) as error:
        raise NaoGaitError(f"mesh {file}", str(error), "STL, DAE or OBJ") from error
    return np.array(mesh.vertices())
