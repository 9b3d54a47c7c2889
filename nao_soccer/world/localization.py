"""Where am I: Monte Carlo localisation (Fox, Burgard, Dellaert, Thrun 1999).

Particles live at the time of the last image that was used; odometry carries their estimate on to
the present. Each holds, besides its pose, the error of the camera's tilt: that is the same for
seconds, which images do not average, and moves what is far away most.

A pose and its point reflection at the centre of the field (`mirrored`) look the same. The particles
hold one of the two, by history; the odds that it is the right one are kept beside them, and change
by what team mates tell.
"""

import math

import numpy as np

from nao_soccer.world.field_map import FieldMap
from nao_soccer.world.likelihood import Evidence, log_likelihood, poses_from
from nao_soccer.world.odometry import Displacement
from nao_soccer.world.settings import WorldSettings
from nao_soccer.world.state import PoseEstimate
from robot_core.geometry import compose, wrapped
from robot_core.types import FloatArray, Pose2, PoseCovariance

RESAMPLE_BELOW = 0.5
"""Resample if fewer particles than this share carry the weight."""
ROUGHENING = (0.012, 0.012, 0.008)
"""[m, m, rad] Deviations that are added to each particle when it is drawn."""
CLUSTER = (1.2, 0.3)
"""[deviations of a valid pose, rad] Particles that are nearer than this are in one cluster."""
TILT, TILT_TIME = 0.67, 5.0
"""Share of this error in the deviation that vision states along the line of sight, and its time
constant [s]: a first-order Gauss-Markov process."""
SYSTEMATIC = (0.01, 0.01, 0.01)
"""[m, m, rad] Deviations by errors of base_footprint, map and the camera's pan, which last."""
CENTRES = 20
"""Number of particles, drawn by weight, that are tried as the middle of the heaviest cluster."""
FAST, SLOW = 0.25, 0.02
"""Shares by which the means of the explained evidence follow an image; augmented MCL."""
LOST = 0.75
"""Particles are drawn from the percepts below this share of the usual explained evidence."""
INJECT_MAX = 0.15
"""Largest share of the particles that one image replaces."""
USUAL = 0.75
"""Explained share of the evidence that is usual, at the start."""
USUAL_MIN = 0.55
"""Smallest share that can become usual."""
SAME_HEADING = 0.8
"""[rad] Deviation of a pose that is found again from the last valid one, which odometry has carried
on; it decides between mirror poses. Without a yaw gyro others turn the robot unnoticed."""
SURE = 12.0
"""Largest log-odds of the half of the field; those of a known start."""
CARRIED = 0.005
"""Likelihood that the robot was carried anywhere, against 1 for the same place."""
ONE_PLACE = 0.9
"""Share of the particles in the heaviest cluster, below which a robot may well be elsewhere."""
JUMP = 2.0
"""Squared deviations from the last valid pose from which on the robot was lost."""
FLIP = -2.0
"""Log-odds below which the pose is mirrored."""


_ROUGHENED, _LASTING = np.diag(np.square(ROUGHENING)), np.diag(np.square(SYSTEMATIC))


class Validity:
    """What a valid pose has to fulfil.

    Attributes:
        MASS: Share of the particles in the heaviest cluster.
        HEADING: [rad] Deviation of the heading.
        EXPLAINED: Share of the usual explained evidence.
        IMAGES: Images in a row that fulfil all this before a pose becomes valid again.
        PATIENCE: Images in a row that do not, after which it is not valid any more.
    """

    MASS = 0.7
    HEADING = math.radians(15.0)
    EXPLAINED = 0.8
    ODDS = 2.0
    IMAGES = 15
    PATIENCE = 8


def mirrored(poses: FloatArray) -> FloatArray:
    """Poses (n, 3) turned by half a turn about the centre of the field; they look the same."""
    return np.column_stack((-poses[:, 0], -poses[:, 1], poses[:, 2] + math.pi))


