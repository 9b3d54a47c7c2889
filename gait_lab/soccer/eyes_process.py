"""Eyes of robots in other processes: each draws, disturbs and reads the images of some robots.

An image is used 0.1 s after its exposure, and the body at its time is known 0.06 s sooner: so long
a process may take without holding up the match. The percepts are those of `RenderedEyes`, to the
bit, as long as no robot is put back: vision then has seen images that a robot alone would forget.
"""

import contextlib
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import NamedTuple

import numpy as np

from gait_lab.soccer.eyes import Sight
from gait_lab.soccer.rendered_eyes import BodyAt, BodyReports, RobotVision
from nao_lipm_gait.gait import Gait
from nao_soccer.vision.percepts import Percepts
from nao_soccer.vision.settings import VisionSettings
from robot_core.errors import NaoGaitError
from robot_core.robot.camera import CameraView, RgbImage
from robot_core.types import FloatArray
from sim_bridge.cameras.camera import CameraImage, CameraSettings, SimulatedCamera
from sim_bridge.plant import Plant
from sim_bridge.robot import SimulatedRobot
from sim_bridge.scene import Scene
from sim_bridge.trials.trial import make_scene_world
from sim_bridge.world import World

END = 5.0
"""[s] in which a process has to end."""


@dataclass(frozen=True, slots=True)
class EyesSpec:
    """The world that is drawn, as the match has it; see `make_scene_world`."""

    scene: Scene
    plant: str | Plant
    engine: str
    noise_seed: int
    settings: VisionSettings


class Exposure(NamedTuple):
    """An image to be drawn.

    Attributes:
        robot: Index of the robot.
        camera: Index of its camera.
        stamp: [ns].
        view: The camera in the world.
        motion: u, v [px] by which the image moves during the exposure.
        picture: Of the world; see `World.picture`.
    """

    robot: int
    camera: int
    stamp: int
    view: CameraView
    motion: tuple[float, float]
    picture: FloatArray


class Seen(NamedTuple):
    """What became of an image: its percepts, or None if it could not be used."""

    robot: int
    camera: int
    stamp: int
    percepts: Percepts | None


class EyesProcess:
    """One of the processes, as the match sees it."""

    def __init__(self, spec: EyesSpec) -> None:
        """Start it."""
        context = get_context("spawn")
        self._connection, other = context.Pipe()
        self._process = context.Process(target=work, args=(other, spec), daemon=True)
        self._process.start()
        other.close()
        self._seen: dict[tuple[int, int], deque[Seen]] = {}

    def send(self, message: Exposure | tuple[int, BodyAt]) -> None:
        """Send an image to be drawn, or the body of the robot of an index.

        Raises:
            NaoGaitError: The process has ended.
        """
        # A process that cannot get rid of its answers would not listen either.
        while self._connection.poll():
            self._receive()
        try:
            self._connection.send(message)
        except OSError as error:
            raise self._ended() from error

    def take(self, robot: int, camera: int, stamp: int) -> Percepts | None:
        """What an image showed, once it is known; older ones are forgotten."""
        waiting = self._seen.setdefault((robot, camera), deque())
        while True:
            while waiting and waiting[0].stamp < stamp:
                waiting.popleft()
            if waiting:
                return waiting.popleft().percepts
            self._receive()

    def close(self) -> None:
        """End it."""
        self._connection.close()
        self._process.join(END)
        self._process.kill()

    def _receive(self) -> None:
        try:
            seen: Seen = self._connection.recv()
        except (EOFError, OSError) as error:
            raise self._ended() from error
        self._seen.setdefault((seen.robot, seen.camera), deque()).append(seen)

    def _ended(self) -> NaoGaitError:
        self._process.join(END)
        state = f"a process that ended with status {self._process.exitcode}"
        return NaoGaitError("eyes", state, "processes that render and see")


