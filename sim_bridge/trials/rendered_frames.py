"""What one robot of a scene sees while it stands or walks, with what it measures and the truth."""

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import attrs

from nao_lipm_gait.gait import Gait
from robot_core.errors import NaoGaitError
from robot_core.geometry import rotation_matrix
from robot_core.head_goals import Angles, Goal
from robot_core.robot.camera import CameraView, Intrinsics, RgbImage
from robot_core.types import STANDSTILL, FloatArray, Point2, Pose2, Pose6, VelocityCommand
from sim_bridge.cameras.camera import CameraSettings, SimulatedCamera
from sim_bridge.plant import PlantOption, load_plant, with_options
from sim_bridge.robot import SimulatedRobot
from sim_bridge.scene import Scene, load_scene
from sim_bridge.trials.trial import (
    Policy,
    WalkerResponder,
    make_gaits,
    make_scene_world,
    run_responders,
)
from sim_bridge.world import World

BALL_TIME = 400_000_000
"""[ns] until the ball is moved again."""
HISTORY = 200
"""Number of samples that go with an image: 2 s."""


@dataclass(frozen=True, slots=True)
class HeadSweep:
    """The head turns to and fro at one speed.

    Attributes:
        speed: [rad/s] of the pan.
        width: [rad] largest pan to either side.
        tilt: [rad] down.
    """

    speed: float
    width: float = 1.0
    tilt: float = 0.0

    def at(self, time: float) -> Angles:
        """Where the head is to be at a time [s]; it begins straight ahead."""
        way = (self.speed * time + self.width) % (4.0 * self.width)
        return Angles(min(way, 4.0 * self.width - way) - self.width, self.tilt)


@dataclass(frozen=True, slots=True, kw_only=True)
class RenderSpec:
    """What is rendered. Small and picklable.

    Attributes:
        scene: The scene, or its name.
        engine: `pybullet` or `mujoco`.
        plant: Name or file of the plant.
        plant_options: Replaced options of the plant.
        robot: Name of the robot that sees; empty for the first one.
        seed: Its individual; None for that of the scene.
        noise_seed: Seed of all noise.
        pose: Its start; None for that of the scene.
        ball: Place of the ball at the start [m]; None for that of the scene.
        balls: Places to which the ball is moved one after the other, every `BALL_TIME`.
        command: Velocity of the robot, from second 1 on.
        others: Velocity of the other robots; standstill leaves them without a gait.
        head: Where the head looks; None leaves it to the gait.
        seconds: Length of the run [s].
        cameras: Cameras that see; empty for all of the robot.
        settings: Rate, size and delay of the images.
    """

    scene: str | Scene = "pitch"
    engine: str = "mujoco"
    plant: str = "reference"
    plant_options: tuple[PlantOption, ...] = ()
    robot: str = ""
    seed: int | None = None
    noise_seed: int = 0
    pose: Pose2 | None = None
    ball: Point2 | None = None
    balls: tuple[Point2, ...] = ()
    command: VelocityCommand = STANDSTILL
    others: VelocityCommand = STANDSTILL
    head: Goal | HeadSweep | None = None
    seconds: float = 5.0
    cameras: tuple[str, ...] = ()
    settings: CameraSettings = field(default_factory=CameraSettings)

    @property
    def teams(self) -> dict[str, str]:
        """Team of each robot of the scene by its name."""
        scene = load_scene(self.scene) if isinstance(self.scene, str) else self.scene
        return {robot.name: robot.team for robot in scene.robots}


class BodySample(NamedTuple):
    """What the robot has measured of itself.

    Attributes:
        stamp: [ns]
        joint_position: (n,) [rad]
    """

    stamp: int
    joint_position: FloatArray
    torso_in_footprint: Pose6


class FrameTruth(NamedTuple):
    """The truth at the time of an image, in the frame of the field.

    Attributes:
        view: The camera.
        footprint: base_footprint of the robot: between the soles, with their mean heading.
        torso_position: (3,) [m]
        torso_rotation: (3, 3)
        ball: (3,) [m] its centre; None without a ball.
        others: base_footprint of the other robots by name.
    """

    view: CameraView
    footprint: Pose2
    torso_position: FloatArray
    torso_rotation: FloatArray
    ball: FloatArray | None
    others: dict[str, Pose2]


class RenderedFrame(NamedTuple):
    """An image, as a robot's software gets it, and the truth.

    Attributes:
        camera: Name of the camera.
        stamp: [ns] time of the exposure.
        time: [ns] now, when the image can be used.
        image: (h, w, 3) red, green, blue.
        intrinsics: As in `camera_info`.
        samples: What the robot has measured until now, at increasing times.
        truth: At the time of the exposure.
    """

    camera: str
    stamp: int
    time: int
    image: RgbImage
    intrinsics: Intrinsics
    samples: tuple[BodySample, ...]
    truth: FrameTruth


