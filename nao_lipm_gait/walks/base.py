"""The interface of a walk engine: what the gait calls, and what it gets back."""

from collections.abc import Callable
from typing import Protocol, final

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.walk_engines import WALKS, load_class
from nao_lipm_gait.walks.lipm.com_observer import ComObserver
from nao_lipm_gait.walks.lipm.parameters import LipmParameters
from robot_core.errors import NaoGaitError
from robot_core.types import LEFT, Point3, Pose2, VelocityCommand


@final
class SoleTarget:
    """Target pose of a sole in Q; its reference point is below the ankle axes.

    Attributes:
        x: Forward [m].
        y: To the left [m].
        z: Height above the ground [m].
        yaw: Rotation about the vertical [rad].
        pitch: Pitch [rad]; positive lowers the toes.
        roll: Roll [rad].
    """

    __slots__ = ("pitch", "roll", "x", "y", "yaw", "z")

    def __init__(
        self,
        x: float,
        y: float,
        z: float,
        yaw: float,
        pitch: float = 0.0,
        roll: float = 0.0,
    ):
        self.x = x
        self.y = y
        self.z = z
        self.yaw = yaw
        self.pitch = pitch
        self.roll = roll


@final
class BodyTargets:
    """Targets for the body at the time when the command takes effect.

    Attributes:
        com_in_q: CoM in Q [m]; z is its height above the ground.
        left_sole: Left sole in Q.
        right_sole: Right sole in Q.
        torso_pitch: Pitch of the torso against gravity [rad]; its roll is 0.
        q_in_odom: Pose of Q by the planned steps; only differences of it are meaningful.
        torso_yaw: Turn of the torso ahead of the mean of both soles [rad]; hips that share a yaw
            joint leave no choice, and it counts as 0.
    """

    __slots__ = ("com_in_q", "left_sole", "q_in_odom", "right_sole", "torso_pitch", "torso_yaw")

    def __init__(
        self,
        com_in_q: Point3,
        left_sole: SoleTarget,
        right_sole: SoleTarget,
        torso_pitch: float,
        q_in_odom: Pose2,
        torso_yaw: float = 0.0,
    ):
        self.com_in_q = com_in_q
        self.left_sole = left_sole
        self.right_sole = right_sole
        self.torso_pitch = torso_pitch
        self.q_in_odom = q_in_odom
        self.torso_yaw = torso_yaw

    def posed(self, com_in_q: Point3, torso_pitch: float) -> "BodyTargets":
        """The same targets with another CoM [m] and torso pitch [rad]."""
        left, right = self.left_sole, self.right_sole
        return BodyTargets(com_in_q, left, right, torso_pitch, self.q_in_odom, self.torso_yaw)

    def on_soles(
        self, com_in_q: Point3, left_sole: SoleTarget, right_sole: SoleTarget
    ) -> "BodyTargets":
        """The same targets with another CoM [m] and other soles."""
        return BodyTargets(
            com_in_q, left_sole, right_sole, self.torso_pitch, self.q_in_odom, self.torso_yaw
        )


@final
class Expectation:
    """The state that the walk expects at the time of the measurement.

    Attributes:
        com_in_q: Expected CoM, x and y in Q [m].
        sole_in_q: Pose of the supporting sole in Q; the measured CoM refers to it.
        wanted_step: Size of the last step before feedback changed it.
    """

    __slots__ = ("com_in_q", "sole_in_q", "support", "wanted_step")

    def __init__(
        self, support: int, com_in_q: tuple[float, float], sole_in_q: Pose2, wanted_step: Pose2
    ):
        self.support = support
        self.com_in_q = com_in_q
        self.sole_in_q = sole_in_q
        self.wanted_step = wanted_step


class WalkView(Protocol):
    """State of a walk at some time, for status and diagnostics."""

    @property
    def support(self) -> int:
        """Supporting leg, LEFT or RIGHT."""

    @property
    def x(self) -> float:
        """CoM in Q, forward [m]."""

    @property
    def y(self) -> float:
        """CoM in Q, to the left [m]."""

    @property
    def sole_in_q(self) -> Pose2:
        """Pose of the supporting sole in Q."""

    @property
    def q_in_odom(self) -> Pose2:
        """Pose of Q by the planned steps; only differences of it are meaningful."""

    @property
    def step_count(self) -> int:
        """Number of support changes since the walk started."""


