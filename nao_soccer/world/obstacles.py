"""Other robots: tracked in the robot's plane, with their team, forgotten when they are not seen."""

import math

import numpy as np

from nao_soccer.vision.percepts import ROBOT_OF, Percept
from nao_soccer.world.odometry import Displacement
from nao_soccer.world.planar_track import PlanarTrack, inside
from robot_core.types import FloatArray, Point2

SPEED = 0.3
"""[m/s] Deviation of the velocity of a robot that was seen once."""
ACCELERATION = 0.2
"""[m/s/s^0.5] Unknown changes of the velocity of a robot that walks."""
DAMPING = 0.7
"""[s] Time constant by which a velocity fades that is not seen."""
NOISE_MIN = 0.05
"""[m] Least deviation of a measurement: the middle of a robot is not well defined."""
GATE = 9.0
"""Squared standard deviations up to which a measurement is of a known robot."""
NEAR = 0.25
"""[m] Measurements that are nearer to a robot than this are always of it."""
FORGET = 8.0
"""[s] Time without a sighting after which a robot is forgotten. One beside this robot is out of the
image for so long."""
MISSES = 6
"""Number of images that should show a robot and do not, after which it is forgotten."""
TORSO_HIDES = 2.2
"""A robot is found by its feet and its torso. The lower edge of that, 0.25 m high, hides the ground
at this many times the robot's distance from a camera 0.46 m high."""
SURE_RANGE = 2.0
"""[m] Distance up to which an image that does not show the robot is a miss."""
CONFIRMED = 2
"""Number of sightings from which on a robot is reported."""
TEAMS = {kind: team for team, kind in ROBOT_OF.items()}


class ObstacleTrack:
    """One robot.

    Attributes:
        age: [s] since it was seen.
        missed: Number of images since the last one that should have shown it.
    """

    def __init__(self, percept: Percept) -> None:
        self.track = PlanarTrack.at(percept.position, _noise(percept), SPEED)
        self.age, self.seen, self.missed = 0.0, 1, 0
        self._votes = {team: 0.0 for team in TEAMS.values()}
        self._vote(percept)

    def _vote(self, percept: Percept) -> None:
        team = TEAMS.get(percept.kind)
        for name in self._votes:
            self._votes[name] = 0.9 * self._votes[name] + (name == team)

    @property
    def team(self) -> str | None:
        """The team by most of the sightings."""
        (most, name), (least, _) = sorted(((n, t) for t, n in self._votes.items()), reverse=True)
        return name if most > least else None

    def see(self, percept: Percept) -> None:
        """Use a sighting."""
        self.track.correct(percept.position, _noise(percept))
        self._vote(percept)
        self.age, self.missed = 0.0, 0
        self.seen += 1

    def distance(self, percept: Percept) -> float:
        """Squared standard deviations of a sighting from this robot; infinite if it is another."""
        apart = math.dist(percept.position, self.track.mean[:2])
        square, _ = self.track.innovation(percept.position, _noise(percept))
        return square if square < GATE or apart < NEAR else math.inf


class ObstacleFilter:
    """All other robots that were seen lately."""

    def __init__(self) -> None:
        self._tracks: list[ObstacleTrack] = []

    @property
    def robots(self) -> tuple[ObstacleTrack, ...]:
        """Those that were seen more than once."""
        return tuple(each for each in self._tracks if each.seen >= CONFIRMED)

    def forget(self) -> None:
        """Forget everything."""
        self._tracks.clear()

    def advance(self, motion: Displacement, dt: float) -> None:
        """Carry all robots through a motion of the own one and a time [s]."""
        for each in self._tracks:
            each.track.carry(motion)
            each.track.predict(dt, math.exp(-dt / DAMPING), ACCELERATION)
            each.age += dt
        self._tracks = [each for each in self._tracks if each.age < FORGET]

    def see(self, percepts: tuple[Percept, ...], visible: FloatArray) -> None:
        """Use the robots of one image; `visible` (k, 2) [m] is the ground that it shows."""
        left = list(self._tracks)
        for percept in percepts:
            distances = [each.distance(percept) for each in left]
            best = int(np.argmin(distances)) if distances else -1
            if best >= 0 and math.isfinite(distances[best]):
                left.pop(best).see(percept)
            else:
                self._tracks.append(ObstacleTrack(percept))
        for each in left:
            place = each.track.mean[:2]
            whole = inside(visible, place, 0.15) and inside(visible, TORSO_HIDES * place, 0.15)
            if whole and float(np.hypot(*place)) < SURE_RANGE:
                each.missed += 1
        self._tracks = [each for each in self._tracks if each.missed < MISSES]


def _noise(percept: Percept) -> tuple[float, float, float]:
    xx, xy, yy = percept.covariance
    return xx + NOISE_MIN**2, xy, yy + NOISE_MIN**2


def near(place: Point2, places: list[Point2], limit: float) -> bool:
    """Whether one of some places is nearer than a limit [m]."""
    return any(math.dist(place, each) < limit for each in places)
