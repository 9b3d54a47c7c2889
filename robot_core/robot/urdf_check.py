"""One check of a whole URDF for both engines: tree, numbers, masses, inertias, size."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.robot.urdf_model import driven_model

JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
AXIS_TYPES = ("revolute", "continuous", "prismatic", "planar")
SHAPES = {
    "box": {"size": 3}, "cylinder": {"radius": 1, "length": 1}, "sphere": {"radius": 1},
    "capsule": {"radius": 1, "length": 1}, "mesh": {"scale": 3},
}  # fmt: skip
"""How many numbers the attributes of a shape have; a mesh may be without."""
MASS_RANGE = (0.3, 300.0)
"""[kg] of the whole robot; a mass in grams is outside."""
REACH_RANGE = (0.03, 3.0)
"""[m] from the torso to a sole with all joints at zero; a length in millimetres is outside."""
ROUNDING = 1e-3
"""Share by which the largest principal moment may exceed the sum of the others: rounded files."""


def checked_urdf(
    text: str, path: Path, joints: Iterable[str], torso: str, soles: tuple[str, str]
) -> tuple[str, tuple[str, ...]]:
    """Refuse masses and sizes that no robot has, and balance inertias that no body can have.

    `check_description` has passed.

    Args:
        text: The URDF, which is well-formed XML of a <robot>.
        path: Its file, for error messages.
        joints: Joints that are driven; all others count as fixed.
        torso: Link of the torso.
        soles: Links of the left and the right sole.

    Returns:
        The URDF, and one remark for each inertia that was changed.

    Raises:
        NaoGaitError: Names the link or joint, what it has and what is allowed.
    """
    root = ET.fromstring(text)
    remarks = [
        remark for link in root.findall("link") if (remark := _balanced(link, path)) is not None
    ]
    text = ET.tostring(root, encoding="unicode") if remarks else text
    _check_bodies(root, path, set(joints), torso, soles)
    return text, tuple(remarks)


def check_description(root: ET.Element, path: Path) -> None:
    """Refuse a URDF that an engine would misread, before anything is derived from it.

    `check_names` has passed.

    Raises:
        NaoGaitError: Names the link or joint, what it has and what is allowed.
    """
    _check_tree(root, path)
    for joint in root.findall("joint"):
        _check_joint(joint, path)
    mass = 0.0
    for link in root.findall("link"):
        _check_shapes(link, path)
        mass += _mass(link, path)
    if mass == 0.0:
        raise NaoGaitError(f"mass of the robot in {path}", mass, "links with masses (<inertial>)")


def _mass(link: ET.Element, path: Path) -> float:
    """[kg] of a link, 0 without an inertial; NaoGaitError if it is none, not finite or negative."""
    inertial = link.find("inertial")
    if inertial is None:
        return 0.0
    where = f"link {link.get('name')} in {path}: mass"
    mass = inertial.find("mass")
    if mass is None:
        raise NaoGaitError(where, "missing", "a <mass value=...> in its <inertial>")
    (value,) = _numbers(mass, "value", 1, where)
    if value < 0.0:
        raise NaoGaitError(where, float(value), "0 kg or more")
    return float(value)


def check_names(root: ET.Element, path: Path) -> None:
    """Refuse a xacro file, and links without a name or with that of another; NaoGaitError."""
    for element in root.iter():
        if "xacro" in str(element.tag) or any("${" in value for value in element.attrib.values()):
            allowed = "a URDF: run `xacro FILE > robot.urdf` first"
            raise NaoGaitError(f"URDF {path}", "xacro", allowed)
    names = [link.get("name", "") for link in root.findall("link")]
    for name in names:
        if not name:
            raise NaoGaitError(f"URDF {path}", "a link without a name", "links with names")
        if names.count(name) > 1:
            raise NaoGaitError(f"link {name} in {path}", "listed twice", "one link per name")


def _check_tree(root: ET.Element, path: Path) -> None:
    links = {link.get("name", "") for link in root.findall("link")}
    above: dict[str, str] = {}
    for joint in root.findall("joint"):
        where = f"joint {joint.get('name')} in {path}"
        ends = []
        for end in ("parent", "child"):
            element = joint.find(end)
            name = "" if element is None else element.get("link", "")
            if name not in links:
                raise NaoGaitError(f"{where}: {end}", name or "missing", "a link of this URDF")
            ends.append(name)
        parent, child = ends
        if child in above:
            raise NaoGaitError(f"link {child} in {path}", "moved by two joints", "one joint")
        above[child] = parent
    roots = sorted(links - above.keys())
    for link in sorted(links):
        seen, name = {link}, link
        while name in above:
            name = above[name]
            if name in seen:
                raise NaoGaitError(f"link {link} in {path}", "part of a loop", "a tree of links")
            seen.add(name)
    if len(roots) != 1:
        raise NaoGaitError(f"URDF {path}", f"roots {', '.join(roots)}", "one root link")


def _check_joint(joint: ET.Element, path: Path) -> None:
    where, kind = f"joint {joint.get('name')} in {path}", joint.get("type", "")
    if kind not in JOINT_TYPES:
        raise NaoGaitError(f"{where}: type", kind, JOINT_TYPES)
    _read_origin(joint, where)
    axis = joint.find("axis")
    if axis is not None and kind in AXIS_TYPES:
        direction = _numbers(axis, "xyz", 3, f"{where}: axis")
        if np.linalg.norm(direction) < 1e-6:
            raise NaoGaitError(f"{where}: axis", axis.get("xyz"), "a direction, not 0 0 0")


def _check_shapes(link: ET.Element, path: Path) -> None:
    for shape in (*link.findall("visual"), *link.findall("collision")):
        where = f"link {link.get('name')} in {path}: {shape.tag}"
        _read_origin(shape, where)
        geometry = shape.find("geometry")
        first = None if geometry is None else next(iter(geometry), None)
        if first is None or first.tag not in SHAPES:
            found = None if first is None else first.tag
            raise NaoGaitError(f"{where} geometry", found, SHAPES)
        for key, count in SHAPES[first.tag].items():
            if first.tag != "mesh" or key in first.attrib:
                _numbers(first, key, count, f"{where} {key}")


def _read_origin(element: ET.Element, where: str) -> None:
    origin = element.find("origin")
    if origin is not None:
        for key in ("xyz", "rpy"):
            if key in origin.attrib:
                _numbers(origin, key, 3, f"{where}: origin {key}")


def _numbers(element: ET.Element, key: str, count: int, where: str) -> np.ndarray:
    """(count,) finite numbers of an attribute, separated by spaces."""
    text = element.get(key, "")
    allowed = f"{count} finite number{'s' if count > 1 else ''}, separated by spaces"
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError as error:
        raise NaoGaitError(where, text, allowed) from error
    if values.shape != (count,) or not np.isfinite(values).all():
        raise NaoGaitError(where, text, allowed)
    return values


def _balanced(link: ET.Element, path: Path) -> str | None:
    """Check an inertial; a moment that exceeds the sum of the others raises these, and is said."""
    where = f"link {link.get('name')} in {path}"
    inertial = link.find("inertial")
    if inertial is None:
        return None
    _read_origin(inertial, where)
    element = inertial.find("inertia")
    if element is None:
        if _mass(link, path) == 0.0:
            return None
        raise NaoGaitError(f"{where}: inertia", "missing", "an <inertia> in its <inertial>")
    xx, yy, zz, xy, xz, yz = (
        _numbers(element, key, 1, f"{where}: {key}")[0] if key in element.attrib else 0.0
        for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    )
    moments, axes = np.linalg.eigh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    small, middle, large = moments.tolist()
    if small < -ROUNDING * large or large < 0.0:
        raise NaoGaitError(f"{where}: inertia", dict(element.attrib), "principal moments over 0")
    excess = large - small - middle
    if excess <= ROUNDING * large:
        return None
    moments[:2] += 0.5 * excess * (1.0 + ROUNDING)
    matrix = axes @ np.diag(moments) @ axes.T
    for key, (row, column) in {
        "ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2), "iyz": (1, 2),
    }.items():  # fmt: skip
        element.set(key, repr(float(matrix[row, column])))
    return (
        f"{where}: its largest principal moment of inertia exceeds the sum of the others "
        f"by {100.0 * excess / large:.0f} %, which no body has; the others are raised"
    )


def _check_bodies(
    root: ET.Element, path: Path, joints: set[str], torso: str, soles: tuple[str, str]
) -> None:
    """Masses of what moves, and the size of the robot, with all other joints fixed."""
    import pinocchio as pin

    model = driven_model(root, joints, path)
    for name, inertia in list(zip(model.names, model.inertias, strict=True))[1:]:
        moved = "the torso" if name == "root_joint" else f"what joint {name} moves"
        where = f"{moved} in {path}"
        if not (math.isfinite(inertia.mass) and inertia.mass > 0.0):
            raise NaoGaitError(f"{where}: mass", float(inertia.mass), "more than 0 kg")
        if np.linalg.eigvalsh(inertia.inertia).min() <= 0.0:
            raise NaoGaitError(f"{where}: inertia", 0.0, "moments over 0 about each axis")
    mass = sum(inertia.mass for inertia in model.inertias)
    low, high = MASS_RANGE
    if not low <= mass <= high:
        unit = " (are the masses in grams?)" if mass > high else ""
        allowed = f"{low:g} to {high:g} kg in all{unit}"
        raise NaoGaitError(f"mass of the robot in {path}", float(mass), allowed)
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    place = {
        name: data.oMf[model.getFrameId(name, pin.FrameType.BODY)].translation
        for name in (torso, *soles)
    }
    low, high = REACH_RANGE
    for sole in soles:
        reach = float(np.linalg.norm(place[sole] - place[torso]))
        if not low <= reach <= high:
            unit = " (are the lengths in millimetres?)" if reach > high else ""
            allowed = f"{low:g} to {high:g} m{unit}"
            raise NaoGaitError(f"distance from {torso} to {sole} in {path}", reach, allowed)
