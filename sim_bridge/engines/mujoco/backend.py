"""The plant in MuJoCo."""

from collections.abc import Sequence
from typing import Any

import mujoco

from robot_core.errors import NaoGaitError
from robot_core.robot.camera import CameraView, RgbImage
from robot_core.types import FloatArray
from sim_bridge.ball import BallState
from sim_bridge.engines.backend import BALL, RobotModel
from sim_bridge.engines.mujoco.model import MujocoModel
from sim_bridge.engines.mujoco.pictures import MujocoPictures
from sim_bridge.engines.mujoco.robot_state import MujocoRobot
from sim_bridge.engines.mujoco.scene import MujocoBall, ball_body
from sim_bridge.state import StartState, StepInput, TrueState
from sim_bridge.surroundings import PLAIN_FLOOR, Surroundings

_FRAME = 1.0 / 60.0
"""[s] of simulated time between two pictures in the window."""


class MujocoBackend:
    """`Backend` with MuJoCo.

    A position servo is the torque of a spring and a damper whose ratio is the lag, limited by the
    motor. Servos can have a stiffness, and joints rotor inertia, dry friction and play. If the
    plant gives no stiffness, the servo is as stiff as the integration allows. If it gives no rotor
    inertia, the rotors have their real one: without it the stiff servo of a foot would chatter.

    Attributes:
        data: MuJoCo's own; for pictures.
    """

    def __init__(
        self,
        robots: Sequence[RobotModel],
        surroundings: Surroundings = PLAIN_FLOOR,
        *,
        gui: bool = False,
        visual: bool = False,
    ) -> None:
        """Compile the model and open the window.

        Args:
            robots: The individuals, at least one.
            surroundings: What is around them.
            gui: Open MuJoCo's window.
            visual: With what can be seen; always so with `gui`.

        Raises:
            NaoGaitError: MuJoCo cannot honour an option of the plant.
        """
        compiled = MujocoModel(robots, surroundings, visual=gui or visual)
        self.model = compiled.model
        self.data = mujoco.MjData(self.model)
        ball = surroundings.ball
        self._ball = None if ball is None else MujocoBall(ball, self.data)
        self._robots = [MujocoRobot(parts, self.model, self.data) for parts in compiled.parts]
        self._owners = {robot.torso: index for index, robot in enumerate(self._robots)}
        if self._ball is not None:
            self._owners[ball_body(self.model)] = BALL
        warnings = mujoco.mjtWarning
        self._unstable = [
            self.data.warning[int(kind)]
            for kind in (warnings.mjWARN_BADQPOS, warnings.mjWARN_BADQVEL, warnings.mjWARN_BADQACC)
        ]
        self._pictures: MujocoPictures | None = None
        self._shown = 0.0
        self._viewer = _open_viewer(self.model, self.data) if gui else None

    def reset(self, starts: Sequence[StartState]) -> None:
        """See `Backend`."""
        mujoco.mj_resetData(self.model, self.data)
        for robot, start in zip(self._robots, starts, strict=True):
            robot.reset(start)
        if self._ball is not None:
            self._ball.reset()

    def place(self, robot: int, start: StartState) -> None:
        """See `Backend`."""
        self._robots[robot].place(start)

    def step(self, inputs: Sequence[StepInput]) -> None:
        """See `Backend`."""
        for robot, given in zip(self._robots, inputs, strict=True):
            robot.apply(given)
        mujoco.mj_step(self.model, self.data)
        for robot in self._robots:
            robot.watch_legs()
        if self._viewer is not None:
            self._show(self._viewer)

    def observe(self) -> list[TrueState]:
        """See `Backend`."""
        if any(warning.number for warning in self._unstable):
            raise NaoGaitError(
                "physics", "a state that is not finite, or huge", "smaller forces, or smaller steps"
            )
        # mj_step leaves the poses of the bodies as they were before the step.
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        return [robot.observe() for robot in self._robots]

    def disturb(self, robot: int, torque_share: FloatArray, friction: float | None) -> None:
        """See `Backend`."""
        self._robots[robot].disturb(torque_share, friction)

    def ball(self) -> BallState | None:
        """See `Backend`."""
        return None if self._ball is None else self._ball.state

    def put_ball(self, position: FloatArray, velocity: FloatArray) -> None:
        """See `Backend`."""
        assert self._ball is not None
        self._ball.put(position, velocity)

    def touches(self) -> set[tuple[int, int]]:
        """See `Backend`."""
        model = self.model
        roots = model.body_rootid[model.geom_bodyid[self.data.contact.geom]]
        pairs = {(self._owners.get(i), self._owners.get(j)) for i, j in roots.tolist()}
        return {(min(i, j), max(i, j)) for i, j in pairs if not (i is None or j is None or i == j)}

    def render(self, view: CameraView) -> RgbImage:
        """See `Backend`."""
        if self._pictures is None or not self._pictures.fits(view):
            self._close_pictures()
            pinhole = view.intrinsics
            self._pictures = MujocoPictures(self.model, pinhole.width, pinhole.height)
            mujoco.mj_camlight(self.model, self.data)
        return self._pictures.render(self.data, view)

    def picture(self) -> FloatArray:
        """See `Backend`."""
        qpos: FloatArray = self.data.qpos.copy()
        return qpos

    def show(self, picture: FloatArray) -> None:
        """See `Backend`."""
        self.data.qpos[:] = picture
        mujoco.mj_kinematics(self.model, self.data)

    def _close_pictures(self) -> None:
        if self._pictures is not None:
            self._pictures.close()
            self._pictures = None

    def _show(self, viewer: Any) -> None:
        if self.data.time < self._shown:  # after a reset
            self._shown = 0.0
        if self.data.time >= self._shown + _FRAME:
            self._shown = self.data.time
            viewer.sync()

    def close(self) -> None:
        """See `Backend`."""
        self._close_pictures()
        if self._viewer is not None:
            self._viewer.close()
            self._viewer = None


def _open_viewer(model: mujoco.MjModel, data: mujoco.MjData) -> Any:
    import mujoco.viewer

    return mujoco.viewer.launch_passive(model, data)