class RemoteEyes:
    """The cameras of a robot, whose images another process draws and reads; see `Eyes`.

    Args:
        process: That process.
        world: The world of the match.
        index: Of the robot in it.
        gait: Of the robot.
    """

    def __init__(self, process: EyesProcess, world: World, index: int, gait: Gait) -> None:
        self._process, self._index = process, index
        self._cameras = world.robots[index].cameras
        self._body = BodyReports(world.robots[index], gait)
        self._seen = [-1] * len(self._cameras)
        self._waiting: dict[int, int] = {}
        for number, camera in enumerate(self._cameras):
            camera.develop = Develop(process, world, index, number)

    def arrived(self, sight: Sight) -> list[Percepts]:
        """See `Eyes`; the truth is not looked at."""
        body = self._body.newest()
        if body is not None:
            self._process.send((self._index, body))
        found = []
        for number, camera in enumerate(self._cameras):
            newest = camera.newest(sight.time)
            if newest is not None and self._seen[number] != newest.stamp:
                self._seen[number] = self._waiting[number] = newest.stamp
            stamp = self._waiting.get(number)
            if stamp is not None and stamp <= self._body.stamp:
                del self._waiting[number]
                percepts = self._process.take(self._index, number, stamp)
                if percepts is not None:
                    found.append(percepts)
        return found


@dataclass(frozen=True, slots=True)
class Develop:
    """In place of `SimulatedCamera.develop`: the image is drawn elsewhere, none comes back."""

    process: EyesProcess
    world: World
    robot: int
    camera: int

    def __call__(
        self, render: object, view: CameraView, stamp: int, motion: tuple[float, float]
    ) -> RgbImage:
        """Send what the image needs."""
        picture = self.world.picture()
        self.process.send(Exposure(self.robot, self.camera, stamp, view, motion, picture))
        return np.empty((0, 0, 3), dtype=np.uint8)


# -- in the other process --------------------------------------------------------------------------


class _Robot:
    """Vision of one robot, and its images that wait for the body at their time."""

    def __init__(self, robot: SimulatedRobot, settings: VisionSettings) -> None:
        self.cameras: Sequence[SimulatedCamera] = robot.cameras
        self._vision = RobotVision(robot, settings)
        self.waiting: deque[tuple[int, CameraImage]] = deque()
        self._known = -1

    def add_body(self, body: BodyAt) -> None:
        """Take what the gait reported."""
        self._vision.add_body(body)
        self._known = body.stamp

    @property
    def ready(self) -> bool:
        """An image can be read."""
        return bool(self.waiting) and self.waiting[0][1].stamp <= self._known

    def see(self, index: int) -> Seen:
        """Read the oldest image."""
        camera, image = self.waiting.popleft()
        name = self.cameras[camera].name
        self._vision.add_image(name, *image)
        return Seen(index, camera, image.stamp, self._vision.see(name))


def work(connection: Connection, spec: EyesSpec) -> None:
    """Draw and read until the match ends."""
    import cv2

    cv2.setNumThreads(1)  # the processes share the cores
    with (
        contextlib.suppress(EOFError, OSError, KeyboardInterrupt),
        make_scene_world(
            spec.scene, plant=spec.plant, engine=spec.engine, noise_seed=spec.noise_seed,
            cameras=CameraSettings(),
        ) as world,
    ):  # fmt: skip
        robots = [_Robot(robot, spec.settings) for robot in world.robots]
        exposures: deque[Exposure] = deque()
        while True:
            ready = next((index for index, robot in enumerate(robots) if robot.ready), None)
            idle = ready is None and not exposures
            if idle or connection.poll():
                message = connection.recv()
                if isinstance(message, Exposure):
                    exposures.append(message)
                else:
                    index, body = message
                    robots[index].add_body(body)
            elif ready is not None:
                connection.send(robots[ready].see(ready))
            else:
                exposure = exposures.popleft()
                robot = robots[exposure.robot]
                robot.waiting.append((exposure.camera, _drawn(world, robot.cameras, exposure)))


def _drawn(world: World, cameras: Sequence[SimulatedCamera], exposure: Exposure) -> CameraImage:
    world.show(exposure.picture)
    develop = cameras[exposure.camera].develop
    pixels = develop(world.render, exposure.view, exposure.stamp, exposure.motion)
    return CameraImage(exposure.stamp, pixels)
