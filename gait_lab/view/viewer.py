"""`nao_gait view`: a page on this machine that shows and drives the running robots."""

import contextlib
import io
import math
import re
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest.mock import patch

from gait_lab.ros_session import ros_node
from gait_lab.view.pitch import PitchScene
from gait_lab.view.robot_link import COMMAND_PERIOD, FAR, RobotLink, RobotState
from gait_lab.view.scene import RobotScene
from gait_lab.view.world_scene import WorldScene
from robot_core.errors import NaoGaitError
from robot_core.field import COLORS
from robot_core.message_checks import read_array
from robot_core.robot import load_robot
from robot_core.ros.process import stop_on_signal
from robot_core.types import VelocityCommand
from sim_bridge.scene import parse_scene
from sim_bridge.shapes import Color

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
PING_PERIOD, PING_TIMEOUT = 0.5, 1.5
"""Wall time [s] between two pings of a browser, and without an answer after which it has gone."""
ANSWER_PERIOD, ANSWER_TIMEOUT = 0.5, 2.0
"""The same for answers of the page itself: a browser answers pings for a page that hangs."""
LONGEST_STATE = 60
"""Characters of the gait's state that are shown."""
PUSH_DURATION = 0.1
"""Duration of a push of the simulated robot [s]."""
CAMERA = (0.75, -0.75, 0.5)
"""Initial position of the camera relative to the robot [m]."""
OVERLOOK = (0.0, -0.8, 0.6)
"""Initial position of the camera over a pitch, of the pitch's length."""


class Panel:
    """Sliders for the velocity, a push button, and the state of the gait.

    The callbacks run on threads of the server, so they only store what was clicked.

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
        robot: Which robot is driven, pushed and followed; None if there is only one.
        driver: Client that moved a slider of the velocity last; None before that.
    """

    def __init__(self, server: Any) -> None:
        gui = self._gui = server.gui
        self.robot: Any = None
        self.driver: int | None = None
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
        for slider in (self.x, self.y, self.yaw):
            slider.on_update(self._note_driver)
        self.stop.on_click(lambda _: self.command_standstill())
        self.push.on_click(lambda _: self.click_push())

    async def _note_driver(self, event: Any) -> None:
        # On the thread that takes the messages: the driver is known before it can leave.
        if event.client_id is not None:  # else this program has set the slider
            self.driver = event.client_id

    def offer_robots(self, names: tuple[str, ...]) -> None:
        """Let the user choose one of several robots."""
        if self.robot is not None:
            self.robot.remove()
        self.robot = self._gui.add_dropdown("robot", names, initial_value=names[0], order=0.5)

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
            f"**{_plain(state.support) or 'no gait yet'}**  \n"
            f"{round(100 * x)} cm/s forward, {round(100 * y)} cm/s left, "
            f"{round(math.degrees(yaw))}°/s  \n"
            f"sensors at {rate:.0f} Hz, t = {max(0, state.stamp) * 1e-9:.1f} s"
        )
        if content != self._text.content:
            self._text.content = content


def _plain(text: str) -> str:
    """A text from a topic without what Markdown would turn into links, images or HTML."""
    return re.sub(r"[^A-Za-z0-9_ ]", "", text)[:LONGEST_STATE]


class Pages:
    """The connected pages, and when each last answered.

    Each page is asked for a value of its storage, again and again, by a thread that waits for it.
    """

    def __init__(self, server: Any) -> None:
        self._server = server
        self._answered: dict[int, float] = {}
        server.on_client_connect(self._watch)

    def alive(self) -> frozenset[int]:
        """The pages that are connected and have answered lately."""
        since = time.monotonic() - ANSWER_TIMEOUT
        return frozenset(
            page for page in self._server.get_clients() if self._answered.get(page, 0.0) > since
        )

    def _watch(self, client: Any) -> None:
        self._answered[client.client_id] = time.monotonic()
        threading.Thread(target=self._ask, args=(client,), daemon=True).start()

    def _ask(self, client: Any) -> None:
        page = client.client_id
        while page in self._server.get_clients():
            # TimeoutError: it hangs; RuntimeError: it has gone, or answers that it stores nothing.
            with contextlib.suppress(TimeoutError):
                with contextlib.suppress(RuntimeError):
                    client.local_storage.get_item("alive", timeout=ANSWER_TIMEOUT)
                self._answered[page] = time.monotonic()
            time.sleep(ANSWER_PERIOD)
        self._answered.pop(page, None)


