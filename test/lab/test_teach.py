"""Taught poses become a file that the engine takes, whatever the encoders said."""

from pathlib import Path

import numpy as np
import pytest

from gait_lab import cli
from gait_lab.drive import teach
from gait_lab.drive.teach import Lesson
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import GaitParameters
from robot_core.errors import NaoGaitError
from robot_core.motion.keyframes import Posture
from robot_core.motion.motion_file import load_motions
from robot_core.robot import load_robot

ROBOT = load_robot()
STANDING = Posture.STANDING


def taught(lesson: Lesson, path: Path) -> None:
    path.write_text(lesson.document("a test", STANDING, STANDING), encoding="utf-8")


def test_what_was_shown_is_what_the_motion_does(tmp_path: Path) -> None:
    lesson = Lesson(ROBOT)
    arms = np.array(ROBOT.stand_pose)
    arms[ROBOT.index("LShoulderPitch")] = 0.4321
    assert lesson.show("arms 0.7\n", arms) == "arms, 0.7 s"
    assert lesson.show("\n", ROBOT.stand_pose) == "pose_2, 1 s"
    assert lesson.show("2.5", arms) == "pose_3, 2.5 s"
    taught(lesson, tmp_path / "wave.yaml")
    (motion,) = load_motions(tmp_path / "wave.yaml", ROBOT)
    assert [keyframe.pose for keyframe in motion.keyframes] == ["arms", "pose_2", "pose_3", "stand"]
    assert [keyframe.time for keyframe in motion.keyframes][:3] == [0.7, 1.0, 2.5]
    first = motion.keyframes[0].position
    assert first is not None
    assert first[ROBOT.index("LShoulderPitch")] == pytest.approx(0.4321, abs=1e-3)
    assert np.isnan(first[ROBOT.index("HeadYaw")]), "the head is left alone"


def test_random_poses_beyond_the_limits_give_a_file_that_runs(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    lesson = Lesson(ROBOT, with_head=True)
    for _ in range(12):
        lesson.show("0.05", rng.uniform(ROBOT.lower - 0.02, ROBOT.upper + 0.02))
    path = tmp_path / "wild.yaml"
    taught(lesson, path)
    with pytest.raises(NaoGaitError, match="legs that do not cross"):
        load_motions(path, ROBOT)
    path.write_text(f"{path.read_text()}legs_press: true\n")
    (motion,) = load_motions(path, ROBOT)
    assert motion.time > 12 * 0.05, "too quick ways were made long enough"


@pytest.mark.parametrize("line", ["Up", "a b", "up 0", "up 1 2", "stand", "up -1", "two words 3"])
def test_lines_that_cannot_be_understood_are_refused(line: str) -> None:
    lesson = Lesson(ROBOT)
    with pytest.raises(NaoGaitError, match="pose: got"):
        lesson.show(line, ROBOT.stand_pose)
    assert not lesson.order


def test_nothing_shown_is_no_motion() -> None:
    with pytest.raises(NaoGaitError, match="at least one pose"):
        Lesson(ROBOT).document("nothing", STANDING, STANDING)


def test_a_motion_that_is_in_no_library_runs(tmp_path: Path) -> None:
    lesson = Lesson(ROBOT)
    lesson.show("up", ROBOT.stand_pose)
    taught(lesson, tmp_path / "up.yaml")
    gait = Gait(ROBOT, GaitParameters())
    gait.request_motion(load_motions(tmp_path / "up.yaml", ROBOT)[0])
    with pytest.raises(NaoGaitError):
        gait.request_motion("up")


def test_the_tool_lists_and_checks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["teach", "list"]) == 0
    assert "get_up_front" in capsys.readouterr().out
    file = tmp_path / "bad.yaml"
    file.write_text("meaning: bad\nkeyframes: [{pose: nowhere, time: 1}]\n", encoding="utf-8")
    assert cli.main(["teach", "check", str(file)]) == 2
    assert "nowhere" in capsys.readouterr().err
    with pytest.raises(SystemExit, match="2"):
        cli.main(["teach", "check"])
    with pytest.raises(NaoGaitError, match="lowercase letters"):
        teach.record(tmp_path / "No Name.yaml", lines=[])
