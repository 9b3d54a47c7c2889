"""What one robot of a scene sees while it turns its head, stands or walks, and the truth."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from nao_lipm_gait.gait import Gait
from nao_soccer.vision.pose_history import BodyHistory
from robot_core.geometry import rotation_from_rpy
from robot_core.head_goals import Angles
from robot_core.robot.camera import CameraView, RgbImage
from robot_core.types import STANDSTILL, FloatArray, Point2, Pose2, VelocityCommand
from sim_bridge.cameras.camera import CameraSettings, SimulatedCamera
from sim_bridge.plant import PlantOption, load_plant, with_options
from sim_bridge.scene import Scene
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
KEPT = 2_000_000_000
"""[ns] for which the truth is kept for images that are on their way."""


@dataclass(frozen=True, slots=True)
class HeadSweep:
    """The head turns to and fro at one speed.

    Attributes:
        speed: [rad/s] of the pan.
        width: [rad] largest pan to either side.
        tilt: [rad] down.
    """

    speed: float
    width: float
    tilt: float

    def at(self, time: float) -> Angles:
        """Where the head is to be at a time [s]; it begins straight ahead."""
        way = (self.speed * time + self.width) % (4.0 * self.width)
        return Angles(min(way, 4.0 * self.width - way) - self.width, self.tilt)


@dataclass(frozen=True, slots=True, kw_only=True)
class RenderSpec:
    """What is rendered. Small and picklable.

    Attributes:
        scene: The scene, in which the other robots stand.
        head: What the head does.
        seconds: Length of the run [s].
        robot: Place in the scene of the robot that sees.
        engine: `pybullet` or `mujoco`.
        plant: Name or file of the plant.
        plant_options: Replaced options of the plant.
        noise_seed: Seed of all noise.
        balls: Places to which the ball is moved one after the other, every `BALL_TIME`.
        command: Velocity of the robot, from second 1 on.
        settings: Rate, size and delay of the images.
    """

    scene: Scene
    head: HeadSweep
    seconds: float
    robot: int = 0
    engine: str = "mujoco"
    plant: str = "reference"
    plant_options: tuple[PlantOption, ...] = ()
    noise_seed: int = 0
    balls: tuple[Point2, ...] = ()
    command: VelocityCommand = STANDSTILL
    settings: CameraSettings = field(default_factory=CameraSettings)


class FrameTruth(NamedTuple):
    """The truth at the time of an image, in the frame of the field.

    Attributes:
        view: The camera.
        footprint: base_footprint of the robot: between the soles, with their mean heading.
        ball: (3,) [m] its centre; None without a ball.
        others: base_footprint of the other robots by name.
    """

    view: CameraView
    footprint: Pose2
    ball: FloatArray | None
    others: dict[str, Pose2]


class RenderedFrame(NamedTuple):
    """An image, as a robot's vision gets it, and the truth.

    Attributes:
        camera: Name of the camera.
        stamp: [ns] time of the exposure.
        time: [ns] now, when the image can be used.
        image: (h, w, 3) red, green, blue.
        view: The camera in base_footprint at the time of the exposure, as measured.
        late_view: The same from the newest measurement, that of now.
        truth: At the time of the exposure.
    """

    camera: str
    stamp: int
    time: int
    image: RgbImage
    view: CameraView
    late_view: CameraView
    truth: FrameTruth


def rendered_frames(spec: RenderSpec) -> Iterator[RenderedFrame]:
    """Run a scene and yield each image of one of its robots when it can be used.

    Raises:
        NaoGaitError: A plant or engine cannot be used, or renders no images here.
    """
    with make_scene_world(
        spec.scene,
        plant=with_options(load_plant(spec.plant), spec.plant_options),
        engine=spec.engine,
        noise_seed=spec.noise_seed,
        cameras=spec.settings,
    ) as world:
        for number, each in enumerate(world.robots):
            for camera in each.cameras:
                camera.enabled = number == spec.robot
        yield from _run(world, spec)


class _Commands(Policy):
    """A velocity from second 1 on, while the head sweeps."""

    def __init__(self, spec: RenderSpec, gait: Gait) -> None:
        self._spec, self._gait = spec, gait

    def command(self, time: float, tick: object) -> VelocityCommand:
        """The command of this time."""
        self._gait.request_look(self._spec.head.at(time))
        return self._spec.command if time >= 1.0 else STANDSTILL


class _Holding:
    """A controller that leaves its robot as it stands."""

    command, targets, status = STANDSTILL, None, None

    def respond(self, tick: object) -> bool:
        """Do nothing."""
        return True


def _run(world: World, spec: RenderSpec) -> Iterator[RenderedFrame]:
    robot, gait = world.robots[spec.robot], make_gaits(world)[spec.robot]
    controllers: list[Any] = [_Holding() for _ in world.robots]
    controllers[spec.robot] = WalkerResponder(world, robot, gait, _Commands(spec, gait))
    history, newest = BodyHistory(), 0
    truths: dict[int, dict[str, FrameTruth]] = {}
    sent: dict[str, int] = {}
    end = world.time + round(spec.seconds * 1e9)

    def move_ball(*_: object) -> None:
        if spec.balls and world.time % BALL_TIME == 0:
            world.put_ball(*spec.balls[world.time // BALL_TIME % len(spec.balls)])

    for _ in run_responders(world, controllers, move_ball, past_falls=True):
        status, frame = controllers[spec.robot].status, robot.sense()
        if status is not None and frame is not None:
            newest, torso = frame.stamp, gait.torso_pose
            history.add_joints(newest, frame.joint_position)
            rotation = np.array(rotation_from_rpy(*torso[3:]))
            history.add_torso(newest, np.array(torso[:3]), rotation)
        truths[world.time] = _truth(world, spec.robot, robot.cameras)
        for camera in robot.cameras:
            image = camera.newest(world.time)
            if image is None or sent.get(camera.name) == image.stamp:
                continue
            sent[camera.name] = image.stamp
            if not history.covers(image.stamp):
                continue
            view, late_view = (
                camera.model.view(*history.at(stamp)) for stamp in (image.stamp, newest)
            )
            yield RenderedFrame(
                camera.name, image.stamp, world.time, image.pixels, view, late_view,
                truths[image.stamp][camera.name],
            )  # fmt: skip
        truths.pop(world.time - KEPT, None)
        if world.time >= end:
            return


def _truth(
    world: World, index: int, cameras: Sequence[SimulatedCamera]
) -> dict[str, FrameTruth]:
    """The truth of now, by camera."""
    robot = world.robots[index]
    ball = world.ball
    others = {
        each.name: each.truth().base_footprint
        for number, each in enumerate(world.robots)
        if number != index
    }
    return {
        camera.name: FrameTruth(
            camera.view(robot.state),
            robot.truth().base_footprint,
            None if ball is None else ball.position,
            others,
        )
        for camera in cameras
    }
