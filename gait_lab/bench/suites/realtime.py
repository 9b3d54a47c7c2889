"""The suite `realtime`: does each answer come in time, also on a busy machine?

The sensor messages of a walk are passed to the `GaitController` at their times by the wall clock.
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
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
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

SPEED = VelocityCommand(0.2, 0.0, 0.0)
BUSY = "while True: sum(range(1000))"


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `realtime` runs on."""

    robots: int = 1
    engine: str = "mujoco"


@dataclass(frozen=True, slots=True)
class Replay:
    """One replay of the messages of a walk.

    Attributes:
        load: Whether the other processes run.
        keeper: Python's garbage collector is kept off the tick.
        wake: [s] that the process woke up late, sorted.
        tick: [s] from waking up to the answer, sorted.
        misses: Answers more than a period after their message was due.
        blocks: Mean number of memory blocks that a tick leaves behind.
    """

    load: bool
    keeper: bool
    wake: tuple[float, ...]
    tick: tuple[float, ...]
    misses: int
    blocks: float

    @property
    def rows(self) -> list[Measurement]:
        """The measurements."""
        load = "loaded" if self.load else "quiet"
        name = f"{load}_{'kept' if self.keeper else 'automatic'}"
        return [
            Measurement(f"{name}_wake_p99", "ms", 1e3 * _quantile(self.wake, 0.99)),
            Measurement(f"{name}_tick_p99", "ms", 1e3 * _quantile(self.tick, 0.99)),
            Measurement(f"{name}_tick_max", "ms", 1e3 * self.tick[-1]),
            Measurement(f"{name}_missed", "ticks", self.misses),
        ]


class _Listener(Fault):
    """Records the messages of the robot by tick."""

    def __init__(self) -> None:
        super().__init__(np.random.default_rng(0))
        self.messages: dict[int, list[Message]] = {}

    def _record(self, harness: Harness, message: Message) -> Iterator[Delivery[Message]]:
        self.messages.setdefault(harness.tick, []).append(message)
        yield Delivery(0, message)

    on_sensor = on_velocity = _record


def realtime(options: Options) -> SuiteResult:
    """Quiet and loaded, with Python's own collector and with the gait's."""
    script = _record(options)
    found = []
    for load in (False, True):
        for keeper in (False, True):
            with _burners(os.cpu_count() or 1 if load else 0):
                found.append(_replay(options, script, load, keeper))
    columns = (
        Column("machine"), Column("collector"), Column("woken late", "p99 ms", 2),
        Column("", "max ms", 2), Column("tick", "p50 ms", 2), Column("", "p99 ms", 2),
        Column("", "max ms", 2), Column("missed", "ticks"), Column("blocks", "per tick", 2),
    )  # fmt: skip
    lines = [
        (
            "loaded" if each.load else "quiet", "kept off" if each.keeper else "automatic",
            1e3 * _quantile(each.wake, 0.99), 1e3 * each.wake[-1],
            1e3 * _quantile(each.tick, 0.5), 1e3 * _quantile(each.tick, 0.99),
            1e3 * each.tick[-1], f"{each.misses}/{len(each.tick)}", each.blocks,
        )
        for each in found
    ]  # fmt: skip
    return SuiteResult(
        tuple(row for each in found for row in each.rows),
        f"{options.window:g} s of walking at 100 Hz by the wall clock, one process; loaded: "
        f"{os.cpu_count()} more that compute without end",
        (Table(columns, lines),),
        ("missed: answered more than a control period after the message was due.",),
    )


def _record(options: Options) -> list[list[Message]]:
    """The messages of the robot in each tick of a walk."""
    listener = _Listener()
    spec = fault_run(options, "none", options.seed).rollout_spec(options.seed)
    simulation, _ = make_pair(spec)
    ticks = round((1.0 + options.window) / PERIOD)
    with simulation:
        Harness(simulation, options.parameters, listener, SPEED).run(ticks)
    return [listener.messages.get(tick, []) for tick in range(1, ticks + 1)]


def _replay(
    options: Options, script: list[list[Message]], load: bool, keeper: bool
) -> Replay:
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
    return Replay(
        load, keeper, tuple(sorted(wake)), tuple(sorted(ticks)), misses, left / len(script)
    )


def _content(message: Message) -> Input:
    return message.content


@contextmanager
def _burners(count: int) -> Iterator[None]:
    """`count` processes that compute without end."""
    processes = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(count)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
        for process in processes:
            process.wait()


def _quantile(ordered: tuple[float, ...], share: float) -> float:
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)]


SUITE = Suite(
    name="realtime",
    title="Ticks on a busy machine",
    summary="whether each answer comes in time, on a quiet and on a busy machine",
    measure=realtime,
    options=Options,
    takes=("window",),
    quick=({"window": 5.0},),
)
