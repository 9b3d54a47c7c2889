"""The tour that the demo walks, and the evaluation of each of its phases from the recorded bag."""

import math
from dataclasses import dataclass

from robot_core.types import STANDSTILL, VelocityCommand
from sim_bridge.trials.metrics import fall_tick, measure
from sim_bridge.trials.trace import Trace

SETTLE = 2.5
"""Time [s] after a change of the command from which a phase is measured."""


@dataclass(frozen=True, slots=True)
class TourPhase:
    """One phase of the tour, with a constant command.

    Attributes:
        duration: Simulated time [s].
        reach: Axis (`x`, `y` or `yaw`) and the speed along it [m/s or rad/s] that the robot has to
            reach; None without a requirement.
    """

    name: str
    duration: float
    command: VelocityCommand
    reach: tuple[str, float] | None = None


def _turn(degrees: float) -> VelocityCommand:
    return VelocityCommand(0.0, 0.0, math.radians(degrees))


# The speeds to reach are 3 to 5 % below the slowest of robots 0 to 11 in PyBullet: 35.5 cm/s
# forward, 18.1 to the side, 30.5 back, 83 deg/s in a turn, and 24.1 cm/s in the curve.
FULL_TOUR = (
    TourPhase("stand", 1.5, STANDSTILL),
    TourPhase("forward", 9.0, VelocityCommand(0.40, 0.0, 0.0), ("x", 0.34)),
    TourPhase("side left", 7.0, VelocityCommand(0.0, 0.20, 0.0), ("y", 0.175)),
    TourPhase("side right", 7.0, VelocityCommand(0.0, -0.20, 0.0), ("y", -0.175)),
    TourPhase("back", 8.0, VelocityCommand(-0.33, 0.0, 0.0), ("x", -0.29)),
    TourPhase("turn left", 7.0, _turn(100.0), ("yaw", math.radians(80.0))),
    TourPhase("turn right", 7.0, _turn(-100.0), ("yaw", -math.radians(80.0))),
    TourPhase("curve", 8.0, VelocityCommand(0.25, 0.0, math.radians(30.0)), ("x", 0.23)),
    TourPhase("stop", 4.0, STANDSTILL),
)
SHORT_TOUR = (
    TourPhase("stand", 1.5, STANDSTILL),
    TourPhase("forward", 5.0, VelocityCommand(0.2, 0.0, 0.0), ("x", 0.16)),
    TourPhase("stop", 4.0, STANDSTILL),
)
TOURS = {"full": FULL_TOUR, "short": SHORT_TOUR}


@dataclass(frozen=True, slots=True)
class TourPhaseResult:
    """What the robot achieved in a phase.

    Attributes:
        achieved: Mean ground-truth velocity in the torso's own heading; yaw gained over time.
        com_error_y: Mean absolute difference between expected and measured CoM along y, relative to
            the pendulum origin [m]; NaN while standing.
        flight_share: Share of the readings without a loaded sole.
    """

    phase: TourPhase
    achieved: VelocityCommand
    com_error_y: float
    flight_share: float

    @property
    def reached(self) -> bool | None:
        """Whether the phase reached its speed; None without a requirement."""
        if self.phase.reach is None:
            return None
        axis, speed = self.phase.reach
        return bool(getattr(self.achieved, axis) * math.copysign(1.0, speed) >= abs(speed))


def phase_at(tour: tuple[TourPhase, ...], time: float) -> TourPhase | None:
    """Return the phase at a time [s since the tour began]; None after the end."""
    for phase in tour:
        if time < phase.duration:
            return phase
        time -= phase.duration
    return None


def duration(tour: tuple[TourPhase, ...]) -> float:
    """Return the duration of a tour [s]."""
    return sum(phase.duration for phase in tour)


def evaluate(trace: Trace, tour: tuple[TourPhase, ...], began: float) -> list[TourPhaseResult]:
    """Evaluate every phase that was walked to its end, as the benchmark measures a task.

    Args:
        trace: The recorded tour.
        tour: Its phases.
        began: [s since the trace's first tick] when the tour began.

    Returns:
        The results of the phases before the end of the trace or a fall.
    """
    fallen = fall_time(trace)
    last = float(trace.time[-1]) if fallen is None else fallen
    results = []
    begin = began
    for phase in tour:
        end = begin + phase.duration
        start = begin + min(SETTLE, 0.5 * phase.duration)
        if last >= end - 0.1:
            measured = measure(trace, start, end)
            results.append(
                TourPhaseResult(
                    phase,
                    VelocityCommand(measured.speed_x, measured.speed_y, measured.turn_rate),
                    math.nan if phase.command.is_zero else measured.com_error_y_measured,
                    measured.flight_share,
                )
            )
        begin = end
    return results


def fall_time(trace: Trace) -> float | None:
    """Return the time of the fall [s since the first tick]; None without one."""
    height = float(trace.torso_position[0, 2])
    tick = fall_tick(trace.torso_position, trace.torso_quaternion, height)
    return None if tick is None else float(trace.time[tick])
