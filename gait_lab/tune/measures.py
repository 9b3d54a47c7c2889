"""What one robot's walk under a protocol gave: named numbers, and whether it may count."""

from collections.abc import Mapping
from dataclasses import dataclass

from gait_lab.analysis.metrics import FLIGHT_LIMIT, SLIP_LIMIT, Metrics

CONTACT_LIMIT = 0.01
"""Share of ticks with leg against leg that costs as much as twice the flight limit."""
EXCESS_MAX = 3.0
"""A robot that skates is not worse than that."""


@dataclass(frozen=True, slots=True)
class Measures:
    """One robot's result; `values` are SI and hold the protocol's names."""

    robot: int
    values: Mapping[str, float]
    fell: bool
    excess: float = 0.0
    """By how much the walk breaks the limits of walking, in shares of them; 0 = honest."""


def excess_of(metrics: Metrics) -> float:
    """Sum of what goes beyond the limits of flight, slip and contact, each over its limit."""
    contact = metrics.contact_ticks * 0.01 / metrics.duration if metrics.duration > 0.0 else 0.0
    over = (
        metrics.flight_share / FLIGHT_LIMIT - 1.0,
        metrics.slip_speed / SLIP_LIMIT - 1.0,
        contact / CONTACT_LIMIT,
    )
    return min(EXCESS_MAX, sum(max(0.0, each) for each in over))
