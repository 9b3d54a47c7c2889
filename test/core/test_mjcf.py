"""A robot from an MJCF: the same body as from its URDF."""

import re
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription, load_robot, mjcf

mujoco = pytest.importorskip("mujoco")

LEG = """
<body name="{s}_hip" pos="0 {y} -0.05"><joint name="{s}_hip_pitch" axis="0 1 0" range="-1.5 1.5"/>
 <geom type="box" size=".02 .02 .02" mass=".3"/>
 <body name="{s}_hip2"><joint name="{s}_hip_roll" axis="1 0 0" range="-1 1"/>
  <geom type="box" size=".02 .02 .02" mass=".3"/>
  <body name="{s}_thigh" pos="0 0 -.02"><joint name="{s}_hip_yaw" axis="0 0 1" range="-1 1"/>
   <geom type="capsule" fromto="0 0 0 0 0 -.15" size=".02" mass=".6"/>
   <body name="{s}_shank" pos=".01 0 -.16">
    <joint name="{s}_knee" pos="0 0 .01" axis="0 1 0" range="0 2.2"/>
    <geom type="capsule" fromto="0 0 0 0 0 -.14" size=".02" mass=".4"/>
    <body name="{s}_ankle" pos="0 0 -.15"><joint name="{s}_ankle_pitch" axis="0 1 0" range="-1 1"/>
     <geom type="sphere" size=".015" mass=".1"/>
     <body name="{s}_foot" pos="0 0 -.01"><joint name="{s}_ankle_roll" axis="1 0 0" range="-1 1"/>
      <geom type="box" pos=".02 0 -.03" size=".08 .04 .01" mass=".2"/>
     </body></body></body></body></body></body>
"""
MODEL = """
<mujoco model="walker"><compiler angle="radian"/>
 <default><joint actuatorfrcrange="-20 20"/></default>
 <worldbody><geom type="plane" size="1 1 1"/>
  <body name="trunk" pos="0 0 .5"><freejoint/>
   <geom type="box" pos="0 0 .1" size=".08 .1 .12" mass="4"/>{legs}
  </body></worldbody></mujoco>
"""


def model(legs: str | None = None) -> str:
    if legs is None:
        legs = LEG.format(s="left", y=0.06) + LEG.format(s="right", y=-0.06)
    return MODEL.format(legs=legs)


@pytest.fixture(scope="module")
def walker(tmp_path_factory: pytest.TempPathFactory) -> RobotDescription:
    path = tmp_path_factory.mktemp("mjcf") / "walker.xml"
    path.write_text(model())
    return load_robot(path)


def test_masses_and_kinematics_are_those_of_mujoco(walker: RobotDescription) -> None:
    theirs = mujoco.MjModel.from_xml_string(model())
    state = mujoco.MjData(theirs)
    ours = pin.buildModelFromXML(walker.urdf, pin.JointModelFreeFlyer())
    data, q = ours.createData(), pin.neutral(ours)
    rng = np.random.default_rng(2)
    for _ in range(5):
        state.qpos[:7] = (0, 0, 0, 1, 0, 0, 0)
        for name in walker.joint_names:
            limit = walker.limits[name]
            angle = rng.uniform(limit.lower, limit.upper)
            state.joint(name).qpos = angle
            q[ours.joints[ours.getJointId(name)].idx_q] = angle
        mujoco.mj_forward(theirs, state)
        com = pin.centerOfMass(ours, data, q)
        np.testing.assert_allclose(com, state.subtree_com[1], atol=1e-9)
        pin.framesForwardKinematics(ours, data, q)
        for foot in ("left_foot", "right_foot"):
            place = data.oMf[ours.getFrameId(foot, pin.FrameType.BODY)]
            np.testing.assert_allclose(place.translation, state.body(foot).xpos, atol=1e-9)
            rotation = np.reshape(state.body(foot).xmat, (3, 3))
            np.testing.assert_allclose(place.rotation, rotation, atol=1e-9)
    assert walker.limits["left_knee"].effort == 20.0


def test_roles_and_soles_are_found(walker: RobotDescription) -> None:
    assert walker.left_leg.hip == ("left_hip_yaw", "left_hip_roll", "left_hip_pitch")
    assert walker.right_leg.ankle == ("right_ankle_pitch", "right_ankle_roll")
    assert walker.head is None
    xs = [x for x, _ in walker.sole_outline]
    assert (min(xs), max(xs)) == pytest.approx((-0.06, 0.10))


ROLL = '<joint name="{s}_ankle_roll" axis="1 0 0" range="-1 1"/>'
FOOT = """<body name="{s}_foot" pos="0 0 -.01">""" + ROLL + """
      <geom type="box" pos=".02 0 -.03" size=".08 .04 .01" mass=".2"/>"""
