"""Benchmarks of the gait: `suites/` measure, `catalogue` lists them, `running` runs them."""

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, table
from gait_lab.bench.score import Score, walk_all

__all__ = ["BenchOptions", "Report", "Row", "Score", "table", "walk_all"]
