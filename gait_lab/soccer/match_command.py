"""What `nao_gait match` does: play, show the progress, write replay and JSON."""

import json as json_format
import time as clock
from collections.abc import Callable
from typing import Any

from gait_lab.soccer.match import MatchResult, match_scene, play_match
from gait_lab.soccer.match_options import MatchOptions, Progress
from gait_lab.soccer.replay_page import write_replay
from gait_lab.terminal import EXIT_OK
from robot_core.errors import NaoGaitError


def command(say: Callable[[str], None], **options: Any) -> int:
    """Run with the fields of `MatchOptions`; the exit status."""
    return run(MatchOptions(**options), say)


def run(options: MatchOptions, say: Callable[[str], None]) -> int:
    """Play a match; return the exit status."""
    spec = options.spec
    options.out.mkdir(parents=True, exist_ok=True)
    began = clock.monotonic()
    status = EXIT_OK
    if options.vision == "camera":
        from gait_lab.soccer import ros_match

        with Progress() as progress:
            status, finished = ros_match.run(options, spec, say, progress)
        if finished is None:
            return status
        result = finished
    else:
        if options.real_time:
            raise NaoGaitError("--real-time", "with --vision model", "--vision camera")
        with Progress() as progress:
            result = play_match(
                spec, lambda frame, referee: progress.show(frame, referee.rules.duration)
            )
    finish(options, result, clock.monotonic() - began, say)
    return status


def finish(
    options: MatchOptions, result: MatchResult, seconds: float, say: Callable[[str], None]
) -> None:
    """Write replay and JSON, and say the result."""
    replay = options.out / "replay.html"
    scene = match_scene(result.spec)
    subtitle = (
        f"{options.scene}, seed {options.seed}, {options.engine}, vision by {options.vision}; "
        f"{result.seconds:.0f} s simulated in {seconds:.0f} s"
    )
    write_replay(replay, scene, result.frames, result.goals, subtitle)
    if options.json is not None:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        text = json_format.dumps(result.as_json(), indent=2)
        options.json.write_text(text + "\n", encoding="utf-8")
    say(f"red {result.score['red']} : {result.score['blue']} blue")
    for goal in result.goals:
        own = " (own goal)" if goal.own else ""
        say(f"  {goal.time:6.1f} s  {goal.team}{own}  {goal.player}")
    falls = sum(result.falls.values())
    say(
        f"{result.seconds / 60.0:.1f} simulated minutes in {seconds / 60.0:.1f}; "
        f"{falls} falls, {result.kicks} kicks, {result.strokes} dribble strokes; replay: {replay}"
    )