def rendered_frames(spec: RenderSpec) -> Iterator[RenderedFrame]:
    """Run a scene and yield each image of one of its robots when it can be used.

    Raises:
        NaoGaitError: The scene has no such robot, or a camera, plant or engine cannot be used.
    """
    scene = load_scene(spec.scene) if isinstance(spec.scene, str) else spec.scene
    names = [robot.name for robot in scene.robots]
    if spec.robot and spec.robot not in names:
        raise NaoGaitError("robot", spec.robot, names)
    index = names.index(spec.robot) if spec.robot else 0
    changes: dict[str, Any] = {} if spec.seed is None else {"seed": spec.seed}
    if spec.pose is not None:
        changes["pose"] = spec.pose
    robots = list(scene.robots)
    robots[index] = attrs.evolve(robots[index], **changes)
    with make_scene_world(
        attrs.evolve(scene, robots=tuple(robots)),
        plant=with_options(load_plant(spec.plant), spec.plant_options),
        engine=spec.engine,
        noise_seed=spec.noise_seed,
        cameras=spec.settings,
    ) as world:
        if spec.ball is not None:
            world.put_ball(*spec.ball)
        yield from _run(world, index, spec)


class _Commands(Policy):
    """A velocity from a time on, and what the head does."""

    def __init__(
        self,
        velocity: VelocityCommand,
        gait: Gait | None = None,
        head: Goal | HeadSweep | None = None,
    ) -> None:
        self._velocity, self._gait, self._head = velocity, gait, head

    def command(self, time: float, tick: object) -> VelocityCommand:
        """The command of this time."""
        if self._gait is not None and self._head is not None:
            head = self._head
            self._gait.request_look(head.at(time) if isinstance(head, HeadSweep) else head)
        return self._velocity if time >= 1.0 else STANDSTILL


class _Holding:
    """A controller that leaves its robot as it stands."""

    command, targets, status = STANDSTILL, None, None

    def respond(self, tick: object) -> bool:
        """Do nothing."""
        return True


def _run(world: World, index: int, spec: RenderSpec) -> Iterator[RenderedFrame]:
    robot = world.robots[index]
    watched = _enable(world, robot, spec.cameras)
    gaits = make_gaits(world)
    controllers: list[Any] = [
        WalkerResponder(world, each, gait, _Commands(spec.others))
        if spec.others != STANDSTILL
        else _Holding()
        for each, gait in zip(world.robots, gaits, strict=True)
    ]
    policy = _Commands(spec.command, gaits[index], spec.head)
    controllers[index] = WalkerResponder(world, robot, gaits[index], policy)
    samples: deque[BodySample] = deque(maxlen=HISTORY)
    truths: dict[int, dict[str, FrameTruth]] = {}
    sent: dict[str, int] = {}
    end = world.time + round(spec.seconds * 1e9)

    def move_ball(*_: object) -> None:
        if spec.balls and world.time % BALL_TIME == 0:
            world.put_ball(*spec.balls[world.time // BALL_TIME % len(spec.balls)])

    for _ in run_responders(world, controllers, move_ball, past_falls=True):
        status, frame = controllers[index].status, robot.sense()
        if status is not None and frame is not None:
            torso = gaits[index].torso_pose
            samples.append(BodySample(frame.stamp, frame.joint_position, torso))
        truths[world.time] = _truth(world, index, watched)
        for camera in watched:
            image = camera.newest(world.time)
            if image is None or sent.get(camera.name) == image.stamp:
                continue
            sent[camera.name] = image.stamp
            yield RenderedFrame(
                camera.name,
                image.stamp,
                world.time,
                image.pixels,
                camera.model.intrinsics,
                tuple(samples),
                truths[image.stamp][camera.name],
            )
        for old in [stamp for stamp in truths if stamp < world.time - round(2e9)]:
            del truths[old]
        if world.time >= end:
            return


def _enable(
    world: World, robot: SimulatedRobot, names: Sequence[str]
) -> tuple[SimulatedCamera, ...]:
    """Render only some cameras of one robot; those cameras."""
    known = [camera.name for camera in robot.cameras]
    for name in names:
        if name not in known:
            raise NaoGaitError("camera", name, known)
    for each in world.robots:
        for camera in each.cameras:
            camera.enabled = each is robot and (not names or camera.name in names)
    return tuple(camera for camera in robot.cameras if camera.enabled)


def _truth(
    world: World, index: int, cameras: Sequence[SimulatedCamera]
) -> dict[str, FrameTruth]:
    """The truth of now, by camera."""
    robot = world.robots[index]
    truth = robot.truth()
    ball = world.ball
    others = {
        each.name: each.truth().base_footprint
        for number, each in enumerate(world.robots)
        if number != index
    }
    return {
        camera.name: FrameTruth(
            camera.view(robot.state),
            truth.base_footprint,
            truth.torso_position,
            rotation_matrix(truth.torso_quaternion),
            None if ball is None else ball.position,
            others,
        )
        for camera in cameras
    }
