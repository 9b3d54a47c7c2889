"""What the robot has seen and estimated: figures over time, and a table with errors."""

import numpy as np

from gait_lab.report.analysis import Analysis
from gait_lab.report.page import BLUE, GOLD, GREEN, RED, ArrayStore, Figure, TimeFigure
from gait_lab.report.verdict import TextTable, number

COUNTED = (("crossings", BLUE), ("goal posts", GOLD), ("robots", RED))


def percepts(analysis: Analysis, store: ArrayStore) -> Figure | None:
    """Place and error of the ball, and how much else each image showed."""
    seen = analysis.percepts
    if seen is None:
        return None
    ball = seen.group("ball")
    rows = ["ball distance [m]", "ball bearing [°]", "number"]
    if ball is not None and np.isfinite(ball.error).any():
        rows.insert(2, "ball error [cm]")
    made = TimeFigure(
        store, "percepts", "What the robot saw",
        "At the time of each image. The ball in base_footprint, and how far it is from the truth; "
        "below, how many crossings, goal posts and robots an image showed.",
        tuple(rows), 120,
    )  # fmt: skip
    walk = analysis.walk
    if ball is not None:
        time = walk.seconds(ball.stamp)
        x, y = ball.position.T
        for row, value in enumerate(
            (np.hypot(x, y), np.degrees(np.arctan2(y, x)), 100.0 * ball.error)
        ):
            if row < len(rows) - 1:
                made.line(row, time, value, "ball", RED, markers=True)
    for name, color in COUNTED:
        group = seen.group(name)
        if group is not None:
            made.line(
                len(rows) - 1, walk.seconds(seen.stamp), group.count.astype(float), name,
                GREEN if color == RED else color, step=True,
            )  # fmt: skip
    return made.figure


def world(analysis: Analysis, store: ArrayStore) -> Figure | None:
    """Errors of what the player estimated, beside the deviations that it stated."""
    found = analysis.world
    if found is None:
        return None
    rows = ["place [cm]", "heading [°]", "ball [cm]"]
    made = TimeFigure(
        store, "world", "What the robot estimated",
        "Errors of its own pose and of the ball's place on the field, and the deviations that it "
        "stated. Red: it held its pose for not valid.",
        tuple(rows if len(found.ball_error) else rows[:2]), 120,
    )  # fmt: skip
    time = analysis.walk.seconds(found.stamp)
    scales = (100.0, np.degrees(1.0))
    for row, (error, stated, scale) in enumerate(
        zip((found.place_error, found.heading_error),
            (found.place_deviation, found.heading_deviation), scales, strict=True)
    ):  # fmt: skip
        made.line(row, time, scale * stated, "stated", GOLD)
        made.line(row, time, scale * error, "error", BLUE)
        made.line(row, time, np.where(found.valid, np.nan, scale * error), "not valid", RED)
    if len(found.ball_error):
        ball_time = analysis.walk.seconds(found.ball_stamp)
        made.line(2, ball_time, 100.0 * found.ball_error, "ball", GREEN)
    return made.figure


def percept_table(analysis: Analysis) -> TextTable | None:
    """How often each kind of thing was seen, and how far from the truth."""
    seen = analysis.percepts
    if seen is None:
        return None
    rows = []
    for group in seen.groups:
        error = 100.0 * group.error[np.isfinite(group.error)]
        median, most = (
            (float(np.median(error)), float(np.percentile(error, 90.0)))
            if len(error)
            else (None, None)
        )
        rows.append(
            (
                group.name,
                str(int((group.count > 0).sum())),
                str(len(group.stamp)),
                number(median),
                number(most),
            )
        )
    return TextTable(
        "seen", "Percepts",
        f"{len(seen.stamp)} images. Errors are distances from the nearest such thing of the "
        "bag's truth; a dash without truth.",
        ("", "images with it", "percepts", "median error [cm]", "90 % below [cm]"),
        tuple(rows),
    )  # fmt: skip
