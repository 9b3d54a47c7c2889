"""How early the gait recognises a fall, over many rollouts."""

import statistics
from collections.abc import Iterable
from dataclasses import dataclass, field

from gait_lab.analysis.metrics import Metrics
from gait_lab.bench.report import Row, loop_name
from gait_lab.bench.score import Score


@dataclass(slots=True)
class FallDetection:
    """Counts rollouts, falls, and what the gait said about them."""

    rollouts: int = 0
    leads: list[float] = field(default_factory=list)
    """[s] per fall between the gait's word and the fall; 0 where it said nothing."""
    false_alarms: int = 0
    """The gait said that it falls, and the robot stayed up."""

    def add(self, metrics: Metrics) -> None:
        self.count(metrics.fall_lead, metrics.false_alarm)

    def count(self, lead: float | None, false_alarm: bool) -> None:
        """One rollout; `lead` [s] is None without a fall."""
        self.rollouts += 1
        if lead is not None:
            self.leads.append(lead)
        self.false_alarms += false_alarm

    @property
    def falls(self) -> int:
        return len(self.leads)

    @property
    def foreseen(self) -> int:
        """Falls that the gait said before they happened."""
        return sum(lead > 0.0 for lead in self.leads)

    @property
    def lead_median(self) -> float | None:
        """[s]; None without a fall."""
        return float(statistics.median(self.leads)) if self.leads else None

    def rows(self, suite: str, prefix: str) -> list[Row]:
        return [
            Row(suite, f"{prefix}_falls", "rollouts", self.falls),
            Row(suite, f"{prefix}_falls_foreseen", "rollouts", self.foreseen),
            Row(suite, f"{prefix}_fall_lead_median", "s", self.lead_median),
            Row(suite, f"{prefix}_false_alarms", "rollouts", self.false_alarms),
        ]

    @property
    def text(self) -> str:
        lead = self.lead_median
        early = "" if lead is None else (
            f", {self.foreseen} foreseen, median lead {1000.0 * lead:.0f} ms"
        )  # fmt: skip
        return (
            f"{self.falls} falls in {self.rollouts} rollouts{early}; "
            f"{self.false_alarms} false alarms"
        )


def by_loop(scores: Iterable[Score]) -> dict[bool, FallDetection]:
    """Closed loop (true) and open loop of all these walks."""
    found: dict[bool, FallDetection] = {}
    for score in scores:
        for result in score.results:
            found.setdefault(score.closed_loop, FallDetection()).add(result.metrics)
    return found


def rows_by_loop(suite: str, found: dict[bool, FallDetection]) -> list[Row]:
    """Rows `closed_falls`, `open_loop_falls`, ..."""
    return [
        row for closed, detection in found.items()
        for row in detection.rows(suite, "closed" if closed else "open_loop")
    ]  # fmt: skip


def text_by_loop(found: dict[bool, FallDetection]) -> str:
    return "\n".join(
        f"Fall detection, {loop_name(closed)}: {detection.text}."
        for closed, detection in found.items()
    )
