"""The tour that the demo walks, and how each of its phases is scored from a recorded bag."""

import math
from dataclasses import dataclass

import numpy as np

from gait_lab.record.recording import Recording
from nao_lipm_gait.types import STANDSTILL, VelocityCommand

SETTLE = 2.5
"""[s] after a change of the command before a phase is measured."""
FALL_TILT = math.radians(45.0)
FALL_HEIGHT_SHARE = 0.5
LOADED = 2.0
"""[N] from which a sole carries load."""


@dataclass(frozen=True, slots=True)
class Phase:
    """One stretch of the tour."""

    name: str
    duration: float
    """[s] of simulated time."""
    command: VelocityCommand
    reach: tuple[str, float] | None = None
    """The axis (`x`, `y`, `yaw`) and the speed [m/s, rad/s] that a good walk reaches in it."""


def _turn(degrees: float) -> VelocityCommand:
    return VelocityCommand(0.0, 0.0, math.radians(degrees))


# A little more is asked for than is to be reached: the slower robots lose some of it to slip.
TOUR = (
    Phase("stand", 1.5, STANDSTILL),
    Phase("forward", 9.0, VelocityCommand(0.28, 0.0, 0.0), ("x", 0.25)),
    Phase("side left", 7.0, VelocityCommand(0.0, 0.10, 0.0), ("y", 0.09)),
    Phase("side right", 7.0, VelocityCommand(0.0, -0.10, 0.0), ("y", -0.09)),
    Phase("back", 8.0, VelocityCommand(-0.22, 0.0, 0.0), ("x", -0.20)),
    Phase("turn left", 7.0, _turn(55.0), ("yaw", math.radians(45.0))),
    Phase("turn right", 7.0, _turn(-55.0), ("yaw", -math.radians(45.0))),
    Phase("curve", 8.0, VelocityCommand(0.15, 0.0, math.radians(20.0))),
    Phase("stop", 4.0, STANDSTILL),
)
SHORT_TOUR = (
    Phase("stand", 1.5, STANDSTILL),
    Phase("forward", 5.0, VelocityCommand(0.2, 0.0, 0.0), ("x", 0.16)),
    Phase("stop", 4.0, STANDSTILL),
)
TOURS = {"full": TOUR, "short": SHORT_TOUR}


@dataclass(frozen=True, slots=True)
class PhaseResult:
    """What a phase achieved between `start` and `end` [s since the tour began]."""

    phase: Phase
    start: float
    end: float
    achieved: VelocityCommand
    """Mean ground-truth velocity in the torso's own heading; yaw gained per time."""
    com_error_y: float
    """Mean |expected - measured| y of the CoM in Q [m], the paper's error; NaN while standing."""
    flight_share: float
    """Share of the readings with no loaded sole."""

    @property
    def reached(self) -> bool | None:
        """True if the phase reached its speed, None if it has none to reach."""
        if self.phase.reach is None:
            return None
        axis, speed = self.phase.reach
        return bool(getattr(self.achieved, axis) * math.copysign(1.0, speed) >= abs(speed))


def phase_at(tour: tuple[Phase, ...], time: float) -> Phase | None:
    """The phase at a time [s since the tour began]; None after its end."""
    for phase in tour:
        if time < phase.duration:
            return phase
        time -= phase.duration
    return None


def duration(tour: tuple[Phase, ...]) -> float:
    """[s]"""
    return sum(phase.duration for phase in tour)


def evaluate(recording: Recording, tour: tuple[Phase, ...], began: float) -> list[PhaseResult]:
    """Score every phase that was walked to its end; `began` [s] of simulated time."""
    results = []
    truth = recording.truth
    begin = began
    for phase in tour:
        end = begin + phase.duration
        start = begin + min(SETTLE, 0.5 * phase.duration)
        inside = (truth.time >= start) & (truth.time <= end)
        if truth.time.size and truth.time[-1] >= end - 0.1 and inside.sum() > 2:
            velocity = truth.velocity_in_heading[inside].mean(axis=0)
            yaw = np.unwrap(truth.yaw[inside])
            seconds = truth.time[inside][-1] - truth.time[inside][0]
            achieved = VelocityCommand(
                float(velocity[0]), float(velocity[1]), float((yaw[-1] - yaw[0]) / seconds)
            )
            results.append(
                PhaseResult(
                    phase,
                    start - began,
                    end - began,
                    achieved,
                    math.nan if phase.command.is_zero else recording.com_error_y(start, end),
                    recording.flight_share(start, end, LOADED),
                )
            )
        begin = end
    return results


def fall_time(recording: Recording) -> float | None:
    """[s] of simulated time at which the robot had fallen, None if it stayed up."""
    truth = recording.truth
    if not truth.time.size:
        return None
    fallen = (truth.tilt > FALL_TILT) | (
        truth.position[:, 2] < FALL_HEIGHT_SHARE * truth.position[0, 2]
    )
    return float(truth.time[fallen][0]) if fallen.any() else None
