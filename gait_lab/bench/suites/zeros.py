"""The suite `zeros`: are leg joints with a wrong zero named, and does a walk get better by it?"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from statistics import median

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row
from gait_lab.bench.suite import suite
from gait_lab.bench.suites.peers import is_nao
from gait_lab.bench.walks import root_mean_square
from nao_lipm_gait.calibration import NOT_CALIBRATED, Calibration
from nao_lipm_gait.estimation.joint_zeros import judged_joints, wrong_zeros
from robot_core.errors import NaoGaitError
from sim_bridge.trials.calibration import find_zeros
from sim_bridge.trials.calibration_procedure import CalibrationError
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import Task, find_task
from sim_bridge.trials.trial import TrialSpec, loaded_robot, make_world

SPREAD = 4
"""On each robot one of so many joints has a wrong zero, one after the other."""


@dataclass(frozen=True, slots=True)
class Case:
    """A robot to calibrate.

    Attributes:
        spec: The robot, with its wrong zero.
        joint: The joint; empty for none.
        degrees: [deg] How far its zero is off; 0 for none.
        task: What it walks without and with what was found; None for nothing.
    """

    spec: TrialSpec
    joint: str = ""
    degrees: int = 0
    task: Task | None = None


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of it.

    Attributes:
        failed: The calibration failed.
        named: The joints that were named, the likeliest first.
        error: [rad] Estimated minus true zero of the joint; NaN if it was not among them.
        walks: Speed [m/s] without and with the calibration, NaN for a fall; None if none is used.
    """

    failed: bool = False
    named: tuple[str, ...] = ()
    error: float = math.nan
    walks: tuple[float, float] | None = None


JUDGES: dict[str, Callable[[str, Outcome], bool]] = {
    "alone": lambda joint, outcome: outcome.named == (joint,),
    "first": lambda joint, outcome: outcome.named[:1] == (joint,),
    "listed": lambda joint, outcome: joint in outcome.named,
    "other": lambda joint, outcome: bool(outcome.named) and joint not in outcome.named,
    "failed": lambda joint, outcome: outcome.failed,
}
"""Shares of the trials: quantity -> whether a trial with that wrong joint counts."""


def carry_out(case: Case) -> Outcome:
    """Calibrate a robot, and let it walk without and with a calibration that corrects a zero."""
    try:
        found, calibration = find_zeros(case.spec)
    except CalibrationError:
        return Outcome(failed=True)
    wrong = wrong_zeros(found)
    with make_world(case.spec) as world:
        robot = world.robot
        names, true = robot.description.joint_names, robot.individual.joint_zero.tolist()
    errors = {each.joint: each.zero - true[names.index(each.joint)] for each in wrong}
    walks = None
    if calibration.joint_zero and case.task is not None:
        walks = _speed(case, NOT_CALIBRATED), _speed(case, calibration)
    return Outcome(
        named=tuple(errors), error=errors.get(case.joint, math.nan), walks=walks
    )


def _speed(case: Case, calibration: Calibration) -> float:
    assert case.task is not None
    walk = RolloutSpec(**{**case.spec.fields, "calibration": calibration}, task=case.task)
    metrics = rollout(walk).metrics
    return math.nan if metrics.fell else metrics.speed_x


def cases(options: Options) -> list[Case]:
    """Each robot as drawn, and with a wrong zero in some of its joints."""
    joints = judged_joints(loaded_robot(options.urdf))
    for joint in options.joints:
        if joint not in joints:
            raise NaoGaitError("joints", joint, joints)
    task = find_task(options.tasks[0]).lasting(options.window) if options.tasks else None
    found = []
    for seed in options.seeds:
        spec = TrialSpec(robot_seed=seed, noise_seed=max(seed, 0), **options.trial)
        found.append(Case(spec))
        for turn, degrees in enumerate(options.degrees):
            for number, joint in enumerate(joints):
                if joint not in options.joints and (options.joints or (number + seed) % SPREAD):
                    continue
                sign = 1 if (seed // SPREAD + number + turn) % 2 else -1
                wrong = (
                    ("variation.wrong_joint", joint),
                    ("variation.wrong_zero", sign * math.radians(degrees)),
                )
                turned = replace(spec, plant_options=(*spec.plant_options, *wrong))
                found.append(Case(turned, joint, degrees, task))
    return found


@suite(
    "zeros", "Wrong zeros", "leg joints with a wrong zero, named by a calibration in four poses",
    options={
        "robots": 20, "seed": 40, "tasks": ("forward=30",), "window": 10.0,
        "joints": Option((), "joints that are off (on each robot a quarter of all)", "JOINT"),
        "degrees": Option((3, 5), "how far they are off", "DEG", parse=int, minimum=1, maximum=15),
    },
    quick=({"robots": 2},), applies=is_nao,
)  # fmt: skip
def zeros(options: Options) -> Iterator[Row | str]:
    """Calibrate the robots, and compare the joints that are named with the truth."""
    jobs = cases(options)
    outcomes = options.map(carry_out, jobs)
    pairs = list(zip(jobs, outcomes, strict=True))
    healthy = [outcome for case, outcome in pairs if not case.joint]
    yield Row("healthy", "robots", "robots", len(healthy))
    yield Row("healthy", "named", "robots", sum(bool(each.named) for each in healthy))
    yield Row("healthy", "failed", "robots", sum(each.failed for each in healthy))
    for degrees in options.degrees:
        tried = [(case, outcome) for case, outcome in pairs if case.degrees == degrees]
        subject = f"wrong_{degrees}"
        yield Row(subject, "trials", "trials", len(tried))
        for quantity, judge in JUDGES.items():
            share = sum(judge(case.joint, outcome) for case, outcome in tried) / max(len(tried), 1)
            yield Row(subject, quantity, "%", 100.0 * share)
        errors = [outcome.error for _, outcome in tried if not math.isnan(outcome.error)]
        if errors:
            yield Row(subject, "error_rms", "deg", math.degrees(root_mean_square(errors)))
        walks = [outcome.walks for _, outcome in tried if outcome.walks is not None]
        if not walks:
            continue
        yield Row(subject, "walks", "walks", len(walks))
        for moment, speeds in zip(("before", "after"), zip(*walks, strict=True), strict=True):
            upright = [speed for speed in speeds if not math.isnan(speed)]
            yield Row(subject, f"upright_{moment}", "walks", len(upright))
            if upright:
                yield Row(subject, f"speed_{moment}", "cm/s", 100.0 * median(upright))
    yield (
        "Robots with ordinary zeros (deviation 0.5 deg), one joint off in addition; alone: only "
        "the right joint is named, first: as the likeliest one, listed: among others, other: only "
        "others are named, failed: most have fallen. Walks without and with the calibration, where "
        "one joint was named."
    )
