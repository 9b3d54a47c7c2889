"""What the numbers of a walk say: in words, and as tables."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gait_lab.report.analysis import SETTLE, SHORTEST, Analysis, Stretch
from nao_lipm_gait.runtime.commands import DRIFT_MAX
from sim_bridge.trials.metrics import FLIGHT_LIMIT, tilt_of

REACHED = 0.9
"""Share of the commanded speed that counts as reached."""
PAPER_ERROR = 7.76e-3
"""[m] mean |expected - measured| of the CoM's y at 31 cm/s, the paper's largest."""
DRIFT = math.radians(5.0)
"""[rad/s] yaw drift of a straight walk that is mentioned."""
TILTED = math.radians(15.0)
"""[rad] tilt of the torso beyond which the robot does not walk."""
SATURATION = 0.1
"""Share of ticks with a motor at its limit that is mentioned."""
ODOMETRY_DISTANCE = 0.1
"""Largest odometry error per walked distance that is good."""
ODOMETRY_HEADING = math.radians(15.0)
"""[rad] largest heading error of the odometry at the end that is good."""
ODOMETRY_BAD = 3.0
"""Multiple of these errors from which the odometry is bad."""
WHITE = 0.8
"""Share of the lags inside the band from which an innovation counts as nearly white."""

WAY = 0.2
"""[m] walked from which odometry's error is given as a share of it."""

BIAS_DEVIATION = "gyro bias deviation [rad/s]"
"""Key of the gait's diagnostics."""

GOOD, FAIR, BAD, NOTE = "good", "fair", "bad", "note"


@dataclass(frozen=True, slots=True)
class TextTable:
    """A table of texts.

    Attributes:
        rows: Cells; one that is preceded by a CSS class and a line end has that class.
    """

    identity: str
    short: str
    title: str
    note: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def number(value: float | None, digits: int = 1) -> str:
    """A number with so many digits after the point; a dash if it is unknown."""
    if value is None or not math.isfinite(value):
        return "–"
    text = f"{value:.{digits}f}"
    return text.replace("-", "−") if float(text) else text.lstrip("-")


def stretch_table(analysis: Analysis) -> TextTable | None:
    """Commanded and achieved speeds; None without stretches."""
    if not analysis.stretches:
        return None
    rows = []
    for stretch in analysis.stretches:
        m, command = stretch.metrics, stretch.command
        asked = ("–",) * 3 if command is None else (
            number(100 * command.x), number(100 * command.y), number(math.degrees(command.yaw)))
        rows.append(
            (
                stretch.name, f"{stretch.start:.1f}–{stretch.end:.1f}", *asked,
                number(100 * m.speed_x), number(100 * m.speed_y),
                number(math.degrees(m.turn_rate)),
                number(None if stretch.reached is None else 100 * stretch.reached, 0),
                number(1e3 * m.com_error_y_measured), number(1e3 * m.com_error_y),
                number(100 * m.flight_share),
            )
        )  # fmt: skip
    source = "ground truth" if len(analysis.walk.truth) else "odometry"
    return TextTable(
        "stretches", "Table", "Commanded and achieved",
        f"Every command, measured from 2.5 s after its change as `nao_gait bench` "
        f"measures ({source}, torso's own heading). CoM: mean |expected − measured| and "
        "|expected − true| in y.",
        ("", "time [s]", "commanded x [cm/s]", "y [cm/s]", "turn [°/s]", "measured x [cm/s]",
         "y [cm/s]", "turn [°/s]", "reached [%]", "CoM y [mm]", "to truth [mm]", "flight [%]"),
        tuple(rows),
    )  # fmt: skip


def joint_table(analysis: Analysis) -> TextTable | None:
    """Errors, lags and loads of the joints; None without motor data."""
    if analysis.motors is None:
        return None
    rows = tuple(
        (
            joint.name,
            number(math.degrees(joint.tracking), 2),
            number(1e3 * joint.lag, 0),
            number(100 * joint.torque_share, 0),
            number(100 * joint.torque_saturated),
            number(100 * joint.speed_share, 0),
            number(100 * joint.speed_saturated),
        )
        for joint in analysis.motors.joints
    )
    return TextTable(
        "jointtable", "Joint table", "Joints in numbers",
        "Error: RMS of target and angle with the lag taken out. Torque: of a nominal motor of the "
        "reference plant at its speed; over 100 %: it brakes, or the robot is stronger.",
        ("joint", "error [°]", "lag [ms]", "most torque [%]", "at torque limit [% of ticks]",
         "top speed [% of limit]", "target too fast [% of ticks]"),
        rows,
    )  # fmt: skip


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
        "seen", "Percepts", "Percepts",
        f"{len(seen.stamp)} images. Errors are distances from the nearest such thing of the "
        "bag's truth; a dash without truth.",
        ("", "images with it", "percepts", "median error [cm]", "90 % below [cm]"),
        tuple(rows),
    )  # fmt: skip


