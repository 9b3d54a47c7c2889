"""What the observer did not expect: measured minus expected CoM, and whether it is white noise.

A good observer leaves nothing to predict in its innovation. What is left in it (a constant part, a
rhythm) is a model that is wrong: joint zeros, a wrong delay, a torso that rocks.
"""

from dataclasses import dataclass

import numpy as np

from gait_lab.analysis.metrics import DOUBLE
from gait_lab.report.steps import Phase, supports_at
from gait_lab.report.walk import IntArray, Walk
from nao_lipm_gait.types import FloatArray

LAG = 1.0
"""[s] up to which the autocorrelation is shown."""
FEWEST = 200
"""Ticks below which no autocorrelation is computed."""


@dataclass(frozen=True, slots=True)
class Innovation:
    """x and y of measured minus expected CoM in Q, in single support."""

    stamp: IntArray
    value: FloatArray
    """(t, 2) [m]"""
    mean: tuple[float, float]
    """[m]"""
    deviation: tuple[float, float]
    """[m]"""
    lag: FloatArray
    """(l,) [s]"""
    correlation: FloatArray
    """(l, 2), 1 at lag 0; empty with too few ticks."""
    band: float
    """95 % of the correlations of white noise are within +-band."""
    inside: tuple[float, float]
    """Share of the lags over 0 that are within the band."""


def find_innovation(walk: Walk, phases: tuple[Phase, ...]) -> Innovation | None:
    """None if the bag lacks the expected or the measured CoM, or the robot never walked."""
    if not (len(walk.expected) and len(walk.measured)):
        return None
    stamp = walk.expected.stamp
    if phases:
        stamp = stamp[supports_at(phases, stamp) != DOUBLE]
    value = (walk.measured.at(stamp) - walk.expected.at(stamp))[:, :2]
    known = np.isfinite(value).all(axis=1)
    stamp, value = stamp[known], value[known]
    if len(stamp) < 2:
        return None
    count = len(stamp)
    lags = round(LAG * 1e9 / max(1, walk.period)) if count >= FEWEST else 0
    correlation = np.empty((0, 2))
    inside = (float("nan"), float("nan"))
    band = 1.96 / np.sqrt(count)
    if lags and lags < count:
        correlation = np.stack([autocorrelation(column, lags) for column in value.T], axis=1)
        share = (np.abs(correlation[1:]) <= band).mean(axis=0)
        inside = float(share[0]), float(share[1])
    mean, deviation = value.mean(axis=0), value.std(axis=0)
    return Innovation(
        stamp=stamp,
        value=value,
        mean=(float(mean[0]), float(mean[1])),
        deviation=(float(deviation[0]), float(deviation[1])),
        lag=np.arange(len(correlation), dtype=float) * (walk.period * 1e-9),
        correlation=correlation,
        band=float(band),
        inside=inside,
    )


def autocorrelation(values: FloatArray, lags: int) -> FloatArray:
    """(lags + 1,) of (t,) values about their mean; 1 at lag 0."""
    centred = values - values.mean()
    size = 1 << (2 * len(values) - 1).bit_length()
    power = np.abs(np.fft.rfft(centred, size)) ** 2
    result = np.fft.irfft(power, size)[: lags + 1]
    return np.asarray(result / result[0] if result[0] > 0.0 else np.eye(1, lags + 1)[0])
