"""What the numbers say, in words and in order of weight."""

import math
from dataclasses import dataclass

import numpy as np

from gait_lab.analysis.metrics import FLIGHT_LIMIT, tilt_of
from gait_lab.report.analysis import Analysis

REACHED = 0.9
"""Share of the asked speed that counts as reached."""
PAPER_ERROR = 7.76e-3
"""[m] mean |expected - measured| of the CoM's y at 31 cm/s, the paper's largest."""
DRIFT = math.radians(5.0)
"""[rad/s] yaw drift of a straight walk that is worth a word."""
TILTED = math.radians(15.0)
"""[rad] from which on a torso is no longer walking."""
SATURATION = 0.1
"""Share of ticks with a motor at its limit that is worth a word."""
WHITE = 0.8
"""Share of the lags inside the band from which an innovation passes as nearly white."""

GOOD, FAIR, BAD, NOTE = "good", "fair", "bad", "note"


@dataclass(frozen=True, slots=True)
class Finding:
    grade: str
    """good, fair, bad, note"""
    text: str


def headline(analysis: Analysis) -> Finding:
    """One sentence about the walk."""
    walk = analysis.walk
    if not analysis.has_motion:
        topics = ", ".join(list(walk.bag.topics)[:8]) or "none at all"
        return Finding(BAD, f"Nothing of a walk is in this bag. Its topics: {topics}.")
    if analysis.fall is not None:
        return Finding(BAD, f"The robot fell after {analysis.fall:.1f} s.")
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
    how = "upright, without a fall" if len(walk.truth) else "and the gait felt no fall"
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
    """All that is worth saying, bad news first."""
    found = [
        *_speeds(analysis),
        *_gait(analysis),
        *_com(analysis),
        *_joints(analysis),
        *_timing(analysis),
        *_odometry(analysis),
    ]
    order = {BAD: 0, FAIR: 1, GOOD: 2, NOTE: 3}
    return tuple(sorted(found, key=lambda finding: order[finding.grade]))


def _speeds(analysis: Analysis) -> list[Finding]:
    asked = [s for s in analysis.stretches if s.reached is not None]
    if not asked:
        return []
    missed = [s for s in asked if s.reached is not None and not s.reached >= REACHED]
    found = []
    by = "" if len(analysis.walk.truth) else " (by odometry)"
    if not missed:
        worst = min(s.reached for s in asked if s.reached is not None)
        found.append(Finding(GOOD, f"All {len(asked)} commanded speeds were reached{by}; the least "
                                   f"of them to {100 * worst:.0f} %."))  # fmt: skip
    for stretch in missed:
        share = 100 * (stretch.reached or 0.0)
        grade = FAIR if share >= 75 else BAD
        when = f"{stretch.name} ({stretch.start:.0f}–{stretch.end:.0f} s)"
        text = f"{when} reached {share:.0f} % of the commanded speed{by}."
        found.append(Finding(grade, text[0].upper() + text[1:]))
    for stretch in asked:
        command = stretch.command
        if command is not None and command.yaw == 0.0:
            drift = stretch.metrics.turn_rate
            if abs(drift) > DRIFT:
                when = f"{stretch.name} at {stretch.start:.0f} s"
                rate = f"{math.degrees(drift):+.1f}°/s"
                text = f"{when}: the heading drifts by {rate}."
                found.append(Finding(FAIR, text[0].upper() + text[1:]))
    return found


def _gait(analysis: Analysis) -> list[Finding]:
    found = []
    metrics = analysis.walking
    if metrics is not None and np.isfinite(metrics.flight_share):
        share = 100 * metrics.flight_share
        if metrics.flight_share > FLIGHT_LIMIT:
            found.append(Finding(BAD, f"It hops: no sole was loaded in {share:.1f} % of the time."))
        else:
            found.append(Finding(GOOD, f"It walks and does not hop: {share:.1f} % of the time "
                                       "without a loaded sole."))  # fmt: skip
    pushes = [event for event in analysis.events if event.kind == "push"]
    if pushes:
        fall = analysis.fall
        stood = sum(fall is None or event.time < fall - 3.0 for event in pushes)
        grade = GOOD if stood == len(pushes) else BAD
        found.append(Finding(grade, f"{stood} of {len(pushes)} pushes were survived."))
    if len(analysis.steps) > 3:
        durations = np.array([step.duration for step in analysis.steps])
        found.append(Finding(NOTE, f"Steps took {np.median(durations):.2f} s in the middle, 5 to "
                                   f"95 %: {np.percentile(durations, 5):.2f} to "
                                   f"{np.percentile(durations, 95):.2f} s."))  # fmt: skip
    return found


