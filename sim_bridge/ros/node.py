"""The bridge as a ROS 2 node: the world behind the topics of its robots.

The node owns `/clock`; `stepping` calls `advance`, no timer does.
"""

from collections.abc import Sequence
from functools import partial
from typing import Any

from geometry_msgs.msg import PointStamped, PoseStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Header, String
from std_srvs.srv import Trigger

from robot_core.errors import NaoGaitError
from robot_core.field import BallPlace
from robot_core.robot import RobotDescription, load_robot
from robot_core.ros.lockstep import UNTIL, LockstepPartners
from robot_core.ros.messages import planar_of
from robot_core.ros.parameters import (
    declare,
    load_from,
    load_parameter_file,
    load_robot_parameter,
    warn_of_unknown_overrides,
)
from robot_core.ros.topics import LATCHED, Inputs, publisher, watch_senders, write_log
from sim_bridge.ball import Ball
from sim_bridge.cameras.camera import CameraSettings
from sim_bridge.engines.registry import engine_for
from sim_bridge.plant import Plant, load_plant
from sim_bridge.ros import parameters
from sim_bridge.ros.messages import WorldWriter
from sim_bridge.ros.monitors import PublisherMonitor
from sim_bridge.ros.parameters import NODE_PARAMETERS, OF_THE_FLOOR
from sim_bridge.ros.robot_interface import RESET_SILENCE, RobotInterface
from sim_bridge.scene import FLOOR, load_scene
from sim_bridge.world import World

CONTROL_PERIOD = 0.01
"""[s] between two readings; a NAO's own."""
CLOCK = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)
"""A clock that lockstep holds is repeated, and must not fill the queue of a node that is late."""


