"""What `nao_gait match` does: play, show the progress, write replay and JSON."""

import json as json_format
import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from gait_lab.commands.terminal import EXIT_OK
from gait_lab.soccer.frames import Frame
from gait_lab.soccer.match import MatchResult, MatchSpec, match_scene, play_match
from gait_lab.soccer.replay_page import write_replay
from nao_lipm_gait.errors import NaoGaitError

MINUTES = (0.05, 60.0)
"""Shortest and longest half [min]."""


@dataclass(frozen=True, slots=True)
class MatchOptions:
    """Arguments of `nao_gait match`.

    Attributes:
        scene: Shipped scene or YAML file.
        robots: Robots in each team; None = as in the scene.
        minutes: Simulated minutes of a half.
        real_time: In real time.
        vision: `camera` or `model`.
        seed: Of the robots and all noise.
        engine: Physics engine.
        out: Folder of replay, logs and bag.
        json: File of the result; None = none.
    """

    scene: str
    robots: int | None
    minutes: float
    real_time: bool
    vision: str
    seed: int
    engine: str
    out: Path
    json: Path | None

    @property
    def spec(self) -> MatchSpec:
        """The match; NaoGaitError if it cannot be played."""
        low, high = MINUTES
        if not low <= self.minutes <= high:
            raise NaoGaitError("minutes", self.minutes, f"{low:g} to {high:g}")
        if self.robots is not None and self.robots < 1:
            raise NaoGaitError("robots", self.robots, "at least 1")
        if self.seed < 0:
            raise NaoGaitError("seed", self.seed, "at least 0")
        spec = MatchSpec(
            scene=self.scene,
            minutes=self.minutes,
            robots=self.robots,
            seed=self.seed,
            engine=self.engine,
        )
        match_scene(spec)
        return spec


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
            result = play_match(spec, lambda frame, referee: progress.show(frame, referee.duration))
    finish(options, result, clock.monotonic() - began, say)
    return status


class Progress:
    """A progress bar of simulated time, with phase and score."""

    def __init__(self) -> None:
        self._bar: tqdm[None] | None = None

    def show(self, frame: Frame, total: float) -> None:
        """Show a moment of a match that takes `total` seconds."""
        if self._bar is None:
            self._bar = tqdm(total=round(total), unit="s", desc="match", disable=None)
        self._bar.set_postfix_str(
            f"{frame.phase}, red {frame.score[0]} : {frame.score[1]} blue", refresh=False
        )
        self._bar.update(min(frame.time, self._bar.total or 0.0) - self._bar.n)

    def __enter__(self) -> "Progress":
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()


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
        f"{falls} falls, {result.kicks} kicks; replay: {replay}"
    )
