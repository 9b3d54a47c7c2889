"""Benchmarks: each measurement is a row, and tables, JSON and CSV are views of the rows.

A suite is a sweep in `config/bench/*.yaml` (`sweep`), or a function in `suites/` (`suite`).
`results` writes docs/results.csv and docs/results.md from many runs.
"""
