"""Benchmarks of the gait.

`suites/` holds one file per suite, `suite` finds, plans and runs them, `options` declares their
options and `result` prints what they measured. `results` writes docs/results.md from many runs.
"""

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.score import Score, walk_all
from gait_lab.bench.suite import Suite

__all__ = [
    "BenchOptions",
    "Column",
    "Measurement",
    "Score",
    "Suite",
    "SuiteResult",
    "Table",
    "option",
    "walk_all",
]