class Localization:
    """The own pose by particles.

    Attributes:
        particles: (n, 3) base_footprint in `field`.
        weights: (n,) their sum is 1.
    """

    def __init__(self, field: FieldMap, settings: WorldSettings) -> None:
        self._field = field
        self._count = settings.particles
        self._random = np.random.default_rng(settings.seed)
        self.particles = np.zeros((self._count, 3))
        self.weights = np.full(self._count, 1.0 / self._count)
        self._mean = np.zeros(3)
        self._covariance = np.eye(3)
        self._deviation = settings.deviation
        self._tilt = self._random_tilt(self._count)
        self._mass = 0.0
        self._odds = 0.0
        self._fast = self._usual = USUAL
        self._good = self._bad = 0
        self._unseen, self._unseen_max = math.inf, settings.unseen
        self._lost = True
        self._named = False  # it has seen landmarks that are known by name
        self._reference: FloatArray
        self.spread()

    # -- starts ------------------------------------------------------------------------------------

    def start(self, poses: tuple[Pose2, ...], place: float = 0.2, heading: float = 0.2) -> None:
        """Begin near known poses, with deviations of place [m] and heading [rad]."""
        base = np.array([poses[i % len(poses)] for i in range(self._count)])
        noise = self._random.standard_normal((self._count, 3)) * (place, place, heading)
        self._begin(base + noise)
        self._odds, self._lost = SURE, False

    def spread(self) -> None:
        """Begin anywhere on the field; which half is not known."""
        low = -np.array((*self._field.half, math.pi))
        self._begin(self._random.uniform(low, -low, (self._count, 3)))
        self._odds, self._lost = 0.0, True
        self._slack, self._followed = (math.inf, math.inf), False

    def disturb(self, place: float, heading: float) -> None:
        """The robot was moved by at most `place` [m] in x and y and `heading` [rad].

        It fell, was carried, or its odometry jumped. The last valid pose stays what decides between
        mirror poses: particles of a robot that was lost before, because it was shoved until it
        fell, may be in the wrong half.
        """
        limit = np.array((place, place, heading))
        here = self._on_our_side(self.particles) if self._lost else self.particles
        reference, (a, b) = self._reference, self._slack
        self._begin(here + self._random.uniform(-limit, limit, (self._count, 3)))
        self._reference = reference
        self._slack = math.hypot(a, place / math.sqrt(3.0)), math.hypot(b, heading / math.sqrt(3.0))
        self._lost, self._followed = True, False

    def _begin(self, particles: FloatArray) -> None:
        self.particles = particles
        self.weights = np.full(self._count, 1.0 / self._count)
        self._follow(_mean(particles, self.weights))
        self._good, self._bad, self._fast = 0, 0, self._usual
        self._find_cluster()

    def _follow(self, pose: FloatArray) -> None:
        """Take a pose (3,) for the last valid one, which odometry carries on without a jump."""
        self._reference, self._followed = pose, True
        self._slack = self._deviation, SAME_HEADING

    def _random_tilt(self, count: int) -> FloatArray:
        """(count,) errors of the tilt, in deviations along the line of sight that vision states."""
        return TILT * self._random.standard_normal(count)

    # -- filter ------------------------------------------------------------------------------------

    def move(self, motion: Displacement, seconds: float) -> None:
        """Move all particles by odometry since the last call, `seconds` [s] ago, and its noise."""
        # The root of the covariance by its eigenvectors: it may be singular, for a robot at rest.
        values, vectors = np.linalg.eigh(motion.covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        noise = self._random.standard_normal((self._count, 3)) @ root.T + motion.offset
        self.particles = _composed(self.particles, noise)
        self._mean = np.array(compose(_pose(self._mean), motion.offset))
        self._covariance = _carried(self._covariance, self._mean[2], motion)
        self._reference = np.array(compose(_pose(self._reference), motion.offset))
        self._unseen += seconds
        keep = math.exp(-max(0.0, seconds) / TILT_TIME)
        fresh = self._random_tilt(self._count)
        self._tilt = keep * self._tilt + math.sqrt(1.0 - keep * keep) * fresh

    def see(self, evidence: Evidence) -> None:
        """Weigh the particles by one image, draw new ones, find the heaviest cluster."""
        if evidence.weight < 1.0:
            return
        logs, explained = log_likelihood(evidence, self.particles, self._field, self._tilt)
        weights = self.weights * np.exp(logs - logs.max())
        self.weights = weights / weights.sum()
        share = float(self.weights @ explained)
        strength = min(1.0, evidence.weight / 4.0)
        self._fast += FAST * strength * (share - self._fast)
        self._inject(evidence)
        if 1.0 / float(self.weights @ self.weights) < RESAMPLE_BELOW * self._count:
            self._resample()
        self._find_cluster()
        self._unseen = 0.0
        good = self._is_good()
        self._good, self._bad = (self._good + 1, 0) if good else (0, self._bad + 1)
        self._compare_with_history()
        if evidence.known:
            self._named = True
            if self._good:  # the mirror pose would show another one there
                self._odds = SURE
        if not self._lost and self._good:
            step = SLOW * strength * (share - self._usual)
            self._usual = max(USUAL_MIN, self._usual + step)

    def _compare_with_history(self) -> None:
        """Notice that the robot is lost, or found again; then judge which half it is in."""
        here = float(self._away(self._mean[None])[0])
        if not self._lost and here > JUMP:
            self._lost = True
        if self._lost and self._good >= Validity.IMAGES:
            there = float(self._away(mirrored(self._mean[None]))[0])
            same, other = (CARRIED + math.exp(-0.5 * each) for each in (here, there))
            self._odds = min(self._odds, max(0.0, math.log(same / other)))
            self._lost = False
        if not self._lost and self._good:
            self._follow(self._mean)

    def _resample(self) -> None:
        """Systematic resampling; the drawn particles are moved a little (roughening)."""
        first = self._random.random()
        drawn = (first + np.arange(self._count)) / self._count
        index = np.searchsorted(np.cumsum(self.weights), drawn).clip(0, self._count - 1)
        noise = self._random.standard_normal((self._count, 3)) * ROUGHENING
        self.particles = self.particles[index] + noise
        self._tilt = self._tilt[index]
        self.weights = np.full(self._count, 1.0 / self._count)

    def _inject(self, evidence: Evidence) -> None:
        """Sensor resetting: the less an image fits, the more particles are drawn from it."""
        missing = 1.0 - self._fast / (LOST * self._usual)
        number = int(self._count * min(INJECT_MAX, max(0.0, missing)))
        if not number:
            return
        poses = poses_from(evidence, self._field)
        if len(poses):
            logs, _ = log_likelihood(evidence, poses, self._field)
            share = np.exp(logs - logs.max())
            if evidence.known:  # one of them fits from all sides
                share *= CARRIED + np.exp(-0.5 * self._away(poses))
            poses = poses[self._random.choice(len(poses), number, p=share / share.sum())]
            poses = poses + self._random.standard_normal((number, 3)) * (0.1, 0.1, 0.1)
        else:
            low = -np.array((*self._field.half, math.pi))
            poses = self._random.uniform(low, -low, (number, 3))
        if not evidence.known:
            poses = self._on_our_side(poses)
        # The least likely particles make room; the new ones have the usual weight.
        worst = np.argpartition(self.weights, number)[:number]
        self.particles[worst] = poses
        self._tilt[worst] = self._random_tilt(number)
        self.weights[worst] = 1.0 / self._count
        self.weights /= self.weights.sum()

    def _on_our_side(self, poses: FloatArray) -> FloatArray:
        """Of each pose and its mirror pose, the one that is nearer to the last valid one."""
        other = mirrored(poses)
        nearer = self._away(poses) <= self._away(other)
        return np.where(nearer[:, None], poses, other)

    def _away(self, poses: FloatArray) -> FloatArray:
        """(n,) squared deviations from the last valid pose."""
        place, heading = self._slack
        dx, dy = poses[:, 0] - self._reference[0], poses[:, 1] - self._reference[1]
        turn = wrapped(poses[:, 2] - self._reference[2])
        result: FloatArray = (dx * dx + dy * dy) / place**2 + (turn / heading) ** 2
        return result

    # -- half of the field -------------------------------------------------------------------------

    def judge_half(self, log_ratio: float) -> None:
        """Use what team mates tell: log-likelihood of the pose minus that of its mirror pose.

        Who knows landmarks by their names sees the half, and two robots may see different balls.
        """
        if self._named:
            return
        self._odds = min(SURE, self._odds + log_ratio)
        if self._odds < FLIP:
            self.particles = mirrored(self.particles)
            self._reference = mirrored(self._reference[None])[0]
            self._odds = -self._odds
            self._find_cluster()

    # -- estimate ----------------------------------------------------------------------------------

    def _find_cluster(self) -> None:
        """Mean and covariance of the heaviest cluster."""
        p, w = self.particles, self.weights
        place, heading = CLUSTER[0] * self._deviation, CLUSTER[1]
        drawn = (np.arange(CENTRES) + 0.5) / CENTRES
        middle = p[np.searchsorted(np.cumsum(w), drawn).clip(0, self._count - 1)]
        dx, dy = middle[:, 0:1] - p[:, 0], middle[:, 1:2] - p[:, 1]
        turn = wrapped(middle[:, 2:3] - p[:, 2])
        near = (dx * dx + dy * dy) / place**2 + (turn / heading) ** 2 < 1.0
        inside = near[int(np.argmax(near @ w))]
        mass = 0.0
        for _ in range(3):
            mean = _mean(p[inside], w[inside])
            dx, dy = p[:, 0] - mean[0], p[:, 1] - mean[1]
            turn = wrapped(p[:, 2] - mean[2])
            inside = (dx * dx + dy * dy) / place**2 + (turn / heading) ** 2 < 4.0
            mass = float(w[inside].sum())
        error = np.column_stack((dx, dy, turn))[inside]
        share = w[inside] / mass
        self._covariance = (error * share[:, None]).T @ error + _ROUGHENED
        self._mean, self._mass = mean, mass

    def _is_good(self) -> bool:
        c = self._covariance
        spread = 0.5 * (c[0, 0] + c[1, 1]) + math.hypot(0.5 * (c[0, 0] - c[1, 1]), c[0, 1])
        return bool(
            self._mass >= Validity.MASS
            and spread <= self._deviation**2
            and c[2, 2] <= Validity.HEADING**2
            and self._fast >= Validity.EXPLAINED * self._usual
        )

    @property
    def is_valid(self) -> bool:
        """The covariance describes the error of the pose."""
        return (
            not self._lost
            and self._bad < Validity.PATIENCE
            and self._odds >= Validity.ODDS
            and self._unseen < self._unseen_max
        )

    def estimate(self, motion: Displacement | None = None) -> PoseEstimate:
        """The pose after a motion since the last image; None = at that image.

        Of a robot that was shoved it is the last valid one, carried on, until most of the particles
        are at one place: the heaviest cluster may be anywhere before.
        """
        mean, covariance = self._mean, self._covariance
        if self._lost and self._mass < ONE_PLACE and self._followed:
            place, heading = self._slack
            mean, covariance = self._reference, np.diag((place**2, place**2, heading**2))
        if motion is not None:
            mean = np.array(compose(_pose(mean), motion.offset))
            covariance = _carried(covariance, mean[2], motion)
        x, y, yaw = mean.tolist()
        (xx, xy, x_yaw), (_, yy, y_yaw), (_, _, yaw_yaw) = (covariance + _LASTING).tolist()
        return PoseEstimate(
            (x, y, math.remainder(yaw, math.tau)),
            PoseCovariance(xx, xy, yy, x_yaw, y_yaw, yaw_yaw),
            self.is_valid,
        )


def _composed(poses: FloatArray, offsets: FloatArray) -> FloatArray:
    """Poses (n, 3) at offsets (n, 3) in the frames of poses (n, 3)."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    return np.column_stack(
        (
            poses[:, 0] + c * offsets[:, 0] - s * offsets[:, 1],
            poses[:, 1] + s * offsets[:, 0] + c * offsets[:, 1],
            poses[:, 2] + offsets[:, 2],
        )
    )


def _carried(covariance: FloatArray, yaw_after: float, motion: Displacement) -> FloatArray:
    """The covariance (3, 3) of a pose after a motion; F P F' + G Q G'."""
    yaw = yaw_after - motion.offset[2]
    c, s = math.cos(yaw), math.sin(yaw)
    f = _jacobian(yaw_after, motion)
    g = np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
    result: FloatArray = f @ covariance @ f.T + g @ motion.covariance @ g.T
    return result


def _jacobian(yaw_after: float, motion: Displacement) -> FloatArray:
    """(3, 3) derivative of a pose after a motion by the pose before."""
    yaw = yaw_after - motion.offset[2]
    c, s = math.cos(yaw), math.sin(yaw)
    dx, dy = motion.offset[0], motion.offset[1]
    return np.array(((1.0, 0.0, -s * dx - c * dy), (0.0, 1.0, c * dx - s * dy), (0.0, 0.0, 1.0)))


def _mean(poses: FloatArray, weights: FloatArray) -> FloatArray:
    """Weighted mean (3,) of poses (n, 3) of one cluster."""
    share = weights / weights.sum()
    yaw = math.atan2(share @ np.sin(poses[:, 2]), share @ np.cos(poses[:, 2]))
    return np.array((share @ poses[:, 0], share @ poses[:, 1], yaw))


def _pose(values: FloatArray) -> Pose2:
    x, y, yaw = values.tolist()
    return x, y, yaw
