"""Robot files that are refused, with the path of the key and what is allowed."""

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from nao_lipm_gait.presets import preset_for
from obedient_robot import ObedientRobot
from robot_core.errors import NaoGaitError
from robot_core.motion.library import library_of
from robot_core.resources import find
from robot_core.robot import load_robot
from robot_core.robot.robot_file import read_robot_file

Settings = dict[str, Any]


def put(*keys: str | int, value: object) -> Callable[[Settings], None]:
    """An edit that sets a value of the robot file."""

    def edit(settings: Any) -> None:
        for key in keys[:-1]:
            settings = settings[key]
        settings[keys[-1]] = value

    return edit


def drop(*keys: str | int) -> Callable[[Settings], None]:
    """An edit that removes a key of the robot file."""

    def edit(settings: Any) -> None:
        for key in keys[:-1]:
            settings = settings[key]
        del settings[keys[-1]]

    return edit


@pytest.fixture(scope="module")
def settings() -> Settings:
    return dict(yaml.safe_load(find("robots", "nao_h21").read_text()))


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (put("colour", value="red"), ": colour: got 'red'"),
        (put("cameras", "camera_top", "hfov", value=7.0), "cameras.camera_top.hfov: got 7.0"),
        (drop("cameras", "camera_top", "frame"), "cameras.camera_top.frame: got 'nothing'"),
        (put("cameras", value=["camera_top"]), ": cameras: got"),
        (put("name", value=7), ": name: got 7"),
        (put("hip", value="ball"), ": hip: got 'ball'"),
        (put("joints", value="HeadYaw"), ": joints: got"),
        (put("joints", 3, value="HeadYaw"), "each item once"),
        (put("joints", 3, value=None), ": joints[4]: got None"),
        (put("left_leg", "knee_pitch", value="LKnee"), "left_leg.knee_pitch: got 'LKnee'"),
        (put("left_leg", "toe", value="LToe"), "left_leg.toe: got"),
        (drop("right_leg", "hip_roll"), "right_leg.hip_roll: got 'nothing'"),
        (put("right_leg", value="legs"), ": right_leg: got 'legs'"),
        (put("coupled_joints", value=[["LHipYawPitch"]]), "coupled_joints[1]: got"),
        (put("coupled_joints", value=[["HeadYaw", "HeadYaw"]]), "coupled_joints[1]: got"),
        (put("coupled_joints", value=[["HeadYaw", "Tail"]]), "got 'Tail'"),
        (put("shoulder_pitch", value=["LShoulderPitch"]), "shoulder_pitch: got"),
        (put("shoulder_pitch", value=["LShoulderPitch", "Wing"]), "'Wing'"),
        (put("frames", "left_sole", value="l_sole"), "frames.left_sole: got"),
        (put("frames", "left_sole", value=["l_foot", "l_toe"]), "link l_foot or l_toe"),
        (put("frames", "tail", value=["tail"]), "frames.tail: got"),
        (put("stand_pose", "LWristYaw", value=0.1), "got 'LWristYaw'"),
        (put("stand_pose", "LHipRoll", value="straight"), "stand_pose.LHipRoll: got"),
        (put("stand_pose", "LHipRoll", value=True), "stand_pose.LHipRoll: got"),
        (put("stand_pose", "LHipRoll", value=float("nan")), "stand_pose.LHipRoll: got"),
        (put("stand_pose", "LHipRoll", value=1.5), "stand_pose of LHipRoll"),
        (put("sole_outline", value=[[0, 0], [1, 0]]), "at least 3 items"),
        (put("sole_outline", 1, value=[0.0, 0.0, 0.0]), "sole_outline[2]: got"),
        (put("sole_outline", 1, value=[-0.01, 0.0]), "counter-clockwise"),
        (put("sole_corners", 0, value=[0.2, 0.0]), "four points of sole_outline"),
        (drop("sole_corners", 0), "at least 4 items"),
        (put("ankle_limits", value=[]), "at least 1 item"),
        (put("ankle_limits", 1, value=[-2.0, -0.1, 0.1]), "increasing pitch"),
        (put("ankle_limits", 1, value=[-0.9, 0.1, -0.1]), "lowest roll"),
        (put("motors", 0, "stall_torque", value=0.0), "motors[1].stall_torque: got"),
        (put("motors", 0, "stall_torque", value="strong"), "motors[1].stall_torque: got"),
        (put("motors", 0, "gear", value=1.0), "motors[1].gear: got"),
        (drop("motors", 1), "none for HeadPitch"),
        (put("motors", 1, "joints", value="HeadPitch"), "motors[2].joints: got"),
        (put("motors", 1, "joints", 0, value="HeadYaw"), "each joint once"),
        (put("motors", 1, "joints", 0, value="Tail"), "got 'Tail'"),
    ],
)
def test_a_bad_robot_file_is_refused(
    tmp_path: Path, settings: Settings, edit: Callable[[Settings], None], said: str
) -> None:
    changed = copy.deepcopy(settings)
    edit(changed)
    path = tmp_path / "changed.yaml"
    path.write_text(yaml.safe_dump(changed))
    with pytest.raises(NaoGaitError) as refused:
        load_robot(robot=path)
    assert said in str(refused.value)
    if "stand_pose of" in said or "link " in said:  # these belong to the URDF as well
        assert "nao_h21_v33.urdf" in str(refused.value)
    else:
        assert str(path) in str(refused.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("name: [unclosed", "readable YAML"),
        ("", "mapping"),
        ("- 1", "mapping"),
        ("!!python/object/apply:os.getcwd []", "readable YAML"),
    ],
)
def test_a_file_that_is_no_robot_file_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(text)
    with pytest.raises(NaoGaitError, match=said) as refused:
        load_robot(robot=path)
    assert str(path) in str(refused.value)


def test_a_v6_has_its_own_file_over_that_of_the_h21() -> None:
    v6, h21 = load_robot("nao_v6"), load_robot("nao_h21_v33")
    assert (v6.name, v6.gyro_axes, v6.motions) == ("nao_v6", 3, "nao_h21")
    assert v6.joint_names == h21.joint_names
    assert v6.motors["LKneePitch"].stall_torque > h21.motors["LKneePitch"].stall_torque
    assert library_of(v6).motions.keys() == library_of(h21).motions.keys()


def test_a_v6_stands_with_its_knees_bent_as_those_of_the_h21() -> None:
    knees = []
    for name in ("nao_v6", "nao_h21_v33"):
        model = load_robot(name)
        robot = ObedientRobot(model, preset_for(model, "default").replace(torso_pitch=0.0))
        robot.run(2.0)
        knees.append(robot.joints[model.index("LKneePitch")])
    assert knees[0] == pytest.approx(knees[1], abs=0.03)


def test_the_force_sensors_of_the_right_sole_mirror_those_of_the_left() -> None:
    left, right = load_robot("nao_v6").force_sensors or ((), ())
    assert [y > 0.0 for _, y in left] == [y > 0.0 for _, y in right] == [True, False, True, False]
    assert right[0] == (left[1][0], -left[1][1])
    assert right[3] == (left[2][0], -left[2][1])


def test_an_unknown_base_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("base: nao_h22\nname: mine\n")
    with pytest.raises(NaoGaitError, match=r"base: got 'nao_h22'; did you mean nao_h21\? allowed"):
        read_robot_file(path)
