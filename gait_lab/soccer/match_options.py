"""Arguments of `nao_gait match`, and how far a match is."""

from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from gait_lab.soccer.match import MatchSpec, match_scene
from gait_lab.soccer.snapshots import Snapshot
from robot_core.errors import NaoGaitError

MINUTES = (0.1, 60.0)
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


class Progress:
    """A progress bar of simulated time, with phase and score."""

    def __init__(self) -> None:
        self._bar: tqdm[None] | None = None

    def show(self, frame: Snapshot, total: float) -> None:
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
