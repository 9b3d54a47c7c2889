"""The figures of docs/tune.md: `python -m gait_lab.tune.guide [PARAMETER ...] [--out DIR]`."""

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gait_lab.analysis.plots import BLACK, BLUE, GREY, ORANGE, RED, pyplot
from nao_lipm_gait.parameters import BY_NAME, GaitParameters, load_preset
from robot_core.errors import NaoGaitError
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import walk as walk_task
from sim_bridge.trials.trace import LEFT, RIGHT, Trace


@dataclass(frozen=True, slots=True)
class Sweep:
    """A parameter and its values.

    Attributes:
        name: Name of the parameter.
        values: Values to try, SI units.
    """

    name: str
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if self.name not in BY_NAME:
            raise NaoGaitError("parameter", self.name, f"one of {', '.join(BY_NAME)}")
        for value in self.values:
            BY_NAME[self.name].check(value)


@dataclass(frozen=True, slots=True)
class SweepSample:
    """One robot at one value; NaN where nothing was measured.

    Attributes:
        value: Value of the parameter, SI unit.
        robot: Seed of the robot.
        fell: Whether the robot fell.
        proper: Whether flight, slip and contact are within their limits.
        speed: Speed forward [m/s].
        error: Mean absolute difference of expected and true CoM along y [m].
        step_duration: Mean duration of a step [s].
    """

    value: float
    robot: int
    fell: bool
    proper: bool
    speed: float
    error: float
    step_duration: float


@dataclass(frozen=True, slots=True)
class SweepSetup:
    """What all samples have in common.

    Attributes:
        base: Parameters of the gait.
        speed: Commanded speed forward [m/s].
        robots: Seeds of the robots.
        engine: Physics engine.
        plant: Name or file of the plant.
        window: Duration of the measurement [s].
    """

    base: GaitParameters
    speed: float
    robots: tuple[int, ...]
    engine: str = "mujoco"
    plant: str = "reference"
    window: float = 6.0


SWEEPS = {
    sweep.name: sweep
    for sweep in (
        Sweep("pendulum_width", (0.020, 0.026, 0.032, 0.038, 0.044)),
        Sweep("pendulum_offset_y", (0.040, 0.045, 0.050, 0.055, 0.060)),
        Sweep("pendulum_height", (0.20, 0.22, 0.24, 0.26, 0.28)),
        Sweep("com_height", (0.22, 0.23, 0.24, 0.25, 0.26)),
        Sweep("foot_reference_x", (-0.01, 0.005, 0.02, 0.035, 0.05)),
        Sweep("torso_pitch", (-0.10, -0.04, 0.02, 0.08, 0.14)),
        Sweep("swing_lift", (0.006, 0.012, 0.02, 0.03, 0.04)),
        Sweep("swing_travel_end", (0.5, 0.65, 0.8, 0.9, 1.0)),
        Sweep("step_forward_max", (0.03, 0.05, 0.07, 0.09, 0.11)),
        Sweep("feedback_delay", (0.0, 0.03, 0.06, 0.09, 0.12)),
        Sweep("velocity_sigma", (0.0005, 0.002, 0.004, 0.01, 0.03)),
        Sweep("gyro_pitch_gain", (-0.03, 0.0, 0.03, 0.06, 0.1)),
    )
}
COLOURS = (BLUE, BLACK, GREY)



def run_sweep(
    sweep: Sweep, setup: SweepSetup, jobs: int | None, show: bool = True
) -> list[SweepSample]:
    """Walk with every value on every robot.

    Args:
        sweep: The parameter and its values.
        setup: What all samples have in common.
        jobs: Number of processes; None for all cores.
        show: Whether to show a progress bar.

    Returns:
        The samples, by value, then by robot.
    """
    calls = [(sweep.name, v, robot, setup) for v in sweep.values for robot in setup.robots]
    found: list[SweepSample] = parallel_map(_sample, calls, jobs=jobs, label=sweep.name, show=show)
    return found


def _sample(call: tuple[str, float, int, SweepSetup]) -> SweepSample:
    name, value, robot, setup = call
    task = walk_task("forward", x=setup.speed, axis="x", window=setup.window)
    spec = RolloutSpec(
        task,
        robot_seed=robot,
        parameters=setup.base.replace(**{name: value}),
        plant=setup.plant,
        engine=setup.engine,
        keep_trace=True,
    )
    result = rollout(spec)
    metrics = result.metrics
    duration = float("nan")
    if result.trace is not None and not metrics.fell:
        duration = step_duration(result.trace.between(task.start, task.end))
    return SweepSample(
        value, robot, metrics.fell, metrics.walks, metrics.speed_x, metrics.com_error_y, duration
    )


