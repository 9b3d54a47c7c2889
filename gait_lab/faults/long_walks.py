"""Long walks in the fault harness: with messages that are lost or late, and for hours."""

import gc
import math
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gait_lab.faults.campaign import FaultRun
from gait_lab.faults.harness import PERIOD, Fault, Harness, Timed
from gait_lab.faults.messages import Delivery, Message
from gait_lab.faults.network_faults import Loss, WanderingAge
from robot_core.types import VelocityCommand
from sim_bridge.trials.tasks import RandomCommands

START = 1.0
"""Time of the first velocity command [s]."""
SETTLED = 3.0
"""Time after `START` from which the speed is measured [s]."""


@dataclass(frozen=True, slots=True)
class LossWalk:
    """A straight walk of some seconds at a speed [m/s], of the robot with the seed of the run.

    Attributes:
        wander: Up to this time [s] the age of the sensors wanders beyond the plant's delay.
        coast: The gait walks on for single control periods without sensors.
    """

    run: FaultRun
    share: float
    speed: float
    seconds: float
    wander: float = 0.0
    coast: bool = True


class _LossAndAge(Loss):
    """Loss of messages, and sensor messages whose age wanders."""

    def __init__(self, walk: LossWalk) -> None:
        random = np.random.default_rng(max(0, walk.run.seed))
        super().__init__(random)
        self.begin, self.share = 0.0, walk.share
        self._coasts = walk.coast
        self._age = WanderingAge(random)
        self._age.begin, self._age.most = 0.0, round(walk.wander / PERIOD)

    def coasts(self, harness: Timed) -> bool:
        """As the walk asks for."""
        return self._coasts

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Drop the message, or delay it."""
        for delay, kept in super().on_sensor(harness, message):
            if self._age.most == 0:
                yield Delivery(delay, kept)
            else:
                yield from self._age.on_sensor(harness, kept)


@dataclass(frozen=True, slots=True)
class LossResult:
    """Time of a fall [s], and the mean speed along the torso's heading [m/s]; NaN after a fall."""

    walk: LossWalk
    fell_at: float | None
    speed: float
    violations: tuple[str, ...]


def walk_with_loss(walk: LossWalk) -> LossResult:
    """Walk with loss until the end or a fall."""
    fault = _LossAndAge(walk)
    speeds = []
    with walk.run.world(walk.run.seed) as world:
        command = VelocityCommand(walk.speed, 0.0, 0.0)
        harness = Harness(world, walk.run.parameters, fault, command, START)
        for _ in range(round((START + walk.seconds) / PERIOD)):
            harness.step()
            if harness.fallen:
                break
            if harness.seconds() > START + SETTLED:
                speeds.append(float(harness.truth.torso_linear_velocity_in_torso[0]))
        invariants = harness.invariants
        mean = math.nan if invariants.fell_at is not None or not speeds else float(np.mean(speeds))
        return LossResult(walk, invariants.fell_at, mean, invariants.listed())


@dataclass(frozen=True, slots=True)
class SoakSample:
    """The process after some simulated seconds: resident bytes, objects that Python tracks."""

    seconds: float
    memory: int
    objects: int
    falls: int
    steps: int
    violations: tuple[str, ...]


def soak(run: FaultRun, minutes: float, every: float = 10.0) -> Iterator[SoakSample]:
    """Walk for simulated minutes with random commands; yield a sample `every` so many seconds.

    The robot is reset after each fall. The seed of the run is that of robot and commands.
    """
    commands = RandomCommands((max(0, run.seed), 1))
    falls = steps = last = 0
    with run.world(run.seed) as world:
        fault = Fault(np.random.default_rng(0))
        harness = Harness(world, run.parameters, fault, commands.at(0.0))
        down = 0
        for tick in range(1, round(minutes * 60.0 / PERIOD) + 1):
            asked = commands.at(harness.seconds())
            # Half the full speeds: the test is about the process, not about falls.
            harness.command = VelocityCommand(0.5 * asked.x, 0.5 * asked.y, 0.5 * asked.yaw)
            harness.step()
            status = harness.gaits[0].controller.last_status
            count = 0 if status is None else status.step_count
            steps += max(0, count - last)
            last = count
            down = down + 1 if harness.fallen else 0
            if down == 100:
                falls += 1
                harness.reset_robot()
            if tick % round(every / PERIOD) == 0:
                gc.collect()
                objects = len(gc.get_objects())
                violations = harness.invariants.listed()
                yield SoakSample(
                    harness.seconds(), resident_memory(), objects, falls, steps, violations
                )


def resident_memory() -> int:
    """Return the resident memory of this process [bytes]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")
