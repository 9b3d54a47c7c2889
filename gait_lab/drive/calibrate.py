"""Calibration of the running robot: it stands, steps on the spot and stands; a file comes out.

With `zeros` it does so in several poses, and leg joints with a wrong zero are looked for.

`run` connects the procedure of `sim_bridge.trials.calibration_procedure` to the nodes. The gait
itself measures; this tool commands, watches and writes down.
"""

import math
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gait_lab.ros_session import VelocityPublisher, ros_node
from gait_lab.terminal import EXIT_FAILED, EXIT_OK
from nao_lipm_gait.calibration import Calibration, SensorCorrection
from nao_lipm_gait.calibration_file import CalibrationFile, Deviation
from nao_lipm_gait.estimation.joint_zeros import in_words, wrong_zeros
from nao_lipm_gait.runtime.calibration_monitor import CALIBRATION, Measurement
from nao_lipm_gait.runtime.inputs import read_velocity
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription, load_robot
from robot_core.ros.patience import ANSWER, STALL
from robot_core.ros.process import StopRequest, stop_on_signal
from robot_core.schema import write_text
from robot_core.types import FloatArray
from sim_bridge.trials.calibration_procedure import (
    POSED,
    CalibrationError,
    Phase,
    Procedure,
    calibration_poses,
)

if TYPE_CHECKING:
    from rclpy.node import Node

COMMAND_PERIOD = 0.1
"""Time [s] of the sensors between two velocity commands."""
AGAIN = 1.0
"""Wall time [s] after which a request is sent again: it or its answer may be lost."""


class _RobotClient:
    """Feeds the procedure with what the gait says, and sends its commands.

    The callbacks raise what the procedure raises; `rclpy.spin_once` passes it on.

    Attributes:
        procedure: What is fed.
        robot: Name of the robot; empty before the first report of the gait.
        problem: Why the gait has no usable measurement; empty if it has.
        heard: Wall time [s] of the last odometry; None before the first.
    """

    def __init__(self, node: "Node", procedure: Procedure) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from nav_msgs.msg import Odometry
        from rclpy.qos import qos_profile_sensor_data
        from std_msgs.msg import String

        from robot_core.ros.topics import LATCHED

        self.robot = self.problem = ""
        self.heard: float | None = None
        self._node = node
        self.procedure = procedure
        self._velocity: VelocityPublisher | None = None
        self._next_command = 0.0
        self._namespace = node.get_namespace()
        self._report = f"{self._namespace}/gait: {CALIBRATION}".lstrip("/")
        node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)
        node.create_subscription(Odometry, "odom", self._on_odometry, qos_profile_sensor_data)
        node.create_subscription(String, "gait/support", self._on_state, LATCHED)

    def prepare_commands(self) -> bool:
        """Publish `cmd_vel` as the gait expects it, once the gait is seen there."""
        from nao_lipm_gait.ros.messages import twist_input

        name = self._node.resolve_topic_name("cmd_vel")
        for reader in self._node.get_subscriptions_info_by_topic(name):
            if reader.node_name == "gait" and reader.node_namespace == self._namespace:
                stamped = reader.topic_type.endswith("/TwistStamped")
                self._velocity = VelocityPublisher(self._node, stamped=stamped)

                def receive(message: Any) -> None:
                    self.procedure.see_command(read_velocity(twist_input(message)))

                self._node.create_subscription(self._velocity.message_type, name, receive, 10)
                return True
        return False

    def watch_joints(self, robot: RobotDescription) -> None:
        """Let the procedure have joint angles and accelerometer, too."""
        from rclpy.qos import qos_profile_sensor_data
        from sensor_msgs.msg import Imu, JointState

        force: list[FloatArray] = []

        def take_force(message: Any) -> None:
            a = message.linear_acceleration
            force[:] = [np.array((a.x, a.y, a.z))]

        def take_joints(message: Any) -> None:
            angles = dict(zip(message.name, message.position, strict=False))
            position = np.array([angles.get(name, np.nan) for name in robot.joint_names])
            measured = self.procedure.measured
            if force and measured is not None and np.isfinite((*position, *force[0])).all():
                zeros = Calibration(joint_zero=measured.joint_zero)
                position = SensorCorrection(robot, zeros).for_model(position)
                self.procedure.see_sensors(position, force[0])

        qos = qos_profile_sensor_data
        self._node.create_subscription(Imu, "imu/data", take_force, qos)
        self._node.create_subscription(JointState, "joint_states", take_joints, qos)

    def stop(self) -> None:
        """Command a stop, if anything was commanded."""
        if self._velocity is not None and self.procedure.command is not None:
            self._velocity.stop()

    def _on_diagnostics(self, message: Any) -> None:
        for status in message.status:
            if status.name == self._report:
                self.robot = status.hardware_id
                self.problem = "" if status.values else status.message
                if status.values and self.heard is not None:
                    values = {each.key: each.value for each in status.values}
                    stamp = _seconds(message.header.stamp)
                    self.procedure.see_measurement(stamp, Measurement.read(values))

    def _on_odometry(self, message: Any) -> None:
        self.heard = time.monotonic()
        now, place = _seconds(message.header.stamp), message.pose.pose.position
        self.procedure.see_odometry(now, place.x, place.y)
        command = self.procedure.command
        if self._velocity is not None and command is not None and now >= self._next_command:
            self._next_command = now + COMMAND_PERIOD
            self._velocity.publish(command)

    def _on_state(self, message: Any) -> None:
        self.procedure.see_state(message.data)


