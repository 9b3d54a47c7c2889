"""The suite `soles`: how far the soles are from parallel, before and after levelling."""

import math
from collections.abc import Iterator

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row
from gait_lab.bench.suite import suite
from gait_lab.bench.suites.peers import is_nao
from gait_lab.bench.walks import root_mean_square
from robot_core.types import VelocityCommand
from sim_bridge.trials.calibration import Levelled, SoleTilt, levelling
from sim_bridge.trials.tasks import STAND_TIME, find_task
from sim_bridge.trials.trial import Push, TrialSpec

PUSHES = ((2.0, -0.5 * math.pi), (4.0, 0.0), (6.0, math.pi))
"""Times of walking [s] and directions [rad] of the pushes."""


def walk(asked: tuple[TrialSpec, VelocityCommand, float, float]) -> tuple[Levelled, Levelled]:
    """The first and the last state of a walk of some seconds with pushes of an impulse [N s]."""
    spec, command, seconds, impulse = asked
    pushes = [Push(STAND_TIME + time, impulse, direction) for time, direction in PUSHES
              if impulse > 0.0 and time < seconds]  # fmt: skip
    states = levelling(spec, command, seconds, tuple(pushes))
    before = after = next(states)
    for after in states:
        if after.fallen:
            break
    return before, after


@suite(
    "soles", "Level soles", "the soles against each other before and after levelling",
    options={
        "robots": 40, "tasks": ("spot", "forward=20"), "window": 10.0,
        "push": Option(0.0, "push the robot three times with this impulse [N s]", "J", minimum=0.0,
                       maximum=5.0),
    },
    quick=({"robots": 4},), applies=is_nao,
)  # fmt: skip
def soles(options: Options) -> Iterator[Row | str]:
    """Walk the robots and compare their soles with the truth."""
    jobs = [
        (TrialSpec(robot_seed=seed, noise_seed=max(seed, 0), **options.trial),
         find_task(name).command, options.window, options.push)
        for name in options.tasks for seed in options.seeds
    ]  # fmt: skip
    walked = options.map(walk, jobs)
    for index, (name, robots) in enumerate(
        zip(options.tasks, options.by_robots(walked), strict=True)
    ):
        # The first task has the names without a prefix.
        subject = "sole" if index == 0 else f"{name.replace('=', '_')}_sole"
        upright = [pair for pair in robots if not pair[1].fallen]
        for axis in SoleTilt._fields:
            for place, moment in enumerate(("before", "after") if upright else ()):
                tilts = [math.degrees(getattr(pair[place].left, axis)) for pair in upright]
                yield Row(subject, f"{axis}_rms_{moment}", "deg", root_mean_square(tilts))
                yield Row(subject, f"{axis}_worst_{moment}", "deg", max(map(abs, tilts)))
        yield Row(subject, "upright", "robots", len(upright))
    yield (
        f"Tilt of the left sole relative to the right one against the truth, {options.window:g} s "
        "after a walk begins from a stand, of the robots that stayed upright. The robot measures "
        "it by gyro, accelerometer and encoders."
    )
