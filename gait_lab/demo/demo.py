"""`nao_gait demo`: both nodes as processes, a tour by `cmd_vel`, a bag, a table and figures."""

import json
import math
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gait_lab.analysis.bag import BagWriter
from gait_lab.analysis.recorded_trace import find_phases, make_trace
from gait_lab.analysis.recorded_walk import RecordedWalk, read_walk
from gait_lab.demo.node_processes import NodeProcesses, empty_folder
from gait_lab.demo.tour import (
    TOURS,
    TourPhaseResult,
    duration,
    evaluate,
    fall_time,
)
from gait_lab.demo.tour_driver import TourDriver, TourError
from gait_lab.ros_session import ros_node
from gait_lab.terminal import EXIT_FAILED, EXIT_OK
from nao_lipm_gait.presets import preset_for
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from robot_core.ros.lockstep import LockstepPartner
from robot_core.ros.process import DomainClaim, stop_on_signal
from robot_core.schema import write_text
from robot_core.types import VelocityCommand
from sim_bridge.engines.registry import engine_for
from sim_bridge.plant import load_plant

REST_SPEED = 0.02
"""Speed [m/s] above which a robot does not stand."""
NODE = "nao_gait_demo"
BIAS_WAIT = 5.0
"""Longest stand [s] for the gyro: a tour is short, and its heading need not be exact."""


@dataclass(frozen=True, slots=True)
class DemoOptions:
    """Options of the demo, as the command line explains them."""

    out: Path = Path("out/demo")
    gui: bool = False
    real_time: bool = False
    tour: str = "full"
    engine: str | None = None
    plant: str = "reference"
    robot_seed: int = 0
    preset: str = "default"
    urdf: str = "nao_h21_v33"

    @property
    def in_real_time(self) -> bool:
        """A window shows the robot as fast as it walks."""
        return self.real_time or self.gui

    def __post_init__(self) -> None:
        if self.tour not in TOURS:
            raise NaoGaitError("tour", self.tour, TOURS)
        # Refused here rather than by a node that has been started.
        load_plant(self.plant)
        preset_for(load_robot(self.urdf), self.preset)


@dataclass(frozen=True, slots=True)
class DemoResult:
    """Result of a tour.

    Attributes:
        fallen_at: Time of the fall [s since the tour began]; None without one.
    """

    phases: tuple[TourPhaseResult, ...]
    fallen_at: float | None
    problems: tuple[str, ...]

    @property
    def succeeded(self) -> bool:
        """Whether the whole tour was walked upright at the required speeds."""
        return not self.problems


def command(say: Callable[[str], None], **options: Any) -> int:
    """Run with the fields of `DemoOptions`; the exit status."""
    return run(DemoOptions(**options), say)


def run(options: DemoOptions, say: Callable[[str], None] = print) -> int:
    """Walk the tour and evaluate its bag; status 0 only for the whole tour upright."""
    # Before anything is started: the ROS wheels restart the interpreter at their first import.
    import rclpy  # noqa: F401

    began = time.monotonic()
    if options.engine is None:
        options = replace(options, engine=engine_for((load_robot(options.urdf),)))
    out = options.out
    empty_folder(out, "report.html", "result.json", "frames.png", "walk.gif")
    tour_began, problems = _walk(options, out, say)
    walked = time.monotonic() - began
    recorded = None if tour_began is None else read_walk(out / "bag")
    result = _evaluate(recorded, options, tour_began, problems)
    if tour_began is not None:
        _print_table(result, options, walked, say)
    _write_json(result, options, out)
    if tour_began is not None and recorded is not None:
        _draw(recorded, out, options, tour_began, say)
    say(f"Everything is in {out} (bag: {out / 'bag'}); {time.monotonic() - began:.0f} s in all.")
    if result.succeeded:
        say("The tour was completed upright.")
        return EXIT_OK
    for problem in result.problems:
        sys.stderr.write(f"nao_gait demo: {problem}\n")
    return EXIT_FAILED


def _walk(
    options: DemoOptions, out: Path, say: Callable[[str], None]
) -> tuple[float | None, list[str]]:
    """Run both nodes and the tour; return the simulated time of its start [s], and problems."""
    problems: list[str] = []
    tour_began: float | None = None
    with (
        stop_on_signal() as stop,
        DomainClaim() as domain,
        NodeProcesses(domain.environment(), out) as nodes,
    ):
        os.environ.update(domain.environment())
        say(
            f"Two ROS 2 nodes, sim_bridge ({options.engine}, plant {options.plant}, robot "
            f"{options.robot_seed}) and gait, in ROS domain {domain.domain} of this machine"
        )
        nodes.start("sim_bridge", _bridge_parameters(options))
        gait = {"preset": options.preset, "urdf": options.urdf, "bias_wait": BIAS_WAIT}
        nodes.start("gait", gait)
        with ros_node(NODE) as node, BagWriter(out / "bag") as writer:
            lockstep = None if options.in_real_time else LockstepPartner(node, NODE)
            driver = TourDriver(node, TOURS[options.tour], writer, stop, nodes, lockstep)
            try:
                driver.run()
            except TourError as error:
                problems.append(str(error))
            finally:
                tour_began = driver.tour_began
                driver.close()
        statuses = nodes.stop()
        problems += [
            f"{name} ended with status {status}" for name, status in statuses.items() if status != 0
        ]
        if problems:
            problems += nodes.log_tails()
    return tour_began, problems


