"""`nao_gait estimate`: a recorded walk through the estimators, against its reference."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gait_lab.analysis.plots import BLUE, GREY, INK, RED, pyplot, save
from gait_lab.estimate.estimator import (
    Estimate,
    by_legs_alone,
    estimate,
    roll_and_pitch,
)
from gait_lab.estimate.recorded_body import RecordedBody
from gait_lab.estimate.sensor_log import Reference, SensorLog, load_log
from robot_core.geometry import planar_rotation
from robot_core.schema import write_text
from robot_core.types import FloatArray


@dataclass(frozen=True, slots=True)
class Truth:
    """The reference as an `Estimate` has it.

    Attributes:
        up: (t, 3) unit vertical in the base.
        position: (t, 3) [m] of the base.
        yaw: (t,) [rad].
    """

    up: FloatArray
    position: FloatArray
    yaw: FloatArray


def truth_of(reference: Reference | None, body: RecordedBody) -> Truth | None:
    """The base by the reference, from its first pose on; None without a reference."""
    if reference is None:
        return None
    rotation, position = reference.rotation, reference.position
    if reference.link:
        link = body.in_root(reference.link)
        rotation = rotation @ link.rotation.T
        position = position - rotation @ link.translation
    yaw = np.unwrap(np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0]))
    moved = position - position[0]
    moved[:, :2] = moved[:, :2] @ planar_rotation(-yaw[0]).T
    return Truth(rotation[:, 2, :], moved, yaw - yaw[0])


def errors(found: Estimate, truth: Truth | None) -> dict[str, tuple[float, str]]:
    """Metric -> value and unit; empty without a reference."""
    if truth is None:
        return {}
    angle = np.degrees(np.arccos(np.clip((found.up * truth.up).sum(axis=1), -1.0, 1.0)))
    off = np.degrees(found.yaw - truth.yaw)
    place = 100.0 * np.linalg.norm(found.position[:, :2] - truth.position[:, :2], axis=1)
    return {
        "tilt_rms": (float(np.sqrt(np.mean(angle**2))), "deg"),
        "tilt_worst": (float(angle.max()), "deg"),
        "yaw_end": (abs(float(off[-1])), "deg"),
        "yaw_worst": (float(np.abs(off).max()), "deg"),
        "place_end": (float(place[-1]), "cm"),
        "place_worst": (float(place.max()), "cm"),
    }


def command(
    path: Path, robot: str, imu: str, soles: Sequence[str], out: Path, json_file: Path | None,
    say: Callable[[str], None],
) -> None:  # fmt: skip
    """Estimate a log; table, figure, arrays and JSON."""
    log = load_log(path)
    body = RecordedBody(robot, log.joint_names, imu or log.imu, soles)
    found, legs = estimate(log, body), by_legs_alone(log, body)
    truth = truth_of(log.reference, body)
    moved = float(np.linalg.norm(found.position[-1, :2]))
    say(
        f"{path}: {body.name}, {body.mass:.1f} kg, {log.time[-1] - log.time[0]:.1f} s, moved "
        f"{moved:.2f} m, turned {np.degrees(found.yaw[-1]):.1f} deg; stood quietly "
        f"{found.quiet_time:.1f} s"
    )
    if not found.quiet_time:
        say("no quiet stand: gyro bias and tilt of the soles are not removed")
    if not found.yaw_by_gyro:
        say("no yaw gyro: yaw and place are those of the legs, and feet slip in turns")
    rows = [("distance", moved, "m"), ("turn", float(np.degrees(found.yaw[-1])), "deg")]
    if truth is None:
        say("no reference: nothing to compare with")
    else:
        of_legs = errors(legs, truth)
        say(f"{'':12s} {'estimate':>9s} {'legs alone':>11s}")
        for name, (value, unit) in errors(found, truth).items():
            say(f"{name:12s} {value:9.2f} {of_legs[name][0]:11.2f} {unit}")
            rows += [(name, value, unit), (f"{name}_legs", of_legs[name][0], unit)]
    out.mkdir(parents=True, exist_ok=True)
    np.savez(
        out / "estimate.npz", time=log.time, up=found.up, position=found.position, yaw=found.yaw,
        com=found.com, load_share=found.load_share,
    )  # fmt: skip
    say(f"written: {out / 'estimate.npz'}, {draw(log, found, legs, truth, out / 'estimate.png')}")
    if json_file is not None:
        rows_of_json = [
            {"suite": "estimate", "metric": name, "unit": unit, "value": value}
            for name, value, unit in rows
        ]
        write_text(json_file, json.dumps(rows_of_json, indent=1) + "\n", "json")


def draw(
    log: SensorLog, found: Estimate, legs: Estimate, truth: Truth | None, path: Path
) -> Path:
    """Tilt, yaw, path and CoM as one PNG."""
    figure, axes = pyplot().subplots(2, 2, figsize=(11.0, 7.0), layout="constrained")
    (tilt, yaw), (way, com) = axes
    time = log.time
    several = [("legs alone", legs, GREY), ("estimate", found, BLUE)]
    shown = [(name, each.up, each.position, each.yaw, colour) for name, each, colour in several]
    if truth is not None:
        shown.append(("reference", truth.up, truth.position, truth.yaw, INK))
    for name, up, position, heading, colour in shown:
        roll_pitch = np.degrees(roll_and_pitch(up))
        tilt.plot(time, roll_pitch[:, 0], color=colour, lw=1, label=f"roll, {name}")
        tilt.plot(time, roll_pitch[:, 1], "--", color=colour, lw=1, label=f"pitch, {name}")
        yaw.plot(time, np.degrees(heading), color=colour, lw=1, label=name)
        way.plot(position[:, 0], position[:, 1], color=colour, lw=1, label=name)
    for values, name, colour in zip(found.com.T, "xyz", (BLUE, RED, INK), strict=True):
        com.plot(time, values, color=colour, lw=1, label=name)
    for each, x, y in (
        (tilt, "s", "tilt of the base / deg"), (yaw, "s", "yaw / deg"),
        (way, "base x / m", "base y / m"), (com, "s", "CoM / m"),
    ):  # fmt: skip
        each.set_xlabel(x)
        each.set_ylabel(y)
        each.legend(fontsize=8)
    way.set_aspect("equal", adjustable="datalim")
    return save(figure, path)
