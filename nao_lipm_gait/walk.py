"""What a walk is to the gait, so that another walk can take the pendulum walk's place."""

from typing import NamedTuple, Protocol

from nao_lipm_gait.signals import Point3, Pose2, VelocityCommand


class SoleTarget(NamedTuple):
    """Wanted pose of a sole in Q: the point under the ankle axes, and its angles."""

    x: float
    y: float
    z: float
    """[m] above the ground."""
    yaw: float
    pitch: float = 0.0
    roll: float = 0.0


class BodyTargets(NamedTuple):
    """Where the body shall be at the time the command takes effect."""

    com_in_q: Point3
    left_sole: SoleTarget
    right_sole: SoleTarget
    torso_roll: float
    torso_pitch: float
    q_in_odom: Pose2
    """Where the walk believes its Q to be; only differences of it mean anything."""


class Expectation(NamedTuple):
    """What the walk expects at the time of the measurement."""

    support: int
    """+1 left, -1 right."""
    com_in_q: tuple[float, float]
    sole_in_q: Pose2
    """The sole that the measured CoM is to be referred to."""


class Walk(Protocol):
    """One gait tick is expect -> observe -> plan."""

    def start(self, command: VelocityCommand) -> None:
        """Begin from a stand with the CoM at rest in the middle of Q."""

    def expect(self) -> Expectation:
        """Move on by one control period and say what should be measured now."""

    def observe(self, measured_x: float, measured_y: float) -> None:
        """Correct the walk by the measured CoM in Q [m]."""

    def plan(self, command: VelocityCommand) -> BodyTargets:
        """Targets for the time at which a command sent now takes effect."""

    @property
    def finished(self) -> bool:
        """True once a stop has brought the CoM to rest between the feet."""
