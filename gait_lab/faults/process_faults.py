"""Faults in the life of the two processes, and of those who command."""

import math
from collections.abc import Iterable

import numpy as np

from gait_lab.faults.channel import Message
from gait_lab.faults.fault import Fault, Late
from gait_lab.faults.harness import Harness
from gait_lab.faults.stamp_faults import shifted
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import PARAMETERS
from nao_lipm_gait.runtime.diagnostics import Others
from nao_lipm_gait.runtime.inputs import TwistInput


class GaitRestart(Fault):
    """`kill -9` of the gait at speed; another one is there within a second."""

    summary = "the gait is killed at speed and started again 0.1 to 1 s later"
    why = "the robot stands on one leg with the last targets until the new gait is there."
    end = 8.0

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._back = self.begin + float(random.uniform(0.1, 1.0))

    def act(self, stage: Harness) -> None:
        time = stage.seconds()
        if self.begin <= time < self._back and stage.gaits:
            stage.kill_gait()
        elif time >= self._back and not stage.gaits:
            stage.start_gait()


class BridgeReset(Fault):
    """The simulated robot is put back to its start while it walks."""

    summary = "the simulated robot is reset while it walks"
    end = 8.0

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._done = False

    def act(self, stage: Harness) -> None:
        if self.now(stage) and not self._done:
            self._done = True
            stage.reset_robot()


class BridgeRestart(Fault):
    """`kill -9` of the simulated robot; another one is there within a second, its clock at zero."""

    summary = "the simulated robot is killed and started again 0.1 to 1 s later, at time zero"
    end = 8.0

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._silence = int(random.integers(10, 100))
        self._born: int | None = None

    def act(self, stage: Harness) -> None:
        if self.now(stage) and self._born is None:
            self._born = stage.simulation.time
            stage.restart_robot(self._silence)

    def sensors(self, stage: Harness, message: Message) -> Iterable[Late]:
        yield 0, message if self._born is None else shifted(message, -self._born)


class TwoDrivers(Fault):
    """Somebody else sends other velocities to the same robot."""

    summary = "a second sender on cmd_vel asks for something else, at 2 to 50 Hz"

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._every = int(random.integers(2, 50))
        self._asked = random.uniform((-0.2, -0.1, -0.8), (0.3, 0.1, 0.8)).tolist()
        self._stop = random.uniform() < 0.3

    def act(self, stage: Harness) -> None:
        if self.now(stage):
            stage.others = Others(cmd_vel=2)
            if stage.tick % self._every == 0:
                x, y, yaw = (0.0, 0.0, 0.0) if self._stop else self._asked
                twist = TwistInput((x, y, 0.0), (0.0, 0.0, yaw))
                for gait in stage.gaits:
                    gait.receive(Message("cmd_vel", twist))


class TwoGaits(Fault):
    """A second gait is started by mistake, while the first one walks."""

    summary = "a second gait commands the same robot"
    why = "where the first gait ends, the second one takes over in mid-step, from a stand."

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._first_ends = random.uniform() < 0.3

    def act(self, stage: Harness) -> None:
        if self.now(stage) and stage.others.joint_command == 1:
            stage.start_gait()
            stage.others = Others(joint_command=2)
        if self._first_ends and stage.seconds() > self.begin + 1.0 and len(stage.gaits) > 1:
            stage.kill_gait()


class Parameters(Fault):
    """Parameters are changed while the robot walks: good ones, bad ones, several at once."""

    summary = "every 50 to 500 ms a parameter is set: within 10 % of its value, or a bad value"

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._every = int(random.integers(5, 50))

    def act(self, stage: Harness) -> None:
        if not self.now(stage) or stage.tick % self._every:
            return
        for gait in stage.gaits:
            before = gait.entry.parameters
            changes = self._changes(before.as_dict())
            try:
                gait.entry.with_changes(changes)
            except NaoGaitError as error:
                if not (error.field and error.allowed):
                    stage.judge.violate("parameters", f"refused without a reason: {changes}")
                if gait.entry.parameters != before:
                    stage.judge.violate("parameters", f"refused and taken: {changes}")
                continue
            gait.entry.change_parameters(changes)

    def _changes(self, now: dict[str, float | bool | str]) -> dict[str, object]:
        changes: dict[str, object] = {}
        for _ in range(int(self.random.integers(1, 4))):
            parameter = PARAMETERS[self.random.integers(len(PARAMETERS))]
            value = now[parameter.name]
            kind = self.random.integers(4)
            if kind == 0:
                bad = (math.nan, math.inf, 1e9, "fast", None, [1.0])
                changes[parameter.name] = bad[self.random.integers(len(bad))]
            elif isinstance(value, bool | str):
                changes[parameter.name] = value
            else:
                changed = value * float(self.random.uniform(0.9, 1.1))
                changes[parameter.name] = min(max(changed, parameter.minimum), parameter.maximum)
        return changes


class Silent(Fault):
    """The operator's messages stop coming."""

    summary = "cmd_vel falls silent: the robot has to stop"

    def drive(self, stage: Harness, message: Message) -> Iterable[Late]:
        if not self.now(stage):
            yield 0, message


class BadCommands(Fault):
    """The operator's sender is broken."""

    summary = "cmd_vel with NaN, absurd and jumping values"

    def drive(self, stage: Harness, message: Message) -> Iterable[Late]:
        yield 0, message
        if self.now(stage):
            pick = (math.nan, math.inf, 1e9, -1e9, 9.9, -9.9, 0.0)
            x, y, yaw = (pick[self.random.integers(len(pick))] for _ in range(3))
            bad = Message("cmd_vel", TwistInput((x, y, 0.0), (0.0, 0.0, yaw)))
            yield int(self.random.integers(0, 5)), bad
