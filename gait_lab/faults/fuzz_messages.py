"""Random valid and invalid messages into every input of the gait and of the bridge."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from gait_lab.faults.invariants import HANG, CommandCheck
from nao_lipm_gait.head.gaze import PAN, TILT
from nao_lipm_gait.parameters import PARAMETERS, GaitParameters
from nao_lipm_gait.runtime.commands import head_angles, head_follow, head_mode
from nao_lipm_gait.runtime.controller import ControllerSettings, GaitController, Output
from nao_lipm_gait.runtime.inputs import (
    ImuInput,
    Input,
    JointInput,
    LoadInput,
    TemperatureInput,
    TwistInput,
)
from nao_lipm_gait.runtime.publisher_watch import PublisherCounts
from robot_core.command_input import CommandInput, read_push
from robot_core.errors import NaoGaitError
from robot_core.head_goals import Goal
from robot_core.motion.library import shipped_library
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import GaitStatus, JointTargets

PERIOD = 10_000_000
"""Control period [ns]."""
FLOATS = (
    math.nan, math.inf, -math.inf, 0.0, -0.0, 5e-324, 1e-300, 1.7976931348623157e308, -1e308, 1e9,
    -1e9, 1e3, -1e3, math.pi, -math.pi, 0.1, -0.1,
)  # fmt: skip
SECONDS = (-(2**31), -1, 0, 1, 2**31 - 1)
"""Limits and special values of the seconds of a stamp, an int32."""
NANOSECONDS = (0, 1, 999_999_999, 1_000_000_000, 2**32 - 1)
"""Limits and special values of the nanoseconds of a stamp, a uint32."""
NAMES = ("", "Tail", "LKneePitch", "x" * 1000, "\u0000", "%s%n", "../../etc", "\U0001f916")
MOTION_FILES = ("x.yaml", "/.yaml", "\u0000.yaml", f"{'x' * 5000}.yaml")
"""Motions that are files, none of which can be read."""
GAIT, LOLA = "gait", "LoLA"
"""What is fuzzed."""
BAD_SHARE = 0.3
"""Share of the messages with invalid content."""


@dataclass(frozen=True, slots=True)
class FuzzRun:
    """A run of the fuzzer.

    Attributes:
        target: What it fuzzes.
        seed: Seed of all random choices.
        ticks: Number of control ticks.
    """

    target: str
    seed: int
    ticks: int


@dataclass(frozen=True, slots=True)
class FuzzResult:
    """Result of a fuzzing run.

    Attributes:
        run: The run.
        answers: Joint commands that the gait sent.
        refused: Messages, parameters and commands that were refused.
        violations: Violated invariants, the first 20.
    """

    run: FuzzRun
    answers: int
    refused: int
    violations: tuple[str, ...]


class Fuzzer:
    """A robot that follows its targets exactly, and senders of valid and invalid messages.

    Args:
        seed: Seed of all random choices. With an odd one the gait walks on while messages are lost.
        robot: The robot; by default the NAO.

    Attributes:
        controller: The gait under test.
        violations: Violated invariants, the first 20.
        ticks: Control ticks so far.
        answers: Joint commands that the gait sent.
        refused: Messages, parameters and commands that were refused.
        random: The random generator.
    """

    def __init__(self, seed: int, robot: RobotDescription | None = None) -> None:
        self._seed = seed
        self.random = np.random.default_rng(seed)
        self._robot = load_robot() if robot is None else robot
        self._names = list(self._robot.joint_names)
        self._motions = tuple(shipped_library(self._robot).motions)
        self._pose = self._robot.stand_pose.tolist()
        self._stamp = 1_000_000_000
        self._now = 0.0
        self._command_input = CommandInput(self._robot)
        self.violations: list[str] = []
        self.answers = self.refused = self.ticks = 0
        self._make_controller()

    def _make_controller(self) -> None:
        self.controller = GaitController(
            self._robot, GaitParameters(), ControllerSettings(), lambda: self._now
        )
        self._check = CommandCheck(self._robot)

    # -- output of the gait -----------------------------------------------------------------------

    def _check_output(self, output: Output) -> None:
        for targets, status, _ in output.answers:
            self._check_command(targets)
            if status is not None:
                self._check_status(status)
        for _, text in output.log:
            if len(text) > 2000:
                self._violate(f"log: a line of {len(text)} characters")

    def _check_command(self, targets: JointTargets) -> None:
        """Check a joint command; the robot follows it."""
        self.answers += 1
        found = self._check.check(targets)
        if found is not None:
            self._violate(f"command: {found}")
        self._pose = np.asarray(targets.position).tolist()

    def _check_status(self, status: GaitStatus) -> None:
        """Check that the published status is finite."""
        values = (*status.com_estimated_in_q, *status.velocity, *status.base_footprint_in_odom)
        if not all(math.isfinite(value) for value in values):
            self._violate(f"status: {values}")

    def _violate(self, text: str) -> None:
        if len(self.violations) < 20:
            self.violations.append(f"tick {self.ticks}: {text}")

    # -- input of the gait -------------------------------------------------------------------------

    def run(self, ticks: int) -> FuzzResult:
        """Send valid and invalid messages for a number of ticks."""
        for _ in range(ticks):
            before = time.thread_time()
            try:
                self.tick()
            except Exception as error:
                self._violate(f"{type(error).__name__}: {error}")
            if time.thread_time() - before > HANG:
                self._violate("hang")
        self.refused += sum(self.controller.rejected.values())
        run = FuzzRun(GAIT, self._seed, self.ticks)
        return FuzzResult(run, self.answers, self.refused, tuple(self.violations))

    def tick(self) -> None:
        """Send the messages of one control period, call services, and check the robot's side."""
        self.ticks += 1
        self._stamp += PERIOD
        self._now += 0.01
        messages: list[tuple[str, Input]] = [("imu/data", self._imu())]
        messages.append(("joint_states", self._joints()))
        if self._chance(0.1):
            messages.append(("cmd_vel", self._twist()))
        if self._chance(0.02):
            messages.append(("temperature", self._temperature()))
        if self.controller.needs_loads:
            messages += [("l_sole/wrench", self._load(side)) for side in (0, 1)]
        if self._chance(0.05):
            self.random.shuffle(messages)  # type: ignore[arg-type]
        for topic, message in messages:
            if self._chance(0.02):
                continue
            if self._chance(BAD_SHARE):
                self.send(topic, self._invalid(message))
            if not self._chance(0.2):
                self.send(topic, message)
        if self._seed % 2 == 1 and self._chance(0.2):
            self._checked("overdue", "", self.controller.overdue)
        self._services()
        self._robot_side()

    def send(self, topic: str, message: Input) -> None:
        """Send one message; an exception of the gait is a violation."""
        controller = self.controller
        self._checked(topic, message, lambda: controller.receive(topic, lambda: message))

    def _checked(self, topic: str, what: object, work: Callable[[], Output]) -> None:
        unexpected, crashes = self.controller.unexpected, len(self.controller.crashes)
        self._check_output(work())
        if self.controller.unexpected > unexpected:
            self._violate(f"exception for {topic}: {what}"[:500])
        if len(self.controller.crashes) > crashes:
            self._violate(f"crash for {topic}: {self.controller.crashes[-1]}"[:500])

    def _requests(self) -> None:
        """Ask for a motion, or for a goal of the head."""
        controller, kind = self.controller, int(self.random.integers(4))
        if kind == 0:
            name = self._pick((*NAMES, *MOTION_FILES, *self._motions))
            topic, what = "~/motion", name
            act = partial(controller.request_motion, name)
        elif kind == 1:
            names, angles = [self._pick((*NAMES, PAN, TILT)) for _ in range(2)], self._triple(0.5)
            names = [PAN, TILT] if self._chance(0.5) else names
            topic, what = "~/head", f"{names}: {angles}"
            act = partial(self._look, lambda: head_angles(names, angles[:2], self._robot))
        elif kind == 2:
            point, frame = self._triple(1.0), self._pick((*NAMES, "odom", "base_footprint"))
            topic, what = "~/follow", f"{point} in {frame}"
            act = partial(self._look, lambda: head_follow(point, frame, self._robot))
        else:
            text = self._pick((*NAMES, "search", "free"))
            topic, what = "~/head_mode", text
            act = partial(self._look, lambda: head_mode(text))
        self._checked(topic, what, lambda: controller.run(topic, act))

    def _look(self, goal: Callable[[], Goal | None]) -> None:
        self.controller.look(goal())

    def _services(self) -> None:
        controller = self.controller
        if self._chance(0.005):
            acts = (controller.stand, controller.stand, controller.relax, controller.get_up)
            self._checked("service", "", partial(self._serve, self._pick(acts)))
        if self._chance(0.01):
            self._requests()
        if self._chance(0.002):
            controller.note_motors(self._chance(0.8))
        if self._chance(0.02):
            changes = self._changes()
            try:
                controller.change_parameters(changes)
            except NaoGaitError:
                self.refused += 1
        if self.ticks % 25 == 0:
            self._check_output(controller.watch())
        if self.ticks % 100 == 0:
            counts = PublisherCounts(*self.random.integers(0, 4, 3).tolist())
            controller.note_publishers(counts)
            controller.reports()
        if self._chance(0.0005):
            self.refused += sum(controller.rejected.values())
            self._make_controller()  # a restarted gait
        if self._chance(0.001):
            self._stamp += int(self.random.integers(-(10**9), 10**10))
            self._stamp = max(0, self._stamp)

    def _serve(self, act: Callable[[], str]) -> Output:
        accepted, _ = self.controller.answer(act)
        self.refused += not accepted
        return Output()

    def _robot_side(self) -> None:
        """Send a joint command and a push to the bridge."""
        names, position = list(self._names), list(self._pose)
        effort = [1.0] * len(names)
        if self._chance(BAD_SHARE):
            names, position, effort = self._invalid_lists(names, position, effort)
        sender, now = self._pick(NAMES), self._now
        bridge, stamp = self._command_input, self._stamp
        self._count_refusal(lambda: bridge.admit(sender, now))
        self._count_refusal(lambda: bridge.read(sender, now, stamp, names, position, effort))
        force = [self._number(1.0) for _ in range(3)]
        frame = self._pick(("", "world", "x"))
        self._count_refusal(lambda: read_push(force, (0.0, 0.0, 0.0), frame))

    def _count_refusal(self, work: Callable[[], Any]) -> None:
        try:
            result = work()
        except NaoGaitError:
            self.refused += 1
            return
        targets = result[0] if isinstance(result, tuple) else None
        if targets is not None and not np.isfinite(targets.position).all():
            self._violate("robot: accepted targets that are not finite")

    # -- messages ----------------------------------------------------------------------------------

    def _joints(self) -> JointInput:
        noise = self.random.normal(0.0, 0.002, len(self._pose))
        position = (np.asarray(self._pose) + noise).tolist()
        sec, nanosec = divmod(self._stamp, 1_000_000_000)
        return JointInput(sec, nanosec, self._names, position)

    def _imu(self) -> ImuInput:
        x, y, z = self.random.normal(0.0, 0.05, 3).tolist()
        sec, nanosec = divmod(self._stamp, 1_000_000_000)
        return ImuInput(sec, nanosec, (x, y, 0.0), (y, z, 9.81 + x))

    def _twist(self) -> TwistInput:
        x, y, yaw = self.random.uniform(-0.3, 0.4, 3).tolist()
        return TwistInput((x, y, 0.0), (0.0, 0.0, yaw))

    def _load(self, side: int) -> LoadInput:
        sec, nanosec = divmod(self._stamp, 1_000_000_000)
        return LoadInput(sec, nanosec, side, float(self.random.uniform(0.0, 50.0)))

    def _temperature(self) -> TemperatureInput:
        sec, nanosec = divmod(self._stamp, 1_000_000_000)
        joint = self._pick((*self._names, *NAMES))
        return TemperatureInput(sec, nanosec, joint, float(self.random.normal(50.0, 10.0)))

    def _invalid(self, message: Input) -> Input:
        if isinstance(message, TwistInput):
            return replace(message, linear=self._triple(0.3), angular=self._triple(0.3))
        if self._chance(0.3):
            message = replace(
                message, sec=self._pick(SECONDS), nanosec=self._pick(NANOSECONDS)
            )  # fmt: skip
        if isinstance(message, LoadInput):
            return replace(message, force=self._number(20.0))
        if isinstance(message, ImuInput):
            return replace(
                message,
                angular_velocity=self._triple(1.0),
                linear_acceleration=self._triple(10.0),
                orientation=(*self._triple(1.0), self._number(1.0)),
                orientation_covariance=self._number(1.0),
                angular_velocity_covariance=self._pick((-1.0, 0.0, math.nan)),
            )
        if isinstance(message, TemperatureInput):
            return replace(message, degrees=self._number(50.0))
        names, position, _ = self._invalid_lists(
            list(message.names), list(message.position), [0.0] * len(message.names)
        )
        return replace(message, names=names, position=position)

    def _invalid_lists(
        self, names: list[str], *columns: list[float]
    ) -> tuple[list[str], list[float], list[float]]:
        position, other = columns
        kind = int(self.random.integers(8))
        place = int(self.random.integers(len(names)))
        if kind == 0:
            position[place] = self._number(1.0)
        elif kind == 1:
            other[place] = self._number(1.0)
        elif kind == 2:
            position = [self._number(1.0) for _ in position]
        elif kind == 3:
            names[place] = self._pick(NAMES)
        elif kind == 4:
            del names[place], position[place], other[place]
        elif kind == 5:
            cut = int(self.random.integers(len(position) + 1))
            position, other = position[:cut], other[: int(self.random.integers(cut + 1))]
        elif kind == 6:
            order = self.random.permutation(len(names)).tolist()
            names = [names[i] for i in order]
            position, other = [position[i] for i in order], [other[i] for i in order]
        else:
            more = int(self.random.integers(1, 50))
            names, position = names + ["x"] * more, position + [0.0] * more
            other = other + [0.0] * more
        return names, position, other

    def _changes(self) -> dict[str, object]:
        changes: dict[str, object] = {}
        for _ in range(int(self.random.integers(1, 5))):
            parameter = PARAMETERS[self.random.integers(len(PARAMETERS))]
            if parameter.is_switch:
                good: object = bool(self.random.integers(2))
            elif parameter.choices:
                good = parameter.default
            else:
                good = float(self.random.uniform(parameter.minimum, parameter.maximum))
            changes[parameter.name] = (
                self._pick((*FLOATS, "x", None, [], True)) if self._chance(0.5) else good
            )
        return changes

    def _chance(self, share: float) -> bool:
        return bool(self.random.uniform() < share)

    def _pick(self, values: tuple[Any, ...]) -> Any:
        return values[int(self.random.integers(len(values)))]

    def _number(self, size: float) -> float:
        if self._chance(0.5):
            return float(self.random.normal(0.0, size))
        return float(self._pick(FLOATS))

    def _triple(self, size: float) -> tuple[float, float, float]:
        return self._number(size), self._number(size), self._number(size)
