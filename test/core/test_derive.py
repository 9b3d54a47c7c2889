"""A robot of which there is only a URDF: legs, head, arms, soles, motors and a stand from it."""

import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
import yaml

from robot_core.errors import NaoGaitError
from robot_core.motion.joints import joint_groups
from robot_core.resources import find
from robot_core.robot import RobotDescription, load_robot

ROBOTS = ("booster_t1", "booster_k1", "op3", "bruno")


def unnamed(source: str, edit: object = None) -> str:
    """A shipped URDF whose links and joints have numbers for names."""
    root = ET.fromstring(find("urdf", source).read_text())
    if callable(edit):
        edit(root)
    root.set("name", "somebody")
    names = [each.get("name", "") for tag in ("link", "joint") for each in root.findall(tag)]
    text = ET.tostring(root, encoding="unicode")
    new = {name: f"part_{number}" for number, name in enumerate(dict.fromkeys(names))}
    return re.sub(
        r'\b(name|link)="([^"]*)"', lambda m: f'{m[1]}="{new.get(m[2], m[2])}"', text
    )


def new_name(source: str, name: str) -> str:
    root = ET.fromstring(find("urdf", source).read_text())
    names = [each.get("name", "") for tag in ("link", "joint") for each in root.findall(tag)]
    return f"part_{list(dict.fromkeys(names)).index(name)}"


