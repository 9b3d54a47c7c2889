"""`nao_gait bench`: measure the gait on many robots."""

import argparse
from pathlib import Path

from gait_lab.commands.terminal import EXIT_OK, say


def _add_robot(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("robot and plant")
    group.add_argument("--robot", "--urdf", metavar="NAME", dest="urdf",
                       help="shipped robot (nao_h21_v33; suite posture: bruno) or a URDF file with "
                       "the joint names of one")  # fmt: skip
    group.add_argument("--plant", default="reference", metavar="P",
                       help="shipped name (reference, ideal, worn) or YAML file")  # fmt: skip
    group.add_argument("--plant-set", action="append", default=[], metavar="OPTION=VALUE",
                       dest="plant_settings", help="override one option of the plant, e.g. "
                       "motor.play=0.035; may be given often")  # fmt: skip
    group.add_argument("--engine", metavar="E", help="physics engine: pybullet (default) or mujoco "
                       "(the only one of the suite plant)")  # fmt: skip


def _add_parameters(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("gait parameters")
    group.add_argument("--preset", default="default", metavar="NAME",
                       help="default, paper or a YAML file")  # fmt: skip
    group.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", dest="settings",
                       help="override one parameter; may be given often")  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    """Run it; the exit status."""
    from gait_lab.bench import running
    from sim_bridge.plant import parse_options

    given = {
        "robots": arguments.robots,
        "seed": arguments.seed,
        "engine": arguments.engine,
        "plant": arguments.plant,
        "plant_options": parse_options(arguments.plant_settings) or None,
        "urdf": arguments.urdf,
        "tasks": tuple(arguments.task) or None,
        "window": arguments.seconds,
        "open_loop": arguments.open_loop,
        "jobs": arguments.jobs,
        "ingredients": tuple(arguments.ingredient) or None,
        "impulses": tuple(arguments.impulse) or None,
        "directions": tuple(arguments.direction) or None,
        "experiments": tuple(arguments.experiment) or None,
        "phases": arguments.phases,
        "metres": arguments.metres,
        "attempts": arguments.attempts,
        "half_speed": arguments.half_speed,
        "changes": arguments.changes,
        "runs": arguments.runs,
        "faults": tuple(arguments.fault) or None,
        "loss": arguments.loss,
        "ticks": arguments.ticks,
        "minutes": arguments.minutes,
        "placo_python": arguments.placo_python,
    }
    # What was not given is the suite's to choose.
    asked = {name: value for name, value in given.items() if value is not None}
    running.run(
        arguments.suite,
        asked,
        preset=arguments.preset,
        settings=arguments.settings,
        json_file=arguments.json,
        page=arguments.report,
        out=say,
    )
    return EXIT_OK


def add(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("suite", metavar="SUITE", help="speed, error, push, start, endurance, "
                        "delay, robust, rough (ground), getup, kick, posture, compute, plant (its "
                        "ingredients one by one), ablation (the gait's extensions one by one), "
                        "peers (other walks), faults (what goes wrong in the middle of a walk), "
                        "loss (of messages), fuzz, soak, realtime, or all in a quick form")
    parser.add_argument("--robots", type=int, metavar="N", help="number of robots (8; push and "
                        "ablation: 5; start, endurance, robust, rough, getup, kick, posture: 20; "
                        "delay: 4; plant: 2)")  # fmt: skip
    parser.add_argument("--seed", type=int, metavar="S",
                        help="seed of the first robot (0); -1 is the nominal robot")  # fmt: skip
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the rows as JSON")
    parser.add_argument("--report", type=Path, metavar="FILE",
                        help="write a Markdown page of all tables, figures in images/ beside it")
    parser.add_argument("--task", action="append", default=[], metavar="NAME[=SPEED]",
                        help="walk this instead of the suite's tasks, e.g. forward=31 (cm/s); "
                        "may be given often")  # fmt: skip
    parser.add_argument("--seconds", type=float, metavar="T",
                        help="seconds at speed (20; delay: 10; ablation, peers: 8; "
                        "plant: 5)")  # fmt: skip
    parser.add_argument("--ingredient", action="append", default=[], metavar="NAME",
                        help="suite plant: vary only this, e.g. stiffness; "
                        "may be given often")  # fmt: skip
    parser.add_argument("--impulse", type=float, action="append", default=[], metavar="NS",
                        help="suite push: this impulse in N s instead of searching the largest "
                        "that is survived; may be given often")  # fmt: skip
    parser.add_argument("--direction", action="append", default=[], metavar="NAME",
                        help="suite push: only this way, e.g. left, back_right; "
                        "may be given often")  # fmt: skip
    parser.add_argument("--experiment", action="append", default=[], metavar="NAME",
                        help="suite posture: only this one: start, straight or soccer; suite "
                        "rough: bruno_slow, bruno_fast, bruno_level, nao_level or given (by "
                        "--robot, --preset, --set, --task); may be given often")  # fmt: skip
    parser.add_argument("--phases", type=int, metavar="N",
                        help="suite push: pushes per gait cycle (8)")  # fmt: skip
    parser.add_argument("--metres", type=float, metavar="M",
                        help="suite endurance: what each robot walks (50)")  # fmt: skip
    parser.add_argument("--attempts", type=int, metavar="N",
                        help="attempts of each robot: suites getup (from each side; 5), kick (1)")
    parser.add_argument("--changes", type=Path, metavar="FILE",
                        help="suite ablation: YAML list of changes (config/bench/ablation.yaml)")
    parser.add_argument("--runs", type=int, metavar="N",
                        help="suite faults: walks with a fault each (2000)")  # fmt: skip
    parser.add_argument("--fault", action="append", default=[], metavar="NAME",
                        help="suite faults: only this class, e.g. imu_outage; may be given often")
    parser.add_argument("--loss", type=float, metavar="P",
                        help="suite loss: share of all messages that are lost, in %% (10)")
    parser.add_argument("--ticks", type=int, metavar="N", help="suite fuzz: ticks (1000000)")
    parser.add_argument("--minutes", type=float, metavar="M",
                        help="suite soak: simulated minutes in one process (30)")  # fmt: skip
    parser.add_argument("--placo-python", metavar="PATH",
                        help="suite peers: Python of an environment that has placo, to measure "
                        "its walk too")  # fmt: skip
    parser.add_argument("--no-half", dest="half_speed", action="store_false", default=None,
                        help="suite speed: not also at half of each speed")  # fmt: skip
    parser.add_argument("--open-loop", choices=("beside", "off", "only"),
                        help="open loop beside the closed (default), off, or only")  # fmt: skip
    parser.add_argument("--jobs", "--workers", type=int, metavar="N", dest="jobs",
                        help="processes (all cores)")  # fmt: skip
    _add_robot(parser)
    _add_parameters(parser)
    parser.set_defaults(run=run)
