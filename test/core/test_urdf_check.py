"""What makes a URDF unusable is found at load, for both engines alike, and named."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from sim_bridge.plant import Plant
from sim_bridge.world import World
from urdf_edits import Xml, edited_urdf, joint


def of_link(name: str, path: str, key: str, value: str) -> Xml:
    """Set an attribute of an element of a link."""

    def edit(root: ET.Element) -> None:
        element = root.find(f"link[@name='{name}']/{path}")
        assert element is not None
        element.set(key, value)

    return edit


def of_joint(name: str, path: str, key: str, value: str) -> Xml:
    """Set an attribute of an element of a joint."""

    def edit(root: ET.Element) -> None:
        element = joint(root, name).find(path)
        assert element is not None
        element.set(key, value)

    return edit


def scaled(path: str, keys: tuple[str, ...], factor: float) -> Xml:
    """Multiply numbers everywhere, as another unit does."""

    def edit(root: ET.Element) -> None:
        for element in root.iterfind(path):
            for key in keys:
                if key in element.attrib:
                    words = (repr(factor * float(word)) for word in element.get(key, "").split())
                    element.set(key, " ".join(words))

    return edit


def without_inertial(name: str) -> Xml:
    """Remove the inertial of a link."""

    def edit(root: ET.Element) -> None:
        (link,) = root.findall(f"link[@name='{name}']")
        for element in link.findall("inertial"):
            link.remove(element)

    return edit


def add(text: str) -> Xml:
    """Append an element."""
    return lambda root: root.append(ET.fromstring(text))


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (without_inertial("LTibia"), ("joint LKneePitch moves", "mass", "more than 0 kg")),
        (of_link("LTibia", "inertial/mass", "value", "0"), ("LKneePitch moves", "mass")),
        (of_link("LTibia", "inertial/mass", "value", "-0.3"), ("link LTibia", "-0.3", "0 kg")),
        (of_link("LTibia", "inertial/mass", "value", "nan"), ("link LTibia", "nan", "finite")),
        (of_link("LTibia", "inertial/inertia", "ixx", "-1"), ("link LTibia", "moments over 0")),
        (of_link("LTibia", "inertial/inertia", "ixx", "1e-4,"), ("link LTibia", "1e-4,", "finite")),
        (of_joint("LKneePitch", "axis", "xyz", "0 0 0"), ("LKneePitch", "axis", "a direction")),
        (of_joint("LKneePitch", "axis", "xyz", "0 1"), ("LKneePitch", "axis", "3 finite numbers")),
        (of_joint("LKneePitch", "origin", "xyz", "0, 0, -0.1"), ("LKneePitch", "spaces")),
        (of_joint("HeadYaw", "child", "link", "nose"), ("HeadYaw", "child", "'nose'")),
        (lambda root: joint(root, "HeadYaw").set("type", "hinge"), ("HeadYaw",)),
        (of_link("LTibia", "visual/origin", "xyz", "0 [] 0"), ("LTibia", "visual: origin xyz")),
        (of_link("LTibia", "visual/geometry/*", "radius", "nan"), ("LTibia", "visual radius")),
        (lambda root: root.find("link/visual/geometry").insert(0, ET.Element("origin")),
         ("visual geometry", "'origin'", "box, cylinder")),
        (add("<link name='stand'/>"), ("roots", "stand", "one root link")),
        (add("<link name='LTibia'/>"), ("link LTibia", "listed twice")),
        (add("<joint name='x' type='fixed'><parent link='torso'/><child link='Head'/></joint>"),
         ("link Head", "moved by two joints")),
        (add("<joint name='${side}' type='fixed'/>"), ("xacro", "run `xacro")),
        (scaled("link/inertial/mass", ("value",), 1e3), ("mass of the robot", "in grams?")),
        (scaled("joint/origin", ("xyz",), 1e3), ("distance from torso", "in millimetres?")),
    ],
)  # fmt: skip
def test_a_urdf_that_an_engine_would_misread_is_refused(
    tmp_path: Path, edit: Xml, said: tuple[str, ...]
) -> None:
    path = edited_urdf(tmp_path, edit)
    with pytest.raises(NaoGaitError) as refused:
        load_robot(path)
    for words in (*said, str(path), "; allowed: "):
        assert words in str(refused.value)


def test_a_loop_of_links_is_refused(tmp_path: Path) -> None:
    ring = "".join(
        f"<link name='{a}'/><joint name='{a}{b}' type='fixed'><parent link='{a}'/>"
        f"<child link='{b}'/></joint>"
        for a, b in (("one", "two"), ("two", "three"), ("three", "one"))
    )

    def edit(root: ET.Element) -> None:
        root.extend(ET.fromstring(f"<robot>{ring}</robot>"))

    with pytest.raises(NaoGaitError, match="part of a loop"):
        load_robot(edited_urdf(tmp_path, edit))


@pytest.fixture
def hip_of_no_body(tmp_path: Path) -> Path:
    """A NAO whose hip has a moment of inertia that exceeds the sum of the others."""
    moments = {"ixx": "9e-5", "iyy": "1e-5", "izz": "1e-5", "ixy": "0", "ixz": "0", "iyz": "0"}

    def edit(root: ET.Element) -> None:
        for key, value in moments.items():
            of_link("LPelvis", "inertial/inertia", key, value)(root)

    return edited_urdf(tmp_path, edit)


def test_an_inertia_that_no_body_has_is_raised_as_little_as_needed(hip_of_no_body: Path) -> None:
    robot = load_robot(hip_of_no_body)
    (remark,) = robot.remarks
    assert "link LPelvis" in remark
    element = ET.fromstring(robot.urdf).find("link[@name='LPelvis']/inertial/inertia")
    assert element is not None
    moments = np.array([float(element.get(key, "")) for key in ("ixx", "iyy", "izz")])
    assert moments[0] == pytest.approx(9e-5)
    assert 0.0 <= moments[1] + moments[2] - moments[0] < 1e-6
    assert moments[1] == pytest.approx(moments[2])


def test_a_mended_robot_stands_in_each_engine(
    hip_of_no_body: Path, engine: str, reference: Plant
) -> None:
    with World.single(load_robot(hip_of_no_body), reference, engine=engine) as world:
        for _ in range(50):
            world.robot.command(None)
            world.step()
        assert world.robot.truth().torso_position[2] > 0.25


def test_the_shipped_robots_need_no_mending() -> None:
    for name in ("nao_h21_v33", "nao_h21_v40", "nao_v6", "bruno"):
        assert load_robot(name).remarks == ()
