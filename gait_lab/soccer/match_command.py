"""What `nao_gait match` does: play, write replay and JSON."""

import json as json_format
import time as clock
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from gait_lab.bench.policies import policy_of
from gait_lab.soccer.match import MatchResult, MatchSpec, match_scene, play_match
from gait_lab.soccer.match_progress import MatchProgress
from gait_lab.soccer.replay_page import three_js, write_replay
from gait_lab.terminal import EXIT_OK
from nao_soccer.behavior.duel import DuelSettings
from robot_core.errors import NaoGaitError
from robot_core.schema import write_text

EYES_MAX = 20
"""Most processes that render and see: there are not more robots."""


def play(
    say: Callable[[str], None],
    *,
    vision: str,
    eyes: int | None,
    real_time: bool,
    composed: bool,
    video: bool,
    out: Path,
    json: Path | None,
    policy: Sequence[str] = (),
    against: Sequence[str] = (),
    **match: Any,
) -> int:
    """Play a match over ROS 2 (vision `camera`) or without (`model`, or `eyes`); the exit status.

    Args:
        say: Prints a line.
        vision: Rendered images, or percepts by the model.
        eyes: Further processes that render and see, without ROS 2; None = over ROS 2.
        real_time: Not in lockstep; only over ROS 2.
        composed: Over ROS 2, gait, vision and player of a robot share a process.
        video: Write a video file, too.
        out: Folder of replay, video, logs and bag.
        json: File of the result; None = none.
        policy: `NAME=VALUE` of how red plays beside others; only without ROS 2.
        against: The same of blue.
        match: Fields of `MatchSpec`.

    Raises:
        NaoGaitError: It cannot be played.
    """
    spec = MatchSpec(**match, red=policy_of(policy), blue=policy_of(against))
    _check(spec)
    over_ros = vision == "camera" and eyes is None
    if over_ros and (policy or against):
        given = " ".join((*policy, *against))
        allowed = "with --vision model or --eyes, without ROS 2"
        raise NaoGaitError("--policy, --against", given, allowed)
    if real_time and vision == "model":
        raise NaoGaitError("--real-time", "with --vision model", "--vision camera")
    if composed and (vision == "model" or eyes is not None):
        raise NaoGaitError("--composed", "without ROS 2", "with rendered images over ROS 2")
    if eyes is not None:
        if vision == "model" or real_time:
            other = "--vision model" if vision == "model" else "--real-time"
            raise NaoGaitError("--eyes", f"with {other}", "with rendered images, at any speed")
        if not 0 <= eyes <= EYES_MAX:
            raise NaoGaitError("--eyes", eyes, f"0 to {EYES_MAX}")
    three_js()  # what is missing, is missed before the match and not after it
    if video:
        import_module("imageio_ffmpeg")
    out.mkdir(parents=True, exist_ok=True)
    began = clock.monotonic()
    status = EXIT_OK
    if over_ros:
        from gait_lab.soccer import ros_match

        with MatchProgress() as progress:
            status, finished = ros_match.run(
                spec, out, say, progress.show, real_time=real_time, composed=composed
            )
        if finished is None:
            return status
        result = finished
    else:
        result = play_match(spec, rendered=vision == "camera", eyes=eyes or 0, show=True)
    _finish(result, clock.monotonic() - began, vision, out / "replay.html", json, say)
    if video:
        from gait_lab.soccer.video import write_video

        write_video(out / "match.mp4", result)
        say(f"video: {out / 'match.mp4'}")
    return status


def _check(spec: MatchSpec) -> None:
    if spec.seed < 0:
        raise NaoGaitError("seed", spec.seed, "at least 0")
    match_scene(spec)


def _changed(spec: MatchSpec) -> str:
    """What of the teams' policies is not the default."""
    usual = DuelSettings().as_dict()
    return "".join(
        f", {team} {name}={value:g}"
        for team, policy in (("red", spec.red), ("blue", spec.blue))
        for name, value in policy.as_dict().items() if value != usual[name]
    )  # fmt: skip


def _finish(
    result: MatchResult,
    seconds: float,
    vision: str,
    replay: Path,
    json: Path | None,
    say: Callable[[str], None],
) -> None:
    """Write replay and JSON, and say the result."""
    spec = result.spec
    subtitle = (
        f"{spec.scene}, seed {spec.seed}, {spec.engine}, vision by {vision}{_changed(spec)}; "
        f"{result.seconds:.0f} s simulated in {seconds:.0f} s"
    )
    write_replay(replay, result, subtitle)
    if json is not None:
        write_text(json, json_format.dumps(result.as_json(), indent=2) + "\n", "json")
    say(f"red {result.score['red']} : {result.score['blue']} blue")
    for goal in result.goals:
        own = " (own goal)" if goal.own else ""
        say(f"  {goal.time:6.1f} s  {goal.team}{own}  {goal.player}")
    falls = sum(result.falls.values())
    say(
        f"{result.seconds / 60.0:.1f} simulated minutes in {seconds / 60.0:.1f}; "
        f"{falls} falls, {result.kicks} kicks, {result.strokes} dribble strokes; replay: {replay}"
    )
