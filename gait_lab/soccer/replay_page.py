"""A match as a page: in 3D, with what each robot thought, and what happened and why."""

import base64
import math
import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from html import escape
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from gait_lab.analysis.body import shapes_of
from gait_lab.report.page import asset, filled, script_json
from gait_lab.soccer.match import MatchResult, match_scene
from gait_lab.soccer.motion_track import PERIOD, MotionTrack
from gait_lab.soccer.snapshots import RobotSnapshot, Snapshot
from gait_lab.soccer.story import RobotNumbers, Story
from robot_core.field import COLORS, TEAMS
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import FloatArray
from sim_bridge.scene import Scene
from sim_bridge.shapes import Shape

MOST_BYTES = 9_000_000
"""Of the motion on the page; a longer match has fewer moments."""
UNKNOWN = -32768
"""Stands for a number that is not known."""
_LENGTH, _ANGLE, _SHARE, _SECONDS, _VERTEX = 5e-4, 2e-4, 1.0 / 32767.0, 0.01, 1e-4
"""Steps [m, rad, 1, s, m] in which numbers are kept."""
_JERSEY = -1
"""Stands for the colour of the team."""


def write_replay(path: Path, result: MatchResult, subtitle: str) -> None:
    """Write the page of a match; `subtitle` says what was played.

    Raises:
        ModuleNotFoundError: three.js is not installed.
    """
    scene, story = match_scene(result.spec), Story(result)
    assert result.motion is not None
    robots = [load_robot(robot.urdf) for robot in scene.robots]
    kinds = list(dict.fromkeys(robot.urdf for robot in robots))
    data = {
        **_surroundings(scene),
        "kinds": [_kind(next(r for r in robots if r.urdf == urdf)) for urdf in kinds],
        "robots": [
            {
                "name": each.name, "team": each.team, "number": each.number,
                "kind": kinds.index(robot.urdf),
            }
            for each, robot in zip(scene.robots, robots, strict=True)
        ],
        **_motion(result.motion, len(robots)),
        **_moments(result.frames, [robot.name for robot in scene.robots]),
        "events": [event._asdict() for event in story.events],
        "touches": [
            [round(each.time, 2), TEAMS.index(each.team), each.robot] for each in story.touches
        ],
        "duels": [[round(begin, 2), round(end, 2)] for begin, end in story.duels],
    }  # fmt: skip
    score = result.frames[-1].score
    parts = {
        "TITLE": f"Match: red {score[0]} : {score[1]} blue",
        "SUBTITLE": escape(subtitle),
        "STYLE": asset("match.css"),
        "NUMBERS": _numbers_html(story.numbers(), story),
        "THREE": three_js(),
        "SCRIPT": asset("match.js"),
        "DATA": script_json(data),
    }
    path.write_text(filled(asset("match.html"), parts), encoding="utf-8")


def three_js() -> str:
    """The script of three.js; ModuleNotFoundError if it is not installed."""
    folder = files("jupyter_threejs_sage") / "static" / f"r{version('jupyter-threejs-sage')}"
    return (folder / "three.min.js").read_text(encoding="utf-8")


def packed(values: Any, step: float) -> dict[str, Any]:
    """Numbers as 16 bit integers, in multiples of `step`; NaN is kept."""
    whole = np.asarray(values, dtype=float).ravel() / step
    limited = np.clip(np.rint(whole), UNKNOWN + 1, -UNKNOWN - 1)
    integers = np.where(np.isnan(whole), UNKNOWN, limited).astype("<i2")
    return {"i16": base64.b64encode(integers.tobytes()).decode("ascii"), "step": step}


# -- what is seen ----------------------------------------------------------------------------------


def _surroundings(scene: Scene) -> dict[str, Any]:
    around = scene.surroundings()
    assert around.ball is not None
    return {
        "carpet": around.carpet,
        "green": COLORS["green"],
        "markings": [marking.corners() for marking in around.markings],
        "fixtures": [_fixture(each.shape, each.kind) for each in around.fixtures],
        "ball": {"radius": around.ball.radius, "color": around.ball.color[:3]},
    }