class BridgeNode(Node):
    """A world with its robots; takes commands, publishes sensors and the ground truth.

    Attributes:
        control_period: [ns] simulated time of one step.
        factor: Simulated seconds per wall second; 0 = as fast as possible.
    """

    def __init__(self) -> None:
        super().__init__("sim_bridge", automatically_declare_parameters_from_overrides=True)
        plant = load_parameter_file(self, parameters.PLANT, load_plant)
        self.factor: float = declare(self, parameters.REAL_TIME_FACTOR)
        self.lockstep: bool = declare(self, parameters.LOCKSTEP)
        push_duration = declare(self, parameters.PUSH_DURATION)
        scene = declare(self, parameters.SCENE)
        self._world = self._make_world(scene, plant)
        self.control_period = self._world.control_period
        self._ball_place: BallPlace | None = None
        self._robots = tuple(
            RobotInterface(self, robot, lockstep=self.lockstep, push_duration=push_duration)
            for robot in self._world.robots
        )
        self._make_world_topics(named=scene != FLOOR)
        self._partners = self._make_partners(declare(self, parameters.LOCKSTEP_NODES))
        warn_of_unknown_overrides(self, (p.name for p in NODE_PARAMETERS))
        watch_senders(self)
        self.get_logger().info(
            ", ".join(self._titles(plant))
            + (": lockstep" if self.lockstep else f": real time factor {self.factor:g}")
        )
        for remark in {each for robot in self._world.robots for each in robot.description.remarks}:
            self.get_logger().warning(remark)

    def _make_world(self, name: str, plant: Plant) -> World:
        delay = declare(self, parameters.SENSOR_DELAY, plant.sensors.delay)
        common: dict[str, Any] = {
            "sensor_delay": delay,
            "control_period": CONTROL_PERIOD,
            "gui": declare(self, parameters.GUI),
            "cameras": self._camera_settings(plant),
        }
        if name != FLOOR:
            scene = load_from(parameters.SCENE, load_scene, name)
            for field in OF_THE_FLOOR:
                if self.has_parameter(field.name):
                    value = self.get_parameter(field.name).value
                    allowed = f"nothing: scene {scene.name} says it for each robot"
                    raise NaoGaitError(field.name, value, allowed)
            models = [load_robot(robot.urdf) for robot in scene.robots]
            return World.of_scene(scene, plant, engine=self._engine(models), **common)
        robot = load_robot_parameter(self)
        return World.single(
            robot,
            plant,
            engine=self._engine([robot]),
            robot_seed=declare(self, parameters.ROBOT_SEED),
            start_state=declare(self, parameters.START_STATE),
            ball=Ball() if declare(self, parameters.BALL) else None,
            **common,
        )

    def _engine(self, robots: Sequence[RobotDescription]) -> str:
        """The engine that is asked for, else the one for these robots."""
        asked, default = self.has_parameter(parameters.ENGINE.name), engine_for(robots)
        if not asked and default != parameters.ENGINE.default:
            soft = next(each for each in robots if each.soft_joint)
            reason = f"{soft.soft_joint} of {soft.name} has a motor that gives way"
            self.get_logger().info(f"engine {default}: {reason}")
        return declare(self, parameters.ENGINE, default)

    def _camera_settings(self, plant: Plant) -> CameraSettings | None:
        """Settings of the cameras; None without cameras."""
        delay = declare(self, parameters.CAMERA_DELAY, plant.camera.delay)
        noise = declare(self, parameters.CAMERA_NOISE, plant.camera.noise)
        settings = CameraSettings(
            declare(self, parameters.CAMERA_RATE),
            declare(self, parameters.CAMERA_WIDTH),
            declare(self, parameters.CAMERA_HEIGHT),
            delay,
            noise,
        )
        return settings if declare(self, parameters.CAMERAS) else None

    def _titles(self, plant: Plant) -> list[str]:
        robots = [each.robot for each in self._robots]
        kinds = [
            f"{robot.name or robot.description.name}"
            + (f" ({robot.description.name} {robot.individual.seed})" if robot.name else "")
            for robot in robots
        ]
        seed = [] if robots[0].name else [f"robot {robots[0].individual.seed}"]
        return [*kinds, f"plant {plant.name}", *seed]

    def _make_world_topics(self, *, named: bool) -> None:
        """Clock, ball and reset; `named`: the robots have names, the ball is the world's."""
        self._writer = WorldWriter()
        self._clock_topic: Any = None
        if declare(self, parameters.PUBLISH_CLOCK):
            self._clock_topic = publisher(self, Clock, "/clock", CLOCK)
        self._ball = self._ball_place_topic = None
        if self._world.ball is not None:
            self._ball = publisher(self, PointStamped, "ground_truth/ball")
            put_ball = "put_ball" if named else "~/put_ball"
            Inputs(self).subscribe(PointStamped, put_ball, self._on_put_ball)
        if self._world.ball_place is not None:
            topic = "ground_truth/ball_place"
            self._ball_place_topic = publisher(self, String, topic, LATCHED)
        if self._world.scene is not None:
            description = publisher(self, String, "scene_description", LATCHED)
            description.publish(String(data=self._world.scene.to_yaml()))
        self.create_service(Trigger, "~/reset", self._on_reset)
        for each in self._robots if named else ():
            service = f"{each.robot.name}/{self.get_name()}/reset"
            self.create_service(Trigger, service, partial(self._on_reset_robot, each))
            put_robot = f"{each.robot.name}/put_robot"
            Inputs(self).subscribe(PoseStamped, put_robot, partial(self._on_put_robot, each))
        advice = {
            each.joint_states: "is there another robot? Use another namespace or ROS_DOMAIN_ID"
            for each in self._robots
        }
        if self._clock_topic is not None:
            advice["/clock"] = (
                "is there another simulator? Set publish_clock:=false for one of them"
            )
        self._publisher_monitor = PublisherMonitor(advice)
        self._watched_topics = tuple(advice)

    def _make_partners(self, names: str) -> LockstepPartners | None:
        """The nodes that time waits for; None without lockstep, or without a clock of its own."""
        partners = LockstepPartners(tuple(each.strip() for each in names.split(",") if each))
        if not self.lockstep or self._clock_topic is None:
            if names:
                allowed = "nothing without lockstep and publish_clock"
                raise NaoGaitError(parameters.LOCKSTEP_NODES.name, names, allowed)
            return None
        Inputs(self).subscribe(Header, UNTIL, self._on_until)
        return partners

    def destroy_node(self) -> None:
        """Free the engine too."""
        self._world.close()
        super().destroy_node()

    # -- stepping ----------------------------------------------------------------------------------

    @property
    def waits_for_answer(self) -> bool:
        """In lockstep, a last reading has not been answered yet, or another node holds time."""
        held = self._partners is not None and self._partners.held is not None
        return held or (self.lockstep and any(each.awaited is not None for each in self._robots))

    def advance(self) -> None:
        """Step the world by one control period and publish the clock, sensors and ground truth.

        While a node holds time in lockstep, only the clock; the others once time goes on.
        """
        self._world.step()
        now = self._world.time
        if self._clock_topic is not None:
            self._clock_topic.publish(self._writer.clock(now))
        if self._partners is None or self._partners.reach(now):
            self._publish()

    def _publish(self) -> None:
        """Publish the sensors and the ground truth of this time."""
        now = self._world.time
        for each in self._robots:
            each.publish(now)
        ball = self._world.ball
        if self._ball is not None and ball is not None:
            self._ball.publish(self._writer.point(now, ball.position))
        place = self._world.ball_place
        if self._ball_place_topic is not None and place is not self._ball_place:
            self._ball_place = place
            self._ball_place_topic.publish(String(data=str(place)))

    def resend(self) -> None:
        """Publish the readings that have not been answered again, or the clock if it is held."""
        if self._partners is not None and self._partners.held is not None:
            self._clock_topic.publish(self._writer.clock(self._partners.held))
        for each in self._robots:
            each.resend()

    def forget_ended(self) -> None:
        """Wait no longer for nodes that hold time and have ended."""
        if self._partners is not None and self._partners.forget_vanished(
            self.count_publishers(UNTIL)
        ):
            self._publish()

    def release_control(self) -> None:
        """Let other gaits answer where the one in control does not."""
        for each in self._robots:
            each.release_control()

    def report_wait(self, waited: float) -> None:
        """Log that lockstep has waited for an answer for `waited` [s] of wall time."""
        if self._partners is not None and self._partners.held is not None:
            held = self._partners.held
            names = ", ".join(self._partners.missing(held))
            self.get_logger().warning(
                f"lockstep: {names} has let time run up to {held * 1e-9:.2f} s on {UNTIL}, "
                f"not further for {waited:.0f} s"
            )
        for each in self._robots:
            if each.awaited is not None:
                self.get_logger().warning(f"lockstep: {each.missing_answer(waited)}")

    def check_publishers(self) -> None:
        """Log topics of this bridge on which others publish too."""
        counts = {topic: self.count_publishers(topic) for topic in self._watched_topics}
        for line in self._publisher_monitor.update(counts):
            write_log(self, line)

    # -- inputs ------------------------------------------------------------------------------------

    def _on_until(self, message: Header) -> None:
        if self._partners is not None and self._partners.receive(message):
            self._publish()

    def _on_put_ball(self, message: PointStamped) -> None:
        frame = message.header.frame_id
        if frame not in ("", "world"):
            raise NaoGaitError("put_ball header.frame_id", frame, "world, or empty")
        self._world.put_ball(message.point.x, message.point.y)

    def _on_put_robot(self, interface: RobotInterface, message: PoseStamped) -> None:
        frame = message.header.frame_id
        if frame not in ("", "world"):
            raise NaoGaitError("put_robot header.frame_id", frame, "world, or empty")
        pose = planar_of(message.pose.position, message.pose.orientation)
        self._world.reset_robot(interface.robot.name, pose)
        interface.restart(self._world.time)

    def _on_reset(self, _request: Any, response: Trigger.Response) -> Trigger.Response:
        self._world.reset()
        for each in self._robots:
            each.restart(self._world.time)
        return self._answered(response, "reset")

    def _on_reset_robot(
        self, interface: RobotInterface, _request: Any, response: Trigger.Response
    ) -> Trigger.Response:
        name = interface.robot.name
        try:
            self._world.reset_robot(name)
        except NaoGaitError as error:
            response.success, response.message = False, str(error)
            self.get_logger().warning(f"reset of {name}: {error}")
            return response
        interface.restart(self._world.time)
        return self._answered(response, f"reset of {name}")

    def _answered(self, response: Trigger.Response, done: str) -> Trigger.Response:
        response.success = True
        response.message = (
            f"back at the start; no sensors for {RESET_SILENCE} s, so that controllers start again"
        )
        self.get_logger().info(done)
        return response
