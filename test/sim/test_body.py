"""The body of an individual against Pinocchio on the plain URDF, and against its own shapes."""

import dataclasses
import math
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import FloatArray
from sim_bridge.body import CONTACT_RADIUS, Body
from sim_bridge.engines.simulation_urdf import simulation_urdf
from sim_bridge.individual import NOMINAL, Individual, draw_individual
from sim_bridge.plant import load_plant


@pytest.fixture(scope="module")
def individual(robot: RobotDescription) -> Individual:
    return draw_individual(load_plant("reference"), robot, 4)


@pytest.fixture(scope="module")
def body(robot: RobotDescription, individual: Individual) -> Body:
    return Body(robot, individual)


def tumbled(robot: RobotDescription, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Torso position, rotation (3, 3), joints."""
    random = np.random.default_rng(seed)
    share = random.uniform(0.1, 0.9, len(robot.joint_names))
    joints = robot.lower + share * (robot.upper - robot.lower)
    return random.uniform(-1.0, 1.0, 3), pin.exp3(random.uniform(-2.0, 2.0, 3)), joints


def kinematics(
    urdf: str, robot: RobotDescription, pose: tuple[FloatArray, FloatArray, FloatArray]
) -> tuple[pin.Model, pin.Data, FloatArray]:
    """The URDF's own kinematics; its root is the torso frame."""
    model = pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer())
    data, q = model.createData(), pin.neutral(model)
    position, rotation, joints = pose
    q[:3], q[3:7] = position, pin.Quaternion(rotation).coeffs()
    for joint, angle in zip(robot.joint_names, joints, strict=True):
        q[model.joints[model.getJointId(joint)].idx_q] = angle
    pin.framesForwardKinematics(model, data, q)
    return model, data, q


def weighed(
    robot: RobotDescription,
    individual: Individual,
    pose: tuple[FloatArray, FloatArray, FloatArray],
) -> tuple[float, FloatArray]:
    """Mass and centre of mass, link by link as the URDF lists them."""
    model, data, _ = kinematics(robot.urdf, robot, pose)
    mass, moment = 0.0, np.zeros(3)
    for link in ET.fromstring(robot.urdf).iter("link"):
        inertial = link.find("inertial")
        assert inertial is not None
        name = link.attrib["name"]
        own = float(inertial.find("mass").attrib["value"])  # type: ignore[union-attr]
        own *= individual.mass_scale.get(name, 1.0)
        origin = inertial.find("origin")
        assert origin is not None
        local = np.array([float(v) for v in origin.attrib["xyz"].split()])
        frame = data.oMf[model.getFrameId(name, pin.FrameType.BODY)]
        mass, moment = mass + own, moment + own * frame.act(local)
    return mass, moment / mass


def test_mass_and_centre_of_mass_are_those_of_the_scaled_links(
    robot: RobotDescription, individual: Individual, body: Body
) -> None:
    for seed in range(5):
        pose = tumbled(robot, seed)
        mass, com = weighed(robot, individual, pose)
        assert body.mass == pytest.approx(mass, rel=1e-12)
        assert body.pose(*pose).com == pytest.approx(com, abs=1e-12)
    assert abs(body.mass - 4.88083) > 0.002, "an individual has its own weight"


def test_soles_are_where_the_urdf_has_them(robot: RobotDescription, body: Body) -> None:
    pose = tumbled(robot, 9)
    model, data, _ = kinematics(robot.urdf, robot, pose)
    found = body.pose(*pose)
    for side, name in enumerate(("l_sole", "r_sole")):
        frame = data.oMf[model.getFrameId(name)]
        assert found.sole_position[side] == pytest.approx(frame.translation, abs=1e-12)
        assert found.sole_rotation[side] == pytest.approx(frame.rotation, abs=1e-12)


def test_a_pose_once_given_does_not_change(robot: RobotDescription, body: Body) -> None:
    first = body.pose(*tumbled(robot, 1))
    com, sole = first.com.copy(), first.sole_rotation[0].copy()
    body.pose(*tumbled(robot, 2))
    assert np.array_equal(first.com, com)
    assert np.array_equal(first.sole_rotation[0], sole)


