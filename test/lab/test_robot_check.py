"""`nao_gait robot check`: what it says of good robots, and how it refuses others."""

from pathlib import Path

import pytest
import yaml

from gait_lab.cli import main
from nao_lipm_gait.parameters import load_preset
from nao_lipm_gait.presets import preset_for
from nao_lipm_gait.similarity import fitted
from robot_core.resources import find
from robot_core.robot import load_robot


def test_a_shipped_robot_stands_and_is_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["robot", "check", "booster_t1", "-o", str(tmp_path / "t1.png")]) == 0
    said = capsys.readouterr().out
    for words in ("31.61 kg", "Waist", "numeric", "stands", "of 60 N m on one leg\n",
                  "30 mm below the ankle"):  # fmt: skip
        assert words in said
    assert (tmp_path / "t1.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("file", "said"),
    [("other.yaml", " {}other.yaml"), ("heron.yaml", " none (looked for {}other.yaml)")],
)
def test_the_robot_file_is_the_one_named_as_the_urdf(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], file: str, said: str
) -> None:
    text = find("urdf", "op3").read_text().replace('name="op3"', 'name="heron"')
    for old, new in (("l_hip", "hip_l"), ("r_hip", "hip_r"), ("sho_", "shoulder_")):
        text = text.replace(old, new)
    urdf = tmp_path / "other.urdf"
    urdf.write_text(text)
    (tmp_path / file).write_text("gyro_axes: 3\n")
    assert main(["robot", "check", str(urdf), "-o", str(tmp_path / "p.png")]) == 0
    lines = capsys.readouterr().out.splitlines()
    line = next(each for each in lines if each.startswith("robot file"))
    assert line.endswith(said.format(f"{tmp_path}/"))


def changed(tmp_path: Path, **keys: object) -> str:
    """The robot file of T1 with other keys."""
    values = yaml.safe_load(find("robots", "booster_t1").read_text())
    values.update({"urdf": str(find("urdf", "booster_t1")), **keys})
    path = tmp_path / "changed.yaml"
    path.write_text(yaml.safe_dump(values))
    return str(path)


def test_a_robot_file_names_a_preset_beside_it(tmp_path: Path) -> None:
    (tmp_path / "walk.yaml").write_text("swing_lift: 0.011\n")
    robot = load_robot(changed(tmp_path, preset="walk.yaml"))
    assert preset_for(robot, "default").swing_lift == 0.011


def test_the_preset_of_t1_differs_from_the_fitted_walk_where_it_says_so() -> None:
    own, robot = load_preset("booster_t1").as_dict(), load_robot("booster_t1")
    rule = fitted(load_preset("default"), robot, load_robot()).as_dict()
    assert own["pendulum_height"] > own["com_height"]
    lower = ("swing_lift", "step_forward_max", "step_backward_max", "step_side_max",
             "step_side_share", "offset_time", "speed_time", "arm_swing",
             "pendulum_shift_max", "kick_reach")  # fmt: skip
    assert all(own[name] < rule[name] for name in lower)
    higher = ("torso_pitch", "com_height", "pendulum_height", "step_turn_max", "foot_reference_x",
              "lean_torque")  # fmt: skip
    assert all(own[name] > rule[name] for name in higher)
    changed = (*higher, *lower)
    same = {**rule, **{name: own[name] for name in changed}}
    assert own == pytest.approx(same, abs=1e-4)


def test_a_motor_that_is_too_weak_to_stand_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    motors = yaml.safe_load(find("robots", "booster_t1").read_text())["motors"]
    knees = next(each for each in motors if "Left_Knee_Pitch" in each["joints"])
    knees["stall_torque"] = 5.0
    given = changed(tmp_path, motors=motors)
    assert main(["robot", "check", given, "-o", str(tmp_path / "t1.png")]) == 2
    said = capsys.readouterr().err
    assert "Knee_Pitch: got '3.5 N m'" in said
    assert "which the stand pose needs" in said


def test_a_motor_that_is_too_weak_for_a_step_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    motors = yaml.safe_load(find("robots", "booster_t1").read_text())["motors"]
    hips = next(each for each in motors if "Left_Hip_Roll" in each["joints"])
    hips["stall_torque"] = 15.0
    given = changed(tmp_path, motors=motors)
    assert main(["robot", "check", given, "-o", str(tmp_path / "t1.png")]) == 0
    assert "Left_Hip_Roll: 14 of 10.5 N m on one leg, too much" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"left_leg": {"hip_yaw": "Left_Hip_Yaw"}}, "left_leg.hip_roll"),
        ({"head": ["AAHead_yaw", "Antenna"]}, "head: got 'Antenna'"),
        ({"joints": ["Left_Knee_Pitch"]}, "one of joints"),
        ({"urdf": "nothing.urdf"}, "nothing.urdf"),
    ],
)
def test_bad_files_are_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], keys: dict[str, object], said: str
) -> None:
    assert main(["robot", "check", changed(tmp_path, **keys)]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
