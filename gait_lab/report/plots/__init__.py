"""The figures of a report. Each takes what it needs from the analysis; without that, there is none.

A comparison lays the second walk over the first in the figures that do not run over time.
"""
