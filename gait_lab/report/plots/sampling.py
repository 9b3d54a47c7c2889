"""Numbers made fit for a figure: smoothed, pooled, without outliers."""

from typing import Any

import numpy as np

from nao_lipm_gait.types import FloatArray

SMOOTHING = 0.5
"""[s] over which speeds are averaged: about two steps."""
COM_WINDOW = 4.0
"""[s] of the CoM shown at a time: the paper's figures show 3 to 5."""
HEAT_COLUMNS = 700


def largest(values: FloatArray) -> float:
    """The largest magnitude but for outliers; 0 where nothing is known."""
    known = np.abs(values[np.isfinite(values)])
    return float(np.percentile(known, 99.5)) if len(known) else 0.0


def smoothed(values: FloatArray, time: FloatArray) -> FloatArray:
    """(n,) values at rising times (n,) [s], each the mean over `SMOOTHING`."""
    period = float(np.median(np.diff(time)))
    window = max(1, round(SMOOTHING / period)) if period > 0.0 else 1
    if len(values) <= window:
        return values
    padded = np.pad(np.nan_to_num(values), window // 2, mode="edge")
    return np.convolve(padded, np.ones(window) / window, mode="same")[
        window // 2 : window // 2 + len(values)
    ]


def pool(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """At most HEAT_COLUMNS rows, each the largest of its rows."""
    size = max(1, -(-len(time) // HEAT_COLUMNS))
    count = len(time) // size
    pooled: Any = np.nan_to_num(values[: count * size]).reshape(count, size, -1).max(axis=1)
    return time[: count * size : size], pooled