def _seconds(stamp: Any) -> float:
    return float(stamp.sec + 1e-9 * stamp.nanosec)


def command(out: Path, namespace: str, zeros: bool, say: Callable[[str], None]) -> int:
    """Calibrate, and say in one line why if it fails; the exit status."""
    try:
        run(out, namespace=namespace, zeros=zeros, say=say)
    except CalibrationError as error:
        sys.stderr.write(f"nao_gait calibrate: {error}; nothing was written\n")
        return EXIT_FAILED
    return EXIT_OK


def run(
    out: Path, *, namespace: str = "", zeros: bool = False, say: Callable[[str], None] = print
) -> None:
    """Calibrate the running robot and write a file.

    Args:
        out: The file to write.
        namespace: Namespace of the robot; "" for none.
        zeros: Look for leg joints with a wrong zero, in several poses.
        say: Prints a line.

    Raises:
        NaoGaitError: If the file cannot be written, if no gait answers, or if it does not measure.
        CalibrationError: If the robot was not calibrated.
        KeyboardInterrupt: If the user interrupts.
    """
    with ros_node("nao_gait_calibrate", namespace) as node, stop_on_signal() as stop:
        posing = _Posing(node, stop) if zeros else None
        procedure = Procedure(posing.poses if posing else ())
        client = _RobotClient(node, procedure)
        try:
            _find_gait(node, client, stop)
            if posing is not None:
                client.watch_joints(posing.robot)
            _carry_out(node, client, stop, say, posing)
        finally:
            client.stop()
            if posing is not None and not posing.restored():
                say("the gait has not taken its parameters back: start it again")
        measured = procedure.level
        if measured is None:
            raise CalibrationError("nothing was measured")
        calibration = measured.calibration if posing is None else _judge(posing, procedure, say)
    file = CalibrationFile(
        robot=client.robot,
        date=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
        calibration=calibration,
        deviation=Deviation(measured.sole_pitch_deviation, measured.sole_roll_deviation),
    )
    write_text(out, file.as_yaml(), "out")
    say(f"wrote {out}; use it by: gait --ros-args -p calibration:={out}")


def _find_gait(node: "Node", client: _RobotClient, stop: StopRequest) -> None:
    """Wait for the messages of a gait that has sensors."""
    for found, what, allowed in (
        (lambda: client.robot, "gait", "a running gait (`gait`), in this namespace and domain"),
        (client.prepare_commands, "gait's cmd_vel", "a subscriber of cmd_vel"),
        (lambda: client.heard, "odom", "a gait with sensors: a running robot (`sim_bridge`)"),
    ):
        deadline = time.monotonic() + ANSWER
        while not found():
            _spin(node, stop)
            if time.monotonic() > deadline:
                raise NaoGaitError(what, "nothing", allowed)


class GaitParameters:
    """Reads and sets parameters of the node `gait` of a namespace.

    Args:
        node: The node of the command.
        spin: Lets the node take what has come; it may raise what ends the command.
    """

    def __init__(self, node: "Node", spin: Callable[[], None]) -> None:
        from rclpy.parameter_client import AsyncParameterClient

        self._client = AsyncParameterClient(node, "gait")
        self._spin = spin

    def read(self, names: Sequence[str]) -> list[float | str]:
        """Numbers and texts by name; NaoGaitError if the gait does not answer."""
        from rclpy.parameter import parameter_value_to_python

        answer = self._ask(lambda: self._client.get_parameters(list(names)))
        return [parameter_value_to_python(value) for value in answer.values]

    def write(self, values: Mapping[str, float]) -> None:
        """Set numbers; NaoGaitError if the gait refuses them, or does not answer."""
        from rclpy.parameter import Parameter

        changed = [Parameter(name, value=value) for name, value in values.items()]
        result = self._ask(lambda: self._client.set_parameters_atomically(changed)).result
        if not result.successful:
            raise NaoGaitError("parameters of the gait", dict(values), result.reason)

    def _ask(self, request: Callable[[], Any]) -> Any:
        end, again = time.monotonic() + ANSWER, 0.0
        answers: list[Any] = []
        while time.monotonic() < end:
            if time.monotonic() > again and self._client.services_are_ready():
                again = time.monotonic() + AGAIN
                answers.append(request())
            self._spin()
            done = [answer.result() for answer in answers if answer.done()]
            if done:
                return done[0]
        raise NaoGaitError("parameters of the gait", "nothing", f"an answer within {ANSWER:g} s")


