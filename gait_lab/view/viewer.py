"""`nao_gait view`: a page on this machine that shows and drives the running robot."""

import contextlib
import io
import math
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gait_lab.ros_session import ros_node
from gait_lab.view.robot_link import COMMAND_PERIOD, RobotLink, RobotState
from gait_lab.view.scene import RobotScene
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import load_robot
from nao_lipm_gait.ros.process import stop_on_signal
from nao_lipm_gait.types import VelocityCommand

if TYPE_CHECKING:
    from rclpy.node import Node

HOST = "127.0.0.1"
"""The page can drive the robot, so it is served on this machine only."""
FRAME_PERIOD = 1.0 / 30.0
"""Wall time between two frames [s]."""
TEXT_PERIOD = 0.25
"""Wall time between two updates of the text [s]."""
URDF_TIMEOUT = 3.0
"""Wall time [s] to wait for robot_description before the shipped robot is shown."""
PUSH_DURATION = 0.1
"""Duration of a push of the simulated robot [s]."""
CAMERA = (0.75, -0.75, 0.5)
"""Initial position of the camera relative to the robot [m]."""


class Panel:
    """Sliders for the velocity, a push button, and the state of the gait.

    The callbacks run on threads of the server, so they only store what was clicked.

    Args:
        server: The viser server of the page.

    Attributes:
        x: Slider of the forward velocity [cm/s].
        y: Slider of the velocity to the left [cm/s].
        yaw: Slider of the yaw rate [deg/s].
        impulse: Slider of the impulse of a push [N s].
        direction: Direction of a push, seen from the robot.
        push: Button for a push.
        stop: Button that sets all velocities to 0.
        follow: Whether the camera follows the robot.
        through: Whether the robot is transparent.
    """

    def __init__(self, server: Any) -> None:
        gui = server.gui
        self._text = gui.add_markdown("waiting for the robot")
        with gui.add_folder("Drive"):
            self.x = gui.add_slider("forward [cm/s]", min=-40.0, max=40.0, step=1.0,
                                    initial_value=0.0)  # fmt: skip
            self.y = gui.add_slider("left [cm/s]", min=-20.0, max=20.0, step=1.0,
                                    initial_value=0.0)  # fmt: skip
            self.yaw = gui.add_slider("turn [°/s]", min=-100.0, max=100.0, step=1.0,
                                      initial_value=0.0)  # fmt: skip
            self.stop = gui.add_button("stop", color="red")
        with gui.add_folder("Push"):
            self.impulse = gui.add_slider("impulse [N s]", min=0.25, max=4.0, step=0.25,
                                          initial_value=1.0)  # fmt: skip
            self.direction = gui.add_dropdown(
                "towards", ("left", "right", "front", "back"), initial_value="left"
            )
            self.push = gui.add_button("push")
        self.follow = gui.add_checkbox("camera follows", initial_value=True)
        self.through = gui.add_checkbox("see through the robot", initial_value=False,
                                        hint="to the CoM and the pendulum")  # fmt: skip
        self._pushes: list[tuple[float, float]] = []
        self.stop.on_click(lambda _: self.command_standstill())
        self.push.on_click(lambda _: self.click_push())

    @property
    def command(self) -> VelocityCommand:
        """The velocity that the sliders command [m/s, m/s, rad/s]."""
        return VelocityCommand(
            0.01 * self.x.value, 0.01 * self.y.value, math.radians(self.yaw.value)
        )

    def command_standstill(self) -> None:
        """Set all velocities to 0."""
        for slider in (self.x, self.y, self.yaw):
            slider.value = 0.0

    def click_push(self) -> None:
        """Store a push with the chosen impulse and direction."""
        angle = {"front": 0.0, "left": 0.5, "back": 1.0, "right": -0.5}[self.direction.value]
        self._pushes.append((self.impulse.value / PUSH_DURATION, angle * math.pi))

    def take_push(self, heading: float) -> tuple[float, float] | None:
        """Return the force (x, y) [N] in the world of the oldest stored push; None without one.

        Args:
            heading: Heading of the robot in the world [rad].
        """
        if not self._pushes:
            return None
        force, angle = self._pushes.pop(0)
        return force * math.cos(heading + angle), force * math.sin(heading + angle)

    def show(self, state: RobotState, rate: float) -> None:
        """Show the state of the gait, and the rate [Hz] of the joint states."""
        x, y, yaw = state.speed
        content = (
            f"**{state.support or 'no gait yet'}**  \n"
            f"{_whole(100 * x)} cm/s forward, {_whole(100 * y)} cm/s left, "
            f"{_whole(math.degrees(yaw))}°/s  \n"
            f"sensors at {rate:.0f} Hz, t = {max(0, state.stamp) * 1e-9:.1f} s"
        )
        if content != self._text.content:
            self._text.content = content


