"""A match over ROS 2: bridge with cameras, and for each robot a gait, a vision and a player."""

import os
import shutil
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gait_lab.analysis.bag import BagWriter
from gait_lab.demo.node_processes import NodeProcesses
from gait_lab.ros_session import ros_node
from gait_lab.soccer.eyes import in_field
from gait_lab.soccer.match import MatchResult, MatchSpec, match_scene
from gait_lab.soccer.player_nodes import player_parameters, referee_ports
from gait_lab.soccer.snapshots import (
    RobotSnapshot,
    Snapshot,
    dribble_strokes,
    is_turned,
    wrong_half,
)
from gait_lab.terminal import EXIT_FAILED, EXIT_OK
from nao_soccer.referee.rules import Goal, Rules
from robot_core.errors import NaoGaitError
from robot_core.field import TEAMS
from robot_core.geometry import yaw_of_quaternion
from robot_core.ros.process import DomainClaim, StopRequest, stop_on_signal
from robot_core.types import state_of
from sim_bridge.scene import Scene

if TYPE_CHECKING:
    from rclpy.node import Node

START = 6.0
"""[s] of simulated time before the referee begins: the nodes find each other."""
BIAS_WAIT = 5.0
"""Longest stand [s] for the gyro: players see where they are, so their heading is corrected."""
REFEREE_TIMEOUT = 20.0
"""[s] of simulated time after which the referee has to be heard."""
STALL_TIMEOUT = 120.0
"""[s] without a new time on `/clock`, after which a match is given up."""
FRAME_PERIOD = 0.2
"""[s] between two frames of the replay."""


def run(
    spec: MatchSpec,
    out: Path,
    say: Callable[[str], None],
    show: Callable[[Snapshot, float], None],
    *,
    real_time: bool = False,
) -> tuple[int, MatchResult | None]:
    """Play a match with rendered images; exit status, and the result if it came to its end."""
    # Before anything is started: the ROS wheels restart the interpreter at their first import.
    import rclpy  # noqa: F401

    scene = match_scene(spec)
    _empty(out)
    file = out / "scene.yaml"
    file.write_text(scene.to_yaml(), encoding="utf-8")
    problem: str | None = None
    with (
        stop_on_signal() as stop,
        DomainClaim() as domain,
        NodeProcesses(domain.environment(), out) as nodes,
    ):
        os.environ.update(domain.environment())
        file = file.absolute()
        count = _start(nodes, spec, scene, file, domain.domain, real_time=real_time)
        say(f"{count} ROS 2 nodes in domain {domain.domain} of this machine; logs in {out}")
        with ros_node("nao_gait_match") as node, BagWriter(out / "bag") as writer:
            watcher = _Watcher(node, scene, spec, writer, stop, nodes, show)
            try:
                watcher.run()
            except _MatchError as error:
                problem = str(error)
        statuses = nodes.stop()
        failed = [f"{name} ended with status {each}" for name, each in statuses.items() if each]
        tails = nodes.log_tails() if problem or failed else ()
    for line in (*([problem] if problem else []), *failed, *tails):
        sys.stderr.write(f"nao_gait match: {line}\n")
    result = None if problem else watcher.result()
    return (EXIT_FAILED if problem or failed else EXIT_OK), result


def _empty(out: Path) -> None:
    """Remove the results of an earlier match."""
    try:
        if (out / "bag").is_dir():
            shutil.rmtree(out / "bag")
        for old in (*out.glob("*.log"), *out.glob("replay.html")):
            old.unlink()
    except OSError as error:
        raise NaoGaitError("out", str(out), f"a folder that can be written ({error})") from error


def _start(
    nodes: NodeProcesses, spec: MatchSpec, scene: Scene, file: Path, domain: int, *, real_time: bool
) -> int:
    """Start all nodes; their number."""
    nodes.start(
        "sim_bridge",
        {
            "scene": file,
            "engine": spec.engine,
            "cameras": True,
            "lockstep": not real_time,
            "real_time_factor": 1.0 if real_time else 0.0,
        },
    )
    for robot in scene.robots:
        nodes.start("gait", {"urdf": robot.urdf, "bias_wait": BIAS_WAIT}, robot.name)
        nodes.start("vision", {"urdf": robot.urdf, "scene": file}, robot.name)
        nodes.start("player", player_parameters(robot, scene, file, domain), robot.name)
    nodes.start(
        "referee",
        {
            "scene": file,
            "minutes": spec.minutes,
            "kick_off": TEAMS[spec.seed % 2],
            "wait": START,
            **referee_ports(domain),
        },
    )
    return 2 + 3 * len(scene.robots)


class _MatchError(Exception):
    """The match did not come to its end."""


