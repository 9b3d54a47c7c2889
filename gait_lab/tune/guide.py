"""The figures of docs/tune.md: `python -m gait_lab.tune.guide [PARAMETER ...] [--out DIR]`."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from gait_lab.analysis.figures import BLACK, BLUE, GREY, ORANGE, RED, pyplot
from gait_lab.tune.sweep import Sample, Sweep, Walked, column, run_sweep
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import BY_NAME, load_preset

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


def draw(sweep: Sweep, samples: Sequence[Sample], walked: Walked, path: Path) -> Path:
    """Speed, CoM error and step duration over the values; one line per robot, falls as crosses."""
    plt = pyplot()
    parameter = BY_NAME[sweep.name]
    figure, panels = plt.subplots(1, 3, figsize=(10, 2.7), layout="constrained")
    quantities = (
        ("speed [cm/s]", lambda s: 100.0 * s.speed),
        ("CoM error along y [mm]", lambda s: 1000.0 * s.error),
        ("step duration [s]", lambda s: s.step_duration),
    )
    for axes, (label, value) in zip(panels, quantities, strict=True):
        for robot, colour in zip(walked.robots, COLOURS, strict=False):
            x, y = column(samples, robot, value)
            axes.plot(x, y, "o-", ms=4, color=colour, label=f"robot {robot}")
        base = float(getattr(walked.base, sweep.name))
        axes.axvline(base, color=GREY, lw=1, ls=":", label="preset")
        _mark_falls(axes, samples)
        axes.set_title(label, loc="left", fontsize=10)
        axes.set_xlabel(f"{sweep.name} [{parameter.unit}]" if parameter.unit else sweep.name)
        axes.set_ylim(0.0, 1.12 * axes.get_ylim()[1])
    panels[0].axhline(100.0 * walked.speed, color=GREY, lw=1, ls="--")
    panels[2].legend(fontsize=7, loc="lower right")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
    plt.close(figure)
    return path


def _mark_falls(axes: object, samples: Sequence[Sample]) -> None:
    """Falls in red and dishonest walks in orange, at the foot of the panel."""
    for symbol, colour, height, chosen in (
        ("x", RED, 0.05, [s for s in samples if s.fell]),
        ("^", ORANGE, 0.12, [s for s in samples if not s.fell and not s.honest]),
    ):
        axes.plot(  # type: ignore[attr-defined]
            [s.value for s in chosen],
            [height] * len(chosen),
            symbol,
            color=colour,
            transform=axes.get_xaxis_transform(),  # type: ignore[attr-defined]
        )


def text(sweep: Sweep, samples: Sequence[Sample]) -> str:
    """The same in numbers."""
    lines = [f"{sweep.name} [{BY_NAME[sweep.name].unit}]"]
    for value in sweep.values:
        cells = [
            "fell" if s.fell else f"{100 * s.speed:.1f} cm/s {1000 * s.error:.1f} mm "
            f"{s.step_duration:.3f} s" + ("" if s.honest else " (!)")
            for s in samples
            if s.value == value
        ]
        lines.append(f"  {value:<8g}" + " | ".join(cells))
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m gait_lab.tune.guide", description=__doc__)
    parser.add_argument("parameters", nargs="*", help=f"of {', '.join(SWEEPS)} (all)")
    parser.add_argument("--out", type=Path, default=Path("docs/images"))
    parser.add_argument("--preset", default="default")
    parser.add_argument("--speed", type=float, default=0.30, help="asked [m/s] (0.30)")
    parser.add_argument("--robots", type=int, nargs="+", default=[0, 2], help="seeds (0 2)")
    parser.add_argument("--engine", default="mujoco")
    parser.add_argument("--plant", default="reference")
    parser.add_argument("--jobs", type=int)
    given = parser.parse_args(arguments)
    try:
        walked = Walked(
            load_preset(given.preset), given.speed, tuple(given.robots), given.engine, given.plant
        )
        for name in given.parameters or SWEEPS:
            if name not in SWEEPS:
                raise NaoGaitError("parameter", name, ", ".join(SWEEPS))
        for name in given.parameters or SWEEPS:
            samples = run_sweep(SWEEPS[name], walked, given.jobs)
            draw(SWEEPS[name], samples, walked, given.out / f"tune_{name}.png")
            sys.stdout.write(text(SWEEPS[name], samples) + "\n")
            sys.stdout.flush()
    except NaoGaitError as error:
        sys.stderr.write(f"guide: {error}\n")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
