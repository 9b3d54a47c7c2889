"""Faults of the robot's motors and of its contact with the floor."""

import numpy as np

from gait_lab.faults.harness import Fault, Harness, TemporaryFault
from robot_core.geometry import rotation_matrix
from robot_core.robot import RobotDescription
from robot_core.types import GRAVITY


def motor_of(robot: RobotDescription, number: int) -> str:
    """Return a leg joint that has its own motor; `number` selects one, modulo their count."""
    followers = {follower for _, follower in robot.coupled_joints}
    driven = [name for name in robot.leg_joints if name not in followers]
    return driven[number % len(driven)]


class WeakMotor(Fault):
    """A leg motor gives 20 to 80 % of its torque from now on."""

    why = "a leg can no longer carry the load of a step."
    share = (0.2, 0.8)

    def _draw(self, random: np.random.Generator) -> None:
        self._leg_joint = int(random.integers(12))
        self._share = float(random.uniform(*self.share))
        self._done = False

    def before_physics(self, harness: Harness) -> None:
        """Weaken the motor once."""
        if self.active(harness) and not self._done:
            self._done = True
            harness.world.robot.weaken(motor_of(harness.robot, self._leg_joint), self._share)


class LimpMotor(WeakMotor):
    """A leg motor loses its stiffness from now on."""

    why = "a leg with a limp joint cannot carry the robot."
    share = (0.0, 0.0)


class SlipperyPatch(TemporaryFault):
    """Friction 0.05 to 0.3 under both soles for 0.2 to 2 s."""

    why = "the soles slip."
    span = (0.2, 2.0)

    def _draw(self, random: np.random.Generator) -> None:
        self._friction = float(random.uniform(0.05, 0.3))
        self._slippery = False

    def before_physics(self, harness: Harness) -> None:
        """Set the friction when it changes."""
        slippery = self.active(harness)
        if slippery != self._slippery:
            self._slippery = slippery
            harness.world.robot.set_friction(self._friction if slippery else None)


class PickedUp(TemporaryFault):
    """Lifted by the torso, held in the air for 1 to 3 s, put down gently."""

    why = "it is put down tilted, and rocks while it settles into its stand."
    span = (1.0, 3.0)
    end = 9.0
    LIFT = 0.08
    """[m] above the floor."""
    RAMP = 0.5
    """[s] of lifting, and of putting down."""

    def _draw(self, random: np.random.Generator) -> None:
        self._start: np.ndarray | None = None

    def before_physics(self, harness: Harness) -> None:
        """Pull the torso towards its height with a spring and a damper."""
        since = harness.seconds() - self.begin
        whole = 2.0 * self.RAMP + self.duration
        if not 0.0 <= since < whole:
            return
        position = np.array(harness.truth.torso_position)
        if self._start is None:
            self._start = position
        share = min(1.0, since / self.RAMP, (whole - since) / self.RAMP)
        wanted = self._start.copy()
        wanted[2] = harness.height + self.LIFT * share
        turn = rotation_matrix(harness.truth.torso_quaternion)
        velocity = turn @ harness.truth.torso_linear_velocity_in_torso
        mass = sum(link.mass for link in harness.world.robot.body.links)
        hold = mass * (150.0 * (wanted - position) - 24.0 * velocity)
        hold[2] += mass * GRAVITY * share
        harness.push_robot(hold)