# The same foot in axes that point up, ahead and to the left.
TURNED = """<body name="{s}_foot" pos="0 0 -.01" quat=".5 -.5 -.5 -.5">
      <joint name="{s}_ankle_roll" axis="0 1 0" range="-1 1"/>
      <geom type="box" pos="-.03 .02 0" size=".01 .08 .04" mass=".2"/>"""


@pytest.mark.parametrize(
    ("part", "other"),
    [(FOOT, TURNED), (ROLL, ROLL.replace(" axis", ' pos=".07 0 0" axis'))],
    ids=["foot", "origin_of_roll"],
)
def test_a_sole_is_below_the_ankle_whatever_the_axes_of_the_foot_and_the_origin_of_its_joint(
    tmp_path: Path, walker: RobotDescription, part: str, other: str
) -> None:
    assert part in LEG
    legs = "".join(LEG.replace(part, other).format(s=side, y=y)
                   for side, y in (("left", 0.06), ("right", -0.06)))  # fmt: skip
    (tmp_path / "walker.xml").write_text(model(legs))
    same = load_robot(tmp_path / "walker.xml")
    np.testing.assert_allclose(same.sole_outline, walker.sole_outline, atol=2e-4)
    places = []
    for robot in (walker, same):
        body = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
        data = body.createData()
        pin.framesForwardKinematics(body, data, pin.neutral(body))
        places.append([data.oMf[body.getFrameId(sole)].homogeneous for sole in robot.sole_frames])
    np.testing.assert_allclose(places[1], places[0], atol=1e-6)


def test_a_sole_that_is_a_mesh_is_level(tmp_path: Path, walker: RobotDescription) -> None:
    # A wedge, whose axes of inertia are tilted.
    corners = [f"{x} {y} {z}" for x, top in ((-0.06, 0.02), (0.1, -0.03))
               for y in (-0.04, 0.04) for z in (-0.04, top)]  # fmt: skip
    box = '<geom type="box" pos=".02 0 -.03" size=".08 .04 .01" mass=".2"/>'
    text = model().replace(box, '<geom type="mesh" mesh="wedge" mass=".2"/>')
    asset = f'<asset><mesh name="wedge" vertex="{"  ".join(corners)}"/></asset><worldbody>'
    (tmp_path / "walker.xml").write_text(text.replace("<worldbody>", asset))
    outline = load_robot(tmp_path / "walker.xml").sole_outline
    np.testing.assert_allclose(sorted(outline), sorted(walker.sole_outline), atol=2e-4)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<mujoco><worldbody/></mujoco>", "no body"),
        ("<mujoco><worldbody>", "well-formed XML"),
        ("<mujoco><worldbody><bodi/></worldbody></mujoco>", "MuJoCo can read"),
        (model('<body name="a"><joint name="x"/><joint name="y"/><geom size="1"/></body>'),
         "joints x, y"),
        (model('<body name="a"><joint name="x" type="slide"/><geom size="1"/></body>'), "no hinge"),
        (model(LEG.format(s="left", y=0.06)), "right leg"),
        (model().replace("</worldbody>", "</worldbody><equality><connect body1='left_foot' "
                         "body2='right_foot' anchor='0 0 0'/></equality>"), "closed chain"),
    ],
)  # fmt: skip
def test_bad_models_are_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "bad.xml"
    path.write_text(text)
    with pytest.raises(NaoGaitError) as refused:
        load_robot(path)
    assert said in str(refused.value)


def test_a_mesh_of_which_only_the_hull_is_kept_is_the_same_body(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Models of many triangles are read mesh by mesh; a box is its own hull."""
    corners = "".join(f"v {x} {y} {z}\n" for x in (0, 3) for y in (-1, 1) for z in (0, 1))
    faces = ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4))
    sides = "".join(f"f {a} {b} {c}\nf {a} {c} {d}\n" for a, b, c, d in faces)
    (tmp_path / "box.obj").write_text(corners + sides)
    foot = '<geom type="box" pos=".02 0 -.03" size=".08 .04 .01" mass=".2"/>'
    mesh = '<geom type="mesh" mesh="box" pos="-.04 0 -.04" mass=".2"/>'
    file = 'file="box.obj" scale=".04 .03 .02" refpos="1 0 0"'
    asset = f'<asset><mesh name="box" {file}/><mesh name="other" {file}/></asset>'
    path = tmp_path / "meshes.xml"
    path.write_text(model().replace(foot, mesh).replace("<worldbody>", f"{asset}<worldbody>"))
    whole, keep_hull = load_robot(path), mjcf._keep_hull
    monkeypatch.setattr(mjcf, "FACES", 12)
    kept = []
    monkeypatch.setattr(mjcf, "_keep_hull", lambda *a: kept.append(a) or keep_hull(*a))
    hull = load_robot(path)
    assert len(kept) == 2
    numbers = [
        np.array(re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", each.urdf), dtype=float)
        for each in (whole, hull)
    ]
    np.testing.assert_allclose(*numbers, atol=1e-6)
    assert len(numbers[0]) > 500
