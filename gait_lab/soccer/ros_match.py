"""A match over ROS 2: bridge with cameras, and for each robot a gait, a vision and a player."""

import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gait_lab.analysis.bag import BagWriter
from gait_lab.demo.node_processes import NodeProcesses, empty_folder
from gait_lab.ros_session import ros_node
from gait_lab.soccer.eyes import in_field
from gait_lab.soccer.match import MatchResult, MatchSpec, match_scene
from gait_lab.soccer.motion_track import PERIOD, BodyState, MotionTrack
from gait_lab.soccer.player_nodes import player_parameters, referee_ports
from gait_lab.soccer.snapshots import (
    PlanSnapshot,
    RobotSnapshot,
    Snapshot,
    dribble_strokes,
    is_turned,
    path_of,
    wrong_half,
)
from gait_lab.terminal import EXIT_FAILED, EXIT_OK
from nao_soccer.behavior.option_tree import Activation
from nao_soccer.referee.rules import TEAM_NUMBERS, Goal, Rules
from robot_core.field import TEAMS
from robot_core.geometry import yaw_of_quaternion
from robot_core.robot import load_robot
from robot_core.ros.patience import STALL
from robot_core.ros.process import (
    DomainClaim,
    StopRequest,
    events_executor,
    stop_on_signal,
)
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
FRAME_PERIOD = 0.2
"""[s] between two frames of the replay."""


def run(
    spec: MatchSpec,
    out: Path,
    say: Callable[[str], None],
    show: Callable[[Snapshot, float], None],
    *,
    real_time: bool = False,
    composed: bool = False,
) -> tuple[int, MatchResult | None]:
    """Play a match with rendered images; exit status, and the result if it came to its end.

    `composed`: gait, vision and player of a robot share a process.
    """
    # Before anything is started: the ROS wheels restart the interpreter at their first import.
    import rclpy  # noqa: F401

    scene = match_scene(spec)
    empty_folder(out, "replay.html")
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
        _start(nodes, spec, scene, file, domain.domain, real_time=real_time, composed=composed)
        count = 2 + 3 * len(scene.robots)
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


