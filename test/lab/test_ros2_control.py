"""`nao_gait write ros2_control`: a robot for ros2_control, and its controllers."""

from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

from gait_lab.cli import main
from gait_lab.terminal import EXIT_OK, EXIT_USAGE
from robot_core.robot import load_robot


@pytest.mark.parametrize(("name", "period"), [("nao_v6", 0.012), ("bruno", 0.01)])
def test_tag_and_controllers_name_the_joints_of_the_robot(
    tmp_path: Path, name: str, period: float
) -> None:
    words = ["--robot", name, "--period", str(period), "--out", str(tmp_path / "new")]
    assert main(["write", "ros2_control", *words]) == EXIT_OK
    joints = load_robot(name).joint_names
    urdf = tmp_path / "new" / "robot.urdf"
    assert load_robot(str(urdf)).joint_names == joints
    tag = ElementTree.parse(urdf).getroot().find("ros2_control")
    assert tag is not None
    assert tag.get("type") == "system"
    assert tuple(each.get("name") for each in tag.iter("joint")) == joints
    for each in tag.iter("joint"):
        assert [(e.tag, e.get("name")) for e in each] == [
            ("command_interface", "position"),
            ("state_interface", "position"),
            ("state_interface", "velocity"),
        ]
    files = yaml.safe_load((tmp_path / "new" / "controllers.yaml").read_text())
    manager = files["controller_manager"]["ros__parameters"]
    assert manager["update_rate"] == round(1.0 / period)
    for controller in manager.keys() - {"update_rate"}:
        assert files[controller]["ros__parameters"]["joints"] == list(joints)


def test_what_cannot_be_written_is_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    assert main(["write", "ros2_control", "--out", str(tmp_path / "file" / "x")]) == EXIT_USAGE
    assert len(capsys.readouterr().err.splitlines()) == 1
