"""One robot of the world behind the topics of a real one."""

from geometry_msgs.msg import PointStamped, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import BatteryState, Imu, JointState, Temperature
from std_msgs.msg import String

from robot_core.command_input import CommandInput
from robot_core.errors import NaoGaitError
from robot_core.ros.messages import stamp_in, temperature_messages
from robot_core.ros.topics import LATCHED, MOTORS, RELIABLE, Inputs, publisher
from sim_bridge.robot import Reading, SimulatedRobot
from sim_bridge.ros.camera_topics import CameraTopics
from sim_bridge.ros.messages import ReadingWriter, TruthWriter, battery_state, push_of

HEAT_PERIOD = 1_000_000_000
"""[ns] between two messages about battery and temperatures."""
RESET_SILENCE = 0.6
"""[s] of simulated time without sensors after a reset. The clock continues, so a controller notices
the reset by this gap: more than 0.5 s is a new start for it."""


class RobotInterface:
    """Publishes the sensors and the truth of a robot and takes its commands.

    The topics of a robot with a name are below it.

    Attributes:
        awaited: [ns] stamp of the reading that lockstep waits for; None = of none.
    """

    def __init__(
        self, node: Node, robot: SimulatedRobot, *, lockstep: bool, push_duration: float
    ) -> None:
        """Make the publishers and subscriptions.

        Args:
            node: The bridge.
            robot: The robot.
            lockstep: Each reading waits for its answer.
            push_duration: [s] for which a push acts.
        """
        self.robot = robot
        self._lockstep, self._push_duration = lockstep, push_duration
        self._inputs = Inputs(node, robot.name)
        self._commands = CommandInput(robot.description)
        self._sent: Reading | None = None
        self.awaited: int | None = None
        self._answered: int | None = None  # stamp [ns] of the last reading that was answered
        self._silent_until = 0
        self._readings = ReadingWriter(robot.description, robot.plant.sensors)
        self._truths = TruthWriter(robot.description)
        below = f"{robot.name}/" if robot.name else ""
        self._imu = publisher(node, Imu, f"{below}imu/data")
        self._joint_states = publisher(node, JointState, f"{below}joint_states")
        self._wrenches = tuple(
            publisher(node, WrenchStamped, f"{below}{frame}/wrench")
            for frame in robot.description.sole_frames
        )
        self._odometry = publisher(node, Odometry, f"{below}ground_truth/odom")
        self._com = publisher(node, PointStamped, f"{below}ground_truth/com")
        self._heat = None
        if robot.heat is not None:
            self._heat = (
                publisher(node, BatteryState, f"{below}battery"),
                publisher(node, Temperature, f"{below}temperature", MOTORS),
            )
        self._heat_due = 0
        self._cameras = [CameraTopics(node, camera, below) for camera in robot.cameras]
        description = publisher(node, String, f"{below}robot_description", LATCHED)
        description.publish(String(data=robot.description.urdf))
        self.joint_states: str = self._joint_states.topic_name
        # Reliable in lockstep, where a lost command would stop the world.
        commands = RELIABLE if lockstep else qos_profile_sensor_data
        self._inputs.subscribe(JointState, f"{below}joint_command", self._on_command, commands)
        self._inputs.subscribe(WrenchStamped, f"{below}push", self._on_push)

    def publish(self, now: int) -> None:
        """Publish a new reading, if there is one, and the truth.

        Args:
            now: [ns] simulated time.
        """
        reading = self.robot.read()
        if reading is not None and reading is not self._sent and now >= self._silent_until:
            self._sent = reading
            self.awaited = reading.frame.stamp
            self._send(reading)
        if now >= self._silent_until:
            for camera in self._cameras:
                camera.publish(now)
        truth = self.robot.truth()
        self._odometry.publish(self._truths.odometry(truth))
        self._com.publish(self._truths.com(truth))

    def resend(self) -> None:
        """Publish the last reading again, unchanged, if it has not been answered."""
        if self._sent is not None and self.awaited is not None:
            self._send(self._sent)

    def release_control(self) -> None:
        """Let another gait answer, because the one in control does not."""
        if self.awaited is not None:
            self._commands.release()

    def restart(self, now: int) -> None:
        """Forget what was before a reset at `now` [ns]; no sensors for a while."""
        self._commands.reset(now)
        if self.awaited is not None:
            self._answered = self.awaited  # its answer may be on the way, and comes too late
        self._sent = self.awaited = None
        self._silent_until = now + round(RESET_SILENCE * 1e9)

    def missing_answer(self, waited: float) -> str:
        """What lockstep has waited for, for `waited` [s] of wall time."""
        stamp = 0.0 if self.awaited is None else self.awaited * 1e-9
        subscribers = self._joint_states.get_subscription_count()
        name = f"{self.robot.name}: " if self.robot.name else ""
        return (
            f"{name}no joint_command with header.stamp {stamp:.3f} s for {waited:.0f} s; "
            f"{subscribers} subscriber(s) on joint_states"
        )

    def _send(self, reading: Reading) -> None:
        stamp, motors = reading.frame.stamp, reading.motors
        if self._heat is not None and motors is not None and stamp >= self._heat_due:
            self._heat_due = stamp + HEAT_PERIOD
            battery, temperature = self._heat
            battery.publish(battery_state(stamp, motors))
            for message in temperature_messages(
                stamp, self.robot.description.joint_names, motors.temperature.tolist()
            ):
                temperature.publish(message)
        # The IMU goes first: the joint state of the same stamp starts a tick of the gait.
        self._imu.publish(self._readings.imu(reading))
        self._joint_states.publish(self._readings.joints(reading))
        for side, topic in enumerate(self._wrenches):
            topic.publish(self._readings.wrench(reading, side))

    def _on_command(self, message: JointState) -> None:
        header = message.header
        stamp = stamp_in(header, "joint_command")
        answers = stamp == self.awaited
        if self._lockstep and not answers:
            if stamp == self._answered:
                return  # second answer, to a reading that was sent again
            raise NaoGaitError(
                "joint_command header.stamp",
                f"{stamp * 1e-9:.3f} s",
                "in lockstep, the stamp of the last joint_states"
                + ("" if self.awaited is None else f", {self.awaited * 1e-9:.3f} s"),
            )
        now = self.robot.time * 1e-9
        self._commands.admit(header.frame_id, now)
        if answers:
            # Before the command is read: after a bad one the world continues with the last targets.
            self.awaited, self._answered = None, stamp
        targets, warning = self._commands.read(
            header.frame_id, now, stamp, message.name, message.position, message.effort
        )
        self.robot.command(targets)
        if warning is not None:
            self._inputs.warn("limits", warning)

    def _on_push(self, message: WrenchStamped) -> None:
        self.robot.push(push_of(message), self._push_duration)
