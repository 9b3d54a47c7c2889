"""Faults of the two processes, of their parameters, and of the senders of commands."""

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from gait_lab.faults.harness import Fault, Harness
from gait_lab.faults.messages import Command, Delivery, Message
from gait_lab.faults.stamp_faults import shifted
from nao_lipm_gait.parameters import BY_NAME
from nao_lipm_gait.runtime.inputs import TwistInput
from nao_lipm_gait.runtime.reporter import PublisherCounts
from robot_core.errors import NaoGaitError

CHANGED = (
    "pendulum_width", "pendulum_offset_y", "pendulum_shift_max", "com_height", "foot_spacing",
    "torso_pitch", "swing_lift", "swing_travel_end", "step_forward_max", "step_side_max",
    "step_turn_max", "feedback", "feedback_delay", "velocity_sigma", "offset_time", "heading_gain",
    "gyro_pitch_gain", "tilt_pitch_gain", "arm_swing", "walk", "stand_catch", "kick_reach",
)  # fmt: skip
"""Parameters that the fault `parameters` changes; a fixed list, so that a new one alters no run."""


class GaitRestart(Fault):
    """The gait is killed while walking and restarts 0.1 to 1 s later."""

    why = "until the new gait runs, the robot holds the last targets, on one leg."
    end = 8.0

    def _draw(self, random: np.random.Generator) -> None:
        self._back = self.begin + float(random.uniform(0.1, 1.0))

    def before_physics(self, harness: Harness) -> None:
        """Kill the gait, and start it again."""
        time = harness.seconds()
        if self.begin <= time < self._back and harness.gaits:
            harness.kill_gait()
        elif time >= self._back and not harness.gaits:
            harness.start_gait()


class BridgeReset(Fault):
    """The simulated robot is reset while it walks."""

    end = 8.0

    def _draw(self, random: np.random.Generator) -> None:
        self._done = False

    def before_physics(self, harness: Harness) -> None:
        """Reset the robot once."""
        if self.active(harness) and not self._done:
            self._done = True
            harness.reset_robot()


class BridgeRestart(Fault):
    """The bridge is killed and restarts 0.1 to 1 s later, its clock at zero."""

    end = 8.0

    def _draw(self, random: np.random.Generator) -> None:
        self._silence = int(random.integers(10, 100))
        self._restarted_at: int | None = None

    def before_physics(self, harness: Harness) -> None:
        """Restart the bridge once."""
        if self.active(harness) and self._restarted_at is None:
            self._restarted_at = harness.world.time
            harness.restart_robot(self._silence)

    def on_sensor(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Shift the stamps to the clock of the new bridge."""
        began = self._restarted_at
        yield Delivery(0, message if began is None else shifted(message, -began))

    def on_command(self, harness: Harness, command: Command) -> Iterable[Delivery[Command]]:
        """Shift the stamp back: the simulated world keeps its clock."""
        began, targets = self._restarted_at, command.targets
        if began is not None:
            command = replace(command, targets=targets._replace(stamp=targets.stamp + began))
        yield Delivery(0, command)


class TwoDrivers(Fault):
    """A second sender on cmd_vel commands other velocities, at 2 to 50 Hz."""

    def _draw(self, random: np.random.Generator) -> None:
        self._every = int(random.integers(2, 50))
        self._velocity = random.uniform((-0.2, -0.1, -0.8), (0.3, 0.1, 0.8)).tolist()
        self._stop = random.uniform() < 0.3

    def before_physics(self, harness: Harness) -> None:
        """Send the velocity commands of the second operator."""
        if self.active(harness):
            harness.publishers = PublisherCounts(cmd_vel=2)
            if harness.tick % self._every == 0:
                x, y, yaw = (0.0, 0.0, 0.0) if self._stop else self._velocity
                twist = TwistInput((x, y, 0.0), (0.0, 0.0, yaw))
                for gait in harness.gaits:
                    gait.receive(Message("cmd_vel", twist))


class TwoGaits(Fault):
    """A second gait commands the same robot."""

    why = "when the first gait ends, the second takes over in mid-step with a standing posture."

    def _draw(self, random: np.random.Generator) -> None:
        self._first_ends = random.uniform() < 0.3

    def before_physics(self, harness: Harness) -> None:
        """Start the second gait, and perhaps end the first."""
        if self.active(harness) and harness.publishers.joint_command == 1:
            harness.start_gait()
            harness.publishers = PublisherCounts(joint_command=2)
        if self._first_ends and harness.seconds() > self.begin + 1.0 and len(harness.gaits) > 1:
            harness.kill_gait()


class Parameters(Fault):
    """Every 50 to 500 ms a parameter changes, by up to 10 % or to an invalid value."""

    def _draw(self, random: np.random.Generator) -> None:
        self._every = int(random.integers(5, 50))

    def before_physics(self, harness: Harness) -> None:
        """Change parameters of each gait; refusals must name what is allowed."""
        if not self.active(harness) or harness.tick % self._every:
            return
        for gait in harness.gaits:
            before = gait.controller.parameters
            changes = self._changes(before.as_dict())
            try:
                gait.controller.with_changes(changes)
            except NaoGaitError as error:
                if not (error.field and error.allowed):
                    evidence = f"refusal without allowed values: {changes}"
                    harness.invariants.violate("parameters", evidence)
                if gait.controller.parameters != before:
                    harness.invariants.violate("parameters", f"refused, but applied: {changes}")
                continue
            gait.controller.change_parameters(changes)

    def _changes(self, now: dict[str, float | bool | str]) -> dict[str, object]:
        changes: dict[str, object] = {}
        for _ in range(int(self.random.integers(1, 4))):
            parameter = BY_NAME[CHANGED[self.random.integers(len(CHANGED))]]
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


class NoCommands(Fault):
    """No more cmd_vel: the robot must stop."""

    def on_velocity(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Drop every velocity command."""
        if not self.active(harness):
            yield Delivery(0, message)


class BadCommands(Fault):
    """Cmd_vel with NaN, infinity, huge and jumping values."""

    def on_velocity(self, harness: Harness, message: Message) -> Iterable[Delivery[Message]]:
        """Add an invalid velocity command."""
        yield Delivery(0, message)
        if self.active(harness):
            pick = (math.nan, math.inf, 1e9, -1e9, 9.9, -9.9, 0.0)
            x, y, yaw = (pick[self.random.integers(len(pick))] for _ in range(3))
            bad = Message("cmd_vel", TwistInput((x, y, 0.0), (0.0, 0.0, yaw)))
            yield Delivery(int(self.random.integers(0, 5)), bad)