class Walk(Protocol):
    """A walk engine. One tick calls `expect`, `observe` and `plan`, in this order.

    Three times matter. The state measured now was commanded one delay ago (`expected`; corrected by
    the measurement: `estimated`). The targets sent now take effect one delay later (`predicted`).
    A delay that grows is bridged by more calls of `plan` than of `expect`, one that shrinks by
    fewer.

    Attributes:
        delay_ticks: The delay in control periods, with which the next stand or walk begins.
        hip_lag: How much longer the hips lag behind their targets than the knees [s]; None while it
            is not known.
    """

    delay_ticks: int
    hip_lag: float | None

    @property
    def watches_hips(self) -> bool:
        """Whether `hip_lag` changes the walk."""

    def stand_at(self, q_in_odom: Pose2) -> None:
        """Reset to a stand: both feet side by side, the CoM at rest between them."""

    def set_parameters(self, parameters: GaitParameters) -> None:
        """Use new parameters from the next `plan` on; the engine stays, and so does its delay."""

    def start(self, command: VelocityCommand, inward: float = 0.0) -> None:
        """Start to walk from a stand.

        Args:
            command: Its direction chooses the foot that steps first.
            inward: How much closer to the middle than in the stand each sole is [m].
        """

    def catch(self, x: float, y: float, vx: float, vy: float) -> None:
        """Start to step from a stand whose CoM tips over.

        Args:
            x: CoM in Q, forward [m].
            y: CoM in Q, to the left [m].
            vx: Its velocity, forward [m/s].
            vy: Its velocity, to the left [m/s].
        """

    def expect(self) -> Expectation:
        """Advance by one control period; returns the state expected at the measurement."""

    def observe(
        self, measured_x: float, measured_y: float, acceleration: tuple[float, float] | None = None
    ) -> None:
        """Correct the walk by a measurement.

        Args:
            measured_x: Measured CoM in Q, forward [m].
            measured_y: Measured CoM in Q, to the left [m].
            acceleration: Acceleration of the torso along x and y of Q over the last tick [m/s^2];
                None if it is not used.
        """

    def plan(self, command: VelocityCommand, *, sent: bool = True) -> BodyTargets:
        """Plan one control period more.

        Args:
            command: Commanded velocity.
            sent: The prediction assumes that the joints follow the targets; otherwise that they
                hold the last ones. Also true for periods whose frame was lost, which are corrected
                by the next measurement as usual.

        Returns:
            Targets for the time at which a command sent now takes effect.
        """

    def lengthen(self, ahead: float) -> None:
        """Land the foot that swings farther ahead [m], as far as the walk can; this step alone."""

    def replan(self) -> BodyTargets:
        """The targets of the last `plan` again, by what has been measured since."""

    @property
    def finished(self) -> bool:
        """Whether a stop has brought the CoM to rest between the feet."""

    @property
    def stopping(self) -> bool:
        """Whether both feet stay on the ground from now on."""

    @property
    def expected(self) -> WalkView:
        """State at the time of the measurement, before the correction."""

    @property
    def estimated(self) -> WalkView:
        """State at the time of the measurement, after the correction."""

    @property
    def predicted(self) -> WalkView:
        """State at the time when the targets of the last `plan` take effect."""

    @property
    def origin_in_q(self) -> tuple[float, float]:
        """Pendulum origin or desired ZMP, x and y in Q [m]."""

    @property
    def com_ahead(self) -> float:
        """By how much the CoM is ahead of its targets on average [m].

        As far as motors that give way shall have torque for it.
        """

    @property
    def step_size(self) -> Pose2:
        """Pose of the next Q in the current one."""

    @property
    def reserve(self) -> float:
        """Share of the step limits that the current stride leaves unused, 0 to 1."""

    @property
    def time_left(self) -> float:
        """Time until the next support change [s]; 0 in a stand."""


MakeObserver = Callable[[LipmParameters], ComObserver]
"""Makes a CoM observer from the parameters of the gait."""


def make_walk(
    parameters: GaitParameters, control_period: float, make_observer: MakeObserver | None = None
) -> Walk:
    """The walk engine that the parameter `walk` names, in a stand.

    Args:
        parameters: Parameters of the gait.
        control_period: Time between two ticks [s].
        make_observer: Makes its CoM observer; None = its own.

    Returns:
        The engine; see `nao_lipm_gait.walk_engines`.

    Raises:
        NaoGaitError: There is no such engine, or it has no CoM observer.
    """
    if parameters.walk not in WALKS:
        raise NaoGaitError("walk", parameters.walk, WALKS)
    if make_observer is not None and parameters.walk != "lipm":
        raise NaoGaitError("make_observer", parameters.walk, "an observer only with walk: lipm")
    given = () if make_observer is None else (make_observer,)
    walk: Walk = load_class(WALKS[parameters.walk].engine)(parameters, control_period, *given)
    return walk


def body_targets(
    support: int,
    com_in_q: Point3,
    support_sole: Pose2,
    swing_sole: SoleTarget,
    parameters: GaitParameters,
    q_in_odom: Pose2,
    torso_yaw: float = 0.0,
) -> BodyTargets:
    """Targets of one tick of a walk, with the soles sorted by side.

    Args:
        support: Supporting leg, LEFT or RIGHT.
        com_in_q: CoM in Q [m].
        support_sole: Pose of the supporting sole in Q; it is flat on the ground.
        swing_sole: The other sole in Q.
        parameters: Parameters of the gait.
        q_in_odom: Pose of Q by the planned steps.
        torso_yaw: Turn of the torso ahead of the mean of both soles [rad].

    Returns:
        The targets.
    """
    standing = SoleTarget(support_sole[0], support_sole[1], 0.0, support_sole[2])
    left, right = (standing, swing_sole) if support == LEFT else (swing_sole, standing)
    return BodyTargets(com_in_q, left, right, parameters.torso_pitch, q_in_odom, torso_yaw)
