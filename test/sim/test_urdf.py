"""The URDF files of the NAO against numbers that come from elsewhere, and against its symmetry."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import yaml

from gait_lab import cli, urdf_writer
from robot_core.errors import NaoGaitError
from robot_core.resources import find
from robot_core.types import FloatArray

CHECKS = yaml.safe_load(
    (Path(__file__).parents[1] / "data" / "nao_h21_checks.yaml").read_text(encoding="utf-8")
)
CONFIGURATIONS = CHECKS["configurations"]
ROBOTS = ("nao_h21_v33", "nao_h21_v40", "nao_v6")
POSITION = 1e-6
"""[m] and [rad]: the check values have six decimals."""
CENTRE_OF_MASS = 1e-5
"""[m]."""
MIRROR = np.diag([1.0, -1.0, 1.0])
DEGREES = {
    "HeadYaw": (-119.5, 119.5),
    "HeadPitch": (-38.5, 29.5),
    "LShoulderPitch": (-119.5, 119.5),
    "LShoulderRoll": (-18.0, 76.0),
    "LElbowYaw": (-119.5, 119.5),
    "LElbowRoll": (-88.5, -2.0),
    "LHipYawPitch": (-65.62, 42.44),
    "LHipRoll": (-21.74, 45.29),
    "LHipPitch": (-88.0, 27.73),
    "LKneePitch": (-5.29, 121.04),
    "LAnklePitch": (-68.15, 52.86),
    "LAnkleRoll": (-22.79, 44.06),
    "RShoulderRoll": (-76.0, 18.0),
    "RElbowRoll": (2.0, 88.5),
    "RHipRoll": (-45.29, 21.74),
    "RAnklePitch": (-67.97, 53.40),
    "RAnkleRoll": (-44.06, 22.79),
}
"""The ranges as published."""


class Robot:
    """One URDF file, read by Pinocchio and as plain XML."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.path = find("urdf", name)
        self.model = pin.buildModelFromUrdf(str(self.path), pin.JointModelFreeFlyer())
        self.data = self.model.createData()
        root = ET.parse(self.path).getroot()
        self.links = {link.attrib["name"]: link for link in root.iter("link")}
        self.joints = {joint.attrib["name"]: joint for joint in root.iter("joint")}
        self.revolute = [n for n, j in self.joints.items() if j.attrib["type"] == "revolute"]

    def put(self, angles: Mapping[str, float]) -> None:
        """The torso at the origin of the world."""
        q = pin.neutral(self.model)
        for joint, angle in angles.items():
            q[self.model.joints[self.model.getJointId(joint)].idx_q] = angle
        pin.forwardKinematics(self.model, self.data, q)
        pin.updateFramePlacements(self.model, self.data)
        pin.ccrba(self.model, self.data, q, np.zeros(self.model.nv))
        assert self.frame("torso").isIdentity(1e-12)

    def frame(self, link: str) -> pin.SE3:
        return self.data.oMf[self.model.getFrameId(link, pin.FrameType.BODY)]

    @property
    def com(self) -> FloatArray:
        return np.array(self.data.com[0])

    def inertial(self, link: str) -> tuple[float, FloatArray, FloatArray]:
        """Mass, centre of mass, (3, 3) inertia about it."""
        element = self.links[link].find("inertial")
        assert element is not None
        mass, origin, tensor = (element.find(tag) for tag in ("mass", "origin", "inertia"))
        assert mass is not None
        assert origin is not None
        assert tensor is not None
        assert origin.attrib["rpy"] == "0.0 0.0 0.0"
        xx, yy, zz, xy, xz, yz = (
            float(tensor.attrib[key]) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        )
        com = np.array([float(value) for value in origin.attrib["xyz"].split()])
        return (
            float(mass.attrib["value"]),
            com,
            np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]),
        )


@pytest.fixture(scope="module", params=ROBOTS)
def robot(request: pytest.FixtureRequest) -> Robot:
    return Robot(request.param)


@pytest.fixture(params=CONFIGURATIONS)
def checks(request: pytest.FixtureRequest, robot: Robot) -> dict[str, Any]:
    """The check values of one configuration, with the robot put there."""
    robot.put(CONFIGURATIONS[request.param])
    return dict(CHECKS[robot.name][request.param])