@pytest.mark.parametrize("source", ROBOTS)
def test_roles_soles_and_stand_come_from_the_urdf(tmp_path: Path, source: str) -> None:
    path = tmp_path / "somebody.urdf"
    path.write_text(unnamed(source))
    known, found = load_robot(source), load_robot(path)

    def names(joints: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(new_name(source, joint) for joint in joints)

    assert found.left_leg.names == names(known.left_leg.names)
    assert found.right_leg.names == names(known.right_leg.names)
    assert known.head is not None
    assert found.head == names(known.head)
    assert known.shoulder_pitch is not None
    assert found.shoulder_pitch == names(known.shoulder_pitch)
    for axis in (0, 1):
        for extreme in (min, max):
            sizes = [extreme(p[axis] for p in robot.sole_outline) for robot in (known, found)]
            assert sizes[0] == pytest.approx(sizes[1], abs=0.03)
    assert_stands(found)


def assert_stands(robot: RobotDescription) -> None:
    import pinocchio as pin

    model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
    data, q = model.createData(), pin.neutral(model)
    for name, angle in zip(robot.joint_names, robot.stand_pose.tolist(), strict=True):
        q[model.joints[model.getJointId(name)].idx_q] = angle
    com = pin.centerOfMass(model, data, q)
    pin.framesForwardKinematics(model, data, q)
    places = [data.oMf[model.getFrameId(s, pin.FrameType.BODY)] for s in robot.sole_frames]
    for place in places:
        assert place.rotation[2, 2] == pytest.approx(1.0, abs=1e-6)
        low, high = (f(x for x, _ in robot.sole_outline) for f in (min, max))
        assert low < com[0] - place.translation[0] < high
    assert places[0].translation[1] > 0.0 > places[1].translation[1]


def test_groups_do_not_need_names(tmp_path: Path) -> None:
    path = tmp_path / "somebody.urdf"
    path.write_text(unnamed("booster_t1"))
    known, found = joint_groups(load_robot("booster_t1")), joint_groups(load_robot(path))
    order = [load_robot(path).joint_names.index(new_name("booster_t1", name))
             for name in load_robot("booster_t1").joint_names]  # fmt: skip
    for group, joints in known.items():
        assert sorted(order[joint] for joint in joints) == sorted(found[group])


def bent_at_zero(root: ET.Element) -> None:
    """Pitch both feet of a T1 by 0.25 rad at the zero of their ankles."""
    for joint in root.findall("joint"):
        if joint.get("name") in ("Left_Ankle_Pitch", "Right_Ankle_Pitch"):
            origin = joint.find("origin")
            assert origin is not None
            origin.set("rpy", "0 0.25 0")


def oblique(root: ET.Element) -> None:
    """Tilt the axes of a T1's hip pitch by 10 degrees."""
    for joint in root.findall("joint"):
        if joint.get("name") in ("Left_Hip_Pitch", "Right_Hip_Pitch"):
            axis = joint.find("axis")
            assert axis is not None
            axis.set("xyz", f"0 0.985 {0.174 if 'Left' in joint.get('name', '') else -0.174}")


@pytest.mark.parametrize("edit", [bent_at_zero, oblique])
def test_a_stand_is_level_whatever_the_axes_and_the_zero_pose(
    tmp_path: Path, edit: object
) -> None:
    (tmp_path / "mine.urdf").write_text(unnamed("booster_t1", edit))
    left, right = (new_name("booster_t1", sole) for sole in ("l_sole", "r_sole"))
    outline = [list(point) for point in load_robot("booster_t1").sole_outline]
    (tmp_path / "mine.yaml").write_text(
        f"frames: {{left_sole: [{left}], right_sole: [{right}]}}\nsole_outline: {outline}\n"
    )
    assert_stands(load_robot(tmp_path / "mine.urdf"))


def box_as_stl(size: list[float]) -> str:
    """The two faces of a box that lie on its top and bottom, as text of an STL file."""
    x, y, z = (0.5 * each for each in size)
    corners = [(x, y), (-x, y), (-x, -y), (x, -y)]
    lines = ["solid box"]
    for height in (-z, z):
        for face in ((0, 1, 2), (0, 2, 3)):
            points = "".join(f"vertex {corners[i][0]} {corners[i][1]} {height}\n" for i in face)
            lines.append(f"facet normal 0 0 1\nouter loop\n{points}endloop\nendfacet")
    return "\n".join([*lines, "endsolid box\n"])


def with_mesh_feet(folder: Path, filename: str) -> object:
    """Turn the boxes of both feet of a T1 into meshes in millimetres."""

    def edit(root: ET.Element) -> None:
        for name in ("l_ankle", "r_ankle"):
            geometry = root.find(f"link[@name='{name}']/collision/geometry")
            assert geometry is not None
            size = [1e3 * float(word) for word in geometry[0].get("size", "").split()]
            (folder / "foot.stl").write_text(box_as_stl(size))
            geometry.remove(geometry[0])
            ET.SubElement(geometry, "mesh", filename=filename, scale="0.001 0.001 0.001")
        without_soles(root)

    return edit


@pytest.mark.parametrize("filename", ["package://mine/meshes/foot.stl", "../meshes/foot.stl"])
def test_soles_are_the_lowest_points_of_meshes_too(tmp_path: Path, filename: str) -> None:
    for folder in ("mine/urdf", "mine/meshes"):
        (tmp_path / folder).mkdir(parents=True)
    boxes, meshes = tmp_path / "boxes.urdf", tmp_path / "mine/urdf/meshes.urdf"
    boxes.write_text(unnamed("booster_t1", without_soles))
    meshes.write_text(unnamed("booster_t1", with_mesh_feet(tmp_path / "mine/meshes", filename)))
    assert load_robot(meshes).sole_outline == load_robot(boxes).sole_outline
    (tmp_path / "mine/meshes/foot.stl").unlink()
    with pytest.raises(NaoGaitError, match=r"mesh .*foot\.stl of .*: got 'not found'"):
        load_robot(meshes)


def hung(xyz: str, rpy: str) -> object:
    """Hang a T1 from another root."""

    def edit(root: ET.Element) -> None:
        ET.SubElement(root, "link", name="world_of_its_own")
        joint = ET.SubElement(root, "joint", name="hung", type="fixed")
        ET.SubElement(joint, "origin", xyz=xyz, rpy=rpy)
        ET.SubElement(joint, "parent", link="world_of_its_own")
        ET.SubElement(joint, "child", link="base_link")

    return edit


@pytest.mark.parametrize("root", [("0 0 0", "0 0 3.141592653589793"), ("0 0 0.6", "0 0 0")])
def test_a_root_that_looks_back_or_lies_at_the_feet_is_replaced(
    tmp_path: Path, root: tuple[str, str]
) -> None:
    """As those of an iCub and of a Berkeley Humanoid Lite."""
    path = tmp_path / "somebody.urdf"
    path.write_text(unnamed("booster_t1", hung(*root)))
    known, found = load_robot("booster_t1"), load_robot(path)
    numbers = [int(new_name("booster_t1", joint)[5:]) for joint in known.left_leg.names]
    # One link more comes before the joints.
    assert list(found.left_leg.names) == [f"part_{number + 1}" for number in numbers]
    assert found.torso_frame == "base_at_hips"
    assert_stands(found)


def with_arms_on_the_neck(root: ET.Element) -> None:
    """Hang the arms of an OP3 from its head, whose tilt is moved to the middle."""
    tilt, child = (root.find(f"joint[@name='head_tilt']/{tag}") for tag in ("origin", "child"))
    assert tilt is not None
    assert child is not None
    tilt.set("xyz", "0.01 0 0.029")
    for name in ("l_sho_pitch", "r_sho_pitch"):
        for parent in root.findall(f"joint[@name='{name}']/parent"):
            parent.set("link", child.get("link", ""))


def test_a_waist_that_carries_the_arms_is_no_head(tmp_path: Path) -> None:
    path = tmp_path / "somebody.urdf"
    path.write_text(unnamed("op3", with_arms_on_the_neck))
    assert load_robot(path).head is None


def with_eyes(root: ET.Element) -> None:
    """Give the head of an OP3 an eye on each side that turns."""
    for origin in root.findall("joint[@name='head_tilt']/origin"):
        origin.set("xyz", "0.01 0 0.029")
    (child,) = root.findall("joint[@name='head_tilt']/child")
    limit = {"lower": "-1", "upper": "1", "effort": "1", "velocity": "1"}
    for side in ("0.03", "-0.03"):
        link = ET.SubElement(root, "link", name=f"eye{side}")
        inertial = ET.SubElement(link, "inertial")
        ET.SubElement(inertial, "mass", value="0.01")
        moments = {"ixx": "1e-6", "iyy": "1e-6", "izz": "1e-6", "ixy": "0", "ixz": "0", "iyz": "0"}
        ET.SubElement(inertial, "inertia", moments)
        joint = ET.SubElement(root, "joint", name=f"turn{side}", type="revolute")
        ET.SubElement(joint, "origin", xyz=f"0.03 {side} 0.03")
        ET.SubElement(joint, "parent", link=child.get("link", ""))
        ET.SubElement(joint, "child", link=f"eye{side}")
        ET.SubElement(joint, "axis", xyz="0 0 1")
        ET.SubElement(joint, "limit", limit)


def test_a_head_with_eyes_is_a_head(tmp_path: Path) -> None:
    path = tmp_path / "somebody.urdf"
    path.write_text(unnamed("op3", with_eyes))
    assert load_robot(path).head is not None


def with_bent_elbows(root: ET.Element) -> None:
    for limit in root.findall("joint[@name='Left_Elbow_Pitch']/limit"):
        limit.set("lower", "0.3")


def test_a_joint_that_cannot_be_at_zero_stands_as_near_as_it_can(tmp_path: Path) -> None:
    path = tmp_path / "somebody.urdf"
    path.write_text(unnamed("booster_t1", with_bent_elbows))
    robot = load_robot(path)
    elbow = robot.joint_names.index(new_name("booster_t1", "Left_Elbow_Pitch"))
    assert robot.stand_pose[elbow] == 0.3


@pytest.mark.parametrize("whole", [False, True])
def test_a_stand_pose_without_leg_joints_leaves_the_derived_stand(
    tmp_path: Path, whole: bool
) -> None:
    urdf = tmp_path / "mine.urdf"
    urdf.write_text(find("urdf", "op3").read_text().replace('name="op3"', 'name="mine"'))
    arms = {"l_sho_roll": 1.0, "r_sho_roll": -1.0}
    values = yaml.safe_load(find("robots", "op3").read_text()) if whole else {}
    urdf.with_suffix(".yaml").write_text(yaml.safe_dump({**values, "stand_pose": arms}))
    robot = load_robot(urdf)
    stand = dict(zip(robot.joint_names, robot.stand_pose.tolist(), strict=True))
    assert stand.items() >= arms.items()
    assert stand["l_knee"] == pytest.approx(0.8)
    assert_stands(robot)
    assert "stand_pose" in robot.from_urdf


def test_a_stand_pose_with_a_leg_joint_is_the_whole_stand(tmp_path: Path) -> None:
    urdf = tmp_path / "mine.urdf"
    urdf.write_text(find("urdf", "op3").read_text().replace('name="op3"', 'name="mine"'))
    urdf.with_suffix(".yaml").write_text("stand_pose: {l_knee: 0.1}\n")
    robot = load_robot(urdf)
    stand = dict(zip(robot.joint_names, robot.stand_pose.tolist(), strict=True))
    assert {name for name, angle in stand.items() if angle} == {"l_knee"}
    assert "stand_pose" not in robot.from_urdf


def test_a_robot_that_shares_common_joint_names_is_taken_by_itself(tmp_path: Path) -> None:
    text = find("urdf", "bruno").read_text().replace('name="bruno"', 'name="somebody"')
    for old, new in (("HeadYaw", "HeadPan"), ("HeadPitch", "HeadTilt"), ("KneePitch", "Knee"),
                     ("ElbowPitch", "Elbow"), ("WaistPitch", "Waist")):  # fmt: skip
        text = text.replace(old, new)
    path = tmp_path / "somebody.urdf"
    path.write_text(text)
    robot = load_robot(path)
    assert robot.head == ("HeadPan", "HeadTilt")
    assert_stands(robot)


def fixed(name: str) -> object:
    def edit(root: ET.Element) -> None:
        joint = next(each for each in root.findall("joint") if each.get("name") == name)
        joint.set("type", "fixed")

    return edit


def as_continuous(root: ET.Element) -> None:
    """Let the left hip yaw turn without end."""
    joint = next(each for each in root.findall("joint") if each.get("name") == "Left_Hip_Yaw")
    joint.set("type", "continuous")


def toed(root: ET.Element) -> None:
    """Add a toe joint to the left foot."""
    ET.SubElement(root, "link", name="toe")
    joint = ET.SubElement(root, "joint", name="toe_joint", type="revolute")
    ET.SubElement(joint, "origin", xyz="0.1 0 -0.04")
    ET.SubElement(joint, "parent", link="l_ankle")
    ET.SubElement(joint, "child", link="toe")
    ET.SubElement(joint, "axis", xyz="0 1 0")
    ET.SubElement(joint, "limit", lower="-1", upper="1", effort="1", velocity="1")


def sideways(root: ET.Element) -> None:
    """Put a root above the T1's, which looks along its y."""
    ET.SubElement(root, "link", name="pelvis")
    joint = ET.SubElement(root, "joint", name="pelvis_joint", type="fixed")
    ET.SubElement(joint, "origin", rpy="0 0 1.5708")
    ET.SubElement(joint, "parent", link="pelvis")
    ET.SubElement(joint, "child", link="base_link")


def footless(root: ET.Element) -> None:
    """Remove the shapes and the sole links of both feet."""
    for name in ("l_sole", "r_sole", "l_ankle", "r_ankle"):
        link = next(each for each in root.findall("link") if each.get("name") == name)
        for collision in link.findall("collision"):
            link.remove(collision)
    without_soles(root)


def without_soles(root: ET.Element) -> None:
    """Remove the sole links of both feet."""
    for name in ("l_sole", "r_sole"):
        joint = next(
            each for each in root.findall("joint")
            if (child := each.find("child")) is not None and child.get("link") == name
        )  # fmt: skip
        root.remove(joint)
        root.remove(next(each for each in root.findall("link") if each.get("name") == name))


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (fixed("Left_Hip_Yaw"), ("left leg", "5 joints", "six joints from the hip")),
        (as_continuous, ("left leg", "5 joints", "not driven: part_", "(continuous)")),
        (toed, ("left leg", "7 joints", "six joints from the hip")),
        (sideways, ("left leg", "x of the root ahead or back and z up")),
        (footless, ("sole of what joint", "a box under the foot")),
    ],
)
def test_a_urdf_alone_that_cannot_walk_is_refused(
    tmp_path: Path, edit: object, said: tuple[str, ...]
) -> None:
    path = tmp_path / "somebody.urdf"
    path.write_text(unnamed("booster_t1", edit))
    with pytest.raises(NaoGaitError) as refused:
        load_robot(path)
    for words in (*said, str(path)):
        assert words in str(refused.value)