class _Posing:
    """The poses of the running gait.

    Attributes:
        robot: The robot of the gait.
        poses: Its parameters in each pose.
    """

    def __init__(self, node: "Node", stop: StopRequest) -> None:
        self._node = node
        self._gait = GaitParameters(node, lambda: _spin(node, stop))
        model, urdf, *values = self._gait.read(("robot", "urdf", *POSED))
        self.robot = load_robot(str(model or urdf))
        if self.robot.soft_joint:
            allowed = "a robot whose motors do not give way"
            raise NaoGaitError("calibrate --zeros", self.robot.name, allowed)
        self._usual = {name: float(value) for name, value in zip(POSED, values, strict=True)}
        self._posed: Mapping[str, float] = self._usual
        self.poses = calibration_poses(self._usual)

    def take(self, pose: Mapping[str, float]) -> None:
        """Give the gait the parameters of a pose, if it does not have them."""
        if pose != self._posed:
            self._posed = pose
            self._gait.write(pose)

    def restored(self) -> bool:
        """Give it back its own, whatever the procedure thinks of it; whether it took them."""

        def spin() -> None:
            with suppress(CalibrationError, NaoGaitError):
                _spin(self._node, None)

        if self._posed != self._usual:
            try:
                GaitParameters(self._node, spin).write(self._usual)
            except NaoGaitError:
                return False
        return True


def _judge(posing: _Posing, procedure: Procedure, say: Callable[[str], None]) -> Calibration:
    """Show how well the zero of each joint explains what was measured; the calibration."""
    found, calibration = procedure.result(posing.robot)
    say("each leg joint, if all others are right: true minus measured angle")
    for each in found:
        zero, sigma = math.degrees(each.zero), math.degrees(each.sigma)
        say(f"  {each.joint:14} {zero:+5.1f} +- {sigma:.1f} deg   evidence {each.evidence:+6.1f}")
    wrong = wrong_zeros(found)
    say(in_words(wrong))
    if len(wrong) == 1:
        say("the file corrects it; better mend it in the robot, and calibrate again")
    return calibration


def _carry_out(
    node: "Node",
    client: _RobotClient,
    stop: StopRequest,
    say: Callable[[str], None],
    posing: _Posing | None,
) -> None:
    """Go through all phases and show each measurement."""
    phase, shown, procedure = Phase.DONE, None, client.procedure
    while procedure.phase is not Phase.DONE:
        _spin(node, stop)
        if client.heard is None or time.monotonic() - client.heard > STALL:
            raise CalibrationError(f"no odometry for {STALL:g} s")
        if client.problem:
            raise CalibrationError(client.problem)
        if posing is not None:
            posing.take(procedure.parameters)
        if procedure.phase is not phase:
            phase = procedure.phase
            say(f"{phase}")
        measured = procedure.measured
        if measured is not None and measured is not shown:
            shown = measured
            if phase is not Phase.STAND:
                say(f"  {procedure.elapsed:4.1f} s  {_in_degrees(measured, phase)}")


def _spin(node: "Node", stop: StopRequest | None) -> None:
    import rclpy

    rclpy.spin_once(node, timeout_sec=0.1)
    if stop:
        raise KeyboardInterrupt


def _in_degrees(measured: Measurement, phase: Phase) -> str:
    """What is measured in a phase."""
    if phase is Phase.STEP:
        pitch, roll = math.degrees(measured.sole_pitch), math.degrees(measured.sole_roll)
        pitch_deviation = math.degrees(measured.sole_pitch_deviation)
        roll_deviation = math.degrees(measured.sole_roll_deviation)
        return (
            f"left sole relative to the right one: pitch {pitch:+.2f} +- {pitch_deviation:.2f}, "
            f"roll {roll:+.2f} +- {roll_deviation:.2f} deg"
        )
    pitch, roll = math.degrees(measured.imu_pitch), math.degrees(measured.imu_roll)
    bias = ", ".join(
        f"{math.degrees(each):+.2f}"
        for each in (measured.gyro_bias_x, measured.gyro_bias_y, measured.gyro_bias_z)
    )
    return f"IMU: pitch {pitch:+.2f}, roll {roll:+.2f} deg; gyro bias {bias} deg/s"
