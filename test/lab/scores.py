"""Made-up results of rollouts, from which the suites make their measurements."""

import dataclasses
from collections.abc import Iterable
from typing import Any

from gait_lab.bench.options import Options
from gait_lab.bench.registry import find_suite
from gait_lab.bench.rows import Row
from gait_lab.bench.walks import Score
from sim_bridge.trials.metrics import Metrics
from sim_bridge.trials.rollout import RolloutResult, RolloutSpec
from sim_bridge.trials.tasks import Task, find_task


def metrics(**changes: Any) -> Metrics:
    """Metrics of a robot that stands still, with these changes."""
    values: dict[str, Any] = {field.name: 0.0 for field in dataclasses.fields(Metrics)}
    values |= {"fell": False, "fall_time": None, "alarm_time": None, "support_changes": 0}
    return Metrics(**{**values, "contact_ticks": 0, **changes})


def score(task: Task | str, *scored: Metrics) -> Score:
    """A score of robots with these metrics in closed loop."""
    task = find_task(task) if isinstance(task, str) else task
    return Score(task, True, tuple(RolloutResult(RolloutSpec(task), each) for each in scored))


def values(rows: Iterable[Row | str]) -> dict[str, float | None]:
    """Metric -> value."""
    return {row.metric: row.value for row in rows if isinstance(row, Row)}


def options(suite: str, **given: Any) -> Options:
    """Options of a suite, without progress bars and in one process."""
    return Options.of(find_suite(suite).options, {"jobs": 1, "show": False, **given})