def _com(analysis: Analysis) -> list[Finding]:
    found = []
    metrics = analysis.walking
    if metrics is not None and np.isfinite(metrics.com_error_y_measured):
        good = metrics.com_error_y_measured <= PAPER_ERROR
        words = "The CoM is where the model has it" if good else "The CoM strays from the model"
        y, x = 1e3 * metrics.com_error_y_measured, 1e3 * metrics.com_error_x_measured
        errors = f"mean |expected − measured| {y:.1f} mm in y and {x:.1f} mm in x"
        found.append(
            Finding(GOOD if good else FAIR, f"{words}: {errors} (paper: 4.3 to 7.8 mm in y).")
        )
    innovation = analysis.innovation
    if innovation is not None and np.isfinite(innovation.inside[1]):
        x, y = innovation.inside
        white = min(x, y) >= WHITE
        mean = [1e3 * value for value in innovation.mean]
        found.append(Finding(GOOD if white else NOTE, (
            "The observer's innovation is nearly white"
            if white else
            "The observer's innovation is not white: part of the measurement error follows the "
            "step"
        ) + f" ({100 * x:.0f} % of lags in x and {100 * y:.0f} % in y inside the 95 % band; "
            f"constant part {mean[0]:+.1f} and {mean[1]:+.1f} mm)."))  # fmt: skip
    return found


def _joints(analysis: Analysis) -> list[Finding]:
    found: list[Finding] = []
    use = analysis.motors
    if use is None:
        return found
    if np.isfinite(use.saturated_share):
        worst = max(use.joints, key=lambda joint: np.nan_to_num(joint.torque_saturated))
        text = f"a motor is at its torque limit in {100 * use.saturated_share:.1f} % of the ticks"
        if worst.torque_saturated > 0:
            text += f", most of all {worst.name} ({100 * worst.torque_saturated:.1f} %)"
        grade = FAIR if use.saturated_share > SATURATION else GOOD
        found.append(Finding(grade, text[0].upper() + text[1:] + "."))
    fast = [joint for joint in use.joints if joint.speed_saturated > 0.01]
    if fast:
        worst = max(fast, key=lambda joint: joint.speed_saturated)
        share = f"{worst.name} in {100 * worst.speed_saturated:.1f} % of the ticks"
        found.append(Finding(FAIR, f"Targets ask for more than the joint's speed: {share}."))
    return found


def _timing(analysis: Analysis) -> list[Finding]:
    timing = analysis.timing
    if timing is None:
        return []
    text = (f"{1 / timing.period:.0f} Hz, sensors {1e3 * timing.age:.0f} ms old, "
            f"{timing.missed} joint states missing")  # fmt: skip
    if len(analysis.walk.targets):
        text += f", {timing.unanswered} unanswered"
    ticks = max(1, len(analysis.walk.position))
    bad = max(timing.missed, timing.unanswered) / ticks
    found = [Finding(GOOD if bad < 0.001 else FAIR if bad < 0.02 else BAD, f"Timing: {text}.")]
    if len(timing.tick):
        worst = float(np.max(timing.tick[:, 1]))
        if worst * 1e-6 > timing.period:
            text = f"Some ticks take longer than a period (p99 {worst:.0f} us)."
            found.append(Finding(BAD, text))
    return found


def _odometry(analysis: Analysis) -> list[Finding]:
    paths = analysis.paths
    if paths is None or not len(paths.error) or not np.isfinite(paths.error).any():
        return []
    x, y, yaw = paths.error[np.isfinite(paths.error).all(axis=1)][-1].tolist()
    off = math.hypot(x, y)
    share = 100 * off / paths.length if paths.length > 0.2 else float("nan")
    text = f"Odometry ends {100 * off:.0f} cm and {math.degrees(yaw):+.0f}° off the truth"
    if math.isfinite(share):
        text += f", {share:.1f} % of the {paths.length:.1f} m walked"
    return [Finding(GOOD if not share > 10 else FAIR, text + ".")]
