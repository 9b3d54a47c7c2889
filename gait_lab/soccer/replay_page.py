"""A match as a page: the pitch from above, the goals on the time line, each robot's state."""

from collections.abc import Sequence
from html import escape
from pathlib import Path

from gait_lab.report.page import asset, filled, script_json
from gait_lab.soccer.pitch import parts_of
from gait_lab.soccer.snapshots import Snapshot
from nao_soccer.referee.rules import Goal
from sim_bridge.scene import Scene


def write_replay(
    path: Path,
    scene: Scene,
    frames: Sequence[Snapshot],
    goals: Sequence[Goal],
    subtitle: str,
) -> None:
    """Write the page.

    Args:
        path: The file.
        scene: Field and robots.
        frames: At least one moment of the match.
        goals: The goals.
        subtitle: What was played.
    """
    field, posts, _ = parts_of(scene)
    data = {
        "carpet": (field.length + 2.0 * field.border, field.width + 2.0 * field.border),
        "markings": [marking.corners() for marking in field.markings()],
        "posts": field.posts(posts),
        "robots": [{"name": robot.name, "team": robot.team} for robot in scene.robots],
        "goals": [{"t": goal.time, "team": goal.team, "player": goal.player} for goal in goals],
        "frames": [
            {
                "t": frame.time,
                "ball": frame.ball,
                "robots": frame.robots,
                "phase": frame.phase,
                "score": frame.score,
            }
            for frame in frames
        ],
    }
    score = frames[-1].score
    parts = {
        "TITLE": f"Match: red {score[0]} : {score[1]} blue",
        "SUBTITLE": escape(subtitle),
        "STYLE": asset("report.css"),
        "SCRIPT": asset("match.js"),
        "DATA": script_json(data),
    }
    path.write_text(filled(asset("match.html"), parts), encoding="utf-8")