def _start(
    nodes: NodeProcesses,
    spec: MatchSpec,
    scene: Scene,
    file: Path,
    domain: int,
    *,
    real_time: bool,
    composed: bool,
) -> None:
    """Start all nodes."""
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
        parts = {
            "gait": {"urdf": robot.urdf, "bias_wait": BIAS_WAIT},
            "vision": {"urdf": robot.urdf, "scene": file},
            "player": player_parameters(robot, scene, file, domain),
        }
        if composed:
            together = {
                f"{part}:{name}": value
                for part, parameters in parts.items()
                for name, value in parameters.items()
            }
            nodes.start("robot", together, robot.name)
            continue
        for part, parameters in parts.items():
            nodes.start(part, parameters, robot.name)
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
        self._spec = spec
        self._stop = stop
        self._nodes = nodes
        self._writer = writer
        self._show_progress = show
        self._executor = events_executor()
        self._executor.add_node(node)
        self._now = 0
        self._moved = time.monotonic()
        self._ball: tuple[float, float, float] | None = None
        self._robots = {r.name: RobotSnapshot(*r.pose, "stand", "", "") for r in scene.robots}
        self._teams = {robot.name: robot.team for robot in scene.robots}
        self._game: dict[str, str] = {}
        self._began = START
        self._frames: list[Snapshot] = []
        self._motion = MotionTrack()
        self._joint_names = {r.name: load_robot(r.urdf).joint_names for r in scene.robots}
        self._poses: dict[str, bytes] = {}
        self._joints: dict[str, bytes] = {}
        self._expected = Rules(half=60.0 * spec.minutes).duration
        self._subscribe(node)

    def _subscribe(self, node: "Node") -> None:
        """Write nearly all topics of the match to the bag, and read what the replay shows."""
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import PointStamped, PoseWithCovarianceStamped
        from nav_msgs.msg import Odometry
        from rclpy.qos import qos_profile_sensor_data as sensors
        from rosgraph_msgs.msg import Clock
        from sensor_msgs.msg import JointState
        from std_msgs.msg import String

        from robot_core.ros.topics import LATCHED

        def subscribe(
            kind: Any, topic: str, take: Callable[[Any], None], qos: Any = 10
        ) -> None:
            """Write all messages of a topic to the bag, and read them."""
            from rclpy.serialization import deserialize_message

            keep(kind, topic, lambda data: take(deserialize_message(data, kind)), qos)

        def keep(kind: Any, topic: str, take: Callable[[bytes], None], qos: Any = 10) -> None:
            package = kind.__module__.split(".")[0]
            name = f"{package}/msg/{kind.__name__}"
            self._writer.add_topic(f"/{topic}", name, latched=qos is LATCHED)
            receive = partial(self._on_message, f"/{topic}", take)
            node.create_subscription(kind, topic, receive, qos, raw=True)

        self._kinds = Odometry, JointState
        node.create_subscription(Clock, "/clock", self._on_clock, sensors)
        subscribe(DiagnosticArray, "game_state", self._on_game)
        subscribe(PointStamped, "ground_truth/ball", self._on_ball, sensors)
        for name in self._robots:
            on = partial(partial, name=name)
            poses = partial(self._poses.__setitem__, name)
            keep(Odometry, f"{name}/ground_truth/odom", poses, sensors)
            joints = partial(self._joints.__setitem__, name)
            node.create_subscription(JointState, f"{name}/joint_states", joints, sensors, raw=True)
            subscribe(String, f"{name}/gait/support", on(self._on_support), LATCHED)
            subscribe(DiagnosticArray, f"{name}/behavior", on(self._on_behavior))
            subscribe(String, f"{name}/gait/motion", on(self._on_motion))
            subscribe(PoseWithCovarianceStamped, f"{name}/pose", on(self._on_pose))
            subscribe(Odometry, f"{name}/ball", on(self._on_known_ball))

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
            if time.monotonic() - self._moved > STALL:
                raise _MatchError(f"no new time on /clock for {STALL:.0f} s")
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
        return MatchResult(
            self._spec,
            score={team: int(self._game.get(team, "0")) for team in TEAMS},
            goals=goals,
            seconds=self._now * 1e-9 - self._began,
            falls=falls,
            kicks=sum(robot.kicks for robot in self._robots.values()),
            strokes=dribble_strokes(self._frames),
            wrong_half=wrong_half(goals, self._frames),
            frames=self._frames,
            motion=self._motion,
        )

    # -- messages ----------------------------------------------------------------------------------

    def _on_message(self, topic: str, take: Callable[[bytes], None], data: bytes) -> None:
        self._writer.write(topic, self._now, data)
        take(data)

    def _on_clock(self, message: Any) -> None:
        now = message.clock.sec * 1_000_000_000 + message.clock.nanosec
        if now != self._now:
            self._now, self._moved = now, time.monotonic()
        ready = len(self._poses) == len(self._joints) == len(self._robots)
        if self._ball is None or not self._game or not ready:
            return
        at = now * 1e-9 - self._began
        if at < 0.0 or at < PERIOD * len(self._motion) - 1e-6:
            return
        self._follow(at)
        if self._frames and at < self._frames[-1].time + FRAME_PERIOD - 1e-6:
            return
        score = int(self._game.get("red", "0")), int(self._game.get("blue", "0"))
        set_play, kicking = self._game.get("set_play", ""), self._game.get("kicking_team", "")
        teams = {str(number): team for team, number in TEAM_NUMBERS.items()}
        frame = Snapshot(
            round(at, 2),
            self._ball[:2],
            dict(self._robots),
            self._game.get("state", ""),
            score,
            "" if set_play == "none" else set_play,
            teams.get(kicking, ""),
        )
        self._frames.append(frame)
        self._show_progress(frame, self._expected)

    def _follow(self, at: float) -> None:
        """Read the newest poses and joints: most messages are only written to the bag."""
        from rclpy.serialization import deserialize_message

        odometry, joints = self._kinds
        bodies = []
        for name, names in self._joint_names.items():
            pose = deserialize_message(self._poses[name], odometry).pose.pose
            given = deserialize_message(self._joints[name], joints)
            angle = dict(zip(given.name, given.position, strict=True))
            place, q = pose.position, pose.orientation
            bodies.append(
                BodyState(
                    np.array((place.x, place.y, place.z)),
                    np.array((q.x, q.y, q.z, q.w)),
                    np.array([angle[each] for each in names]),
                )
            )
            self._change(
                name,
                x=round(place.x, 3),
                y=round(place.y, 3),
                heading=round(yaw_of_quaternion(q.x, q.y, q.z, q.w), 3),
            )
        assert self._ball is not None
        # The track is even: a late clock, as after a pause of the watcher, fills the gap.
        while len(self._motion) * PERIOD <= at + 1e-6:
            self._motion.add(len(self._motion) * PERIOD, self._ball, bodies)

    def _change(self, name: str, **values: Any) -> None:
        self._robots[name] = self._robots[name]._replace(**values)

    def _on_game(self, message: Any) -> None:
        self._game = _values(message.status)
        stamp = message.header.stamp
        self._began = stamp.sec + 1e-9 * stamp.nanosec - float(self._game["time"])
        for name in self._robots:
            state = self._game.get(f"robot/{name}", "").partition(",")[0]
            self._change(name, penalty=state.partition(": ")[2])

    def _on_ball(self, message: Any) -> None:
        point = message.point
        self._ball = round(point.x, 3), round(point.y, 3), round(point.z, 3)

    def _on_pose(self, message: Any, name: str) -> None:
        place, q = message.pose.pose.position, message.pose.pose.orientation
        own = place.x, place.y, yaw_of_quaternion(q.x, q.y, q.z, q.w)
        believed = in_field(own, self._teams[name])
        turned = is_turned(self._robots[name].heading, believed[2])
        self._change(name, believed=believed, turned=turned)

    def _on_known_ball(self, message: Any, name: str) -> None:
        place = message.pose.pose.position
        self._change(name, ball=in_field((place.x, place.y, 0.0), self._teams[name])[:2])

    def _on_support(self, message: Any, name: str) -> None:
        state = state_of(message.data)
        self._change(name, state="" if state is None else state.value)

    def _on_behavior(self, message: Any, name: str) -> None:
        values = _values(message.status)
        path = [
            Activation.parsed(values[key])
            for key in sorted(key for key in values if key.startswith("option_"))
        ]
        plans = {
            field: _plan(values, key, self._teams[name])
            for field, key in (("plan", "plan"), ("runner_up", "second_plan"))
        }
        self._change(name, role=values.get("role", ""), **path_of(path), **plans)

    def _on_motion(self, message: Any, name: str) -> None:
        kicked = message.data.startswith("kick")
        self._change(name, kicks=self._robots[name].kicks + kicked)


def _plan(values: Mapping[str, str], key: str, team: str) -> PlanSnapshot | None:
    """A plan of the topic `behavior`."""
    if f"{key}_direction" not in values:
        return None
    direction = in_field((0.0, 0.0, float(values[f"{key}_direction"])), team)[2]
    return PlanSnapshot(values[key], direction, float(values[f"{key}_seconds"]))


def _values(statuses: Sequence[Any]) -> dict[str, str]:
    return {pair.key: pair.value for status in statuses for pair in status.values}