@pytest.mark.parametrize(
    ("path", "key", "value", "said"),
    [
        ("link[@name='LTibia']/inertial/mass", "value", "-1.5",
         r"link part_\d+ in .*: mass: got -1.5; allowed: 0 kg or more"),
        ("link[@name='LTibia']/inertial/mass", "value", "nan", "mass: got 'nan'; .*finite"),
        ("joint[@name='Left_Knee_Pitch']/limit", "lower", "9", r"joint part_\d+ .*'lower': '9'"),
        ("joint[@name='Left_Knee_Pitch']/limit", "effort", "0", r"joint part_\d+ .*'effort': '0'"),
        ("joint[@name='Left_Knee_Pitch']/limit", "upper", "126",
         r"joint part_\d+ .*126.0\]; .*in degrees\?"),
        ("joint[@name='Left_Knee_Pitch']/axis", "xyz", "0 0 0", r"joint part_\d+ .*: axis: got"),
        ("joint[@name='Left_Knee_Pitch']/child", "link", "shank", "child: .*a link of this URDF"),
        ("joint[@name='Left_Knee_Pitch']", "type", "revolut", "did you mean revolute"),
    ],
)  # fmt: skip
def test_a_wrong_mass_or_limit_is_named_before_a_stand_is_derived(
    tmp_path: Path, path: str, key: str, value: str, said: str
) -> None:
    def edit(root: ET.Element) -> None:
        element = root.find(path)
        assert element is not None
        element.set(key, value)

    file = tmp_path / "somebody.urdf"
    file.write_text(unnamed("booster_t1", edit))
    with pytest.raises(NaoGaitError, match=said):
        load_robot(file)