def test_mass_and_joints(robot: Robot) -> None:
    assert pin.computeTotalMass(robot.model) == pytest.approx(
        CHECKS[robot.name]["total_mass"], abs=1e-6
    )
    assert len(robot.revolute) == CHECKS[robot.name]["joints"] == 22
    assert robot.model.nq == 7 + 22
    assert {joint.attrib["type"] for joint in robot.joints.values()} == {"revolute", "fixed"}


def test_link_frames(robot: Robot, checks: dict[str, Any]) -> None:
    links = [key for key in checks if key in robot.links]
    assert len(links) == 7
    for link in links:
        assert robot.frame(link).translation == pytest.approx(checks[link], abs=POSITION), link
    for sole in ("l_sole", "r_sole"):
        rpy = pin.rpy.matrixToRpy(robot.frame(sole).rotation)
        assert rpy == pytest.approx(checks[f"{sole}_rpy"], abs=POSITION), sole


def test_centre_of_mass(robot: Robot, checks: dict[str, Any]) -> None:
    assert robot.com == pytest.approx(checks["com_in_torso"], abs=CENTRE_OF_MASS)
    in_sole = robot.frame("l_sole").actInv(robot.com)
    assert in_sole == pytest.approx(checks["com_in_l_sole"], abs=CENTRE_OF_MASS)


def test_inertia_about_the_centre_of_mass(robot: Robot, checks: dict[str, Any]) -> None:
    found = np.array(robot.data.Ig.inertia)
    xx, yy, zz, xy, xz, yz = checks["inertia"]
    expected = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    assert np.abs(found - expected).max() < 6e-7  # half of the sixth decimal, and rounded facts


def test_pybullet_agrees_on_the_mass(robot: Robot) -> None:
    """PyBullet gives a link without inertia 1 kg, unless the file has the mass 0."""
    import pybullet as bullet

    client = bullet.connect(bullet.DIRECT)
    try:
        body = bullet.loadURDF(
            str(robot.path), flags=bullet.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client
        )
        joints = range(bullet.getNumJoints(body, physicsClientId=client))
        masses = [
            bullet.getDynamicsInfo(body, link, physicsClientId=client)[0] for link in (-1, *joints)
        ]
        kinds = [bullet.getJointInfo(body, joint, physicsClientId=client)[2] for joint in joints]
    finally:
        bullet.disconnect(physicsClientId=client)
    assert sum(masses) == pytest.approx(CHECKS[robot.name]["total_mass"], abs=1e-6)
    assert kinds.count(bullet.JOINT_REVOLUTE) == 22


def test_rep_120_links(robot: Robot) -> None:
    assert {"base_link", "torso", "l_ankle", "r_ankle", "l_sole", "r_sole", "gaze"} <= set(
        robot.links
    )
    children = {joint.find("child").attrib["link"] for joint in robot.joints.values()}  # type: ignore[union-attr]
    assert set(robot.links) - children == {"base_link"}, "one root"
    robot.put({})
    for side in ("l", "r"):
        ankle, sole = robot.frame(f"{side}_ankle"), robot.frame(f"{side}_sole")
        assert sole.translation - ankle.translation == pytest.approx([0.0, 0.0, -0.04519])
    gaze = robot.frame("gaze")
    assert gaze.translation[0] > 0.05
    assert gaze.translation[2] > 0.18
    assert gaze.rotation[0, 0] > 0.99, "x looks forward"


@pytest.mark.parametrize("joint", DEGREES)
def test_ranges(robot: Robot, joint: str) -> None:
    limit = robot.joints[joint].find("limit")
    assert limit is not None
    degrees = [math.degrees(float(limit.attrib[bound])) for bound in ("lower", "upper")]
    assert degrees == pytest.approx(DEGREES[joint], abs=0.01)


def _mirrored(name: str) -> str:
    return f"r_{name[2:]}" if name.startswith("l_") else f"R{name[1:]}"


def _left(names: list[str]) -> list[str]:
    return [name for name in names if name.startswith(("L", "l_"))]