class ShownRobot:
    """One robot on the page.

    Args:
        node: The node that subscribes and publishes.
        server: The viser server of the page.
        name: Of a robot out of several; "" for the only one.
        color: Of its torso; None for that of the URDF.
        team: Its team; None for a robot that does not play.
        stamped: Whether to publish TwistStamped.

    Attributes:
        name: Its name.
        link: Connection to the robot.
        scene: What is drawn of it; None until joint states arrive.
        world: What it estimates, if it plays.
    """

    def __init__(
        self,
        node: "Node",
        server: Any,
        name: str = "",
        color: Color | None = None,
        team: str | None = None,
        *,
        stamped: bool = False,
    ) -> None:
        self.name = name
        self.world = None if team is None else WorldScene(node, server, name, team)
        self.link = RobotLink(node, name, stamped=stamped)
        self.scene: RobotScene | None = None
        self._node, self._server, self._color = node, server, color
        self._first_joints: float | None = None

    def make_scene(self, now: float) -> None:
        """Begin to draw the robot as soon as its joints and its URDF are known."""
        state = self.link.state
        if self.scene is not None or not state.joints:
            return
        if state.urdf is None:
            if self._first_joints is None:
                self._first_joints = now
            if now - self._first_joints >= URDF_TIMEOUT:
                self.scene = RobotScene(self._server, load_robot(), self.name, self._color)
            return
        try:
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder, "robot.urdf")
                path.write_text(state.urdf, encoding="utf-8")
                robot = load_robot(path)
        except (NaoGaitError, UnicodeError) as error:
            self._node.get_logger().warning(f"robot_description: {error}; the NAO is shown")
            robot = load_robot()
        self.scene = RobotScene(self._server, robot, self.name, self._color)


