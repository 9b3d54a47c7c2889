"""Faults of the robot's body and of the floor."""

import numpy as np

from gait_lab.faults.fault import Fault, Spell
from gait_lab.faults.harness import Harness
from nao_lipm_gait.robot import RobotDescription
from sim_bridge.vectors import rotation_matrix


def motor_of(robot: RobotDescription, number: int) -> str:
    """A joint of the legs with a motor: of two that share one only the leader."""
    followers = {follower for _, follower in robot.coupled_joints}
    legs = (*robot.left_leg.names, *robot.right_leg.names)
    driven = [name for name in legs if name not in followers]
    return driven[number % len(driven)]


class WeakMotor(Fault):
    """A leg motor gets hot and gives 20 to 80 % of its torque."""

    summary = "a leg motor gives 20 to 80 % of its torque from now on"
    why = "a leg no longer carries what the step asks for."
    share = (0.2, 0.8)

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._leg_joint = int(random.integers(12))
        self._share = float(random.uniform(*self.share))
        self._done = False

    def act(self, stage: Harness) -> None:
        if self.now(stage) and not self._done:
            self._done = True
            stage.simulation.weaken(motor_of(stage.robot, self._leg_joint), self._share)


class LimpMotor(WeakMotor):
    """A leg motor loses its stiffness altogether."""

    summary = "a leg motor loses its stiffness from now on"
    why = "a leg without a joint does not carry."
    share = (0.0, 0.0)


class SlipperyPatch(Spell):
    """The robot walks over something slippery."""

    summary = "friction 0.05 to 0.3 under both soles for 0.2 to 2 s"
    why = "nothing holds the feet."
    shortest, longest = 0.2, 2.0

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._friction = float(random.uniform(0.05, 0.3))
        self._slippery = False

    def act(self, stage: Harness) -> None:
        slippery = self.now(stage)
        if slippery != self._slippery:
            self._slippery = slippery
            stage.simulation.set_friction(self._friction if slippery else None)


class PickedUp(Spell):
    """Somebody takes the robot by its shoulders, holds it in the air and puts it down again."""

    summary = "picked up by the torso for 1 to 3 s, held in the air, put down gently"
    why = "the steps in the air do not end where the ground is."
    shortest, longest = 1.0, 3.0
    end = 9.0
    LIFT = 0.08
    """[m]"""
    RAMP = 0.5
    """[s] up, and down."""

    def __init__(self, random: np.random.Generator) -> None:
        super().__init__(random)
        self._place: np.ndarray | None = None

    def act(self, stage: Harness) -> None:
        since = stage.seconds() - self.begin
        whole = 2.0 * self.RAMP + self.duration
        if not 0.0 <= since < whole:
            return
        position = np.array(stage.truth.torso_position)
        if self._place is None:
            self._place = position
        share = min(1.0, since / self.RAMP, (whole - since) / self.RAMP)
        wanted = self._place.copy()
        wanted[2] = stage.height + self.LIFT * share
        turn = rotation_matrix(stage.truth.torso_quaternion)
        velocity = turn @ stage.truth.torso_linear_velocity_in_torso
        mass = sum(link.mass for link in stage.simulation.body.links)
        hold = mass * (150.0 * (wanted - position) - 24.0 * velocity)
        hold[2] += mass * 9.81 * share
        stage.disturb_robot(hold)
