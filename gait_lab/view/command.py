"""`nao_gait view`: connect to the running robot and serve the scene on this machine."""

import contextlib
import io
import math
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gait_lab.view.link import COMMAND_PERIOD, RobotLink
from gait_lab.view.panel import Panel
from gait_lab.view.scene import RobotScene
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import load_robot
from nao_lipm_gait.ros.process import stay_local, stop_on_signal

if TYPE_CHECKING:
    from rclpy.node import Node

HOST = "127.0.0.1"
"""Whoever reaches the page can drive the robot: nobody outside this machine shall."""
FRAME_PERIOD = 1.0 / 30.0
WORD_PERIOD = 0.25
URDF_PATIENCE = 3.0
"""[s] of wall time for robot_description before the shipped robot is taken."""
CAMERA = (0.75, -0.75, 0.5)
"""[m] from the robot, where the camera begins."""


class Viewer:
    """One robot on one page; `step` it often."""

    def __init__(self, node: "Node", server: Any, *, stamped: bool = False) -> None:
        self.link = RobotLink(node, stamped=stamped)
        self.panel = Panel(server)
        self.scene: RobotScene | None = None
        self._server = server
        self._joints_since: float | None = None
        self._next_frame = self._next_word = self._next_command = 0.0
        self._counted = (time.monotonic(), 0)
        self._looked_at = (0.0, 0.0)
        server.initial_camera.position = CAMERA
        server.initial_camera.look_at = (0.0, 0.0, 0.25)

    def step(self) -> None:
        """Draw and send what is due."""
        now = time.monotonic()
        heard = self.link.heard
        if self.scene is None and heard.joints:
            self.scene = self._make_scene(now)
        if now >= self._next_frame and self.scene is not None:
            self._next_frame = now + FRAME_PERIOD
            with self._server.atomic():
                self.scene.update(heard)
                self.scene.see_through(self.panel.through.value)
            if self.panel.follow.value:
                self._follow(self.scene.base)
        if now >= self._next_word:
            self._next_word = now + WORD_PERIOD
            since, count = self._counted
            rate = (heard.count - count) / max(1e-3, now - since)
            self._counted = now, heard.count
            self.panel.tell(heard, rate)
        if now >= self._next_command:
            self._next_command = now + COMMAND_PERIOD
            self.link.drive(self.panel.command)
        heading = 0.0 if self.scene is None else self.scene.base[2]
        push = self.panel.take_push(heading)
        if push is not None:
            self.link.push(push)

    def _make_scene(self, now: float) -> RobotScene | None:
        urdf = self.link.heard.urdf
        if urdf is None:
            if self._joints_since is None:
                self._joints_since = now
            if now - self._joints_since < URDF_PATIENCE:
                return None
            return RobotScene(self._server, load_robot())
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "robot.urdf")
            path.write_text(urdf, encoding="utf-8")
            return RobotScene(self._server, load_robot(path))

    def _follow(self, base: tuple[float, float, float]) -> None:
        """Move every camera by as much as the robot has moved; turning it stays the user's."""
        dx, dy = base[0] - self._looked_at[0], base[1] - self._looked_at[1]
        if abs(dx) + abs(dy) < 1e-3:
            return
        self._looked_at = base[0], base[1]
        for client in self._server.get_clients().values():
            with client.atomic():
                camera = client.camera
                x, y, z = camera.look_at
                px, py, pz = camera.position
                camera.position = (px + dx, py + dy, pz)
                camera.look_at = (x + dx, y + dy, z)


def serve(port: int) -> Any:
    """A viser server on this machine alone; NaoGaitError if it cannot be had."""
    import viser

    if not 0 < port < 65536:
        raise NaoGaitError("port", port, "1 to 65535")
    try:
        # It prints a banner whatever `verbose` says; the one line that counts is ours.
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
    """Until Ctrl-C, or for `duration` s of wall time."""
    # The ROS wheels restart the interpreter at their first import: before the server is there.
    import rclpy
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.signals import SignalHandlerOptions

    from gait_lab.drive.ros_names import checked_namespace

    with stop_on_signal() as stop:
        stay_local()
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        server = serve(port)
        try:
            node = rclpy.create_node("nao_gait_view", namespace=checked_namespace(namespace))
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
            rclpy.try_shutdown()