def _whole(value: float) -> int:
    """Round to an integer, which has no -0."""
    return round(value)


class Viewer:
    """One robot on one page; call `step` often.

    Args:
        node: The node that subscribes and publishes.
        server: The viser server of the page.
        stamped: Whether to publish TwistStamped.

    Attributes:
        link: Connection to the robot.
        panel: Controls of the page.
        scene: The scene; None until joint states arrive.
    """

    def __init__(self, node: "Node", server: Any, *, stamped: bool = False) -> None:
        self.link = RobotLink(node, stamped=stamped)
        self.panel = Panel(server)
        self.scene: RobotScene | None = None
        self._server = server
        self._first_joints: float | None = None
        self._next_frame = self._next_text = self._next_command = 0.0
        self._counted = (time.monotonic(), 0)
        self._followed = (0.0, 0.0)
        server.initial_camera.position = CAMERA
        server.initial_camera.look_at = (0.0, 0.0, 0.25)

    def step(self) -> None:
        """Draw the scene, update the text, and send commands, each at its period."""
        now = time.monotonic()
        state = self.link.state
        if self.scene is None and state.joints:
            self.scene = self._make_scene(now)
        if now >= self._next_frame and self.scene is not None:
            self._next_frame = now + FRAME_PERIOD
            with self._server.atomic():
                self.scene.update(state)
                self.scene.see_through(self.panel.through.value)
            if self.panel.follow.value:
                self._follow(self.scene.base)
        if now >= self._next_text:
            self._next_text = now + TEXT_PERIOD
            since, count = self._counted
            rate = (state.count - count) / max(1e-3, now - since)
            self._counted = now, state.count
            self.panel.show(state, rate)
        if now >= self._next_command:
            self._next_command = now + COMMAND_PERIOD
            self.link.drive(self.panel.command)
        heading = 0.0 if self.scene is None else self.scene.base[2]
        push = self.panel.take_push(heading)
        if push is not None:
            self.link.push(push)

    def _make_scene(self, now: float) -> RobotScene | None:
        urdf = self.link.state.urdf
        if urdf is None:
            if self._first_joints is None:
                self._first_joints = now
            if now - self._first_joints < URDF_TIMEOUT:
                return None
            return RobotScene(self._server, load_robot())
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "robot.urdf")
            path.write_text(urdf, encoding="utf-8")
            return RobotScene(self._server, load_robot(path))

    def _follow(self, base: tuple[float, float, float]) -> None:
        """Move every camera as far as the robot has moved; the user turns it."""
        dx, dy = base[0] - self._followed[0], base[1] - self._followed[1]
        if abs(dx) + abs(dy) < 1e-3:
            return
        self._followed = base[0], base[1]
        for client in self._server.get_clients().values():
            with client.atomic():
                camera = client.camera
                x, y, z = camera.look_at
                px, py, pz = camera.position
                camera.position = (px + dx, py + dy, pz)
                camera.look_at = (x + dx, y + dy, z)


def serve(port: int) -> Any:
    """Start a viser server on this machine; NaoGaitError if the port cannot be used."""
    import viser

    if not 0 < port < 65536:
        raise NaoGaitError("port", port, "1 to 65535")
    try:
        # viser prints a banner even without `verbose`.
        with contextlib.redirect_stdout(io.StringIO()):
            server = viser.ViserServer(host=HOST, port=port, label="nao_gait view", verbose=False)
    except OSError as error:
        raise NaoGaitError("port", port, f"a free port ({error})") from error
    return server


def run(
    *,
    port: int,
    namespace: str = "",
    stamped: bool = False,
    duration: float | None = None,
    say: Callable[[str], None],
) -> None:
    """Show the robot until Ctrl-C, or for `duration`.

    Args:
        port: Port of the page on this machine.
        namespace: Namespace of the robot; "" for none.
        stamped: Whether to publish TwistStamped.
        duration: Wall time [s] after which the view ends; None for no limit.
        say: Prints a line.

    Raises:
        NaoGaitError: If the port cannot be used or the namespace is invalid.
    """
    with stop_on_signal() as stop, ros_node("nao_gait_view", namespace) as node:
        from rclpy.executors import SingleThreadedExecutor

        server = serve(port)
        try:
            executor = SingleThreadedExecutor()
            executor.add_node(node)
            viewer = Viewer(node, server, stamped=stamped)
            say(f"http://{HOST}:{server.get_port()} (Ctrl-C ends)")
            end = math.inf if duration is None else time.monotonic() + duration
            while not stop and time.monotonic() < end:
                executor.spin_once(timeout_sec=0.01)
                viewer.step()
        finally:
            with contextlib.redirect_stdout(io.StringIO()):
                server.stop()