class Viewer:
    """The world on one page: one robot, or the robots of a scene; call `step` often.

    Attributes:
        panel: Controls of the page.
        robots: The robots that are shown.
        pitch: Field and ball; None without a scene.
    """

    def __init__(self, node: "Node", server: Any, *, stamped: bool = False) -> None:
        from geometry_msgs.msg import PointStamped
        from rclpy.qos import qos_profile_sensor_data
        from std_msgs.msg import String

        from robot_core.ros.topics import LATCHED, Inputs

        self.panel = Panel(server)
        self.robots = [ShownRobot(node, server, stamped=stamped)]
        self.pitch: PitchScene | None = None
        self._node, self._server, self._stamped = node, server, stamped
        self._description = ""
        self._next_frame = self._next_text = self._next_command = 0.0
        self._counted = (time.monotonic(), 0)
        self._followed = (0.0, 0.0)
        self._had_clients = False
        self._pages = Pages(server)
        server.initial_camera.position = CAMERA
        server.initial_camera.look_at = (0.0, 0.0, 0.25)
        inputs = Inputs(node, burst=1)
        inputs.subscribe(String, "scene_description", self._on_scene, LATCHED)
        inputs.subscribe(PointStamped, "ground_truth/ball", self._on_ball, qos_profile_sensor_data)

    @property
    def chosen(self) -> ShownRobot:
        """The robot that is driven, pushed and followed."""
        name = "" if self.panel.robot is None else self.panel.robot.value
        return next((robot for robot in self.robots if robot.name == name), self.robots[0])

    @property
    def clients(self) -> frozenset[int]:
        """The pages that are connected and do not hang."""
        return self._pages.alive()

    def step(self) -> None:
        """Draw the scene, update the text, and send commands, each at its period."""
        now = time.monotonic()
        chosen = self.chosen
        self._stop_without_driver()
        for robot in self.robots:
            robot.make_scene(now)
        if now >= self._next_frame:
            self._next_frame = now + FRAME_PERIOD
            with self._server.atomic():
                for robot in self.robots:
                    if robot.scene is not None:
                        robot.scene.update(robot.link.state)
                        robot.scene.see_through(self.panel.through.value)
                    if robot.world is not None:
                        robot.world.update()
            if self.panel.follow.value and chosen.scene is not None:
                self._follow(chosen.scene.base)
        state = chosen.link.state
        if now >= self._next_text:
            self._next_text = now + TEXT_PERIOD
            since, count = self._counted
            rate = max(0.0, (state.count - count) / max(1e-3, now - since))
            self._counted = now, state.count
            self.panel.show(state, rate)
        if now >= self._next_command:
            self._next_command = now + COMMAND_PERIOD
            chosen.link.drive(self.panel.command)
        heading = 0.0 if chosen.scene is None else chosen.scene.base[2]
        push = self.panel.take_push(heading)
        if push is not None:
            chosen.link.push(push)

    def _stop_without_driver(self) -> None:
        """Stop at once if the page that drives is gone or hangs, or no page is left."""
        clients = self.clients
        self._had_clients = self._had_clients or bool(clients)
        driver = self.panel.driver
        gone = driver not in clients if driver is not None else self._had_clients and not clients
        if gone and not self.panel.command.is_zero:
            self.panel.command_standstill()
            self._next_command = 0.0
            self._node.get_logger().warning("the page that drove has gone or hangs: robot stopped")

    def _on_scene(self, message: Any) -> None:
        """Show the robots of a scene in place of the only one."""
        if message.data == self._description:
            return  # the bridge has started again
        scene = parse_scene(message.data)
        self._description = message.data
        self._server.scene.reset()
        self._server.scene.set_up_direction("+z")
        self.pitch = PitchScene(self._server, scene)
        self.robots = [
            ShownRobot(
                self._node,
                self._server,
                robot.name,
                COLORS[robot.team],
                robot.team,
                stamped=self._stamped,
            )
            for robot in scene.robots
        ]
        self.panel.offer_robots(tuple(robot.name for robot in scene.robots))
        if scene.field is not None:
            self._overlook(scene.field.length)

    def _overlook(self, length: float) -> None:
        """Show all of a pitch of this length [m]; the user may let the camera follow a robot."""
        self.panel.follow.value = False
        position = tuple(length * each for each in OVERLOOK)
        views = [client.camera for client in self._server.get_clients().values()]
        for camera in (self._server.initial_camera, *views):
            camera.position = position
            camera.look_at = (0.0, 0.0, 0.0)

    def _on_ball(self, message: Any) -> None:
        if self.pitch is not None:
            p = message.point
            place = read_array((p.x, p.y, p.z), "ground_truth/ball", (3,), FAR, "m", "xyz")
            self.pitch.put_ball(place.tolist())

    def _follow(self, base: tuple[float, float, float]) -> None:
        """Move every camera as far as the robot has moved, or to the one that is newly chosen.

        The user turns it.
        """
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
    """Start a viser server on this machine; NaoGaitError if the port cannot be used.

    Only its own page may open its socket: a browser lets pages from anywhere try that.
    """
    import viser
    from websockets.asyncio import server as websocket_server
    from websockets.typing import Origin

    listen = websocket_server.serve

    def listen_to_own_page(handler: Any, host: str, port: int, **settings: Any) -> Any:
        own = [Origin(f"http://{name}:{port}") for name in (HOST, "localhost")]
        return listen(
            handler, host, port, origins=own, ping_interval=PING_PERIOD, ping_timeout=PING_TIMEOUT,
            **settings,
        )  # fmt: skip

    try:
        # viser prints a banner even without `verbose`, and passes no origins on.
        with (
            contextlib.redirect_stdout(io.StringIO()),
            patch.object(websocket_server, "serve", listen_to_own_page),
        ):
            server = viser.ViserServer(host=HOST, port=port, label="nao_gait view", verbose=False)
    except OSError as error:
        raise NaoGaitError("port", port, f"a free port ({error})") from error
    server.gui.configure_theme(show_share_button=False)  # it would show the page to the internet
    return server


def run(
    *,
    port: int,
    namespace: str = "",
    stamped: bool = False,
    duration: float = math.inf,
    say: Callable[[str], None],
) -> None:
    """Show the robot until Ctrl-C, or for `duration`.

    Args:
        port: Port of the page on this machine.
        namespace: Namespace of the robot; "" for none.
        stamped: Whether to publish TwistStamped.
        duration: Wall time [s] after which the view ends.
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
            end = time.monotonic() + duration
            while not stop and time.monotonic() < end:
                executor.spin_once(timeout_sec=0.01)
                viewer.step()
        finally:
            with contextlib.redirect_stdout(io.StringIO()):
                server.stop()