def _bridge_parameters(options: DemoOptions) -> dict[str, object]:
    return {
        "urdf": options.urdf,
        "engine": options.engine,
        "plant": options.plant,
        "robot_seed": options.robot_seed,
        "gui": options.gui,
        "lockstep": not options.in_real_time,
        "lockstep_nodes": "" if options.in_real_time else NODE,
        "real_time_factor": 1.0 if options.in_real_time else 0.0,
    }


def _evaluate(
    recorded: RecordedWalk | None, options: DemoOptions, tour_began: float | None,
    problems: list[str],
) -> DemoResult:
    """Evaluate the recorded bag."""
    if tour_began is None or recorded is None:
        return DemoResult((), None, (*problems, "the tour did not begin"))
    trace = make_trace(recorded, find_phases(recorded), None)
    if trace is None:
        return DemoResult((), None, (*problems, "the bag has no ground truth"))
    tour, began = TOURS[options.tour], tour_began - 1e-9 * int(trace.stamp[0])
    phases = tuple(evaluate(trace, tour, began))
    fallen = fall_time(trace)
    problems = list(problems)
    if fallen is not None:
        problems.append(f"the robot fell {fallen - began:.1f} s into the tour")
    if len(phases) < len(tour):
        problems.append(f"{len(phases)} of {len(tour)} phases were walked to their end")
    for result in phases:
        if result.reached is False:
            problems.append(f"phase {result.phase.name} did not reach its speed")
    if phases and phases[-1].phase.command.is_zero and _still_moves(phases[-1]):
        problems.append("the robot did not come to rest at the end")
    return DemoResult(phases, None if fallen is None else fallen - began, tuple(problems))


def _still_moves(result: TourPhaseResult) -> bool:
    return math.hypot(result.achieved.x, result.achieved.y) > REST_SPEED


def _print_table(
    result: DemoResult, options: DemoOptions, seconds: float, say: Callable[[str], None]
) -> None:
    """Print commanded against achieved; `seconds`: wall time of the walk."""
    say("")
    say("phase          commanded x, y, yaw         achieved x, y, yaw          CoM y    flight")
    say("               cm/s  cm/s  deg/s           cm/s  cm/s  deg/s           mm       %")
    for row in result.phases:
        mark = {True: "reached", False: "NOT REACHED", None: ""}[row.reached]
        com = "   -" if math.isnan(row.com_error_y) else f"{1e3 * row.com_error_y:4.1f}"
        say(
            f"{row.phase.name:12s} {_triple(row.phase.command)}    {_triple(row.achieved)}"
            f"        {com}     {100 * row.flight_share:4.1f}  {mark}"
        )
    say(
        "Achieved: ground truth in the torso's heading. CoM y: mean |expected - measured|, "
        "the paper's error."
    )
    falls = "none" if result.fallen_at is None else f"at {result.fallen_at:.1f} s"
    say(f"Falls: {falls}. Tour of {duration(TOURS[options.tour]):.0f} s walked in {seconds:.0f} s.")


def _triple(v: VelocityCommand) -> str:
    return f"{100 * v.x:7.1f} {100 * v.y:5.1f} {math.degrees(v.yaw):6.1f}     "


def _write_json(result: DemoResult, options: DemoOptions, out: Path) -> None:
    rows = [
        {
            "phase": row.phase.name,
            "commanded": [row.phase.command.x, row.phase.command.y, row.phase.command.yaw],
            "achieved": [row.achieved.x, row.achieved.y, row.achieved.yaw],
            "com_error_y": None if math.isnan(row.com_error_y) else row.com_error_y,
            "flight_share": None if math.isnan(row.flight_share) else row.flight_share,
        }
        for row in result.phases
    ]
    document = {
        "succeeded": result.succeeded,
        "problems": list(result.problems),
        "urdf": options.urdf,
        "engine": options.engine,
        "plant": options.plant,
        "robot_seed": options.robot_seed,
        "phases": rows,
    }
    (out / "result.json").write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def _draw(
    recorded: RecordedWalk, out: Path, options: DemoOptions, tour_began: float,
    say: Callable[[str], None],
) -> None:
    """Write the page with all figures, and pictures of the robot."""
    from gait_lab.demo.pictures import write_pictures
    from gait_lab.report.analysis import analysis_of
    from gait_lab.report.command import report_page

    analysis = analysis_of(recorded)
    page = out / "report.html"
    try:
        write_text(page, report_page(analysis), "out")
        say(f"Figures: {page} (open it in a browser)")
    except ModuleNotFoundError as error:  # rosdep does not bring plotly
        say(f"Figures: none without {error.name}; docs/ros.md says how to install it")
    pictures = write_pictures(analysis.walk, TOURS[options.tour], tour_began, out, options.urdf)
    say(f"Pictures: {', '.join(path.name for path in pictures)}")
