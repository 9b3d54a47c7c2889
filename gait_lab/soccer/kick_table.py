"""`nao_gait write kicks`: a robot's kicks, standing and walking, of several simulated robots."""

import math
import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from nao_soccer.behavior.walking import WalkLimits
from robot_core.errors import NaoGaitError
from robot_core.motion.library import shipped_library
from robot_core.schema import write_text
from sim_bridge.trials.dribble import DribbleResult, DribbleSpec, dribble
from sim_bridge.trials.kick import KickResult, KickSpec, kick, kick_directions
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.trial import loaded_robot

STANDS = 0.95
"""Share of the robots that have to stand after a kick of the table."""
FOOT = "kick_front_left"
"""A ball that this kick hits lies before the left foot."""
OUTER_EDGE = 0.065
"""[m] from there to a ball that the outer edge of the foot sends outwards."""
OUTWARDS = 0.5
"""[rad] by which the foot swings outwards then."""
DRIBBLES = {
    "dribble_left": (1.0, 0.0, 0.0),
    "dribble_right": (-1.0, 0.0, 0.0),
    "dribble_outward_left": (1.0, OUTER_EDGE, OUTWARDS),
    "dribble_outward_right": (-1.0, OUTER_EDGE, OUTWARDS),
}
"""Names, the side of the foot, how far [m] beside its middle the ball lies, and how far outwards
[rad] the foot swings."""
HIT_TIME = 0.5
"""[s] A dribbling robot walks on: time of the step that hits the ball."""


def measured(urdf: str, robots: int, engine: str, jobs: int | None) -> list[KickResult]:
    """One attempt of each kick with each robot."""
    specs = [
        KickSpec(name, robot_seed=seed, urdf=urdf, engine=engine)
        for name in kick_directions(urdf)
        for seed in range(robots)
    ]
    results: list[KickResult] = parallel_map(kick, specs, jobs=jobs, label="kicks")
    return results


def dribbled(urdf: str, robots: int, engine: str, jobs: int | None) -> list[DribbleResult]:
    """One attempt with each foot and edge of each robot."""
    spot = shipped_library(loaded_robot(urdf)).find(FOOT).kick
    if spot is None:
        raise NaoGaitError("motion", FOOT, "a kick")
    speed = WalkLimits().forward
    specs = [
        DribbleSpec(
            robot_seed=seed, urdf=urdf, engine=engine, across=side * (spot.y + beside), speed=speed,
            direction=side * outwards,
        )
        for side, beside, outwards in DRIBBLES.values()
        for seed in range(robots)
    ]  # fmt: skip
    results: list[DribbleResult] = parallel_map(dribble, specs, jobs=jobs, label="dribbles")
    return results


def means(
    results: Sequence[KickResult | DribbleResult], intended: float
) -> dict[str, float]:
    """Means of kicks in a direction [rad], and the standard deviations, by their names in a table.

    Directions are taken around the intended one, so that a kick straight back has a mean.
    """
    errors = [math.remainder(each.direction - intended, math.tau) for each in results]
    distances = [each.distance for each in results]
    return {
        "direction": math.remainder(intended + statistics.fmean(errors), math.tau),
        "direction_spread": statistics.pstdev(errors),
        "distance": statistics.fmean(distances),
        "distance_spread": statistics.pstdev(distances),
        "speed": statistics.fmean(each.speed for each in results),
    }


def dribble_rows(results: Sequence[DribbleResult]) -> Iterator[str]:
    """The part `dribbles` of the file."""
    yield "dribbles:"
    across = dict.fromkeys(each.spec.across for each in results)
    for name, place in zip(DRIBBLES, across, strict=True):
        mine = [each for each in results if each.spec.across == place and each.stood]
        if not mine:
            raise NaoGaitError(name, "no attempt", "robots that touch the ball and stay upright")
        values = {
            "x": statistics.fmean(each.spot[0] for each in mine),
            "y": mine[0].spec.across,
            **means(mine, 0.0),
            "seconds": HIT_TIME,
        }
        yield _row(name, values)


def table(
    urdf: str, results: Sequence[KickResult], dribbles: Sequence[DribbleResult]
) -> str:
    """The text of the file; kicks after which too many robots fall are left out."""
    motions = shipped_library(loaded_robot(urdf)).motions
    lines = [
        f"# Kicks of {len({each.spec.robot_seed for each in results})} simulated robots each; "
        "written by nao_gait write kicks.",
        *dribble_rows(dribbles),
        "kicks:",
    ]
    for name in dict.fromkeys(each.spec.motion for each in results):
        mine = [each for each in results if each.spec.motion == name]
        spot = motions[name].kick
        if spot is None or sum(each.stood for each in mine) < STANDS * len(mine):
            continue
        values = {
            "x": spot.x,
            "y": spot.y,
            **means(mine, spot.direction),
            "seconds": statistics.fmean(each.seconds for each in mine),
        }
        lines.append(_row(name, values))
    return "\n".join(lines) + "\n"


def _row(name: str, values: Mapping[str, float]) -> str:
    row = ", ".join(f"{key}: {value:.3g}" for key, value in values.items())
    return f"  - {{motion: {name}, {row}}}"


def write(
    urdf: str, robots: int, engine: str, jobs: int | None, out: Path, say: Callable[[str], None]
) -> None:
    """Measure all kicks and dribbles with each robot, and write the file."""
    what = urdf, robots, engine, jobs
    write_text(out, table(urdf, measured(*what), dribbled(*what)), "out")
    say(f"written: {out}")