def test_without_masses_the_masses_are_named(tmp_path: Path) -> None:
    def edit(root: ET.Element) -> None:
        for link in root.findall("link"):
            for inertial in link.findall("inertial"):
                link.remove(inertial)

    file = tmp_path / "somebody.urdf"
    file.write_text(unnamed("booster_t1", edit))
    with pytest.raises(NaoGaitError, match=r"mass of the robot .*got 0.0"):
        load_robot(file)


def test_a_foot_named_as_a_sole_gets_a_sole_below_it(tmp_path: Path) -> None:
    file = tmp_path / "somebody.urdf"
    file.write_text(unnamed("booster_t1", without_soles))
    alone = load_robot(file)
    feet = []
    for joint in (alone.left_leg, alone.right_leg):
        root = ET.fromstring(alone.urdf)
        last = joint.names[-1]
        child = root.find(f"joint[@name='{last}']/child")
        assert child is not None
        feet.append(child.get("link"))
    frames = {"left_sole": feet[:1], "right_sole": feet[1:]}
    file.with_suffix(".yaml").write_text(json.dumps({"frames": frames}))
    named = load_robot(file)
    assert named.sole_frames == alone.sole_frames
    np.testing.assert_allclose(named.stand_pose, alone.stand_pose)
    np.testing.assert_allclose(named.sole_outline, alone.sole_outline)


