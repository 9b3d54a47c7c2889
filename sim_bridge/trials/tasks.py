"""Tasks of a rollout: named, timed velocity commands; and random commands.

A walk task stands, ramps the command up, settles, and is measured over a window at full command.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.schema import Choice, Number, Optional
from robot_core.types import STANDSTILL, VelocityCommand

STAND_TIME = 3.0
"""[s] of standing before the walk; the gait estimates the gyro bias in this time."""
RAMP_TIME = 3.0
SETTLE_TIME = 1.0
WINDOW = 20.0
"""[s] length of the measured window."""

AXES = {"x": ("cm/s", 100.0), "y": ("cm/s", 100.0), "yaw": ("deg/s", math.degrees(1.0))}
"""Unit in tables and its factor from SI, by axis of the command."""


@dataclass(frozen=True, slots=True)
class AskedMotion:
    """A motion and the time of its request.

    Attributes:
        time: [s] since the start.
        name: Name of the motion.
    """

    time: float
    name: str


@dataclass(frozen=True, slots=True)
class Task:
    """A walk: the command over time and the measured window; times are in s since the start.

    Attributes:
        name: Name shown in tables.
        knots: Command at increasing times; linear between them, held after the last.
        start: Start of the measured window.
        end: End of the measured window and of the task.
        axis: `x`, `y` or `yaw`: the axis whose speed is the result; None for standing and stepping.
        motions: Requested on the way, at increasing times; the world then has a ball.
    """

    name: str
    knots: tuple[tuple[float, VelocityCommand], ...]
    start: float
    end: float
    axis: str | None = None
    motions: tuple[AskedMotion, ...] = ()

    def __post_init__(self) -> None:
        times = [time for time, _ in self.knots]
        if not times or any(late <= early for early, late in itertools.pairwise(times)):
            raise NaoGaitError(f"task {self.name}", times, "knots at increasing times")
        asked = [motion.time for motion in self.motions]
        if asked != sorted(asked):
            raise NaoGaitError(f"task {self.name}", asked, "motions at increasing times")
        if not 0.0 <= self.start < self.end:
            raise NaoGaitError(f"task {self.name}", (self.start, self.end), "0 <= start < end")

    def command_at(self, time: float) -> VelocityCommand:
        """The command at a time [s]."""
        before = self.knots[0]
        if time <= before[0]:
            return before[1]
        for after in self.knots[1:]:
            if time < after[0]:
                share = (time - before[0]) / (after[0] - before[0])
                return _between(before[1], after[1], share)
            before = after
        return before[1]

    @property
    def command(self) -> VelocityCommand:
        """The command of the measured window."""
        return self.knots[-1][1]

    @property
    def asked(self) -> float:
        """The commanded speed along the measured axis [m/s or rad/s]."""
        return getattr(self.command, self.axis) if self.axis else 0.0

    def lasting(self, window: float) -> "Task":
        """The same task with another length of the measured window [s]."""
        return self.measured(self.start, self.start + window)

    def scaled(self, share: float, name: str) -> "Task":
        """The same task at a share of its speeds, under another name."""
        knots = tuple((time, _between(STANDSTILL, command, share)) for time, command in self.knots)
        return replace(self, name=name, knots=knots)

    def measured(self, start: float, end: float) -> "Task":
        """The same task with another measured window [s since the start]."""
        return replace(self, start=start, end=end)


def _between(a: VelocityCommand, b: VelocityCommand, share: float) -> VelocityCommand:
    return VelocityCommand(
        a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), a.yaw + share * (b.yaw - a.yaw)
    )


def walk(
    name: str,
    x: float = 0.0,
    y: float = 0.0,
    yaw: float = 0.0,
    axis: str | None = None,
    window: float = WINDOW,
) -> Task:
    """A task: stand, ramp up to x, y, yaw [m/s, m/s, rad/s], settle, walk at it for a window [s].

    The speed along `axis` is the result.

    Raises:
        NaoGaitError: A number is not finite, or there is no such axis.
    """
    up = STAND_TIME + RAMP_TIME
    start = up + SETTLE_TIME
    named = {"x": x, "y": y, "yaw": yaw}
    command = VelocityCommand(*(Number().check(each, value) for each, value in named.items()))
    axis = Optional(Choice(tuple(AXES))).check("axis", axis)
    window = Number(1e-3, 1e6, "s").check("window", window)
    return Task(name, ((STAND_TIME, STANDSTILL), (up, command)), start, start + window, axis)


SPOT_TURN = 1e-3
"""[rad/s] yaw rate that is not zero, so that the robot steps, but too small to be visible."""

TASKS = {
    task.name: task
    for task in (
        walk("forward", x=0.47, axis="x"),
        walk("back", x=-0.40, axis="x"),
        walk("side", y=0.255, axis="y"),
        walk("side_right", y=-0.255, axis="y"),
        walk("turn", yaw=math.radians(126.0), axis="yaw"),
        walk("turn_right", yaw=-math.radians(126.0), axis="yaw"),
        walk("spot", yaw=SPOT_TURN),
        walk("curve", x=0.15, yaw=math.radians(20.0), axis="x"),
        walk("diagonal", x=0.12, y=0.05, axis="x"),
        Task("stand", ((0.0, STANDSTILL),), STAND_TIME, STAND_TIME + WINDOW),
    )
}
SPEED_TASKS = ("forward", "back", "side", "turn")


def find_task(text: str) -> Task:
    """A task by name, or `name=speed` in the unit of its table: `forward=31` is 31 cm/s forward.

    Raises:
        NaoGaitError: There is no such task, or its speed is not above 0.
    """
    name, equals, number = str(text).partition("=")
    task = TASKS.get(name)
    if task is None:
        raise NaoGaitError("task", text, f"one of {', '.join(TASKS)}, or name=speed", TASKS)
    if not equals:
        return task
    if task.axis is None:
        raise NaoGaitError("task", text, f"{name} without =SPEED")
    unit, factor = AXES[task.axis]
    try:
        speed = float(number) / factor
    except ValueError:
        speed = math.nan
    if not math.isfinite(speed) or speed <= 0.0:
        raise NaoGaitError("task", text, f"{name}=SPEED with a speed in {unit}, more than 0")
    # The sign belongs to the name: back=20 walks backward.
    command, asked = task.command, abs(task.asked)
    return walk(
        name, speed * (command.x / asked), speed * (command.y / asked),
        speed * (command.yaw / asked), task.axis, task.end - task.start,
    )


HOLD_TIME = (1.0, 4.0)
"""[s] shortest and longest time for which a command is held."""
CHANGE_TIME = 1.0
"""[s] from one command to the next."""
STOP_SHARE = 0.1
"""Share of the commands that are standstill."""


class RandomCommands:
    """Random, smooth, omnidirectional commands over time.

    Args:
        seed: Seed of the random generator.
    """

    def __init__(self, seed: Sequence[int]) -> None:
        self._random = np.random.default_rng(list(seed))
        self._before = self._after = STANDSTILL
        self._change, self._end = 0.0, STAND_TIME

    def at(self, time: float) -> VelocityCommand:
        """The command at increasing times [s]."""
        while time >= self._end:
            self._before, self._after = self._after, self._draw()
            self._change = self._end
            self._end += CHANGE_TIME + float(self._random.uniform(*HOLD_TIME))
        share = min(1.0, (time - self._change) / CHANGE_TIME)
        share *= share * (3.0 - 2.0 * share)
        return _between(self._before, self._after, share)

    def _draw(self) -> VelocityCommand:
        """Uniform in the ellipsoid whose axes are the full speeds, or standstill."""
        direction = self._random.normal(size=3)
        radius = self._random.uniform() ** (1.0 / 3.0)
        if self._random.uniform() < STOP_SHARE:
            return STANDSTILL
        x, y, yaw = (radius / np.linalg.norm(direction) * direction).tolist()
        ahead = TASKS["forward"].asked if x > 0.0 else -TASKS["back"].asked
        return VelocityCommand(ahead * x, TASKS["side"].asked * y, TASKS["turn"].asked * yaw)
