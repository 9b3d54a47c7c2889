"""`nao_gait demo`: both nodes as processes, a tour by `cmd_vel`, a bag, a table, figures."""

import math
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gait_lab.analysis.bag import BagWriter
from gait_lab.demo.node_processes import NodeProcesses
from gait_lab.demo.tour import TOURS, Phase, PhaseResult, duration, evaluate, fall_time, phase_at
from gait_lab.record.recorder import TopicRecorder
from gait_lab.record.recording import Recording
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.ros.process import DomainClaim, StopRequest, stop_on_signal
from nao_lipm_gait.types import STANDSTILL, VelocityCommand

START_TIMEOUT = 60.0
"""[s] of wall time for both nodes to come up and the robot to stand."""
STALL_TIMEOUT = 20.0
"""[s] of wall time without a tick of the clock after which the demo gives up."""
COMMAND_PERIOD = 0.1
"""[s] of simulated time between two velocity commands."""
STAND_UP = 1.2
"""[s] of simulated time that the gait has for its stand before the tour begins."""
RECORD_ON = 0.2
"""[s] of simulated time that is still recorded after the end of the tour."""
SHOW_PERIOD = 0.25 if sys.stdout.isatty() else 10.0
"""[s] of wall time between two looks of the progress bar; in a log it gets a line now and then."""
EXIT_FAILED = 1


@dataclass(frozen=True, slots=True)
class DemoOptions:
    """What to show and where to put it."""

    out: Path = Path("out/demo")
    gui: bool = False
    real_time: bool = False
    tour: str = "full"
    engine: str = "pybullet"
    plant: str = "reference"
    robot_seed: int = 0
    preset: str = "default"
    urdf: str = "nao_h21_v33"
    figures: bool = True

    def __post_init__(self) -> None:
        if self.tour not in TOURS:
            raise NaoGaitError("tour", self.tour, f"one of {', '.join(TOURS)}")


@dataclass(frozen=True, slots=True)
class DemoResult:
    """What happened."""

    phases: tuple[PhaseResult, ...]
    fallen_at: float | None
    """[s since the tour began]"""
    problems: tuple[str, ...]

    @property
    def succeeded(self) -> bool:
        return not self.problems


def run(options: DemoOptions, say: Callable[[str], None] = print) -> int:
    """Walk the tour; the exit status is 0 only if the robot walked all of it upright."""
    # Before anything is started: the ROS wheels restart the interpreter at their first import.
    import rclpy
    from rclpy.signals import SignalHandlerOptions

    began = time.monotonic()
    out = _fresh(options.out)
    problems: list[str] = []
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
        nodes.start("gait", {"preset": options.preset, "urdf": options.urdf})
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        tour_began: float | None = None
        try:
            with BagWriter(out / "bag") as writer:
                guide = _Guide(TOURS[options.tour], writer, stop)
                try:
                    tour_began = guide.walk(nodes, say)
                except _DemoError as error:
                    problems.append(str(error))
                    tour_began = guide.tour_began
                finally:
                    guide.close()
        finally:
            rclpy.try_shutdown()
        statuses = nodes.stop()
        problems += [
            f"{name} ended with status {status}" for name, status in statuses.items() if status != 0
        ]
        if problems:
            problems += list(nodes.last_words())
    walked = time.monotonic() - began
    result = _judge(out, options, tour_began, problems)
    _report(result, options, out, walked, say)
    if options.figures and tour_began is not None:
        _draw(out, options, tour_began, result, say)
    say(f"Everything is in {out} (bag: {out / 'bag'}); {time.monotonic() - began:.0f} s in all.")
    if result.succeeded:
        say("The tour was completed upright.")
        return 0
    for problem in result.problems:
        sys.stderr.write(f"nao_gait demo: {problem}\n")
    return EXIT_FAILED


class _DemoError(Exception):
    """The tour could not be walked to its end."""


