"""What a walk is to the gait, so that another walk can take the pendulum walk's place."""

from typing import NamedTuple, Protocol

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.types import Point3, Pose2, VelocityCommand


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

    def posed(self, com_in_q: Point3, torso_pitch: float) -> "BodyTargets":
        """The same with another CoM and pitch."""
        left, right, roll = self.left_sole, self.right_sole, self.torso_roll
        return BodyTargets(com_in_q, left, right, roll, torso_pitch, self.q_in_odom)


class Expectation(NamedTuple):
    """What the walk expects at the time of the measurement."""

    support: int
    """+1 left, -1 right."""
    com_in_q: tuple[float, float]
    sole_in_q: Pose2
    """The sole that the measured CoM is to be referred to."""


class WalkView(Protocol):
    """Where a walk is at some time, for those who watch it."""

    @property
    def support(self) -> int:
        """+1 left, -1 right."""

    @property
    def x(self) -> float:
        """CoM in Q [m]."""

    @property
    def y(self) -> float: ...

    @property
    def sole_in_q(self) -> Pose2:
        """The sole of the supporting foot."""

    @property
    def q_in_odom(self) -> Pose2:
        """Where the walk believes its Q to be; only differences of it mean anything."""

    @property
    def step_count(self) -> int:
        """Support changes since the walk began."""


class Walk(Protocol):
    """One gait tick is expect -> observe -> plan.

    Made by `walks.make_walk`, standing. Three times matter: what is measured now (`expected`, and
    corrected by the measurement `estimated`) was commanded a delay ago; what is commanded now takes
    effect later (`predicted`).
    """

    def stand_at(self, q_in_odom: Pose2) -> None:
        """Forget all motion: both feet side by side, the CoM at rest between them."""

    def set_parameters(self, parameters: GaitParameters) -> None:
        """New parameters between two ticks; `walk` and the delay are fixed at construction."""

    def start(self, command: VelocityCommand) -> None:
        """Begin from a stand with the CoM at rest in the middle of Q."""

    def catch(self, x: float, y: float, vx: float, vy: float) -> None:
        """Step out of a stand whose CoM tips; x, y [m], vx, vy [m/s]: its state in Q."""

    def expect(self) -> Expectation:
        """Move on by one control period and say what should be measured now."""

    def observe(
        self, measured_x: float, measured_y: float, acceleration: tuple[float, float] | None = None
    ) -> None:
        """Correct the walk by the measured CoM in Q [m]; acceleration: the torso's, x and y
        in Q over the last tick [m/s^2], None = not looked at.
        """

    def plan(self, command: VelocityCommand) -> BodyTargets:
        """Targets for the time at which a command sent now takes effect."""

    @property
    def finished(self) -> bool:
        """True once a stop has brought the CoM to rest between the feet."""

    @property
    def stopping(self) -> bool:
        """Both feet stay on the ground from now on."""

    @property
    def expected(self) -> WalkView:
        """Before the correction, at the time of the measurement."""

    @property
    def estimated(self) -> WalkView:
        """After it."""

    @property
    def predicted(self) -> WalkView:
        """At the time at which the targets of the last plan take effect."""

    @property
    def origin_in_q(self) -> tuple[float, float]:
        """Where the walk wants the ground to push: pendulum origin or ZMP [m]."""

    @property
    def step_size(self) -> Pose2:
        """The pose of the next Q in this one."""

    @property
    def reserve(self) -> float:
        """The share of the step limits that the stride does not use."""

    @property
    def time_left(self) -> float:
        """[s] until the support changes."""
