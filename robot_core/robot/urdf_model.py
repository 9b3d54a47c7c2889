"""Links, joints and joint limits of a URDF."""

import dataclasses
import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from robot_core.errors import NaoGaitError
from robot_core.robot.description import JointLimit, LegJoints

LARGEST_URDF = 2 * 1024 * 1024
"""[bytes] of a URDF."""
MOST_TAGS, DEEPEST, MOST_LINKS = 40_000, 32, 1_000
"""Tags of a URDF, levels of its elements, and its links and joints of each."""


def limited_xml(text: str, where: str) -> ET.Element:
    """The root of an XML text that is not too large, checked before it is parsed.

    Raises:
        NaoGaitError: It is no XML, has a document type, or is beyond one of the limits.
    """
    if "<!DOCTYPE" in text or "<!ENTITY" in text:  # entities could fill the memory
        raise NaoGaitError(where, "a document type declaration", "plain XML without one")
    size, tags = len(text), text.count("<")
    if size > LARGEST_URDF or tags > MOST_TAGS:
        allowed = f"at most {LARGEST_URDF} characters and {MOST_TAGS} tags"
        raise NaoGaitError(where, f"{size} characters with {tags} tags", allowed)
    try:
        root = ET.fromstring(text)
    except (ET.ParseError, ValueError) as error:
        raise NaoGaitError(where, str(error), "well-formed XML") from error
    _check_extent(root, where)
    return root


def driven_model(root: ET.Element, driven: Iterable[str], path: Path) -> Any:
    """The URDF as a Pinocchio model with a free base; joints that are not driven become fixed.

    In the URDF itself, because Pinocchio's reduced models fail if a link and a joint share a name.

    Raises:
        NaoGaitError: Pinocchio cannot read it.
    """
    import pinocchio as pin  # here: a command line that only names a robot stays quick

    keep = set(driven)
    for joint in root.findall("joint"):
        if joint.get("name") not in keep:
            joint.set("type", "fixed")
    try:
        text = ET.tostring(root, encoding="unicode")
        return pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
    except (ValueError, RuntimeError) as error:
        raise NaoGaitError(f"URDF {path}", str(error), "a URDF that Pinocchio can read") from error


class UrdfModel:
    """Links and joints of one URDF; a missing or invalid one is refused by name.

    Attributes:
        name: Name of the robot in the URDF; empty if it has none.
    """

    def __init__(
        self, path: Path, name: str, links: set[str], joints: dict[str, ET.Element]
    ) -> None:
        self._path = path
        self.name = name
        self._links = links
        self._joints = joints

    @classmethod
    def parse(cls, text: str, path: Path) -> "UrdfModel":
        """Parse the text of a URDF; `path` is for error messages.

        Raises:
            NaoGaitError: It is no XML, no robot, or has a joint twice.
        """
        where = f"URDF {path}"
        root = limited_xml(text, where)
        if root.tag != "robot":
            raise NaoGaitError(where, f"<{root.tag}>", "a <robot> element")
        links = {link.get("name", "") for link in root.findall("link")}
        joints: dict[str, ET.Element] = {}
        for joint in root.findall("joint"):
            name = joint.get("name", "")
            if name in joints:
                raise NaoGaitError(f"joint {name} in {path}", "listed twice", "one joint per name")
            joints[name] = joint
        return cls(path, root.get("name", ""), links, joints)

    def frame(self, names: tuple[str, ...]) -> str:
        """The first of these links that the URDF has.

        Raises:
            NaoGaitError: It has none of them.
        """
        name = self.first_of(names)
        if name is None:
            raise NaoGaitError(f"link {' or '.join(names)} in {self._path}", "missing", "a link")
        return name

    def first_of(self, names: tuple[str, ...]) -> str | None:
        """The first of these links that the URDF has; None if it has none of them."""
        return next((name for name in names if name in self._links), None)

    def has_joint(self, name: str) -> bool:
        """True if the URDF has this joint."""
        return name in self._joints

    def child(self, joint: str) -> str:
        """The link that a joint moves."""
        link = self._joints[joint].find("child")
        return "" if link is None else link.attrib.get("link", "")

    def limit(self, name: str) -> JointLimit:
        """The limits of a revolute joint.

        Raises:
            NaoGaitError: There is no such joint, or its limits are not usable.
        """
        where = f"joint {name} in {self._path}"
        allowed = (
            "a revolute joint with finite limits, lower < upper, velocity and effort over 0; or "
            "`joints` in the robot file without it, if it cannot be driven"
        )
        joint = self._joints.get(name)
        if joint is None:
            raise NaoGaitError(where, "missing", allowed)
        if joint.get("type") != "revolute":
            raise NaoGaitError(where, f"type {joint.get('type')}", allowed)
        element = joint.find("limit")
        if element is None:
            raise NaoGaitError(where, "no <limit>", allowed)
        try:
            limit = JointLimit(
                # In a URDF a missing bound is 0; velocity and effort are required.
                lower=float(element.get("lower", "0")),
                upper=float(element.get("upper", "0")),
                velocity=float(element.get("velocity", "")),
                effort=float(element.get("effort", "")),
            )
        except ValueError as error:
            raise NaoGaitError(where, dict(element.attrib), allowed) from error
        finite = all(math.isfinite(value) for value in dataclasses.astuple(limit))
        if not (finite and limit.lower < limit.upper and limit.velocity > 0.0 < limit.effort):
            raise NaoGaitError(where, dict(element.attrib), allowed)
        return limit

    def check_leg(
        self, torso: str, sole: str, leg: LegJoints, driven: tuple[str, ...]
    ) -> None:
        """Refuse a leg that is not the last six moving joints from the torso to the sole.

        Driven joints above them, such as a waist, are held. A leg joint that could turn more than
        once has its limits in degrees.
        """
        for name in leg.names:
            limit = self.limit(name)
            if max(-limit.lower, limit.upper) > math.tau:
                raise NaoGaitError(
                    f"joint {name} in {self._path}", [limit.lower, limit.upper],
                    "limits from -6.28 to 6.28 rad (are they in degrees?)",
                )  # fmt: skip
        above: dict[str, tuple[str, str]] = {}
        for name, joint in self._joints.items():
            parent, child = joint.find("parent"), joint.find("child")
            if parent is not None and child is not None:
                above[child.get("link", "")] = (name, parent.get("link", ""))
        chain: list[str] = []
        link = sole
        while link in above and link != torso and len(chain) <= len(self._joints):
            name, link = above[link]
            if self._joints[name].get("type") != "fixed":
                chain.insert(0, name)
        held = chain[: -len(leg.names)]
        parts = [set(chain[-6:-3]), set(chain[-3:-2]), set(chain[-2:])]
        wanted = [set(leg.hip), {leg.knee_pitch}, set(leg.ankle)]
        if link != torso or parts != wanted or not set(held) <= set(driven):
            raise NaoGaitError(
                f"joints from {torso} to {sole} in {self._path}",
                ", ".join(chain) or "none",
                f"six: hip ({', '.join(leg.hip)}), knee ({leg.knee_pitch}), ankle "
                f"({', '.join(leg.ankle)}); joints above them must be among the robot's joints",
            )


def _check_extent(root: ET.Element, where: str) -> None:
    level = [root]
    for _ in range(DEEPEST):
        level = [below for each in level for below in each]
    if level:
        raise NaoGaitError(where, f"more than {DEEPEST} levels", f"at most {DEEPEST}")
    for tag in ("link", "joint"):
        count = len(root.findall(tag))
        if count > MOST_LINKS:
            raise NaoGaitError(where, f"{count} <{tag}>", f"at most {MOST_LINKS}")
