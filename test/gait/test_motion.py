"""Motions: interpolation, mirror images, refused files, and limits while playing."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from nao_lipm_gait.motion.player import MotionPlayer
from nao_lipm_gait.whole_body.body_model import BodyModel
from robot_core.errors import NaoGaitError
from robot_core.motion.check import SPEED_SHARE
from robot_core.motion.joints import joint_groups, mirror_law
from robot_core.motion.keyframes import Interpolation, Posture
from robot_core.motion.library import MotionLibrary, load_library, shipped_library
from robot_core.motion.motion_file import load_motions
from robot_core.robot import load_robot

ROBOT = load_robot()
COUNT = len(ROBOT.joint_names)
DT = 0.01
NOD = {
    "meaning": "nods and lifts the arms",
    "poses": {
        "down": {"HeadPitch": 0.3, "ShoulderPitch": 1.0},
        "up": {"like": "down", "HeadPitch": -0.3},
    },
    "keyframes": [
        {"pose": "down", "time": 0.5, "interpolation": "linear"},
        {"pose": "up", "time": 0.5, "stiffness": {"arms": 0.5, "LShoulderPitch": 0.25}},
    ],
}


def written(folder: Path, content: object, name: str = "nod") -> Path:
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def changed(**changes: object) -> dict[str, object]:
    return {**NOD, **changes}


def played(player: MotionPlayer, seconds: float) -> np.ndarray:
    return np.array([player.advance(DT).position for _ in range(round(seconds / DT))])


# -- interpolation ---------------------------------------------------------------------------------


def test_linear_goes_at_one_speed_and_cubic_from_rest_to_rest(tmp_path: Path) -> None:
    (motion,) = load_motions(written(tmp_path, NOD), ROBOT)
    start = np.array(ROBOT.stand_pose)
    way = played(MotionPlayer(motion, ROBOT, start, start), 1.0)
    pitch = ROBOT.index("HeadPitch")
    s = np.arange(1, 51) / 50.0
    np.testing.assert_allclose(way[:50, pitch], start[pitch] + s * (0.3 - start[pitch]))
    np.testing.assert_allclose(way[50:, pitch], 0.3 - 0.6 * (3 * s**2 - 2 * s**3), atol=1e-12)


@given(st.floats(0.0, 1.0))
def test_cubic_is_symmetric_and_its_speed_peaks_at_one_and_a_half(s: float) -> None:
    cubic = Interpolation.CUBIC
    assert cubic.share(s) + cubic.share(1.0 - s) == pytest.approx(1.0)
    slope = (cubic.share(min(s + 1e-6, 1.0)) - cubic.share(max(s - 1e-6, 0.0))) / 2e-6
    assert slope <= cubic.peak + 1e-4


def test_after_the_end_the_last_keyframe_is_held(tmp_path: Path) -> None:
    (motion,) = load_motions(written(tmp_path, NOD), ROBOT)
    start = np.array(ROBOT.stand_pose)
    player = MotionPlayer(motion, ROBOT, start, start)
    played(player, motion.time)
    assert player.finished
    assert player.advance(5.0).position[ROBOT.index("HeadPitch")] == pytest.approx(-0.3)


def test_joints_that_no_pose_names_are_not_the_motions(tmp_path: Path) -> None:
    (motion,) = load_motions(written(tmp_path, NOD), ROBOT)
    tick = MotionPlayer(motion, ROBOT, ROBOT.stand_pose, ROBOT.stand_pose).advance(DT)
    named = {ROBOT.joint_names[i] for i in np.flatnonzero(~np.isnan(tick.position))}
    assert named == {"HeadPitch", "LShoulderPitch", "RShoulderPitch"}


def test_stiffness_stays_until_it_is_changed_and_names_groups_and_joints(tmp_path: Path) -> None:
    (motion,) = load_motions(written(tmp_path, NOD), ROBOT)
    first, second = (keyframe.stiffness for keyframe in motion.keyframes)
    assert (first == 1.0).all()
    arms = joint_groups(ROBOT)["arms"]
    left = ROBOT.index("LShoulderPitch")
    assert second[left] == 0.25
    assert {second[i] for i in arms if i != left} == {0.5}
    assert {second[i] for i in range(COUNT) if i not in arms} == {1.0}


def test_a_far_start_takes_longer_and_keeps_the_joint_speeds(tmp_path: Path) -> None:
    quick = changed(keyframes=[{"pose": "down", "time": 0.1}, {"pose": "stand", "time": 0.1}])
    (motion,) = load_motions(written(tmp_path, quick), ROBOT)
    start = np.array(ROBOT.lower)
    player = MotionPlayer(motion, ROBOT, start, ROBOT.stand_pose)
    assert player.time > motion.time
    way = played(player, player.time)
    named = ~np.isnan(way[0])
    path = np.vstack([start[named], way[:50, named]])
    speed = np.abs(np.diff(path, axis=0)).max(axis=0) / DT
    assert (speed <= SPEED_SHARE * ROBOT.velocity_limit[named] + 1e-9).all()


# -- mirror ----------------------------------------------------------------------------------------


def test_mirror_law_mirrors_the_whole_body() -> None:
    """The CoM and the soles of a mirrored pose are the mirror images of those of the pose."""
    body, law = BodyModel(ROBOT), mirror_law(ROBOT)
    rng = np.random.default_rng(5)
    pose = rng.uniform(ROBOT.lower, ROBOT.upper)
    pose[ROBOT.index("RHipYawPitch")] = pose[ROBOT.index("LHipYawPitch")]
    found = []
    for angles in (pose, law.mirrored(pose)):
        com = body.set_joints(angles)
        found.append((com, body.sole_in_torso(1).position, body.sole_in_torso(-1).position))
    (com, left, right), (com2, left2, right2) = found
    for one, other in ((com, com2), (left, right2), (right, left2)):
        # the published masses of the two arms and legs differ a little
        np.testing.assert_allclose(one, np.multiply(other, (1.0, -1.0, 1.0)), atol=2e-3)


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_mirroring_twice_changes_nothing(seed: int) -> None:
    pose = np.random.default_rng(seed).normal(size=COUNT)
    law = mirror_law(ROBOT)
    np.testing.assert_array_equal(law.mirrored(law.mirrored(pose)), pose)


def test_axes_of_partners_are_mirror_images() -> None:
    law, names = mirror_law(ROBOT), ROBOT.joint_names
    signs = {name: law.sign[i] for i, name in enumerate(names)}
    assert signs["LHipRoll"] == signs["LShoulderRoll"] == signs["HeadYaw"] == -1.0
    assert signs["LHipYawPitch"] == signs["LKneePitch"] == signs["HeadPitch"] == 1.0
    assert names[law.partner[names.index("LElbowYaw")]] == "RElbowYaw"


def test_a_mirrored_motion_has_the_other_support_and_the_other_side(tmp_path: Path) -> None:
    one_leg = changed(
        mirrored_as="nod_right",
        poses={"down": {"LKneePitch": 0.9, "RKneePitch": 0.4, "RHipRoll": -0.1}},
        keyframes=[
            {"pose": "down", "time": 1.0, "support": "right", "stiffness": {"LElbowYaw": 0}}
        ],
    )
    left, right = load_motions(written(tmp_path, one_leg), ROBOT)
    assert (left.name, right.name) == ("nod", "nod_right")
    a, b = left.keyframes[0], right.keyframes[0]
    assert a.position is not None
    assert b.position is not None
    assert (a.support, b.support) == (-1, 1)
    assert b.position[ROBOT.index("RKneePitch")] == 0.9
    assert b.position[ROBOT.index("LHipRoll")] == pytest.approx(0.1)
    assert b.stiffness[ROBOT.index("RElbowYaw")] == 0.0


def test_a_file_with_a_base_says_only_what_differs(tmp_path: Path) -> None:
    (base,) = load_motions(written(tmp_path, changed()), ROBOT)
    path = tmp_path / "nod_fast.yaml"
    differs = "meaning: nods fast\nposes: {up: {HeadPitch: -0.1}}\ntimes: {up: 0.4}\n"
    path.write_text(f"base: nod\n{differs}")
    (fast,) = load_motions(path, ROBOT)
    assert (fast.name, fast.meaning, fast.starts) == ("nod_fast", "nods fast", base.starts)
    head = ROBOT.index("HeadPitch")
    for mine, theirs in zip(fast.keyframes, base.keyframes, strict=True):
        assert mine.time == (0.4 if mine.pose == "up" else theirs.time)
        if mine.pose == "up":
            assert mine.position is not None
            assert mine.position[head] == -0.1
        elif mine.position is not None:
            np.testing.assert_array_equal(mine.position, theirs.position)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("base: nowhere\n", "nowhere"),
        ("base: nod_fast\n", "base: got 'nod_fast'; allowed: a motion file that is not based on"),
        ("base: nod\ntimes: {sideways: 0.4}\n", r"times\.sideways.*a pose of a keyframe"),
    ],
)
def test_a_bad_base_is_refused(tmp_path: Path, text: str, message: str) -> None:
    written(tmp_path, changed())
    path = tmp_path / "nod_fast.yaml"
    path.write_text(text)
    with pytest.raises(NaoGaitError, match=message):
        load_motions(path, ROBOT)


# -- what is refused -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (changed(speed=3), "nod.yaml: speed: got 3; allowed: one of the keys"),
        (changed(starts="hanging"), r"nod\.yaml: starts: got .hanging.; allowed: one of standing"),
        (changed(ends="upright"), r"yaml: ends: got"),
        (changed(meaning=""), r"yaml: meaning: got"),
        (changed(keyframes=[]), r"keyframes: got \[\]; allowed: a list of 1 to 200 items"),
        (changed(keyframes=[{"pose": "sideways", "time": 1}]), r"keyframes\[1\]\.pose.*sideways"),
        (changed(keyframes=[{"pose": "up", "time": 0}]), r"keyframes\[1\].time.*0.02 to 60 s"),
        (changed(keyframes=[{"pose": "up", "time": True}]), r"keyframes\[1\].time.*got True"),
        (changed(keyframes=[{"pose": "up", "time": float("nan")}]), r"keyframes\[1\].time"),
        (changed(keyframes=[{"pose": "up"}]), r"keyframes\[1\]\.time: .*required"),
        (changed(keyframes=[{"pose": "up", "time": 1, "speed": 1}]), r"keyframes\[1\]\.speed"),
        (
            changed(keyframes=[{"pose": "up", "time": 1, "interpolation": "spline"}]),
            r"interpolation.*spline.*linear, cubic",
        ),
        (
            changed(keyframes=[{"pose": "up", "time": 1, "stiffness": {"legs": 2}}]),
            r"stiffness\.legs: got 2",
        ),
        (
            changed(keyframes=[{"pose": "up", "time": 1, "stiffness": {"tail": 1}}]),
            r"stiffness.*tail",
        ),
        (changed(keyframes=[{"pose": "up", "time": 1, "support": "toe"}]), r"support.*toe"),
        (changed(poses={"down": {"Tail": 0.1}}), r"poses\.down\.Tail"),
        (changed(poses={"up": {"like": "down"}}), r"poses\.up\.like"),
        (changed(poses={"stand": {"HeadYaw": 0.1}}), r"poses\.stand"),
        (changed(balance={"yaw": 1}), r"balance\.yaw"),
        (changed(mirrored_as="nod"), "mirrored_as"),
        ("just a text", "a mapping"),
    ],
)
def test_bad_files_are_refused_with_file_key_and_value(
    tmp_path: Path, content: object, message: str
) -> None:
    path = written(tmp_path, content)
    with pytest.raises(NaoGaitError, match=message) as caught:
        load_motions(path, ROBOT)
    assert "nod" in str(caught.value)


CROSSED = {"LHipRoll": -0.35, "RHipRoll": 0.35}


@pytest.mark.parametrize(
    "poses",
    [{"down": {}, "up": CROSSED}, {"down": CROSSED, "up": {}},
     {"down": {"HipRoll": 0.2, "HipYawPitch": 0.0}, "up": {"HipRoll": -0.3}}],
)  # fmt: skip
def test_legs_that_cross_are_refused_with_keyframe_and_links(
    tmp_path: Path, poses: dict[str, object]
) -> None:
    keyframes = [{"pose": "down", "time": 2.0}, {"pose": "up", "time": 2.0}]
    crossing = changed(poses=poses, keyframes=keyframes)
    found = re.search(r"keyframe [12] .*: got '[LRlr]\S+ \d+ mm in", refusal(tmp_path, crossing))
    assert found
    load_motions(written(tmp_path, {**crossing, "legs_press": True}), ROBOT)


def test_yaml_that_would_make_objects_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "evil.yaml"
    path.write_text("meaning: !!python/object/apply:os.getcwd []\n", encoding="utf-8")
    with pytest.raises(NaoGaitError, match="readable YAML"):
        load_motions(path, ROBOT)


def refusal(tmp_path: Path, content: object) -> str:
    with pytest.raises(NaoGaitError) as caught:
        load_motions(written(tmp_path, content), ROBOT)
    return str(caught.value)


def test_a_pose_beyond_a_limit_names_motion_keyframe_joint_value_and_limit(tmp_path: Path) -> None:
    text = refusal(tmp_path, changed(poses={"down": {"KneePitch": 2.5}, "up": {}}))
    for part in ("motion nod", "keyframe 1 (down)", "LKneePitch", "2.5 rad", "2.11255"):
        assert part in text


def test_the_ankles_roll_limit_depends_on_its_pitch(tmp_path: Path) -> None:
    bent = {"LAnklePitch": -1.1, "LAnkleRoll": 0.2}
    assert "LAnkleRoll" in refusal(tmp_path, changed(poses={"down": bent, "up": {}}))
    flat = {"LAnklePitch": 0.0, "LAnkleRoll": 0.2}
    load_motions(written(tmp_path, changed(poses={"down": flat, "up": {}})), ROBOT)


def test_one_motor_cannot_turn_two_joints_apart(tmp_path: Path) -> None:
    apart = {"LHipYawPitch": -0.2, "RHipYawPitch": -0.3}
    assert "one motor" in refusal(tmp_path, changed(poses={"down": apart, "up": {}}))


def test_a_joint_that_would_be_too_fast_is_named_with_the_time_it_needs(tmp_path: Path) -> None:
    quick = changed(
        keyframes=[{"pose": "down", "time": 0.5}, {"pose": "up", "time": 0.1}],
        poses={"down": {"LKneePitch": 0.0}, "up": {"LKneePitch": 1.0}},
    )
    text = refusal(tmp_path, quick)
    needed = 1.5 * 1.0 / (SPEED_SHARE * ROBOT.limits["LKneePitch"].velocity)
    for part in ("keyframe 2 (up)", "LKneePitch", "15 rad/s", f"{needed:.3f} s"):
        assert part in text


# -- the library -----------------------------------------------------------------------------------


def test_every_shipped_motion_loads_and_stays_inside_the_limits_when_played() -> None:
    library = shipped_library(ROBOT)
    assert {"stand", "get_up_front", "get_up_back"} <= set(library.motions)
    for motion in library.motions.values():
        assert not motion.legs_press, "none needs it"
        start = np.array(ROBOT.stand_pose)
        player = MotionPlayer(motion, ROBOT, start, start)
        way = np.vstack([start, played(player, player.time)])
        way = np.where(np.isnan(way), start, way)
        assert (way >= ROBOT.lower - 1e-9).all()
        assert (way <= ROBOT.upper + 1e-9).all()
        speed = np.abs(np.diff(way, axis=0)) / DT
        assert (speed <= ROBOT.velocity_limit).all(), motion.name


def test_an_unknown_motion_is_refused_with_the_names_there_are() -> None:
    with pytest.raises(NaoGaitError, match=r"somersault.*get_up_front"):
        shipped_library(ROBOT).find("somersault")
    with pytest.raises(NaoGaitError, match="none for this robot"):
        MotionLibrary().find("stand")


def test_ways_between_postures(tmp_path: Path) -> None:
    library = shipped_library(ROBOT)
    front = library.between(Posture.LYING_FRONT, Posture.STANDING)
    back = library.between(Posture.LYING_BACK, Posture.STANDING)
    assert front is not None
    assert back is not None
    assert (front.name, back.name) == ("get_up_front", "get_up_back")
    with pytest.raises(NaoGaitError, match="folder of motion files"):
        load_library(tmp_path / "nothing", ROBOT)
