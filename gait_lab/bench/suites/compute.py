"""The suite `compute`: what one tick costs, and where the time of a rollout goes."""

import math

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, table
from gait_lab.bench.timing import WalkTiming, time_walk
from gait_lab.compiled import is_compiled
from gait_lab.trials.tasks import find_task
from gait_lab.trials.trial import CONTROL_PERIOD
from sim_bridge.plant import load_plant, with_options

SUITE = "compute"
FIRST = 50
"""Ticks of the gait that are left out: they pay for caches and imports."""


def compute(options: BenchOptions) -> Report:
    """Cost of one tick while walking, and of the parts of a rollout."""
    timing = time_walk(options, find_task("forward"))
    ticks = sorted(timing.gait_ticks[FIRST:])
    p50 = ticks[len(ticks) // 2] / 1000.0
    p99 = ticks[min(len(ticks) - 1, math.ceil(len(ticks) * 0.99) - 1)] / 1000.0
    most = ticks[-1] / 1000.0
    speed, alone = timing.speed(timing.by_itself), timing.speed(timing.simulation_alone)
    loop = timing.speed(timing.simulation + timing.gait)
    whole = timing.speed(timing.rollout)
    parts = _parts(timing, options)
    rows = (
        Row(SUITE, "tick_p50", "us", p50),
        Row(SUITE, "tick_p99", "us", p99),
        Row(SUITE, "tick_max", "us", most),
        Row(SUITE, "rollout_speed", "s/s", speed),
        Row(SUITE, "loop_speed", "s/s", loop),
        Row(SUITE, "physics_speed", "s/s", alone),
        Row(SUITE, "rollout_share", "", loop / alone),
        Row(SUITE, "rollout_share_with_truth", "", whole / alone),
        *(Row(SUITE, f"{name}_time", "us", timing.per_tick(span)) for name, _, span in parts),
    )
    lines = [["part", "", "us per tick", "share"], ["", "", "", "%"]]
    for name, content, span in parts:
        share = f"{100.0 * span / timing.rollout:.0f}"
        lines.append([name, content, f"{timing.per_tick(span):.0f}", share])
    text = "\n".join(
        (
            f"{timing.ticks * CONTROL_PERIOD:g} s forward walk on robot {options.seed}, one core, "
            f"plant {options.plant_title}, {options.engine}, "
            f"the gait {'compiled' if is_compiled() else 'as Python'}",
            "",
            table(lines),
            "",
            f"Gait.step  p50 {p50:.0f} us   p99 {p99:.0f} us   max {most:.0f} us   "
            f"({len(ticks)} ticks one by one, wall time; all else CPU time)",
            f"simulated s per s: {speed:.1f} the same rollout by itself, with its set-up",
            f"among the clocks of this table: {loop:.1f} engine, plant and gait, "
            f"{alone:.1f} the same engine and plant alone (share {loop / alone:.2f}; "
            f"with truth and metrics {whole:.1f}, {whole / alone:.2f})",
            "In the table, as in rollouts, the gait answers what the delay holds back in a row.",
        )
    )
    return Report(rows, text)


def _parts(timing: WalkTiming, options: BenchOptions) -> tuple[tuple[str, str, int], ...]:
    """Name, content and time [ns] of each part of a rollout."""
    plant = with_options(load_plant(options.plant), options.plant_options)
    steps = round(CONTROL_PERIOD / plant.physics.step)
    rest = timing.rollout - timing.simulation - timing.gait
    return (
        ("engine", f"{steps} steps of {options.engine}", timing.engine_alone),
        ("plant", "setpoints, observation, sensors", timing.simulation - timing.engine_alone),
        ("gait", "Gait.step", timing.gait),
        ("truth", "ground truth, status, metrics", rest),
        ("rollout", "all of it", timing.rollout),
    )