def key_numbers(analysis: Analysis) -> list[tuple[str, str, str]]:
    """(name, value, unit) of the known numbers at the top of the page."""
    found: list[tuple[str, float | None, int, str]] = []
    metrics, paths = analysis.walking, analysis.paths
    found.append(("recorded", analysis.walk.duration, 1, "s"))
    if paths is not None:
        found.append(("walked", paths.length, 1, "m"))
    if analysis.steps:
        found.append(("steps", len(analysis.steps), 0, ""))
        durations = [step.duration for step in analysis.steps]
        found.append(("step duration", float(np.median(durations)), 2, "s"))
    forward = [s.metrics.speed_x for s in analysis.stretches if np.isfinite(s.metrics.speed_x)]
    if forward:
        fastest = max(forward, key=abs)
        found.append(("fastest along x", 100 * fastest, 1, "cm/s"))
    if metrics is not None:
        found.append(("CoM error y", 1e3 * metrics.com_error_y_measured, 1, "mm"))
        found.append(("CoM error x", 1e3 * metrics.com_error_x_measured, 1, "mm"))
        found.append(("flight", 100 * metrics.flight_share, 1, "%"))
    if analysis.motors is not None:
        found.append(("at a torque limit", 100 * analysis.motors.saturated_share, 1, "%"))
    if analysis.timing is not None:
        found.append(("sensor age", 1e3 * analysis.timing.age, 0, "ms"))
        found.append(("missing sensors", analysis.timing.missed, 0, ""))
    return [
        (name, number(value, digits), unit)
        for name, value, digits, unit in found
        if value is not None and math.isfinite(value)
    ]


@dataclass(frozen=True, slots=True)
class Finding:
    """One sentence about a walk, with a grade.

    Attributes:
        grade: `good`, `fair`, `bad` or `note`.
    """

    grade: str
    text: str


def headline(analysis: Analysis) -> Finding:
    """One sentence about the walk, and one more if only a part of the bag is used."""
    found, step = _headline(analysis), analysis.walk.step
    return Finding(found.grade, f"{found.text} But {step}.") if step else found


def _headline(analysis: Analysis) -> Finding:
    walk = analysis.walk
    if not analysis.has_motion:
        topics = ", ".join(list(walk.bag.topics)[:8]) or "none at all"
        return Finding(BAD, f"Nothing of a walk is in this bag. Its topics: {topics}.")
    if analysis.fall is not None:
        return Finding(BAD, f"The robot fell after {analysis.fall:.1f} s.")
    if walk.duration < SHORTEST:
        return Finding(NOTE, f"{walk.duration:.2f} s were recorded, too short for a verdict.")
    walked = analysis.walked
    if walked is None:
        if analysis.phases:
            return Finding(FAIR, f"The robot stood for {walk.duration:.1f} s and did not walk.")
        return Finding(NOTE, f"{walk.duration:.1f} s were recorded; whether the robot walked is "
                             "not in the bag.")  # fmt: skip
    tilt = _last_tilt(analysis)
    if tilt > TILTED:
        angle = f"{math.degrees(tilt):.0f}°"
        return Finding(BAD, f"The recording ends after {walk.duration:.1f} s with the torso tilted "
                            f"by {angle}: probably a fall that is not in the bag.")  # fmt: skip
    how = "upright, without a fall" if len(walk.truth) else "and the gait reported no fall"
    way = ""
    if analysis.paths is not None and np.isfinite(analysis.paths.length):
        way = f", {analysis.paths.length:.1f} m"
    steps = f" in {len(analysis.steps)} steps" if analysis.steps else ""
    return Finding(GOOD, f"The robot walked for {walked[1] - walked[0]:.1f} s{way}{steps}, {how}.")


def _last_tilt(analysis: Analysis) -> float:
    """[rad] of the torso in the last true pose; 0 without ground truth."""
    truth = analysis.walk.truth
    return float(tilt_of(truth.value[-1:, 3:7])[0]) if len(truth) else 0.0