def test_engines_get_the_same_body(robot: RobotDescription, individual: Individual) -> None:
    """Masses, inertias and joints survive merging, scaling and turning to principal axes."""
    body = Body(robot, individual)
    pose = tumbled(robot, 6)
    model, data, q = kinematics(simulation_urdf(body), robot, pose)
    scaled = ET.fromstring(robot.urdf)
    for link in scaled.iter("link"):
        inertial = link.find("inertial")
        assert inertial is not None
        for element in (inertial.find("mass"), inertial.find("inertia")):
            assert element is not None
            for key, value in element.attrib.items():
                scale = individual.mass_scale.get(link.attrib["name"], 1.0)
                element.set(key, repr(float(value) * scale))
    plain, plain_data, plain_q = kinematics(ET.tostring(scaled, encoding="unicode"), robot, pose)
    assert (model.nq, model.nv) == (plain.nq, plain.nv)
    order = [model.joints[model.getJointId(joint)].idx_v for joint in robot.joint_names]
    plain_order = [plain.joints[plain.getJointId(joint)].idx_v for joint in robot.joint_names]
    mass, expected = pin.crba(model, data, q), pin.crba(plain, plain_data, plain_q)
    mass, expected = (np.triu(m) + np.triu(m, 1).T for m in (mass, expected))
    found = mass[np.ix_([*range(6), *order], [*range(6), *order])]
    assert found == pytest.approx(
        expected[np.ix_([*range(6), *plain_order], [*range(6), *plain_order])], abs=1e-9
    )


def test_end_stops_move_with_the_zero_error(
    robot: RobotDescription, individual: Individual, body: Body
) -> None:
    """A joint whose encoder reads its limit must not touch its end stop."""
    for link in body.links[1:]:
        zero = individual.joint_zero[robot.index(link.joint)]
        assert link.lower == pytest.approx(robot.limits[link.joint].lower + zero)
        assert link.upper == pytest.approx(robot.limits[link.joint].upper + zero)


def test_soles_touch_the_floor_with_the_corners_of_their_outline(
    robot: RobotDescription, body: Body
) -> None:
    left, right = body.soles
    for sole, side in ((left, 1.0), (right, -1.0)):
        points = np.array(sole.points)
        corners = np.array([(x, side * y, 0.0) for x, y in robot.sole_corners])
        assert points - [0.0, 0.0, CONTACT_RADIUS] == pytest.approx(corners)
        assert sole.position == pytest.approx([0.0, 0.0, -0.04519])
    assert (left.parent, right.parent) == ("l_ankle", "r_ankle")


def test_the_plate_of_a_foot_stays_inside_its_sole(robot: RobotDescription, body: Body) -> None:
    outline = np.array(robot.sole_outline)
    for sole, side in zip(body.soles, (1.0, -1.0), strict=True):
        length, width, _ = sole.plate.size
        assert length > 0.10
        assert width > 0.06
        middle = sole.plate.position - sole.position
        for x in (middle[0] - length / 2, middle[0] + length / 2):
            for y in (middle[1] - width / 2, middle[1] + width / 2):
                edges = np.roll(outline, -1, axis=0) - outline
                to_point = np.array([x, side * y]) - outline
                turn = edges[:, 0] * to_point[:, 1] - edges[:, 1] * to_point[:, 0]
                assert (turn >= -1e-9).all()


def test_sides(body: Body) -> None:
    sides = {link.name: link.side for link in body.links}
    assert sides["LThigh"] == sides["l_ankle"] == "left"
    assert sides["RThigh"] == sides["r_ankle"] == "right"
    assert sides["LForeArm"] == sides["torso"] == ""
    assert [link.name for link in body.links if not link.joint] == ["torso"]


def test_lowest_point_standing_and_lying(robot: RobotDescription) -> None:
    body = Body(robot, draw_individual(load_plant("ideal"), robot, NOMINAL))
    stand = np.array(robot.stand_pose)
    sole = body.pose(np.zeros(3), np.eye(3), stand).sole_position[0][2]
    assert body.bounds(np.eye(3), stand)[0][2] == pytest.approx(sole, abs=1e-4)
    # head down: the top of the head's sphere, 0.1265 + 0.055 + 0.06 above the torso
    upside_down = pin.exp3(np.array([math.pi, 0.0, 0.0]))
    assert body.bounds(upside_down, stand)[0][2] == pytest.approx(-0.2415, abs=1e-9)


