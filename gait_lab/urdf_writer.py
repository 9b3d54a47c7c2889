"""The URDF of each robot, from its table of facts; `nao_gait write urdf` writes the files."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.resources import share

MODELS: dict[str, tuple[str, str]] = {
    "nao_h21_v33": ("nao_h21_facts.yaml", "v33"),
    "nao_h21_v40": ("nao_h21_facts.yaml", "v40"),
    "nao_v6": ("nao_h21_facts.yaml", "v6"),
    "bruno": ("bruno_facts.yaml", ""),
    "booster_k1": ("booster_k1_facts.yaml", ""),
    "booster_t1": ("booster_t1_facts.yaml", ""),
    "op3": ("op3_facts.yaml", ""),
}
"""URDF -> its table of facts and the variant in it."""
_ALONG = {"x": (0.0, math.pi / 2, 0.0), "y": (-math.pi / 2, 0.0, 0.0), "z": (0.0, 0.0, 0.0)}

Vector = Sequence[float]
Facts = Mapping[str, Any]


def load_facts(path: Path) -> Facts:
    """A table of facts; NaoGaitError if the file holds none."""
    facts = schema.read_yaml(path, "facts")
    if not isinstance(facts, dict):
        raise NaoGaitError(f"facts {path}", type(facts).__name__, "a mapping")
    return facts


def _number(value: float) -> str:
    return repr(float(value) + 0.0)  # + 0.0 turns -0.0 into 0.0


def _numbers(values: Vector) -> str:
    return " ".join(_number(value) for value in values)


def _right(name: str) -> str:
    """The name of the right counterpart of a left part; other names stay."""
    if name.startswith("l_"):
        return "r_" + name[2:]
    if "Left" in name:
        return name.replace("Left", "Right")
    return "R" + name[1:] if name.startswith("L") else name


def _sided(name: str) -> bool:
    return _right(name) != name


def _origin(parent: ET.Element, xyz: Vector, rpy: Vector) -> None:
    ET.SubElement(parent, "origin", xyz=_numbers(xyz), rpy=_numbers(rpy))


def _inertial(link: ET.Element, mass: float, com: Vector, inertia: Vector) -> None:
    element = ET.SubElement(link, "inertial")
    _origin(element, com, (0.0, 0.0, 0.0))
    ET.SubElement(element, "mass", value=_number(mass))
    order = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    tensor = dict(zip(order, map(_number, inertia), strict=True))
    ET.SubElement(element, "inertia", tensor)


def _shape(link: ET.Element, tag: str, shape: Facts, mirror: bool) -> None:
    element = ET.SubElement(link, tag)
    x, y, z = shape["at"]
    along = shape.get("along", "z")
    roll, pitch, yaw = _ALONG[along] if isinstance(along, str) else along
    if mirror:
        # This reverses the axis of a cylinder along y, which is the same cylinder.
        y = -y
        if not isinstance(along, str):
            roll, yaw = -roll, -yaw
    _origin(element, (x, y, z), (roll, pitch, yaw))
    geometry = ET.SubElement(element, "geometry")
    if "box" in shape:
        ET.SubElement(geometry, "box", size=_numbers(shape["box"]))
    elif "cylinder" in shape:
        radius, length = map(_number, shape["cylinder"])
        ET.SubElement(geometry, "cylinder", radius=radius, length=length)
    else:
        ET.SubElement(geometry, "sphere", radius=_number(shape["sphere"]))
    if tag == "visual":
        ET.SubElement(element, "material", name=shape["colour"])


def _shapes(link: ET.Element, facts: Facts, name: str, mirror: bool) -> None:
    for tag, group in (("visual", "visuals"), ("collision", "collisions")):
        for shape in facts[group].get(name, ()):
            _shape(link, tag, shape, mirror)


def _of_block(mass: float, size: Vector) -> tuple[float, ...]:
    """Ixx iyy izz ixy ixz iyz of a solid block about its centre."""
    x, y, z = (mass * edge * edge / 12.0 for edge in size)
    return y + z, x + z, x + y, 0.0, 0.0, 0.0


def _link(facts: Facts, variant: str, name: str, mirror: bool) -> ET.Element:
    link = ET.Element("link", name=_right(name) if mirror else name)
    row = facts["links"][name]
    body = row.get(variant, row)
    x, y, z = body["com"]
    ixx, iyy, izz, ixy, ixz, iyz = (
        body["inertia"] if "inertia" in body else _of_block(body["mass"], body["box"])
    )
    if mirror:
        y, ixy, iyz = -y, -ixy, -iyz
    _inertial(link, body["mass"], (x, y, z), (ixx, iyy, izz, ixy, ixz, iyz))
    _shapes(link, facts, name, mirror)
    return link


def _joint(facts: Facts, name: str, mirror: bool) -> ET.Element:
    row = facts["joints"][name]
    x, y, z = row["origin"]
    length = math.hypot(*row["axis"])
    axis = [component / length for component in row["axis"]]
    lower, upper = row["limits"]
    parent, child = row["parent"], row["child"]
    if mirror:
        y = -y
        parent, child = _right(parent), _right(child)
        # The manufacturer's signs. The mirror image of an axis, an axial vector, keeps the range;
        # the opposite of that image does the same with a mirrored range. Roll and yaw joints have
        # the opposite, which is the axis of the left side, and the pitch joints of some robots too.
        if axis[1] == 0.0 or facts.get("opposite_pitch_axes", False):
            axis = [axis[0], -axis[1], axis[2]]
            lower, upper = -upper, -lower
        else:
            axis = [-axis[0], axis[1], -axis[2]]
        lower, upper = row.get("right_limits", (lower, upper))
    joint = ET.Element("joint", name=_right(name) if mirror else name, type="revolute")
    _origin(joint, (x, y, z), (0.0, 0.0, 0.0))
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    ET.SubElement(joint, "axis", xyz=_numbers(axis))
    ET.SubElement(
        joint,
        "limit",
        lower=_number(lower),
        upper=_number(upper),
        velocity=_number(row["velocity"]),
        effort=_number(row["effort"]),
    )
    return joint


def _frame(facts: Facts, name: str, row: Facts) -> Iterator[ET.Element]:
    link = ET.Element("link", name=name)
    # An explicit zero: PyBullet gives a link without <inertial> a mass of 1 kg.
    _inertial(link, 0.0, (0.0, 0.0, 0.0), (0.0,) * 6)
    _shapes(link, facts, name, mirror=False)
    yield link
    joint = ET.Element("joint", name=f"{name}_fixed", type="fixed")
    _origin(joint, row["xyz"], row["rpy"])
    ET.SubElement(joint, "parent", link=row["parent"])
    ET.SubElement(joint, "child", link=name)
    yield joint


def _elements(facts: Facts, variant: str) -> Iterator[ET.Element]:
    for colour, rgba in facts["colours"].items():
        material = ET.Element("material", name=colour)
        ET.SubElement(material, "color", rgba=_numbers(rgba))
        yield material
    frames = {name: row.get(variant, row) for name, row in facts["frames"].items()}
    for side in ("l", "r"):
        x, y, z = facts["sole"]
        sole = (x, y if side == "l" else -y, z)
        frames[f"{side}_sole"] = {"parent": f"{side}_ankle", "xyz": sole, "rpy": (0.0, 0.0, 0.0)}
    yield _link(facts, variant, "base_link", mirror=False)
    if "torso" in frames:  # otherwise a joint moves it
        yield from _frame(facts, "torso", frames.pop("torso"))
    for mirror in (False, True):
        for name, row in facts["joints"].items():
            if mirror and not _sided(name):
                continue
            yield _joint(facts, name, mirror)
            yield _link(facts, variant, row["child"], mirror)
    for name, row in frames.items():
        yield from _frame(facts, name, row)


def urdf_text(name: str) -> str:
    """The URDF of a model, as in `urdf_text("nao_h21_v33")`.

    Raises:
        NaoGaitError: There is no such model.
    """
    if name not in MODELS:
        raise NaoGaitError("model", name, MODELS)
    source, variant = MODELS[name]
    facts = load_facts(share("urdf", source))
    robot = ET.Element("robot", name=name)
    robot.append(ET.Comment(f" made by nao_gait write urdf from {source} "))
    robot.extend(_elements(facts, variant))
    ET.indent(robot, space=" ")
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"
