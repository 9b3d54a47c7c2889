"""`nao_gait`: the tool around the gait. Each subcommand imports what it needs, and no more."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from nao_lipm_gait.errors import NaoGaitError

EXIT_OK = 0
EXIT_FAILED = 1
EXIT_USAGE = 2
EXIT_INTERRUPTED = 130


class _Parser(argparse.ArgumentParser):
    """Answers bad arguments with one line instead of the whole usage."""

    def error(self, message: str) -> None:  # type: ignore[override]
        self.exit(EXIT_USAGE, f"{self.prog}: {message} (see {self.prog} --help)\n")


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


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


def _bench(arguments: argparse.Namespace) -> int:
    from gait_lab.bench import suites
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
    suites.run(
        arguments.suite,
        asked,
        preset=arguments.preset,
        settings=arguments.settings,
        json_file=arguments.json,
        page=arguments.report,
        out=_say,
    )
    return EXIT_OK


def _add_bench(parser: argparse.ArgumentParser) -> None:
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
    parser.set_defaults(run=_bench)


def _tune(arguments: argparse.Namespace) -> int:
    from gait_lab.tune import run as tune

    options = tune.TuneOptions(
        study=arguments.study,
        method=arguments.method,
        trials=arguments.trials,
        workers=arguments.workers,
        backend=arguments.backend,
        address=arguments.address,
        resume=arguments.resume,
        out=arguments.out,
        seed=arguments.seed,
        engine=arguments.engine,
        confirm=arguments.confirm,
        places=tuple(arguments.confirm_on),
    )
    tune.run(options, _say)
    return EXIT_OK


def _add_tune(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("study", help="shipped name (speed, com_error, omni) or YAML file")
    parser.add_argument("--method", default="surrogate", metavar="M",
                        help="surrogate (Gaussian process, default), pso or cma")  # fmt: skip
    parser.add_argument("--trials", type=int, metavar="N", help="trials (the study's own)")
    parser.add_argument("--workers", type=int, metavar="N", help="processes (all cores)")
    parser.add_argument("--backend", default="loky", metavar="B",
                        help="loky: this machine (default); ray or dask: a cluster")  # fmt: skip
    parser.add_argument("--address", metavar="A", help="of a running Ray or Dask cluster; "
                        "without it a local one is started")  # fmt: skip
    parser.add_argument("--resume", action="store_true",
                        help="go on with the study that is in --out")  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="DIR",
                        help="trials, preset, figures, report (out/tune/STUDY)")  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the method (0)")
    parser.add_argument("--engine", metavar="E", help="physics engine of the search (the study's)")
    parser.add_argument("--no-confirm", action="store_false", dest="confirm",
                        help="do not walk the winner on unseen robots")  # fmt: skip
    parser.add_argument("--confirm-on", action="append", default=[], metavar="ENGINE/PLANT",
                        help="where it walks there instead of the study's places; may be given "
                        "often")  # fmt: skip
    parser.set_defaults(run=_tune)


def _demo(arguments: argparse.Namespace) -> int:
    from gait_lab import demo

    options = demo.DemoOptions(
        out=arguments.out,
        gui=arguments.gui,
        real_time=arguments.real_time or arguments.gui,
        tour=arguments.tour,
        engine=arguments.engine,
        plant=arguments.plant,
        robot_seed=arguments.robot_seed,
        preset=arguments.preset,
        urdf=arguments.urdf,
    )
    return demo.run(options, _say)


def _add_demo(parser: argparse.ArgumentParser) -> None:
    window = parser.add_mutually_exclusive_group()
    window.add_argument("--headless", action="store_false", dest="gui", default=False,
                        help="no window (default)")  # fmt: skip
    window.add_argument("--gui", action="store_true", help="a window with the robot, in real time")
    pace = parser.add_mutually_exclusive_group()
    pace.add_argument("--fast", action="store_false", dest="real_time", default=False,
                      help="in lockstep, as fast as the machine can (default)")  # fmt: skip
    pace.add_argument("--real-time", action="store_true", help="in real time, not in lockstep")
    parser.add_argument("--out", type=Path, default=Path("out/demo"), metavar="DIR",
                        help="bag, table and figures (out/demo)")  # fmt: skip
    parser.add_argument("--tour", default="full", metavar="NAME", help="full (default) or short")
    parser.add_argument("--robot-seed", type=int, default=0, metavar="S",
                        help="the individual (0); -1 is the nominal robot")  # fmt: skip
    parser.add_argument("--robot", "--urdf", default="nao_h21_v33", metavar="NAME", dest="urdf",
                        help="shipped robot (nao_h21_v33, bruno) or a URDF file")  # fmt: skip
    parser.add_argument("--plant", default="reference", metavar="P",
                        help="shipped name (reference, ideal, worn) or YAML file")  # fmt: skip
    parser.add_argument("--engine", default="pybullet", metavar="E",
                        help="physics engine: pybullet (default) or mujoco")  # fmt: skip
    parser.add_argument("--preset", default="default", metavar="NAME",
                        help="default, paper or a YAML file")  # fmt: skip
    parser.set_defaults(run=_demo)


def _record(arguments: argparse.Namespace) -> int:
    from gait_lab import bag

    messages = bag.record(
        arguments.out,
        topics=tuple(arguments.topics),
        duration=arguments.duration,
        storage=arguments.storage,
        say=_say,
    )
    return EXIT_OK if messages else EXIT_FAILED


def _add_record(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--topics", nargs="+", default=[], metavar="TOPIC",
                        help="only these (default: all that appear)")  # fmt: skip
    parser.add_argument("--out", type=Path, default=Path("out/bag"), metavar="DIR",
                        help="a new folder for the bag (out/bag)")  # fmt: skip
    parser.add_argument("--duration", type=float, metavar="S", help="seconds of wall time")
    parser.add_argument("--storage", default="mcap", metavar="S", help="mcap (default) or sqlite3")
    parser.set_defaults(run=_record)


def _report(arguments: argparse.Namespace) -> int:
    from gait_lab.report import command

    if arguments.after is None:
        whole = command.write_report(arguments.bag, arguments.output, _say)
    else:
        whole = command.write_comparison(
            arguments.bag, arguments.after, arguments.output, _say
        )
    return EXIT_OK if whole else EXIT_FAILED


def _add_report(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("bag", type=Path, metavar="BAG",
                        help="a rosbag2 folder, or an .mcap or .db3 file")  # fmt: skip
    parser.add_argument("after", type=Path, nargs="?", metavar="BAG2",
                        help="a second bag to compare the first with")  # fmt: skip
    parser.add_argument("-o", "--output", type=Path, default=Path("report.html"), metavar="FILE",
                        help="the page, complete in one file (report.html)")  # fmt: skip
    parser.set_defaults(run=_report)


def _view(arguments: argparse.Namespace) -> int:
    from gait_lab.view import command

    command.run(
        port=arguments.port,
        namespace=arguments.namespace,
        stamped=arguments.stamped,
        duration=arguments.duration,
        say=_say,
    )
    return EXIT_OK


def _add_view(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--port", type=int, default=8080, metavar="P",
                        help="of the page on 127.0.0.1 (8080, or the next free one)")  # fmt: skip
    parser.add_argument("--namespace", default="", metavar="NS", help="namespace of the robot")
    parser.add_argument("--stamped", action="store_true", help="send TwistStamped")
    parser.add_argument("--duration", type=float, metavar="S", help="end after S s of wall time")
    parser.set_defaults(run=_view)


def _teach(arguments: argparse.Namespace) -> int:
    from gait_lab import teach

    if arguments.action == "list":
        _say(teach.listing(arguments.urdf))
    elif arguments.file is None:
        raise NaoGaitError("file", "none", f"a motion file to {arguments.action}")
    elif arguments.action == "check":
        for motion in teach.check(arguments.file, arguments.urdf):
            _say(f"{motion.name}: {len(motion.keyframes)} keyframes, {motion.time:.2f} s")
    elif arguments.action == "play":
        teach.play(
            arguments.file, urdf=arguments.urdf, namespace=arguments.namespace, say=_say
        )
    else:
        teach.record(
            arguments.file, urdf=arguments.urdf, meaning=arguments.meaning,
            starts=arguments.starts, ends=arguments.ends, stiff=arguments.stiff,
            head=arguments.head, namespace=arguments.namespace, say=_say,
        )  # fmt: skip
    return EXIT_OK


def _add_teach(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("action", choices=("record", "play", "check", "list"),
                        help="record poses of the running robot, play a file on it, check a file, "
                        "list the shipped motions")  # fmt: skip
    parser.add_argument("file", type=Path, nargs="?", metavar="FILE", help="motion file (.yaml)")
    parser.add_argument("--urdf", default="nao_h21_v33", metavar="FILE", help="of the robot")
    parser.add_argument("--meaning", default="", metavar="TEXT", help="record: what it is for")
    parser.add_argument("--starts", default="standing", metavar="P", help="record: posture before")
    parser.add_argument("--ends", default="standing", metavar="P", help="record: posture after")
    parser.add_argument("--stiff", action="store_true",
                        help="record: do not take the torque off")  # fmt: skip
    parser.add_argument("--head", action="store_true", help="record: the head too")
    parser.add_argument("--namespace", default="", metavar="NS", help="namespace of the robot")
    parser.set_defaults(run=_teach)


def _teleop(arguments: argparse.Namespace) -> int:
    from gait_lab import teleop

    teleop.run(
        namespace=arguments.namespace,
        stamped=arguments.stamped,
        use_sim_time=arguments.use_sim_time,
    )
    return EXIT_OK


def _add_teleop(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--namespace", default="", metavar="NS", help="namespace of the robot")
    parser.add_argument("--stamped", action="store_true", help="send TwistStamped")
    parser.add_argument("--use-sim-time", action="store_true", help="stamp with /clock")
    parser.set_defaults(run=_teleop)


def build_parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="nao_gait", description="Watch, drive, measure and record a NAO's gait.")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, help_text, add in _COMMANDS:
        add(commands.add_parser(name, help=help_text, description=help_text))
    return parser


_COMMANDS = (
    ("demo", "watch the robot walk a tour over ROS 2; table, bag and figures", _add_demo),
    ("bench", "measure the gait on many robots, in process, without ROS", _add_bench),
    ("tune", "search parameters of the gait by a study; a preset comes out", _add_tune),
    ("record", "record topics to a bag (rosbag2; MCAP or sqlite3)", _add_record),
    ("report", "a page in one file about a recorded walk, or about two", _add_report),
    ("view", "watch and drive the running robot in the browser", _add_view),
    ("teach", "teach the robot a motion by hand, or play one", _add_teach),
    ("teleop", "drive the robot from the keyboard", _add_teleop),
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a subcommand; the exit status (0 only for success)."""
    parsed = build_parser().parse_args(arguments)
    try:
        return int(parsed.run(parsed))
    except NaoGaitError as error:
        sys.stderr.write(f"nao_gait {parsed.command}: {error}\n")
        return EXIT_USAGE
    except KeyboardInterrupt:
        sys.stderr.write(f"nao_gait {parsed.command}: interrupted\n")
        return EXIT_INTERRUPTED
    except ModuleNotFoundError as error:
        extra = parsed.command if parsed.command in ("view", "tune") else "lab"
        sys.stderr.write(
            f"nao_gait {parsed.command}: needs {error.name}, which is not installed; "
            f"in the checkout: pip install '.[{extra}]', or rosdep install beside an apt ROS\n"
        )
        return EXIT_FAILED


if __name__ == "__main__":
    sys.exit(main())
