"""A camera of a simulated robot: when it exposes, and when its image can be used."""

from collections.abc import Callable
from typing import NamedTuple

import attrs

from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.robot.camera import CameraModel, CameraPose, CameraView, Intrinsics, RgbImage
from robot_core.schema import Settings, number
from robot_core.types import FloatArray
from sim_bridge.cameras.effects import ImageEffects
from sim_bridge.delay_line import DelayLine
from sim_bridge.individual import NOMINAL, rotation_from_vector, stream
from sim_bridge.plant import Plant
from sim_bridge.state import TrueState

Render = Callable[[CameraView], RgbImage]
"""Renders the world as a camera in the world frame images it."""
Develop = Callable[[Render, CameraView, int, tuple[float, float]], RgbImage]
"""Makes an image of a view at a time [ns] that moves by u, v [px] during the exposure."""
_SECOND = 1_000_000_000
_AHEAD = 2.0
"""[m] distance for which the motion blur is right."""


@attrs.frozen
class CameraSettings(Settings):
    """Of all cameras of a world."""

    rate: float = number(10.0, 0.1, 100.0, "Hz", "Images per second.")
    width: int = number(320, 16, 1920, "px", "Columns of an image.", whole=True)
    height: int = number(240, 16, 1440, "px", "Rows of an image.", whole=True)
    delay: float | None = number(
        None, 0.0, 1.0, "s", "Age of an image when it can be used; null = the plant's."
    )
    noise: float | None = number(
        None, 0.0, 64.0, "grey levels", "Standard deviation of the noise; null = the plant's."
    )


class CameraImage(NamedTuple):
    """An image.

    Attributes:
        stamp: [ns] time of the exposure.
        pixels: (h, w, 3) red, green, blue.
    """

    stamp: int
    pixels: RgbImage


class SimulatedCamera:
    """One camera of one robot.

    Attributes:
        name: Name of the camera.
        model: Pinhole and pose in the torso.
        enabled: Images are rendered; without, an exposure is left out and costs nothing.
        develop: Makes an image: rendered, then disturbed as by this camera. Another process may.
    """

    def __init__(
        self,
        robot: RobotDescription,
        name: str,
        plant: Plant,
        settings: CameraSettings,
        *,
        seed: int,
        noise_seed: int,
        phase: float,
    ) -> None:
        """Draw the camera of one individual.

        Args:
            robot: The robot.
            name: One of its cameras.
            plant: Errors and delay.
            settings: Rate and size of the images.
            seed: Number of the individual; -1 = nominal.
            noise_seed: Of the noise.
            phase: Share of a period by which it exposes before a multiple of the period.
        """
        intrinsics = Intrinsics.from_fov(settings.width, settings.height, robot.cameras[name].hfov)
        errors = plant.camera
        if settings.noise is not None:
            errors = attrs.evolve(errors, noise=settings.noise)
        delay = errors.delay if settings.delay is None else settings.delay
        self.name = name
        self.model = CameraModel(robot, name, intrinsics)
        self._effects = ImageEffects(errors, name, seed, noise_seed, intrinsics)
        self._delay_line: DelayLine[CameraImage] = DelayLine(round(delay * _SECOND))
        self._shutter = errors.shutter
        self._mounting: FloatArray | None = None
        if errors.mounting and seed != NOMINAL:
            turn = stream(seed, f"camera/{name}/mounting").normal(0.0, errors.mounting, 3)
            self._mounting = rotation_from_vector(turn)
        self._period = round(_SECOND / settings.rate)
        self._lead = round(phase * self._period)
        self._due = 0
        self.enabled = True
        self.develop: Develop = self._develop

    def restart(self, time: int) -> None:
        """Forget all images; the first exposure is at most one period after `time` [ns]."""
        self._delay_line.clear()
        self._due = time + self._period - self._lead

    def observe(self, time: int, state: TrueState, render: Render) -> None:
        """Expose an image at `time` [ns] if one is due; call it once per control period.

        Exposures are due at even intervals and happen at the first call from then on.
        """
        if time < self._due:
            return
        self._due += self._period * (1 + (time - self._due) // self._period)
        if not self.enabled:
            return
        view = self.view(state)
        pixels = self.develop(render, view, time, self._motion(view, state))
        self._delay_line.put(time, CameraImage(time, pixels))

    def _develop(
        self, render: Render, view: CameraView, time: int, motion: tuple[float, float]
    ) -> RgbImage:
        return self._effects.apply(render(view), time, motion)

    def view(self, state: TrueState) -> CameraView:
        """Where the camera truly is, in the world."""
        return self._view(state.joint_position, state.torso_position, state.torso_matrix)

    def _view(
        self, joint_position: FloatArray, torso_position: FloatArray, torso_rotation: FloatArray
    ) -> CameraView:
        view = self.model.view(joint_position, torso_position, torso_rotation)
        if self._mounting is None:
            return view
        position, rotation = view.pose
        return CameraView(view.intrinsics, CameraPose(position, rotation @ self._mounting))

    def _motion(self, view: CameraView, state: TrueState) -> tuple[float, float]:
        """Pixels (u, v) by which what is ahead moves in the image during the exposure."""
        if not self._shutter:
            return 0.0, 0.0
        turn = rotation_from_vector(self._shutter * state.torso_angular_velocity)
        later = self._view(
            state.joint_position + self._shutter * state.joint_velocity,
            state.torso_position + self._shutter * state.torso_linear_velocity,
            state.torso_matrix @ turn,
        )
        ahead = view.pose.position + _AHEAD * view.pose.rotation[:, 2]
        u, v = (later.project(ahead) - view.project(ahead)).tolist()
        return u, v

    def newest(self, time: int) -> CameraImage | None:
        """The newest image that has passed the delay at `time` [ns]; None before the first one."""
        return self._delay_line.newest(time)


def make_cameras(
    robot: RobotDescription, plant: Plant, settings: CameraSettings, *, seed: int, noise_seed: int
) -> tuple[SimulatedCamera, ...]:
    """All cameras of a robot; they expose one after the other, not at the same time.

    Args:
        robot: The robot.
        plant: Errors and delay.
        settings: Rate and size of the images.
        seed: Number of the individual; -1 = nominal.
        noise_seed: Of the noise.

    Raises:
        NaoGaitError: The robot has no camera.
    """
    if not robot.cameras:
        allowed = f"false: {robot.urdf_path} has no optical frame of a camera"
        raise NaoGaitError("cameras", True, allowed)
    return tuple(
        SimulatedCamera(
            robot,
            name,
            plant,
            settings,
            seed=seed,
            noise_seed=noise_seed,
            phase=index / len(robot.cameras),
        )
        for index, name in enumerate(robot.cameras)
    )