def _fresh(out: Path) -> Path:
    """The folder for the results; what an earlier demo left there is replaced."""
    import shutil

    try:
        out.mkdir(parents=True, exist_ok=True)
        if (out / "bag").is_dir():
            shutil.rmtree(out / "bag")
        for pattern in ("*.png", "*.log", "result.json"):
            for old in out.glob(pattern):
                old.unlink()
    except OSError as error:
        raise NaoGaitError("out", str(out), f"a folder that can be written ({error})") from error
    return out


def _bridge_parameters(options: DemoOptions) -> dict[str, object]:
    return {
        "urdf": options.urdf,
        "engine": options.engine,
        "plant": options.plant,
        "robot_seed": options.robot_seed,
        "gui": options.gui,
        "lockstep": not options.real_time,
        "real_time_factor": 1.0 if options.real_time else 0.0,
    }


class _Guide:
    """Listens to the clock, leads the robot through the tour and records everything."""

    def __init__(self, tour: tuple[Phase, ...], writer: BagWriter, stop: StopRequest) -> None:
        import rclpy
        from geometry_msgs.msg import Twist
        from nav_msgs.msg import Odometry
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
        from rosgraph_msgs.msg import Clock
        from std_msgs.msg import String

        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._tour = tour
        self._stop = stop
        self._node = rclpy.create_node("nao_gait_demo")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._recorder = TopicRecorder(self._node, writer)
        self._twist = Twist
        self._publisher = self._node.create_publisher(Twist, "cmd_vel", 10)
        self._node.create_subscription(Clock, "/clock", self._on_clock, qos_profile_sensor_data)
        self._node.create_subscription(
            Odometry, "ground_truth/odom", self._on_truth, qos_profile_sensor_data
        )
        self._node.create_subscription(String, "gait/support", self._on_support, latched)
        self._now = 0.0
        self._ticked = time.monotonic()
        self._next_command = 0.0
        self._support = ""
        self._speed = 0.0
        self._up = 1.0
        self.tour_began: float | None = None

    def walk(self, nodes: NodeProcesses, say: Callable[[str], None]) -> float:
        """Lead the whole tour; the simulated time [s] at which it began."""
        self._wait_for_stand(nodes)
        self.tour_began = self._now
        total = duration(self._tour)
        shown = 0.0
        with _progress(total) as bar:
            while (elapsed := self._now - self.tour_began) < total:
                self._spin(nodes, STALL_TIMEOUT)
                if time.monotonic() >= shown + SHOW_PERIOD:
                    shown = time.monotonic()
                    phase = phase_at(self._tour, elapsed)
                    bar.n = min(total, round(elapsed, 1))
                    bar.set_description(phase.name if phase else "done", refresh=False)
                    bar.set_postfix_str(f"{100 * self._speed:3.0f} cm/s, {self._support}")
                if self._up < 0.5:
                    raise _DemoError(f"the robot fell {elapsed:.1f} s into the tour")
            bar.n = total
            bar.refresh()
        # On a busy machine the recorder is behind: the end of the tour has to be in the bag.
        while self._recorder.now < self.tour_began + total + RECORD_ON:
            self._spin(nodes, STALL_TIMEOUT)
        return self.tour_began

    def _wait_for_stand(self, nodes: NodeProcesses) -> None:
        deadline = time.monotonic() + START_TIMEOUT
        while self._now < STAND_UP or not self._support or len(self._recorder.topics) < 12:
            self._recorder.add_new_topics()
            self._spin(nodes, max(1.0, deadline - time.monotonic()))
            if time.monotonic() > deadline:
                raise _DemoError(f"the nodes did not come up within {START_TIMEOUT:.0f} s")

    def _spin(self, nodes: NodeProcesses, stall: float) -> None:
        self._executor.spin_once(timeout_sec=0.1)
        if self._stop:
            raise KeyboardInterrupt
        if (ended := nodes.ended()) is not None:
            raise _DemoError(ended)
        if time.monotonic() - self._ticked > stall:
            raise _DemoError(f"the clock stood still for {stall:.0f} s")

    def _on_clock(self, message: Any) -> None:
        self._now = message.clock.sec + 1e-9 * message.clock.nanosec
        self._ticked = time.monotonic()
        if self._now >= self._next_command:
            self._next_command = self._now + COMMAND_PERIOD
            self._publish(self._command())

    def _command(self) -> VelocityCommand:
        if self.tour_began is None:
            return STANDSTILL
        phase = phase_at(self._tour, self._now - self.tour_began)
        return phase.command if phase else STANDSTILL

    def _publish(self, command: VelocityCommand) -> None:
        message = self._twist()
        message.linear.x, message.linear.y = command.x, command.y
        message.angular.z = command.yaw
        self._publisher.publish(message)

    def _on_truth(self, message: Any) -> None:
        q = message.pose.pose.orientation
        self._up = 1.0 - 2.0 * (q.x * q.x + q.y * q.y)
        v = message.twist.twist.linear
        self._speed += 0.05 * (math.hypot(v.x, v.y) - self._speed)

    def _on_support(self, message: Any) -> None:
        self._support = message.data

    def close(self) -> None:
        self._recorder.close()
        self._node.destroy_node()