def findings(analysis: Analysis) -> tuple[Finding, ...]:
    """All findings, the bad ones first; none about less than `SHORTEST`."""
    if analysis.walk.duration < SHORTEST:
        return ()
    found = (each for part in (_speeds, _gait, _com, _joints, _timing, _odometry)
             for each in part(analysis))  # fmt: skip
    order = (BAD, FAIR, GOOD, NOTE)
    return tuple(sorted(found, key=lambda finding: order.index(finding.grade)))


def _speeds(analysis: Analysis) -> Iterator[Finding]:
    asked = [s for s in analysis.stretches if s.reached is not None]
    if not asked:
        return
    missed = [s for s in asked if s.reached is not None and not s.reached >= REACHED]
    by = "" if len(analysis.walk.truth) else " (by odometry)"
    if not missed:
        worst = min(s.reached for s in asked if s.reached is not None)
        reached = f"to {100 * worst:.0f} %"
        text = (
            f"The commanded speed was reached {reached}{by}." if len(asked) == 1 else
            f"All {len(asked)} commanded speeds were reached{by}; the least of them {reached}."
        )
        yield Finding(GOOD, text)
    for stretch in missed:
        share = 100 * (stretch.reached or 0.0)
        grade = FAIR if share >= 75 else BAD
        when = f"{stretch.name} ({stretch.start:.0f}–{stretch.end:.0f} s)"
        text = f"{when} reached {share:.0f} % of the commanded speed{by}."
        yield Finding(grade, text[0].upper() + text[1:])
    yield from (_stood(analysis, stretch) for stretch in asked if stretch.stood)
    for stretch in asked:
        command = stretch.command
        if command is not None and command.yaw == 0.0:
            drift = stretch.metrics.turn_rate
            if abs(drift) > DRIFT:
                when = f"{stretch.name} at {stretch.start:.0f} s"
                rate = f"{math.degrees(drift):+.1f}°/s"
                text = f"{when}: the heading drifts by {rate}."
                yield Finding(FAIR, text[0].upper() + text[1:])


def _stood(analysis: Analysis, stretch: Stretch) -> Finding:
    """That the gait stood before it walked what was asked, and why."""
    walk = analysis.walk
    begin = stretch.start - SETTLE - stretch.stood
    deviations = [
        float(values.get(BIAS_DEVIATION) or 0.0) for stamp, values in walk.diagnostics
        if begin <= float(walk.seconds(stamp)) < begin + stretch.stood
    ]  # fmt: skip
    why = " until the gyro's bias was known" if max(deviations, default=0.0) > DRIFT_MAX else ""
    name = stretch.name[0].upper() + stretch.name[1:]
    return Finding(NOTE, f"{name} was asked from {begin:.0f} s on; the robot stood for "
                         f"{stretch.stood:.0f} s{why} and is measured from then on.")  # fmt: skip


def _gait(analysis: Analysis) -> Iterator[Finding]:
    metrics = analysis.walking
    walked = analysis.walked is not None
    if walked and metrics is not None and np.isfinite(metrics.flight_share):
        share = 100 * metrics.flight_share
        if metrics.flight_share > FLIGHT_LIMIT:
            yield Finding(BAD, f"It hops: no sole is loaded {share:.1f} % of the time.")
        else:
            text = f"It walks and does not hop: no sole is loaded {share:.1f} % of the time."
            yield Finding(GOOD, text)
    pushes = [event for event in analysis.events if event.kind == "push"]
    if pushes:
        fall = analysis.fall
        stood = sum(fall is None or event.time < fall - 3.0 for event in pushes)
        grade = GOOD if stood == len(pushes) else BAD
        yield Finding(grade, f"{stood} of {len(pushes)} pushes were survived.")
    if len(analysis.steps) > 3:
        durations = np.array([step.duration for step in analysis.steps])
        low, median, high = np.percentile(durations, (5, 50, 95))
        span = f"{median:.2f} s (median), 5 to 95 %: {low:.2f} to {high:.2f} s"
        yield Finding(NOTE, f"Steps took {span}.")