def test_lowest_point_of_every_shape(robot: RobotDescription, body: Body) -> None:
    """Against random points on the shapes of the engines' URDF."""
    random = np.random.default_rng(8)
    _, rotation, joints = tumbled(robot, 12)
    model, data, _ = kinematics(robot.urdf, robot, (np.zeros(3), rotation, joints))
    lowest = math.inf
    directions = random.normal(size=(20000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    for link in ET.fromstring(simulation_urdf(body)).iter("link"):
        frame = data.oMf[model.getFrameId(link.attrib["name"], pin.FrameType.BODY)]
        for collision in link.findall("collision"):
            shape = collision.find("geometry")
            origin = collision.find("origin")
            assert shape is not None
            assert origin is not None
            place = pin.SE3(
                pin.rpy.rpyToMatrix(np.array([float(v) for v in origin.attrib["rpy"].split()])),
                np.array([float(v) for v in origin.attrib["xyz"].split()]),
            )
            (kind,) = shape
            if kind.tag == "sphere":
                points = directions * float(kind.attrib["radius"])
            elif kind.tag == "box":
                half = np.array([float(v) for v in kind.attrib["size"].split()]) / 2.0
                points = np.sign(directions) * half
            else:
                around = directions[:, :2] / np.linalg.norm(directions[:, :2], axis=1)[:, None]
                length = float(kind.attrib["length"])
                points = np.column_stack(
                    [around * float(kind.attrib["radius"]), np.sign(directions[:, 2]) * length / 2]
                )
            world = (frame.rotation @ (place.rotation @ points.T + place.translation[:, None])).T
            lowest = min(lowest, float((world + frame.translation)[:, 2].min()))
    # the plates of the feet meet legs only, but here none of them is lowest
    assert body.bounds(rotation, joints)[0][2] == pytest.approx(lowest, abs=2e-4)


def edited(folder: Path, robot: RobotDescription, xml: str) -> RobotDescription:
    root = ET.fromstring(robot.urdf)
    root.extend(ET.fromstring(xml))
    path = folder / "edited.urdf"
    path.write_text(ET.tostring(root, encoding="unicode"))
    return load_robot(path)


# The wrist's link bears the name of its joint, like LAnklePitch in every NAO model.
HAND = """<robot name="x">
  <link name="LWristYaw"><inertial><origin xyz="0.02 0 0"/><mass value="0.1"/>
    <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="LWristYaw" type="revolute"><parent link="LForeArm"/><child link="LWristYaw"/>
    <origin xyz="0.05 0 0"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""


def test_joints_of_no_interest_are_held_and_keep_their_weight(
    tmp_path: Path, robot: RobotDescription
) -> None:
    with_hand = edited(tmp_path, robot, HAND)
    nominal = draw_individual(load_plant("ideal"), with_hand, NOMINAL)
    body = Body(with_hand, nominal)
    assert body.mass == pytest.approx(4.88083 + 0.1, abs=1e-6)
    assert {link.joint for link in body.links} == {"", *robot.joint_names}
    pose = tumbled(robot, 3)
    assert body.pose(*pose).com == pytest.approx(weighed(with_hand, nominal, pose)[1], abs=1e-12)
    joints = [joint.attrib for joint in ET.fromstring(simulation_urdf(body)).iter("joint")]
    assert len([j for j in joints if j["type"] == "revolute"]) == 22


CONTROL = """<robot name="x">
  <ros2_control name="nao" type="system"><joint name="HeadYaw"/><joint name="LKneePitch"/>
    <sensor name="imu"/></ros2_control>
  <transmission name="t"><type>simple</type><joint name="LHipRoll"/></transmission>
  <gazebo reference="Head"><link name="torso"/></gazebo></robot>"""


def test_what_other_tools_write_into_a_urdf_is_left_alone(
    tmp_path: Path, robot: RobotDescription, individual: Individual
) -> None:
    controlled = edited(tmp_path, robot, CONTROL)
    assert draw_individual(load_plant("reference"), controlled, 4).mass_scale == (
        individual.mass_scale
    )
    plain = simulation_urdf(Body(robot, individual))
    assert simulation_urdf(Body(controlled, individual)) == plain


def test_fixed_joints_may_have_the_names_of_links(tmp_path: Path, robot: RobotDescription) -> None:
    root = ET.fromstring(robot.urdf)
    for link in ("l_sole", "torso", "imu_link"):
        joint = root.find(f"joint[@name='{link}_fixed']")
        assert joint is not None
        joint.set("name", link)
    path = tmp_path / "names.urdf"
    path.write_text(ET.tostring(root, encoding="unicode"))
    named = load_robot(path)
    body = Body(named, draw_individual(load_plant("ideal"), named, NOMINAL))
    plain = Body(robot, draw_individual(load_plant("ideal"), robot, NOMINAL))
    assert simulation_urdf(body) == simulation_urdf(plain)
    gait = Gait(named, GaitParameters())
    assert gait.status.support == Gait(robot, GaitParameters()).status.support


def test_a_root_that_is_not_the_torso(tmp_path: Path, robot: RobotDescription) -> None:
    """`base_link` may lie anywhere on the torso; all positions here are the torso's."""
    root = ET.fromstring(robot.urdf)
    origin = root.find("joint[@name='torso_fixed']/origin")
    assert origin is not None
    origin.set("xyz", "0.01 -0.02 0.03")
    origin.set("rpy", "0.1 0.2 -0.3")
    path = tmp_path / "shifted.urdf"
    path.write_text(ET.tostring(root, encoding="unicode"))
    shifted = load_robot(path)
    nominal = draw_individual(load_plant("ideal"), shifted, NOMINAL)
    body = Body(shifted, nominal)
    torso = pin.SE3(pin.rpy.rpyToMatrix(0.1, 0.2, -0.3), np.array([0.01, -0.02, 0.03]))
    position, rotation, joints = tumbled(robot, 5)
    base = pin.SE3(rotation, position) * torso.inverse()
    expected = weighed(shifted, nominal, (base.translation, base.rotation, joints))[1]
    assert body.pose(position, rotation, joints).com == pytest.approx(expected, abs=1e-12)
    assert body.imu_position == pytest.approx([-0.008, 0.00606, 0.027])
    assert body.imu_rotation == pytest.approx(np.eye(3), abs=1e-12)
    # the root link of the engines is the torso frame
    model, data, _ = kinematics(simulation_urdf(body), shifted, (position, rotation, joints))
    sole = data.oMf[model.getFrameId("l_sole")].translation
    assert body.pose(position, rotation, joints).sole_position[0] == pytest.approx(sole, abs=1e-9)


def test_an_imu_on_the_head_is_refused(tmp_path: Path, robot: RobotDescription) -> None:
    root = ET.fromstring(robot.urdf)
    parent = root.find("joint[@name='imu_link_fixed']/parent")
    assert parent is not None
    parent.set("link", "Head")
    path = tmp_path / "imu.urdf"
    path.write_text(ET.tostring(root, encoding="unicode"))
    on_head = load_robot(path)
    with pytest.raises(NaoGaitError, match=r"imu\.urdf.*imu_link fixed to the root"):
        Body(on_head, draw_individual(load_plant("ideal"), on_head, NOMINAL))


def test_meshes_are_left_out(tmp_path: Path, robot: RobotDescription) -> None:
    """Public NAO models have them; the files need not be there."""
    root = ET.fromstring(robot.urdf)
    link = root.find("link[@name='Head']")
    assert link is not None
    for tag in ("visual", "collision"):
        shape = ET.SubElement(ET.SubElement(link, tag), "geometry")
        ET.SubElement(shape, "mesh", filename="package://nao_meshes/Head.dae")
    path = tmp_path / "mesh.urdf"
    path.write_text(ET.tostring(root, encoding="unicode"))
    with_mesh = load_robot(path)
    plain = Body(robot, draw_individual(load_plant("ideal"), robot, NOMINAL))
    body = Body(with_mesh, draw_individual(load_plant("ideal"), with_mesh, NOMINAL))
    assert simulation_urdf(body, visual=True) == simulation_urdf(plain, visual=True)


def test_links_are_frozen(body: Body) -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        body.links[0].mass = 1.0  # type: ignore[misc]


@pytest.mark.parametrize("urdf", ["nao_h21_v33", "bruno"])
def test_the_upper_body_has_the_color_of_the_team(urdf: str):
    """Of a robot with a waist, the part above it: the hips are too small to be seen from afar."""
    robot, red = load_robot(urdf), (0.9, 0.05, 0.1)
    body = Body(robot, draw_individual(load_plant("reference"), robot, 0), color=red)
    colors = {each.name: {shape.color[:3] for shape in each.visual} for each in body.links}
    assert colors.pop("torso") == {red}
    assert not any(red in each for each in colors.values())