class _Watcher:
    """Follows a match on its topics: frames of the replay, bag, score."""

    def __init__(
        self,
        node: "Node",
        scene: Scene,
        spec: MatchSpec,
        writer: BagWriter,
        stop: StopRequest,
        nodes: NodeProcesses,
        show: Callable[[Snapshot, float], None],
    ) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import PointStamped, PoseWithCovarianceStamped
        from nav_msgs.msg import Odometry
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.qos import qos_profile_sensor_data
        from rosgraph_msgs.msg import Clock
        from std_msgs.msg import String

        from robot_core.ros.topics import LATCHED

        self._spec = spec
        self._stop = stop
        self._nodes = nodes
        self._writer = writer
        self._show_progress = show
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._now = 0
        self._moved = time.monotonic()
        self._ball: tuple[float, float] | None = None
        self._robots = {r.name: RobotSnapshot(*r.pose, "stand", "", "") for r in scene.robots}
        self._teams = {robot.name: robot.team for robot in scene.robots}
        self._game: dict[str, str] = {}
        self._began = START
        self._frames: list[Snapshot] = []
        self._kicks = 0
        self._expected = Rules(half=60.0 * spec.minutes).duration
        sensors = qos_profile_sensor_data

        def subscribe(
            kind: Any, topic: str, take: Callable[[Any], None] | None, qos: Any = 10
        ) -> None:
            package = kind.__module__.split(".")[0]
            writer.add_topic(f"/{topic}", f"{package}/msg/{kind.__name__}", latched=qos is LATCHED)
            node.create_subscription(
                kind, topic, partial(self._on_message, kind, f"/{topic}", take), qos, raw=True
            )

        node.create_subscription(Clock, "/clock", self._on_clock, sensors)
        subscribe(DiagnosticArray, "game_state", self._on_game)
        subscribe(PointStamped, "ground_truth/ball", self._on_ball, sensors)
        for name in self._robots:
            on = partial(partial, name=name)
            subscribe(Odometry, f"{name}/ground_truth/odom", on(self._on_robot), sensors)
            subscribe(String, f"{name}/gait/support", on(self._on_support), LATCHED)
            subscribe(DiagnosticArray, f"{name}/behavior", on(self._on_behavior))
            subscribe(String, f"{name}/gait/motion", self._on_motion)
            subscribe(PoseWithCovarianceStamped, f"{name}/pose", on(self._on_pose))
            subscribe(Odometry, f"{name}/ball", None)

    def run(self) -> None:
        """Follow the match to its end.

        Raises:
            _MatchError: The nodes do not start, end or stall.
            KeyboardInterrupt: The user interrupts.
        """
        while self._game.get("over") != "True":
            self._executor.spin_once(timeout_sec=0.1)
            if self._stop:
                raise KeyboardInterrupt
            if (ended := self._nodes.ended()) is not None:
                raise _MatchError(ended)
            if time.monotonic() - self._moved > STALL_TIMEOUT:
                raise _MatchError(f"no new time on /clock for {STALL_TIMEOUT:.0f} s")
            if not self._game and self._now * 1e-9 > 2.0 * START + REFEREE_TIMEOUT:
                raise _MatchError("the referee is not heard")

    def result(self) -> MatchResult:
        """The result, with a replay."""
        goals = [
            Goal(float(t), team, "" if player == "-" else player, own == "True")
            for t, team, player, own in (
                value.split() for key, value in self._game.items() if key.startswith("goal_")
            )
        ]
        falls = {
            name: int(self._game[f"robot/{name}"].split()[-2])
            for name in self._robots
            if f"robot/{name}" in self._game
        }
        score = {team: int(self._game.get(team, "0")) for team in TEAMS}
        return MatchResult(
            self._spec,
            score,
            goals,
            self._now * 1e-9 - self._began,
            falls,
            self._kicks,
            dribble_strokes(self._frames),
            None,
            float("nan"),
            float("nan"),
            wrong_half(goals, self._frames),
            frames=self._frames,
        )

    # -- messages ----------------------------------------------------------------------------------

    def _on_message(
        self, kind: Any, topic: str, take: Callable[[Any], None] | None, data: bytes
    ) -> None:
        from rclpy.serialization import deserialize_message

        self._writer.write(topic, self._now, data)
        if take is not None:
            take(deserialize_message(data, kind))

    def _on_clock(self, message: Any) -> None:
        now = message.clock.sec * 1_000_000_000 + message.clock.nanosec
        if now != self._now:
            self._now, self._moved = now, time.monotonic()
        if self._ball is None or not self._game:
            return
        at = now * 1e-9 - self._began
        if at < 0.0:
            return
        if self._frames and at < self._frames[-1].time + FRAME_PERIOD:
            return
        score = int(self._game.get("red", "0")), int(self._game.get("blue", "0"))
        frame = Snapshot(
            round(at, 2), self._ball, dict(self._robots), self._game.get("state", ""), score
        )
        self._frames.append(frame)
        self._show_progress(frame, self._expected)

    def _on_game(self, message: Any) -> None:
        self._game = _values(message.status)
        stamp = message.header.stamp
        self._began = stamp.sec + 1e-9 * stamp.nanosec - float(self._game["time"])

    def _on_ball(self, message: Any) -> None:
        self._ball = round(message.point.x, 3), round(message.point.y, 3)

    def _on_robot(self, message: Any, name: str) -> None:
        place, q = message.pose.pose.position, message.pose.pose.orientation
        heading = yaw_of_quaternion(q.x, q.y, q.z, q.w)
        self._robots[name] = self._robots[name]._replace(
            x=round(place.x, 3), y=round(place.y, 3), heading=round(heading, 3)
        )

    def _on_pose(self, message: Any, name: str) -> None:
        q = message.pose.pose.orientation
        believed = in_field((0.0, 0.0, yaw_of_quaternion(q.x, q.y, q.z, q.w)), self._teams[name])[2]
        robot = self._robots[name]
        self._robots[name] = robot._replace(turned=is_turned(robot.heading, believed))

    def _on_support(self, message: Any, name: str) -> None:
        state = state_of(message.data)
        self._robots[name] = self._robots[name]._replace(state="" if state is None else state.value)

    def _on_behavior(self, message: Any, name: str) -> None:
        values = _values(message.status)
        options = sorted(key for key in values if key.startswith("option_"))
        doing = values[options[-1]].rsplit(" (", 1)[0] if options else ""
        self._robots[name] = self._robots[name]._replace(role=values.get("role", ""), doing=doing)

    def _on_motion(self, message: Any) -> None:
        self._kicks += message.data.startswith("kick")


def _values(statuses: Sequence[Any]) -> dict[str, str]:
    return {pair.key: pair.value for status in statuses for pair in status.values}