def _com(analysis: Analysis) -> Iterator[Finding]:
    metrics = analysis.walking
    if metrics is not None and np.isfinite(metrics.com_error_y_measured):
        good = metrics.com_error_y_measured <= PAPER_ERROR
        words = "The CoM follows the model" if good else "The CoM deviates from the model"
        y, x = 1e3 * metrics.com_error_y_measured, 1e3 * metrics.com_error_x_measured
        errors = f"mean |expected − measured| {y:.1f} mm in y and {x:.1f} mm in x"
        yield Finding(GOOD if good else FAIR, f"{words}: {errors} (paper: 4.3 to 7.8 mm in y).")
    innovation = analysis.innovation
    if innovation is not None and np.isfinite(innovation.inside[1]):
        x, y = innovation.inside
        white = min(x, y) >= WHITE
        mean = [1e3 * value for value in innovation.mean]
        yield Finding(GOOD if white else NOTE, (
            "The observer's innovation is nearly white"
            if white else
            "The observer's innovation is not white: part of the measurement error follows the "
            "step"
        ) + f" ({100 * x:.0f} % of lags in x and {100 * y:.0f} % in y inside the 95 % band; "
            f"constant part {mean[0]:+.1f} and {mean[1]:+.1f} mm).")  # fmt: skip


def _joints(analysis: Analysis) -> Iterator[Finding]:
    use = analysis.motors
    if use is None:
        return
    if np.isfinite(use.saturated_share):
        worst = max(use.joints, key=lambda joint: np.nan_to_num(joint.torque_saturated))
        text = f"a motor is at its torque limit in {100 * use.saturated_share:.1f} % of the ticks"
        if worst.torque_saturated > 0:
            text += f", most of all {worst.name} ({100 * worst.torque_saturated:.1f} %)"
        grade = FAIR if use.saturated_share > SATURATION else GOOD
        yield Finding(grade, text[0].upper() + text[1:] + ".")
    fast = [joint for joint in use.joints if joint.speed_saturated > 0.01]
    if fast:
        worst = max(fast, key=lambda joint: joint.speed_saturated)
        share = f"{worst.name} in {100 * worst.speed_saturated:.1f} % of the ticks"
        yield Finding(FAIR, f"Targets ask for more than the joint's speed: {share}.")


def _timing(analysis: Analysis) -> Iterator[Finding]:
    timing = analysis.timing
    if timing is None:
        return
    old = f"sensors {1e3 * timing.age:.0f} ms old, " if math.isfinite(timing.age) else ""
    text = f"{1 / timing.period:.0f} Hz, {old}{timing.missed} joint states missing"
    if len(analysis.walk.targets):
        text += f", {timing.unanswered} unanswered"
    ticks = max(1, len(analysis.walk.position))
    bad = max(timing.missed, timing.unanswered) / ticks
    yield Finding(GOOD if bad < 0.001 else FAIR if bad < 0.02 else BAD, f"Timing: {text}.")
    if len(timing.tick):
        worst = float(np.max(timing.tick[:, 1]))
        if worst * 1e-6 > timing.period:
            text = f"Some ticks take longer than a period (p99 {worst:.0f} us)"
            excess = np.maximum(timing.tick[:, 1] * 1e-6 - timing.period, 0.0)
            if len(timing.answer) and (
                timing.answer.sum() < excess.sum()
                # The slowest tick has an answer, whose time is known to a period.
                or timing.answer.max() + timing.period < worst * 1e-6
            ):
                # Sooner than computed: the clock of the bag stood still, as in lockstep.
                text += ", which does not matter here: the simulation waited for every answer"
                yield Finding(NOTE, text + ".")
            else:
                yield Finding(BAD, text + ".")


def _odometry(analysis: Analysis) -> Iterator[Finding]:
    paths = analysis.paths
    if paths is None or not len(paths.error) or not np.isfinite(paths.error).any():
        return
    if analysis.walked is None and paths.length <= WAY:
        return  # a robot that stands shows nothing about its odometry
    x, y, yaw = paths.error[np.isfinite(paths.error).all(axis=1)][-1].tolist()
    off = math.hypot(x, y)
    text = f"Odometry ends {100 * off:.0f} cm and {round(math.degrees(yaw)) + 0:+d}° off the truth"
    errors = [abs(yaw) / ODOMETRY_HEADING]
    if paths.length > WAY:
        share = off / paths.length
        errors.append(share / ODOMETRY_DISTANCE)
        text += f", {100 * share:.1f} % of the {paths.length:.1f} m walked"
    worst = max(errors)
    grade = GOOD if worst <= 1.0 else FAIR if worst <= ODOMETRY_BAD else BAD
    yield Finding(grade, text + ".")
