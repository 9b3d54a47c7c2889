"""All figures of a report, in the order of the page."""

from collections.abc import Callable

from gait_lab.report.analysis import Analysis
from gait_lab.report.figure import (
    ArrayStore,
    Figure,
)
from gait_lab.report.plots.joints import joints, motors, torques
from gait_lab.report.plots.motion import com, speeds, torso
from gait_lab.report.plots.observer import innovation_series, whiteness
from gait_lab.report.plots.sensors import loads, timing
from gait_lab.report.plots.steps import origins, step_series
from gait_lab.report.plots.way import odometry_error, path


def all_figures(analysis: Analysis, store: ArrayStore) -> list[Figure]:
    """Those for which the bag has the topics, in the order of the page."""
    makers: tuple[Callable[[Analysis, ArrayStore], Figure | None], ...] = (
        speeds, com, path, odometry_error, step_series, origins, innovation_series,
        whiteness, joints, torques, motors, torso, loads, timing,
    )  # fmt: skip
    return [figure for make in makers if (figure := make(analysis, store)) is not None]