def _progress(total: float) -> Any:
    from tqdm import tqdm

    layout = "{desc:12s}|{bar:30}| {n:4.1f}/{total:.0f} s simulated, {elapsed}{postfix}"
    return tqdm(total=total, bar_format=layout, mininterval=SHOW_PERIOD, file=sys.stdout)


def _judge(
    out: Path, options: DemoOptions, tour_began: float | None, problems: list[str]
) -> DemoResult:
    """Score the bag, not what was seen on the way."""
    if tour_began is None:
        return DemoResult((), None, (*problems, "the tour did not begin"))
    recording = Recording(out / "bag")
    tour = TOURS[options.tour]
    phases = tuple(evaluate(recording, tour, tour_began))
    fallen = fall_time(recording)
    problems = list(problems)
    if fallen is not None:
        problems.append(f"the robot fell {fallen - tour_began:.1f} s into the tour")
    if len(phases) < len(tour):
        problems.append(f"{len(phases)} of {len(tour)} phases were walked to their end")
    for result in phases:
        if result.reached is False:
            problems.append(f"phase {result.phase.name} did not reach its speed")
    if phases and phases[-1].phase.command.is_zero and _still_moves(phases[-1]):
        problems.append("the robot did not come to rest at the end")
    return DemoResult(phases, None if fallen is None else fallen - tour_began, tuple(problems))


def _still_moves(result: PhaseResult) -> bool:
    return math.hypot(result.achieved.x, result.achieved.y) > 0.02


def _report(
    result: DemoResult,
    options: DemoOptions,
    out: Path,
    seconds: float,
    say: Callable[[str], None],
) -> None:
    import json

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
    text = json.dumps(
        {
            "succeeded": result.succeeded,
            "problems": list(result.problems),
            "urdf": options.urdf,
            "engine": options.engine,
            "plant": options.plant,
            "robot_seed": options.robot_seed,
            "phases": rows,
        },
        indent=1,
    )
    (out / "result.json").write_text(text + "\n", encoding="utf-8")


def _triple(v: VelocityCommand) -> str:
    return f"{100 * v.x:7.1f} {100 * v.y:5.1f} {math.degrees(v.yaw):6.1f}     "


def _draw(
    out: Path,
    options: DemoOptions,
    tour_began: float,
    result: DemoResult,
    say: Callable[[str], None],
) -> None:
    from gait_lab.analysis.figures import draw_demo

    written = draw_demo(Recording(out / "bag"), TOURS[options.tour], tour_began, out, options.urdf)
    say("Figures: " + ", ".join(path.name for path in written))