def step_duration(trace: Trace) -> float:
    """Return the mean time [s] between support changes; NaN with fewer than two changes."""
    single = np.isin(trace.support, (LEFT, RIGHT))
    support, time = trace.support[single], trace.time[single]
    changes = time[1:][np.diff(support) != 0]
    return float(np.diff(changes).mean()) if len(changes) > 1 else float("nan")


Values = Callable[[SweepSample], float]


def column(
    samples: Sequence[SweepSample], robot: int, value: Values
) -> tuple[list[float], list[float]]:
    """Return x and y of a line: the samples of one robot without a fall."""
    kept = [s for s in samples if s.robot == robot and not s.fell]
    return [s.value for s in kept], [value(s) for s in kept]


def draw(sweep: Sweep, samples: Sequence[SweepSample], setup: SweepSetup, path: Path) -> Path:
    """Draw speed, CoM error and step duration over the values, one line per robot.

    Args:
        sweep: The parameter and its values.
        samples: The samples.
        setup: What all samples have in common.
        path: File to write.

    Returns:
        The file.
    """
    plt = pyplot()
    parameter = BY_NAME[sweep.name]
    figure, panels = plt.subplots(1, 3, figsize=(10, 2.7), layout="constrained")
    quantities = (
        ("speed [cm/s]", lambda s: 100.0 * s.speed),
        ("CoM error along y [mm]", lambda s: 1000.0 * s.error),
        ("step duration [s]", lambda s: s.step_duration),
    )
    for axes, (label, value) in zip(panels, quantities, strict=True):
        for robot, colour in zip(setup.robots, COLOURS, strict=False):
            x, y = column(samples, robot, value)
            axes.plot(x, y, "o-", ms=4, color=colour, label=f"robot {robot}")
        base = float(getattr(setup.base, sweep.name))
        axes.axvline(base, color=GREY, lw=1, ls=":", label="preset")
        _mark_falls(axes, samples)
        axes.set_title(label, loc="left", fontsize=10)
        axes.set_xlabel(f"{sweep.name} [{parameter.unit}]" if parameter.unit else sweep.name)
        axes.set_ylim(0.0, 1.12 * axes.get_ylim()[1])
    panels[0].axhline(100.0 * setup.speed, color=GREY, lw=1, ls="--")
    panels[2].legend(fontsize=7, loc="lower right")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
    plt.close(figure)
    return path


def _mark_falls(axes: object, samples: Sequence[SweepSample]) -> None:
    """Mark falls in red and improper walks in orange, at the bottom of the panel."""
    for symbol, colour, height, chosen in (
        ("x", RED, 0.05, [s for s in samples if s.fell]),
        ("^", ORANGE, 0.12, [s for s in samples if not s.fell and not s.proper]),
    ):
        axes.plot(  # type: ignore[attr-defined]
            [s.value for s in chosen],
            [height] * len(chosen),
            symbol,
            color=colour,
            transform=axes.get_xaxis_transform(),  # type: ignore[attr-defined]
        )


def text(sweep: Sweep, samples: Sequence[SweepSample]) -> str:
    """Return the samples as text."""
    lines = [f"{sweep.name} [{BY_NAME[sweep.name].unit}]"]
    for value in sweep.values:
        cells = [
            "fell" if s.fell else f"{100 * s.speed:.1f} cm/s {1000 * s.error:.1f} mm "
            f"{s.step_duration:.3f} s" + ("" if s.proper else " (!)")
            for s in samples
            if s.value == value
        ]
        lines.append(f"  {value:<8g}" + " | ".join(cells))
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run sweeps, print their numbers and draw their figures; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m gait_lab.tune.guide", description=__doc__)
    parser.add_argument(
        "parameters", nargs="*", help=f"parameters to sweep: {', '.join(SWEEPS)} (all)"
    )
    parser.add_argument("--out", type=Path, default=Path("docs/images"))
    parser.add_argument("--preset", default="default")
    parser.add_argument("--speed", type=float, default=0.30, help="commanded speed [m/s] (0.30)")
    parser.add_argument("--robots", type=int, nargs="+", default=[0, 2], help="seeds (0 2)")
    parser.add_argument("--engine", default="mujoco")
    parser.add_argument("--plant", default="reference")
    parser.add_argument("--jobs", type=int)
    given = parser.parse_args(arguments)
    try:
        setup = SweepSetup(
            load_preset(given.preset), given.speed, tuple(given.robots), given.engine, given.plant
        )
        for name in given.parameters or SWEEPS:
            if name not in SWEEPS:
                raise NaoGaitError("parameter", name, ", ".join(SWEEPS))
        for name in given.parameters or SWEEPS:
            samples = run_sweep(SWEEPS[name], setup, given.jobs)
            draw(SWEEPS[name], samples, setup, given.out / f"tune_{name}.png")
            sys.stdout.write(text(SWEEPS[name], samples) + "\n")
            sys.stdout.flush()
    except NaoGaitError as error:
        sys.stderr.write(f"guide: {error}\n")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
