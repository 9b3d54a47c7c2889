"""What behaviour sees of the world: one frozen `WorldState` per update.

Frames: base_footprint is the ground between the soles (REP-120), x forward. `field` has its origin
in the centre of the field and x towards the opponents' goal, for either team. Both have y to the
left. Everything holds at the time of the state.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from nao_soccer.vision.percepts import Covariance2
from robot_core.types import Point2, Pose2, PoseCovariance

IMAGE_AGE_MAX = 2.0
"""[s] without images, after which a robot is blind."""
SIGHT_AGE_MAX = 15.0
"""[s] after which a robot that sees nothing in its images is blind: longer than the turn in which
it searches the ball, and which shows it the field."""


class HeadMode(StrEnum):
    """What the head looks for; the body does not matter.

    Attributes:
        AUTO: Ball and landmarks in turn, whichever is known less well.
        BALL: Follow the ball; search if it is not known where it is.
        LOCALIZE: Look at the landmarks that improve the own pose most.
        AHEAD: Look ahead and to both sides, and at robots near by, to know where others are.
        SCAN: Look to the right, near and far in turn: a robot that turns there sees all ground.
        FREE: The gait controls the head.
    """

    AUTO = "auto"
    BALL = "ball"
    LOCALIZE = "localize"
    AHEAD = "ahead"
    SCAN = "scan"
    FREE = "free"


@dataclass(frozen=True, slots=True)
class PoseEstimate:
    """The own pose, of base_footprint in `field`.

    Attributes:
        pose: x, y [m], yaw [rad] in (-pi, pi].
        covariance: Of x, y [m] and yaw [rad].
        valid: The covariance describes the error; decisions may depend on the pose.
    """

    pose: Pose2
    covariance: PoseCovariance
    valid: bool


@dataclass(frozen=True, slots=True)
class BallEstimate:
    """The ball.

    Attributes:
        position: Its centre [m] in base_footprint.
        velocity: [m/s] over the ground, along the axes of base_footprint.
        position_covariance: [m^2] in base_footprint.
        position_in_field: [m] in `field`, by the own pose.
        velocity_in_field: [m/s] in `field`.
        position_covariance_in_field: [m^2] in `field`; includes that of the own pose.
        velocity_covariance_in_field: [m^2/s^2] in `field`.
        age: [s] since this robot or a team mate saw it.
        seen_recently: This robot saw it a short time ago, and has not missed it since.
    """

    position: Point2
    velocity: Point2
    position_covariance: Covariance2
    position_in_field: Point2
    velocity_in_field: Point2
    position_covariance_in_field: Covariance2
    velocity_covariance_in_field: Covariance2
    age: float
    seen_recently: bool
    by_team: bool = False


@dataclass(frozen=True, slots=True)
class Obstacle:
    """Another robot.

    Attributes:
        position: [m] in base_footprint.
        position_in_field: [m] in `field`.
        covariance: [m^2] in base_footprint.
        velocity: [m/s] over the ground, along the axes of base_footprint.
        team: `red` or `blue`; None if the colour is not known.
        age: [s] since this robot or a team mate saw it.
        by_team: Only a team mate told of it.
    """

    position: Point2
    position_in_field: Point2
    covariance: Covariance2
    velocity: Point2
    team: str | None
    fallen: bool
    age: float
    by_team: bool = False


@dataclass(frozen=True, slots=True)
class TeamBall:
    """The ball as a team mate saw it with its own cameras.

    Attributes:
        position: [m] in `field`.
        velocity: [m/s] in `field`.
        covariance: Of the position [m^2] in `field`.
        age: [s] since the team mate saw it, when it told of it.
    """

    position: Point2
    velocity: Point2
    covariance: Covariance2
    age: float


class TeamRobot(NamedTuple):
    """Another robot as a team mate saw it with its own cameras.

    Attributes:
        position: [m] in `field`.
        age: [s] since the team mate saw it, when it told of it.
        mate: It has the colour of the own team.
    """

    position: Point2
    age: float
    mate: bool = False


@dataclass(frozen=True, slots=True)
class TeamMate:
    """What a team mate told of itself. The reader of team messages makes these.

    Attributes:
        number: Of the player.
        stamp: Time [ns] of what it told, on this robot's clock.
        pose: Its pose in `field`.
        valid: Its pose estimate is valid.
        fallen: It lies on the ground or gets up.
        ball: The ball that it has seen itself; None if it has not.
        robots: The robots that it has seen itself.
    """

    number: int
    stamp: int
    pose: Pose2
    valid: bool
    fallen: bool = False
    ball: TeamBall | None = None
    robots: tuple[TeamRobot, ...] = ()


@dataclass(frozen=True, slots=True)
class WorldState:
    """Everything that decisions depend on, at one time.

    Attributes:
        stamp: Time [ns].
        own: The own pose.
        ball: The ball; None if nothing is known of it.
        obstacles: Other robots, the nearest first.
        mates: Team mates who spoke recently, by their numbers.
        upright: This robot stands or walks: it has not fallen and does not get up.
        ball_from_self: The ball as this robot has seen it, for team messages; None if it has not.
            It holds nothing that team mates have told.
        image_age: [s] since the newest image whose percepts could be used.
        sight_age: [s] of being upright since anything at all was seen in an image.
    """

    stamp: int
    own: PoseEstimate
    ball: BallEstimate | None
    obstacles: tuple[Obstacle, ...] = ()
    mates: tuple[TeamMate, ...] = ()
    upright: bool = True
    ball_from_self: TeamBall | None = None
    image_age: float = 0.0
    sight_age: float = 0.0

    @property
    def blind(self) -> bool:
        """The robot does not see where it walks."""
        return self.image_age > IMAGE_AGE_MAX or self.sight_age > SIGHT_AGE_MAX