def _fixture(shape: Shape, kind: str) -> dict[str, Any]:
    return {
        "kind": shape.kind,
        "size": shape.size,
        "position": shape.position.tolist(),
        "quaternion": pin.Quaternion(shape.rotation).coeffs().tolist(),
        "color": shape.color[:3],
        "net": kind == "net",
    }


def _kind(robot: RobotDescription) -> dict[str, Any]:
    """A kind of robot: its joints as a tree, whose first node is the base, and its shapes."""
    model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
    joints = ET.fromstring(robot.urdf).iter("joint")
    axes = {joint.get("name", ""): joint.find("axis") for joint in joints}
    nodes = []
    for index in range(1, model.njoints):
        name, place = model.names[index], model.jointPlacements[index]
        axis = axes.get(name)
        nodes.append(
            {
                "parent": model.parents[index] - 1,
                "position": place.translation.tolist(),
                "quaternion": pin.Quaternion(place.rotation).coeffs().tolist(),
                "axis": [1.0, 0.0, 0.0]
                if axis is None
                else [float(each) for each in axis.get("xyz", "1 0 0").split()],
                "joint": robot.joint_names.index(name) if name in robot.joint_names else -1,
            }
        )

    def placed(link: str) -> dict[str, Any]:
        frame = model.frames[model.getFrameId(link, pin.FrameType.BODY)]
        return {
            "node": frame.parentJoint - 1,
            "position": frame.placement.translation.tolist(),
            "quaternion": pin.Quaternion(frame.placement.rotation).coeffs().tolist(),
        }

    cameras = list(robot.cameras.values())
    return {
        "joints": len(robot.joint_names),
        "nodes": nodes,
        "torso": placed(robot.torso_frame),
        "eye": {**placed(cameras[0].frame), "fov": cameras[0].hfov} if cameras else None,
        **_mesh(robot, model),
    }


def _mesh(robot: RobotDescription, model: Any) -> dict[str, Any]:
    """All shapes as triangles in the frames of their nodes."""
    shapes = shapes_of(robot.urdf)
    points = np.empty_like(shapes.vertex)
    node_of = np.zeros(len(shapes.links), dtype=int)
    for index, link in enumerate(shapes.links):
        frame = model.frames[model.getFrameId(link, pin.FrameType.BODY)]
        mine = shapes.link == index
        rotation, place = frame.placement.rotation, frame.placement.translation
        points[mine] = shapes.vertex[mine] @ rotation.T + place
        node_of[index] = frame.parentJoint - 1
    links = shapes.link[shapes.triangle[:, 0]]
    palette = sorted(set(shapes.color))
    paint = [
        _JERSEY if shapes.links[link] == robot.upper_body_frame else palette.index(color)
        for link, color in zip(links, shapes.color, strict=True)
    ]
    return {
        "vertex": packed(points[shapes.triangle], _VERTEX),
        "node": packed(node_of[links], 1.0),
        "paint": packed(paint, 1.0),
        "palette": palette,
    }


# -- what moves ------------------------------------------------------------------------------------


def _motion(motion: MotionTrack, robots: int) -> dict[str, Any]:
    bodies = [motion.body(index) for index in range(robots)]
    size = 2 * (4 + sum(body.shape[1] for body in bodies)) * len(motion) * 4 // 3
    every = max(1, math.ceil(size / MOST_BYTES))
    time = motion.time[::every]
    return {
        "begin": round(float(time[0]), 3),
        "period": every * PERIOD,
        "count": len(time),
        "rolling": packed(motion.ball[::every], _LENGTH),
        "bodies": [_body(body[::every]) for body in bodies],
    }


def _body(body: FloatArray) -> dict[str, Any]:
    return {
        "position": packed(body[:, :3], _LENGTH),
        "quaternion": packed(body[:, 3:7], _SHARE),
        "joint": packed(body[:, 7:], _ANGLE),
    }


