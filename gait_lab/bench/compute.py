"""The suite `compute`: what one tick costs, and what control adds to the physics."""

import math
import time
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row
from gait_lab.rollout import CONTROL_PERIOD
from gait_lab.tasks import find_task
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.robot_description import load_robot
from nao_lipm_gait.signals import JointTargets
from sim_bridge.plant import load_plant, with_options
from sim_bridge.simulation import Simulation


@dataclass(frozen=True, slots=True)
class _Timing:
    tick: tuple[int, ...]
    """Duration of every `Gait.step` [ns]."""
    controlled: float
    """Wall time of the closed loop [s]."""
    bare: float
    """Wall time of the same physics with the recorded targets and nothing else [s]."""
    simulated: float
    """[s] of simulated time in either."""


def compute(options: BenchOptions) -> Report:
    """Cost of one tick while walking, and of the rollouts against the same physics alone."""
    timing = _time_walk(options)
    ticks = sorted(timing.tick)
    p50 = ticks[len(ticks) // 2] / 1000.0
    p99 = ticks[min(len(ticks) - 1, math.ceil(len(ticks) * 0.99) - 1)] / 1000.0
    with_control = timing.simulated / timing.controlled
    without = timing.simulated / timing.bare
    suite = "compute"
    rows = (
        Row(suite, "tick_p50", "us", p50),
        Row(suite, "tick_p99", "us", p99),
        Row(suite, "tick_max", "us", ticks[-1] / 1000.0),
        Row(suite, "rollout_speed", "s/s", with_control),
        Row(suite, "physics_speed", "s/s", without),
        Row(suite, "rollout_share", "", with_control / without),
    )
    text = "\n".join(
        (
            f"{timing.simulated:g} s forward walk on robot {options.seed}, one core, "
            f"plant {options.plant_title}, {options.engine}",
            f"  Gait.step           p50 {p50:.0f} us   p99 {p99:.0f} us   "
            f"max {ticks[-1] / 1000.0:.0f} us   ({len(ticks)} ticks)",
            f"  rollout             {with_control:.2f} simulated s per s",
            f"  same physics alone  {without:.2f} simulated s per s   "
            f"(rollout / physics = {with_control / without:.2f})",
        )
    )
    return Report(rows, text)


def _time_walk(options: BenchOptions) -> _Timing:
    robot = load_robot(options.urdf)
    plant = with_options(load_plant(options.plant), options.plant_options)
    task = find_task("forward")
    gait = Gait(robot, options.parameters)
    ticks = round((task.start + options.window) / CONTROL_PERIOD)
    clock = time.perf_counter_ns

    def make() -> Simulation:
        return Simulation(
            robot, plant, options.seed, engine=options.engine, control_period=CONTROL_PERIOD
        )

    # Interleaved in blocks, so that a busy machine slows both alike.
    controlled, bare = make(), make()
    try:
        block = 100
        spans: list[int] = []
        walked = replayed = 0
        targets: JointTargets | None = None
        for first in range(0, ticks, block):
            sent: list[JointTargets | None] = []
            begin = clock()
            for tick in range(first, min(first + block, ticks)):
                sent.append(targets)
                controlled.step(targets)
                frame = controlled.sense()
                if frame is not None:
                    command = task.command_at((tick + 1) * CONTROL_PERIOD)
                    before = clock()
                    targets = gait.step(frame, command)
                    spans.append(clock() - before)
            walked += clock() - begin
            begin = clock()
            for each in sent:
                bare.step(each)
            replayed += clock() - begin
    finally:
        controlled.close()
        bare.close()
    # The first ticks pay for caches and imports.
    return _Timing(
        tuple(spans[50:]), walked * 1e-9, replayed * 1e-9, ticks * CONTROL_PERIOD
    )
