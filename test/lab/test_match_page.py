"""The replay page of a match: what it tells, and what it shows in a browser."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from browser import open_tab
from gait_lab.soccer.match import MatchResult, MatchSpec, match_scene
from gait_lab.soccer.motion_track import PERIOD, BodyState, MotionTrack
from gait_lab.soccer.replay_page import UNKNOWN, packed, write_replay
from gait_lab.soccer.snapshots import PlanSnapshot, RobotSnapshot, Snapshot
from gait_lab.soccer.story import Story
from nao_soccer.referee.rules import Goal
from robot_core.robot import load_robot

pytest.importorskip("jupyter_threejs_sage")

SECONDS = 12.0
ROLLS, SCORES, FALLS = 4.0, 8.0, 5.0
"""[s] when red2 hits the ball, when it is in the goal, when blue1 falls."""
SPEED = 0.6
"""[m/s] of the ball."""
TURN = 0.3
"""[rad] of every joint, at the end."""


def ball_at(time: float) -> tuple[float, float, float]:
    return 1.0 + SPEED * min(max(time - ROLLS, 0.0), SCORES - ROLLS), 0.0, 0.05


def played() -> MatchResult:
    """Red2 behind the ball hits it once; blue1 beside it falls; red1 and blue2 stand far away."""
    spec = MatchSpec()
    scene = match_scene(spec)
    robot = load_robot(scene.robots[0].urdf)
    places = {"red1": (-2.0, 1.0), "red2": (0.82, 0.0), "blue1": (0.95, 0.4), "blue2": (2.0, -1.5)}
    motion, frames = MotionTrack(), []
    for row in range(round(SECONDS / PERIOD)):
        time = row * PERIOD
        joints = np.full(len(robot.joint_names), TURN * time / SECONDS)
        bodies = [
            BodyState(np.array((*places[each.name], 0.32)), np.array((0.0, 0.0, 0.6, 0.8)), joints)
            for each in scene.robots
        ]
        motion.add(time, ball_at(time), bodies)
        if row % 5 == 0:
            robots = {
                name: RobotSnapshot(
                    *place, 0.0,
                    "fallen" if name == "blue1" and time >= FALLS else "walk",
                    "striker", "play the ball: dribble </script>",
                    path=("player: upright", "play the ball: dribble </script>"),
                    change="play the ball: line up \u2192 dribble: ready",
                    plan=PlanSnapshot("dribble_left", 0.1, 4.2),
                    runner_up=PlanSnapshot("kick_hard_left", -0.2, 6.9),
                    believed=(place[0] + 0.1, place[1], 0.0),
                )
                for name, place in places.items()
            }  # fmt: skip
            scored = int(time > SCORES)
            phase = "playing" if 0.5 < time <= SCORES else "ready"
            frames.append(Snapshot(round(time, 2), ball_at(time)[:2], robots, phase, (scored, 0)))
    goals = [Goal(SCORES, "red", "red2", False)]
    return MatchResult(
        spec, {"red": 1, "blue": 0}, goals, SECONDS, falls={}, kicks=0, strokes=1, wrong_half=0,
        frames=frames, motion=motion,
    )  # fmt: skip


@pytest.fixture(scope="module")
def result() -> MatchResult:
    return played()


@pytest.fixture(scope="module")
def page(result: MatchResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("match") / "replay.html"
    write_replay(path, result, "a test")
    return path


def data_of(page: Path) -> dict[str, Any]:
    text = page.read_text()
    assert "{{" not in text.split("<script")[0]
    found: dict[str, Any] = json.loads(text.split('id="data">')[1].split("</script>")[0])
    return found


def test_the_story_has_the_touch_the_fall_and_the_goal(result: MatchResult) -> None:
    story = Story(result)
    (touch,) = story.touches
    assert (touch.robot, touch.team) == ("red2", "red")
    assert math.isclose(touch.time, ROLLS, abs_tol=3 * PERIOD)
    assert math.isclose(touch.gain, SPEED * 3.0, abs_tol=0.1)
    events = {event.kind: event for event in story.events}
    assert set(events) == {"whistle", "fall", "goal"}
    assert events["fall"].text == "blue1 falls"
    assert math.isclose(events["fall"].time, FALLS)
    assert "red2 0.42 m away, of which it did not know" in events["fall"].why
    goal = events["goal"]
    assert goal.text == "goal for red by red2: red 1 : 0 blue"
    assert "red2 hit it last" in goal.why
    assert "blue1 lay on the ground" in goal.why
    red2 = next(each for each in story.numbers() if each.name == "red2")
    assert (red2.goals, red2.touches, red2.falls) == (1, 1, 0)
    assert math.isclose(red2.pose_error, 0.1, abs_tol=1e-6)
    assert story.possession() == {"red": 1.0, "blue": 0.0}


def test_a_ball_that_is_put_somewhere_is_no_touch(result: MatchResult) -> None:
    motion = MotionTrack()
    for row in range(100):
        place = (1.0, 0.0, 0.05) if row < 50 else (0.8, 0.3, 0.05)
        bodies = [
            BodyState(np.array((0.8, 0.0, 0.3)), np.array((0.0, 0.0, 0.0, 1.0)), np.zeros(1))
            for _ in match_scene(result.spec).robots
        ]
        motion.add(row * PERIOD, place, bodies)
    moved = MatchResult(
        result.spec, result.score, [], 4.0, falls={}, kicks=0, strokes=0, wrong_half=0,
        frames=result.frames[:20], motion=motion,
    )  # fmt: skip
    assert not Story(moved).touches


def test_the_page_has_the_match(page: Path, result: MatchResult) -> None:
    data = data_of(page)
    assert len(data["times"]) == len(result.frames)
    assert [each["name"] for each in data["robots"]] == ["red1", "red2", "blue1", "blue2"]
    assert {event["kind"] for event in data["events"]} == {"whistle", "fall", "goal"}
    assert "play the ball: dribble </script>" in data["texts"]
    assert page.stat().st_size < 1_500_000


def test_numbers_are_kept_to_half_a_step() -> None:
    import base64

    values = [0.0, 1.23456, -2.5, math.nan, 1e9]
    kept = np.frombuffer(base64.b64decode(packed(values, 5e-4)["i16"]), "<i2")
    assert np.allclose(kept[:3] * 5e-4, values[:3], atol=2.5e-4)
    assert kept[3] == UNKNOWN
    assert kept[4] == 32767


@pytest.mark.parametrize("size", [(1280, 800), (390, 844)], ids=["laptop", "phone"])
def test_the_page_shows_everything(
    page: Path, result: MatchResult, size: tuple[int, int]
) -> None:
    with open_tab(page, *size) as tab:
        tab.run("show(6.0)")
        edges = tab.run(
            "['view', 'line', 'robots'].map((id) => find(id).getBoundingClientRect())"
            ".map((box) => [box.left, box.top, box.right, box.bottom])"
        )
        for left, top, right, bottom in edges:
            assert left >= 0
            assert top >= 0
            assert right <= size[0]
            assert bottom <= size[1]
        over = tab.run("document.elementFromPoint(innerWidth / 2, innerHeight - 2).tagName")
        assert over != "HTML"
        assert tab.run("document.documentElement.scrollWidth") == size[0]
        card = tab.run("cards[1].card.innerText")
        assert "plan: dribble left, goal in 4.2 s; else kick hard left, 6.9 s" in card
        assert "line up \u2192 dribble: ready" in card
        assert "own place 0.10 m off" in card
        # The robot is where pinocchio has it, to the steps in which numbers are kept.
        place = tab.run(
            "new THREE.Vector3().setFromMatrixPosition("
            "robots[1].nodes.at(-1).matrixWorld).toArray()"
        )
        assert np.allclose(place, last_joint(result, 6.0), atol=2e-3)
        tab.run("find('after').onclick()")
        assert tab.run("time") == pytest.approx(SCORES - 2.0)
        picture = "(renderer.render(scene, camera), renderer.domElement.toDataURL().length)"
        kinds = tab.run("[...find('camera').options].map((each) => each.value)")
        # Without a graphics card each pixel takes its time: a large page draws one of them.
        for kind in kinds if size[0] < 500 else kinds[:1]:
            tab.run(f"choose_camera('{kind}')")
            assert tab.run(picture) > 5000
        assert tab.complaints == []
        assert tab.requests == [page.as_uri()]


def last_joint(result: MatchResult, time: float) -> np.ndarray:
    """(3,) [m] of the last joint of red2 in the world."""
    robot = load_robot(match_scene(result.spec).robots[1].urdf)
    model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
    data, q = model.createData(), pin.neutral(model)
    motion = result.motion
    assert motion is not None
    body = motion.body(1)[round(time / PERIOD)]
    q[:7] = body[:7]
    for name, angle in zip(robot.joint_names, body[7:], strict=True):
        q[model.joints[model.getJointId(name)].idx_q] = angle
    pin.framesForwardKinematics(model, data, q)
    torso = data.oMf[model.getFrameId(robot.torso_frame, pin.FrameType.BODY)]
    found: np.ndarray = pin.SE3ToXYZQUAT(torso.actInv(data.oMi[model.njoints - 1]))[:3]
    return pin.XYZQUATToSE3(body[:7]).act(found)  # type: ignore[no-any-return]