def test_right_masses_mirror_the_left(robot: Robot) -> None:
    left = _left(list(robot.links))
    assert len(left) == 11  # 4 of the arm, 6 of the leg, 1 sole
    for link in left:
        mass, com, inertia = robot.inertial(link)
        other_mass, other_com, other_inertia = robot.inertial(_mirrored(link))
        assert other_mass == mass
        assert other_com == pytest.approx(MIRROR @ com)
        assert other_inertia == pytest.approx(MIRROR @ inertia @ MIRROR)


def test_right_kinematics_mirror_the_left(robot: Robot) -> None:
    random = np.random.default_rng(7)
    left = _left(robot.revolute)
    assert len(left) == 10
    angles = dict(zip(left, random.uniform(-0.7, 0.7, len(left)), strict=True))
    robot.put(
        angles
        | {
            # a pitch stays, roll and yaw turn round; the hip's common joint is the same on both
            _mirrored(joint): angle if joint.endswith("Pitch") else -angle
            for joint, angle in angles.items()
        }
    )
    for link in _left(list(robot.links)):
        one, other = robot.frame(link), robot.frame(_mirrored(link))
        assert other.translation == pytest.approx(MIRROR @ one.translation, abs=1e-12), link
        assert other.rotation == pytest.approx(MIRROR @ one.rotation @ MIRROR, abs=1e-12), link


def test_inertias_belong_to_real_bodies(robot: Robot) -> None:
    for link in robot.links:
        mass, _, inertia = robot.inertial(link)
        if mass == 0.0:
            assert not inertia.any(), link
            continue
        low, middle, high = np.linalg.eigvalsh(inertia)
        assert low > 0.0, link
        assert high <= low + middle, link


def test_only_primitive_shapes(robot: Robot) -> None:
    kinds = {
        shape.tag for link in robot.links.values() for outer in link.iter("geometry")
        for shape in outer
    }  # fmt: skip
    assert kinds == {"box", "cylinder", "sphere"}
    for link in ("torso", "Head", "l_ankle", "r_ankle"):
        assert robot.links[link].find("collision") is not None, link


def test_shapes_mirror(robot: Robot) -> None:
    def middles(link: str) -> list[FloatArray]:
        return [
            np.array([float(v) for v in origin.attrib["xyz"].split()])
            for tag in ("visual", "collision")
            for origin in robot.links[link].findall(f"{tag}/origin")
        ]

    for link in _left(list(robot.links)):
        for one, other in zip(middles(link), middles(_mirrored(link)), strict=True):
            assert other == pytest.approx(MIRROR @ one)


def test_files_are_up_to_date(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["write", "urdf", "--check"]) == 0, "run `make urdf`"
    assert capsys.readouterr().out == ""


def test_check_sees_an_edit_and_writing_repairs_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write = ["write", "urdf", "--folder", str(tmp_path)]
    paths = [tmp_path / f"{name}.urdf" for name in (*ROBOTS, "bruno")]
    assert cli.main([*write, "--check"]) == 1
    assert f"differs: {paths[0]}" in capsys.readouterr().out
    assert not any(path.exists() for path in paths), "checking must not write"
    assert cli.main(write) == 0
    assert cli.main([*write, "--check"]) == 0
    edited = paths[1].read_text().replace("0.16184", "0.16185")
    paths[1].write_text(edited)
    capsys.readouterr()
    assert cli.main([*write, "--check"]) == 1
    assert capsys.readouterr().out == f"differs: {paths[1]}\n"
    assert paths[1].read_text() == edited
    assert cli.main(write) == 0
    assert paths[1].read_text() == find("urdf", ROBOTS[1]).read_text()


def test_bad_facts_and_models_are_refused(tmp_path: Path) -> None:
    with pytest.raises(NaoGaitError, match="nao_h21_v50"):
        urdf_writer.urdf_text("nao_h21_v50")
    bad = tmp_path / "facts.yaml"
    with pytest.raises(NaoGaitError, match=r"facts\.yaml"):
        urdf_writer.load_facts(bad)
    bad.write_text("links: [unclosed")
    with pytest.raises(NaoGaitError, match="readable YAML"):
        urdf_writer.load_facts(bad)
    bad.write_text("- 1")
    with pytest.raises(NaoGaitError, match="mapping"):
        urdf_writer.load_facts(bad)