def _moments(frames: Sequence[Snapshot], names: Sequence[str]) -> dict[str, Any]:
    """What the referee and the robots thought, by moments."""
    texts: dict[str, int] = {}

    def text(value: str) -> int:
        return texts.setdefault(value, len(texts))

    minds = [_mind([frame.robots[name] for frame in frames], text) for name in names]
    games = _changes(
        [
            (text(frame.phase), text(frame.set_play), text(frame.kicking), *frame.score)
            for frame in frames
        ]
    )
    return {
        "times": [frame.time for frame in frames],
        "minds": minds,
        "games": games,
        "texts": list(texts),
    }


def _mind(robots: Sequence[RobotSnapshot], text: Callable[[str], int]) -> dict[str, Any]:
    """Words of a robot where they change, and numbers of each moment."""
    nowhere = (math.nan, math.nan, math.nan)
    words = [
        (
            text(each.state),
            text(each.role),
            text(each.penalty),
            text(each.change),
            text("" if each.plan is None else each.plan.name),
            text("" if each.runner_up is None else each.runner_up.name),
            [text(part) for part in each.path],
        )
        for each in robots
    ]
    plans = [
        [
            number
            for plan in (each.plan, each.runner_up)
            for number in ((math.nan, math.nan) if plan is None else plan[1:])
        ]
        for each in robots
    ]
    return {
        "words": _changes(words),
        "pose": packed([(each.x, each.y, each.heading) for each in robots], _LENGTH),
        "believed": packed([each.believed or nowhere for each in robots], _LENGTH),
        "ball": packed([each.ball or nowhere[:2] for each in robots], _LENGTH),
        "plan": packed(plans, _SECONDS),
        "others": _changes(
            [[[round(x, 2), round(y, 2)] for x, y in each.others] for each in robots]
        ),
    }


def _changes(values: Sequence[Any]) -> list[Any]:
    """The values that differ from those before, each with its number."""
    return [
        [index, value]
        for index, value in enumerate(values)
        if index == 0 or value != values[index - 1]
    ]


# -- numbers ---------------------------------------------------------------------------------------

def _numbers_html(numbers: Sequence[RobotNumbers], story: Story) -> str:
    held = story.possession()
    duels = [end - begin for begin, end in story.duels]
    longest = f", the longest {max(duels):.0f} s" if duels else ""
    text = (
        f"Ball held: red {held['red']:.0%}, blue {held['blue']:.0%}. "
        f"{len(duels)} duels{longest}."
    )
    numbers = sorted(numbers, key=lambda each: TEAMS.index(each.team))
    head = "".join(f'<th class="{each.team}">{escape(each.name)}</th>' for each in numbers)
    rows = "".join(
        f"<tr><th>{escape(name)}</th>{''.join(f'<td>{cell(each)}</td>' for each in numbers)}</tr>"
        for name, cell in _ROWS
    )
    return (
        f'<p class="note">{text}</p><div class="scroll"><table><thead><tr><th></th>{head}</tr>'
        f"</thead><tbody>{rows}</tbody></table></div>"
        '<p class="note">While the ball is in play. A touch: hits that follow each other within '
        "1 s; it brings the ball forward until somebody else touches it, for at most 3 s.</p>"
    )


def _speed(each: RobotNumbers) -> str:
    upright = each.played - each.down
    return f"{each.walked / upright:.2f}" if upright else "-"


def _pose_error(each: RobotNumbers) -> str:
    return "-" if math.isnan(each.pose_error) else f"{each.pose_error:.2f}"


_ROWS: tuple[tuple[str, Callable[[RobotNumbers], str]], ...] = (
    ("goals", lambda each: str(each.goals)),
    ("touches", lambda each: str(each.touches)),
    ("ball brought forward [m]", lambda each: f"{each.gain:+.1f}"),
    ("kicks", lambda each: str(each.kicks)),
    ("falls", lambda each: str(each.falls)),
    ("walked [m]", lambda each: f"{each.walked:.1f}"),
    ("mean speed [m/s]", _speed),
    ("on the ground [s]", lambda each: f"{each.down:.0f}"),
    ("error of the own place, median [m]", _pose_error),
)
"""Lines of the table of numbers."""
