"""Random walks over the pitch in which a robot sees all that vision looks for."""

import math
from collections.abc import Callable

import numpy as np

from gait_lab.vision.rendered_frames import BALL_TIME, HeadSweep, RenderSpec
from robot_core.errors import NaoGaitError
from robot_core.field import Field
from robot_core.types import STANDSTILL, Point2, Pose2, VelocityCommand
from sim_bridge.scene import Scene, SceneBall, SceneRobot, load_scene

KINDS = ("stand", "walk", "sweep")
"""Standing and walking with a slow head, and walking while the head turns fast."""
SPEED = 0.2
"""[m/s]"""
HEADS = {
    "stand": HeadSweep(0.25, 0.6, 0.12),
    "walk": HeadSweep(0.25, 0.6, 0.12),
    "sweep": HeadSweep(1.0, 0.8, 0.12),
}
"""What the head does; speeds in rad/s, angles in rad."""
OTHERS = ("blue", "red")
"""Teams of the other robots."""
ROBOT_RANGE = (0.8, 4.0)
"""[m] Nearest and farthest place of another robot."""
BALL_RANGE = (0.3, 6.0)
"""[m] Nearest and farthest place of the ball."""
BALL_BEARING = 0.35
"""[rad] Largest angle of the ball from where the head looks."""
NO_BALL = 5
"""Every so often the ball is behind the robot."""
BEHIND = 1.2
"""[m] from the robot to the ball behind it."""
MARGIN = 0.15
"""[m] From the outer lines to what is placed on the field."""
WAY = (0.45, 1.6)
"""[m] Half of the width, and length, of what is kept free of robots ahead."""
TRIALS = 500
"""Random places that are tried for one object."""


def random_walk(seed: int, kind: str, engine: str, seconds: float, urdf: str) -> RenderSpec:
    """A walk of one robot for some seconds; even seeds begin anywhere, odd ones before a goal."""
    random = np.random.default_rng([seed, KINDS.index(kind)])
    base = load_scene("pitch")
    if base.field is None:
        raise NaoGaitError("scene", "pitch", "a scene with a field")
    pose = _start(random, base.field, before_goal=bool(seed % 2))
    robots = [SceneRobot(name="seer", team="red", number=1, urdf=urdf, pose=pose, seed=seed)]
    for number, team in enumerate(OTHERS, start=2):
        place = _beside_way(random, base.field, robots)
        heading = float(random.uniform(-math.pi, math.pi))
        robots.append(
            SceneRobot(
                name=f"{team}{number}", team=team, number=number, urdf=urdf,
                pose=(*place, heading), seed=100 + number,
            )
        )  # fmt: skip
    command = STANDSTILL if kind == "stand" else VelocityCommand(SPEED)
    balls = [
        _ball(random, base.field, robots, index, command.x, HEADS[kind])
        for index in range(math.ceil(seconds * 1e9 / BALL_TIME) + 1)
    ]
    x, y = _ahead(pose, -BEHIND, 0.0)
    scene = Scene(
        name="vision", field=base.field, goals=base.goals, robots=tuple(robots),
        ball=SceneBall(x=x, y=y),
    )  # fmt: skip
    return RenderSpec(
        scene=scene,
        engine=engine,
        noise_seed=seed,
        balls=tuple(balls),
        command=command,
        head=HEADS[kind],
        seconds=seconds,
    )


def _ahead(pose: Pose2, distance: float, bearing: float) -> Point2:
    """A place [m] at a distance [m] and bearing [rad] from a pose."""
    x, y, heading = pose
    return x + distance * math.cos(heading + bearing), y + distance * math.sin(heading + bearing)


def _on_field(field: Field, place: Point2, margin: float = MARGIN) -> bool:
    x, y = place
    return abs(x) < 0.5 * field.length - margin and abs(y) < 0.5 * field.width - margin


def _tried(draw: Callable[[], Point2], fits: Callable[[Point2], bool]) -> Point2 | None:
    """The first drawn place that fits; None if none of `TRIALS` does."""
    return next((place for place in (draw() for _ in range(TRIALS)) if fits(place)), None)


def _start(random: np.random.Generator, field: Field, *, before_goal: bool) -> Pose2:
    """A pose with the field ahead; towards a goal 1.6 to 3.5 m ahead, or anywhere."""
    if before_goal:
        side = float(random.choice((-1.0, 1.0)))
        goal = 0.5 * field.length
        x, y = side * (goal - random.uniform(1.6, 3.5)), float(random.uniform(-2.0, 2.0))
        heading = math.atan2(random.uniform(-1.0, 1.0) - y, side * goal - x)
        return x, y, heading + float(random.uniform(-0.3, 0.3))
    heading = float(random.uniform(-math.pi, math.pi))
    place = _tried(
        lambda: (float(random.uniform(-4.0, 4.0)), float(random.uniform(-2.6, 2.6))),
        lambda place: _on_field(field, _ahead((*place, heading), 1.8, 0.0)),
    )
    return (*(place or (0.0, 0.0)), heading)


def _beside_way(random: np.random.Generator, field: Field, robots: list[SceneRobot]) -> Point2:
    """A place for another robot: ahead and beside the way, or where there is room."""
    seer = robots[0].pose

    def fits(place: Point2) -> bool:
        distance = math.dist(place, seer[:2])
        bearing = math.atan2(place[1] - seer[1], place[0] - seer[0]) - seer[2]
        half_width, length = WAY
        in_way = abs(distance * math.sin(bearing)) < half_width and (
            -half_width < distance * math.cos(bearing) < length
        )
        apart = all(math.dist(place, each.pose[:2]) > 0.7 for each in robots)
        return _on_field(field, place, 3.0 * MARGIN) and apart and not in_way

    def ahead() -> Point2:
        return _ahead(seer, random.uniform(*ROBOT_RANGE), random.uniform(-0.9, 0.9))

    def anywhere() -> Point2:
        return _ahead(seer, random.uniform(0.8, 8.0), random.uniform(-math.pi, math.pi))

    place = _tried(ahead, fits) or _tried(anywhere, fits)
    if place is None:
        raise NaoGaitError("vision walk", f"start {seer}", "room for another robot")
    return place


def _ball(
    random: np.random.Generator,
    field: Field,
    robots: list[SceneRobot],
    index: int,
    speed: float,
    head: HeadSweep,
) -> Point2:
    """Place of the ball in one interval: where the head looks, or behind the robot."""
    time = (index + 0.5) * BALL_TIME * 1e-9
    x, y = _ahead(robots[0].pose, speed * max(time - 1.0, 0.0), 0.0)
    pose = x, y, robots[0].pose[2]
    pan = head.at(time).pan

    def ahead() -> Point2:
        distance = BALL_RANGE[0] + (BALL_RANGE[1] - BALL_RANGE[0]) * random.uniform() ** 1.5
        return _ahead(pose, distance, pan + random.uniform(-BALL_BEARING, BALL_BEARING))

    def fits(place: Point2) -> bool:
        return _on_field(field, place) and all(
            math.dist(place, robot.pose[:2]) > 0.3 for robot in robots[1:]
        )

    behind = _ahead(pose, -BEHIND, 0.0)
    if index % NO_BALL == NO_BALL - 1:
        return behind
    return _tried(ahead, fits) or behind
