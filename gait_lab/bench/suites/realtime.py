"""The suite `realtime`: does each answer come in time, also on a busy machine?

The sensor messages of a walk are played to the `GaitController` at their times by the wall clock.
With load, one process per core computes without end beside it.
"""

import gc
import math
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

import numpy as np

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, table
from gait_lab.bench.suites.faults import fault_run
from gait_lab.faults.channel import Delivery, Message
from gait_lab.faults.harness import PERIOD, Fault, Harness
from gait_lab.trials.rollout import make_pair
from nao_lipm_gait.gait import ON_THE_WAY
from nao_lipm_gait.robot import load_robot
from nao_lipm_gait.runtime.controller import GaitController, Settings
from nao_lipm_gait.runtime.inputs import Input
from nao_lipm_gait.runtime.latency import GarbageScheduler
from nao_lipm_gait.types import VelocityCommand

SUITE = "realtime"
SPEED = VelocityCommand(0.2, 0.0, 0.0)
BUSY = "while True: sum(range(1000))"


@dataclass(frozen=True, slots=True)
class Timing:
    """Of one playing."""

    load: bool
    keeper: bool
    """The collector is kept off the tick."""
    wake: tuple[float, ...]
    """[s] how late the process woke up for each tick."""
    tick: tuple[float, ...]
    """[s] from waking up to the answer."""
    misses: int
    """Answers more than a period after their message was due."""
    blocks: float
    """Blocks of memory that a tick leaves behind, mean."""


class _Ear(Fault):
    """Writes down what the robot says."""

    def __init__(self) -> None:
        super().__init__(np.random.default_rng(0))
        self.heard: dict[int, list[Message]] = {}

    def _write(self, harness: Harness, message: Message) -> Iterator[Delivery[Message]]:
        self.heard.setdefault(harness.tick, []).append(message)
        yield Delivery(0, message)

    on_sensor = on_velocity = _write


def realtime(options: BenchOptions) -> Report:
    """Quiet and loaded, with Python's own collector and with the gait's."""
    script = _record(options)
    found = []
    for load in (False, True):
        for keeper in (False, True):
            with _burners(os.cpu_count() or 1 if load else 0):
                found.append(_play(options, script, load, keeper))
    rows = [row for timing in found for row in _rows(timing)]
    lines: list[tuple[str, ...]] = [
        ("machine", "collector", "woken late", "", "tick", "", "", "missed", "blocks"),
        ("", "", "p99 ms", "max ms", "p50 ms", "p99 ms", "max ms", "ticks", "per tick"),
    ]
    for timing in found:
        wake, tick = sorted(timing.wake), sorted(timing.tick)
        lines.append(
            (
                "loaded" if timing.load else "quiet", "kept off" if timing.keeper else "automatic",
                *(f"{1e3 * value:.2f}" for value in (_quantile(wake, 0.99), wake[-1])),
                *(f"{1e3 * value:.2f}" for value in
                  (_quantile(tick, 0.5), _quantile(tick, 0.99), tick[-1])),
                f"{timing.misses}/{len(tick)}", f"{timing.blocks:.2f}",
            )
        )  # fmt: skip
    title = (
        f"{options.window:g} s of walking at 100 Hz by the wall clock, one process; loaded: "
        f"{os.cpu_count()} more that compute without end"
    )
    note = "missed: answered more than a control period after the message was due."
    return Report(tuple(rows), "\n".join((title, "", table(lines), "", note)))


def _record(options: BenchOptions) -> list[list[Message]]:
    """What the robot says in each tick of a walk."""
    ear = _Ear()
    spec = fault_run(options, "none", options.seed).rollout_spec(options.seed)
    simulation, _ = make_pair(spec)
    ticks = round((1.0 + options.window) / PERIOD)
    with simulation:
        Harness(simulation, options.parameters, ear, SPEED).run(ticks)
    return [ear.heard.get(tick, []) for tick in range(1, ticks + 1)]


def _play(
    options: BenchOptions, script: list[list[Message]], load: bool, keeper: bool
) -> Timing:
    controller = GaitController(
        load_robot(options.urdf), options.parameters, Settings(PERIOD), time.monotonic
    )
    gc.collect()
    gc.freeze()
    garbage = GarbageScheduler() if keeper else None
    wake, ticks = [], []
    misses = 0
    blocks = sys.getallocatedblocks()
    begin = time.monotonic() + 0.1
    for index, messages in enumerate(script):
        due = begin + index * PERIOD
        time.sleep(max(0.0, due - time.monotonic()))
        woken = time.monotonic()
        for message in messages:
            controller.receive(message.topic, partial(_content, message))
        done = time.monotonic()
        if garbage is not None:
            garbage.after_tick(resting=controller.state not in ON_THE_WAY)
        wake.append(woken - due)
        ticks.append(done - woken)
        misses += done - due > PERIOD
    left = sys.getallocatedblocks() - blocks
    if garbage is not None:
        garbage.close()
    gc.unfreeze()
    return Timing(load, keeper, tuple(wake), tuple(ticks), misses, left / len(script))


def _content(message: Message) -> Input:
    return message.content


@contextmanager
def _burners(count: int) -> Iterator[None]:
    """So many processes that compute without end."""
    processes = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(count)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
        for process in processes:
            process.wait()


def _quantile(ordered: list[float], share: float) -> float:
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)]


def _rows(timing: Timing) -> list[Row]:
    load = "loaded" if timing.load else "quiet"
    name = f"{load}_{'kept' if timing.keeper else 'automatic'}"
    wake, tick = sorted(timing.wake), sorted(timing.tick)
    return [
        Row(SUITE, f"{name}_wake_p99", "ms", 1e3 * _quantile(wake, 0.99)),
        Row(SUITE, f"{name}_tick_p99", "ms", 1e3 * _quantile(tick, 0.99)),
        Row(SUITE, f"{name}_tick_max", "ms", 1e3 * tick[-1]),
        Row(SUITE, f"{name}_missed", "ticks", timing.misses),
    ]