def test_links_that_are_called_soles_are_taken_as_they_are(tmp_path: Path) -> None:
    root = ET.fromstring(unnamed("booster_t1"))
    kept = new_name("booster_t1", "l_sole"), new_name("booster_t1", "r_sole")
    text = ET.tostring(root, encoding="unicode")
    for old, new in zip(kept, ("l_sole", "r_sole"), strict=True):
        text = text.replace(f'"{old}"', f'"{new}"')
    root = ET.fromstring(text)
    for name in ("l_sole", "r_sole"):
        joint = next(
            each for each in root.findall("joint")
            if (child := each.find("child")) is not None and child.get("link") == name
        )  # fmt: skip
        origin = joint.find("origin")
        assert origin is not None
        x, y, z = map(float, origin.get("xyz", "").split())
        origin.set("xyz", f"{x} {y} {z + 0.02}")
    file = tmp_path / "somebody.urdf"
    file.write_text(ET.tostring(root, encoding="unicode"))
    robot = load_robot(file)
    assert robot.sole_frames == ("l_sole", "r_sole")
    assert robot.urdf.count('link name="l_sole"') == 1


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("left_leg: [a, b]", r"left_leg: got .*a mapping of hip_yaw"),
        ("frames: [a]", r"frames: got \['a'\]"),
        ("frames: {imu: a}", "frames.imu: got 'a'"),
        ("head: part_1", "head: got .*null, or a list of 2 items"),
        ("motors: 3", "motors: got 3"),
        ("shoulder_roll: {a: 1}", "shoulder_roll: got"),
    ],
)
def test_a_bad_key_is_named_before_others_are_derived(
    tmp_path: Path, text: str, said: str
) -> None:
    file = tmp_path / "somebody.urdf"
    file.write_text(unnamed("booster_t1"))
    file.with_suffix(".yaml").write_text(text)
    with pytest.raises(NaoGaitError, match=said):
        load_robot(file)


def test_a_robot_file_beside_the_urdf_is_used(tmp_path: Path) -> None:
    (tmp_path / "mine.urdf").write_text(unnamed("booster_t1"))
    (tmp_path / "mine.yaml").write_text("name: mine\nurdf: mine.urdf\npreset: paper\n")
    for given in ("mine.urdf", "mine.yaml"):
        robot = load_robot(tmp_path / given)
        assert (robot.name, robot.preset) == ("mine", "paper")
    (tmp_path / "mine.yaml").write_text("name: mine\n")
    with pytest.raises(NaoGaitError, match="urdf: got None"):
        load_robot(tmp_path / "mine.yaml")
