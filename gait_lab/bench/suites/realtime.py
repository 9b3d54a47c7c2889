"""The suite `realtime`: does each answer come in time, also on a busy machine?

The sensor messages of a walk are sent at their times by the wall clock: to a `GaitController` in
this process, and over ROS 2 to the node in a process of its own. Beside both, a process that only
sleeps to the same times shows how late the machine itself is. With load, one process per core
computes without end.
"""

import gc
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial

import numpy as np

from gait_lab.bench.options import Options
from gait_lab.bench.ros_replay import ReplayTimes, replay_over_ros, ros_is_installed
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.suites.faults import fault_run
from gait_lab.bench.wake_up import Sleeper, deviations, sleep_until
from gait_lab.demo.node_processes import may_run_in_real_time, real_time_priority
from gait_lab.faults.harness import PERIOD, Fault, Harness
from gait_lab.faults.messages import Delivery, Message
from nao_lipm_gait.gait import ON_THE_WAY
from nao_lipm_gait.presets import preset_for
from nao_lipm_gait.runtime.controller import ControllerSettings, GaitController
from nao_lipm_gait.runtime.latency import GarbageScheduler
from nao_lipm_gait.runtime.reports import quantile
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from robot_core.types import VelocityCommand

SPEED = VelocityCommand(0.2, 0.0, 0.0)
START_TIME = 1.0
"""[s] until the first message: the sleeping process starts meanwhile."""
BUSY = "while True: sum(range(1000))"
Script = list[list[Message]]
"""The messages of the robot in each tick."""


class _Listener(Fault):
    """Records the messages of the robot by tick."""

    def __init__(self) -> None:
        super().__init__(np.random.default_rng(0))
        self.messages: dict[int, list[Message]] = {}

    def _record(self, harness: Harness, message: Message) -> Iterator[Delivery[Message]]:
        self.messages.setdefault(harness.tick, []).append(message)
        yield Delivery(0, message)

    on_sensor = on_velocity = _record


@suite(
    "realtime", "Ticks on a busy machine",
    "whether each answer comes in time, on a quiet and on a busy machine",
    options={"window": ...}, quick=({"window": 5.0},),
)  # fmt: skip
def realtime(options: Options) -> Iterator[Row | str]:
    """In this process with Python's own collector and with the gait's; then over ROS 2."""
    script = _record(options)
    for load in ("quiet", "loaded"):
        for collector in ("automatic", "kept"):
            with _burners(load):
                yield from _replay(f"{load}_{collector}", options, script, collector == "kept")
    if ros_is_installed():
        yield from _over_ros(options, script)
    yield (
        f"At 100 Hz by the wall clock; loaded: beside {os.cpu_count()} processes that compute "
        "without end. missed: answered more than a control period after the message was due or "
        "sent. machine: a process of the same priority that only sleeps to the same times. "
        "automatic: Python's garbage collector; kept: the gait collects while it stands. Over ROS "
        "2: latency from sending joint_states to sending joint_command, period against "
        f"{1e3 * PERIOD:g} ms; net: p99 minus that of the machine; real time: all processes of the "
        "replay under SCHED_FIFO, if this user may."
    )


def _over_ros(options: Options, script: Script) -> Iterator[Row]:
    priorities: dict[str, Callable[[], AbstractContextManager[None]]] = {"normal": nullcontext}
    if may_run_in_real_time():
        priorities["real_time"] = real_time_priority
    for load in ("quiet", "loaded"):
        for priority, taken in priorities.items():
            with _burners(load), taken():
                times = replay_over_ros(script, PERIOD, _node_parameters(options))
            yield from ros_rows(f"ros_{load}_{priority}", times, PERIOD)


def ros_rows(name: str, times: ReplayTimes, period: float) -> list[Row]:
    """Latency and period of the answers, and what is left of them without the machine's own.

    Raises:
        NaoGaitError: Fewer than two answers, of which nothing can be said.
    """
    pairs = zip(times.sent, times.answered, strict=True)
    latency = sorted(after - before for before, after in pairs if after is not None)
    answers = sorted(each for each in times.answered if each is not None)
    if len(answers) < 2:
        found = f"{len(answers)} answers to {len(times.sent)} joint states"
        raise NaoGaitError("replay over ROS 2", found, "a gait that answers")
    woken = [index * period + late for index, late in enumerate(times.machine)]
    late, wake = quantile(latency, 0.99), quantile(sorted(times.machine), 0.99)
    jitter, own = (quantile(deviations(each, period), 0.99) for each in (answers, woken))
    return rows_of(
        name,
        ("latency_p50", "ms", 1e3 * quantile(latency, 0.5)),
        ("latency_p99", "ms", 1e3 * late),
        ("latency_p99_net", "ms", 1e3 * (late - wake)),
        ("period_p99", "ms", 1e3 * jitter),
        ("period_p99_net", "ms", 1e3 * (jitter - own)),
        ("machine_wake_p99", "ms", 1e3 * wake),
        ("missed", "ticks", len(times.sent) - sum(each <= period for each in latency)),
    )


def _node_parameters(options: Options) -> dict[str, object]:
    """ROS parameters of a gait node that walks as the recorded one."""
    usual = preset_for(load_robot(options.urdf), "default").as_dict()
    asked = options.parameters.as_dict()
    changed = {name: value for name, value in asked.items() if value != usual[name]}
    return {"urdf": options.urdf, "bias_wait": 0.0, **changed}


def _record(options: Options) -> Script:
    """The messages of the robot in each tick of a walk."""
    listener = _Listener()
    ticks = round((1.0 + options.window) / PERIOD)
    with fault_run(options, "none", options.seed).world(options.seed) as world:
        Harness(world, options.parameters, listener, SPEED).run(ticks)
    return [listener.messages.get(tick, []) for tick in range(1, ticks + 1)]


def _replay(name: str, options: Options, script: Script, keeper: bool) -> list[Row]:
    """The times of a replay in this process.

    How late it and a process that only sleeps woke up, and how long the answers took.
    """
    controller = GaitController(
        load_robot(options.urdf), options.parameters, ControllerSettings(PERIOD), time.monotonic
    )
    gc.collect()
    gc.freeze()
    garbage = GarbageScheduler() if keeper else None
    wake, ticks = [], []
    misses = 0
    begin = time.monotonic() + START_TIME
    with Sleeper(begin, PERIOD, len(script)) as sleeper:
        for index, messages in enumerate(script):
            due = begin + index * PERIOD
            late = sleep_until(due)
            for message in messages:
                controller.receive(message.topic, partial(getattr, message, "content"))
            done = time.monotonic() - due
            if garbage is not None:
                garbage.after_tick(resting=controller.state not in ON_THE_WAY)
            wake.append(late)
            ticks.append(done - late)
            misses += done > PERIOD
        machine = sleeper.lateness()
    if garbage is not None:
        garbage.close()
    gc.unfreeze()
    return rows_of(
        name,
        ("wake_p99", "ms", 1e3 * quantile(sorted(wake), 0.99)),
        ("machine_wake_p99", "ms", 1e3 * quantile(sorted(machine), 0.99)),
        ("tick_p99", "ms", 1e3 * quantile(sorted(ticks), 0.99)),
        ("tick_max", "ms", 1e3 * max(ticks)),
        ("missed", "ticks", misses),
    )


@contextmanager
def _burners(load: str) -> Iterator[None]:
    """If `load` is `loaded`, one process per core that computes without end."""
    count = (os.cpu_count() or 1) if load == "loaded" else 0
    processes = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(count)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
        for process in processes:
            process.wait()
