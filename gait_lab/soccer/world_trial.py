"""The world model in the loop of head, cameras and percepts, over a walk of random commands.

Over a recorded walk each sample is one step: odometry, head, cameras, vision, world model. Percepts
come from `PerceptModel`, at the delay that is asked for. With rendered images the walk runs
meanwhile. The truth is compared with the state at the state's own time.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gait_lab.channel import Channel
from gait_lab.soccer.ball_course import BallCourse, BallTruth
from gait_lab.soccer.eyes import IMAGE_PERIOD, Sight, cameras_of
from gait_lab.soccer.field_walks import RandomWalk, WalkSamples, WalkSpec, half_of, scene_of
from gait_lab.soccer.percept_model import PerceptModel
from gait_lab.soccer.pitch import PitchSpec
from gait_lab.soccer.rendered_eyes import RenderedEyes
from gait_lab.vision.percept_errors import load_percept_errors
from nao_lipm_gait.estimation.torso_place import TorsoPlace
from nao_lipm_gait.head.head_control import HeadControl
from nao_lipm_gait.whole_body.body_model import SolePose
from nao_soccer.vision.percepts import Percepts
from nao_soccer.vision.settings import settings_of_scene
from nao_soccer.world.looking import Looking
from nao_soccer.world.model import WorldModel
from nao_soccer.world.settings import WorldSettings
from nao_soccer.world.state import HeadMode, TeamBall, TeamMate, WorldState
from robot_core.geometry import (
    as_point,
    compose,
    relative,
    rotate_planar,
    rotation_from_rpy,
    wrapped,
)
from robot_core.robot import RobotDescription, load_robot
from robot_core.robot.camera import CameraModel, CameraView
from robot_core.types import FloatArray, Pose2
from sim_bridge.cameras.camera import CameraSettings
from sim_bridge.trials.trial import WalkerResponder, make_gaits, make_scene_world, run_responder

MATE_PERIOD = 0.5
"""[s] Between two messages of a team mate."""
MATE_ERROR = 0.15
"""[m] Deviation of the ball that a team mate tells."""


class Gap(NamedTuple):
    """A time in which the robot sees nothing; afterwards it may stand elsewhere.

    Attributes:
        start: [s]
        end: [s]
        fall: The robot lies meanwhile, and knows it; otherwise it is carried and does not.
    """

    start: float
    end: float
    fall: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldTrialSpec(PitchSpec):
    """What a trial depends on besides the walk, with which physics are over.

    Attributes:
        delay: [s] From exposure to percept; None = as measured.
        knows_delay: Percepts have the time of their image; False = that of their arrival.
        mate: A team mate tells of the ball.
    """

    urdf: str = "nao_h21_v33"
    delay: float | None = None
    knows_delay: bool = True
    gap: Gap | None = None
    mate: bool = False
    head: HeadMode = HeadMode.AUTO


@dataclass(frozen=True, slots=True, eq=False)
class WorldTrace:
    """A trial; n rows, one for each image that was used.

    Attributes:
        time: (n,) [s]
        pose: (n, 3) estimated, x, y [m], yaw [rad].
        truth: (n, 3) true.
        covariance: (n, 6) of the estimate.
        valid: (n,) The estimate is said to be valid.
        ball: (n, 4) estimated place [m] and velocity [m/s] in base_footprint; NaN if not known.
        ball_truth: (n, 4) true.
        ball_covariance: (n, 3) of the place [m^2].
        ball_age: (n,) [s] since the ball was put down or kicked, at the time of the image.
        ball_recent: (n,) It was seen recently.
    """

    time: FloatArray
    pose: FloatArray
    truth: FloatArray
    covariance: FloatArray
    valid: NDArray[np.bool_]
    ball: FloatArray
    ball_truth: FloatArray
    ball_covariance: FloatArray
    ball_age: FloatArray
    ball_recent: NDArray[np.bool_]

    @classmethod
    def of(cls, rows: Iterable[tuple[object, ...]]) -> "WorldTrace":
        """Of rows by `trace_row`."""
        return cls(*(np.array(column) for column in zip(*rows, strict=True)))

    @property
    def place_error(self) -> FloatArray:
        """(n,) [m] Distance of the estimate from the truth."""
        return np.hypot(*(self.pose - self.truth)[:, :2].T)

    @property
    def heading_error(self) -> FloatArray:
        """(n,) [rad], not negative."""
        turn = self.pose[:, 2] - self.truth[:, 2]
        return np.abs(wrapped(turn))

    @property
    def in_wrong_half(self) -> NDArray[np.bool_]:
        """(n,) The mirror pose of the estimate is right, not the estimate."""
        mirror = self.pose * (-1.0, -1.0, 1.0) + (0.0, 0.0, math.pi)
        away = np.hypot(*(mirror - self.truth)[:, :2].T)
        turn = np.abs(wrapped(mirror[:, 2] - self.truth[:, 2]))
        return (away < 0.7) & (turn < 0.7) & (self.place_error + self.heading_error > 1.4)


class Head:
    """The head of a robot whose body is a recorded walk."""

    def __init__(self, robot: RobotDescription) -> None:
        self.control = HeadControl(robot)
        self.joints = np.array(robot.stand_pose, dtype=float)
        self.cameras = cameras_of(robot)
        self._position = np.zeros(3)
        self._rotation = np.eye(3)

    def step(self, torso: Sequence[float], dt: float) -> None:
        """Turn the head for `dt` [s]; torso x, y, z, roll, pitch, yaw in base_footprint."""
        self._position = np.array(torso[:3])
        self._rotation = np.array(rotation_from_rpy(*torso[3:]))
        # Both soles of this place are base_footprint.
        foot = -self._rotation.T @ self._position
        axes = self._rotation
        sole = SolePose(as_point(foot), as_point(axes[0]), as_point(axes[2]))
        place = TorsoPlace(as_point(axes[2]), sole, sole, (0.0, 0.0, 0.0))
        self.control.apply(self.joints, place, dt)

    def view(self, camera: CameraModel) -> CameraView:
        """A camera in base_footprint."""
        return camera.view(self.joints, self._position, self._rotation)


def trace_row(
    state: WorldState, truth: Pose2, ball: BallTruth, delay: float
) -> tuple[object, ...]:
    """The fields of a `WorldTrace` after an image, with the truth at the time of the state.

    `delay` [s] is from the exposure of the image to the state.
    """
    x, y, _ = relative((*ball.position, 0.0), truth)
    known = state.ball
    return (
        state.stamp * 1e-9,
        state.own.pose,
        truth,
        state.own.covariance,
        state.own.valid,
        (math.nan,) * 4 if known is None else (*known.position, *known.velocity),
        (x, y, *rotate_planar(*ball.velocity, -truth[2])),
        (math.nan,) * 3 if known is None else known.position_covariance,
        ball.since - delay,
        known is not None and known.seen_recently,
    )


def run_trial(spec: WorldTrialSpec, walk: WalkSamples) -> WorldTrace:
    """Run the world model over a recorded walk."""
    scene = settings_of_scene(spec.scene)
    robot = load_robot(spec.urdf)
    errors = load_percept_errors()
    delay = round((errors.delay if spec.delay is None else spec.delay) * 1e9)
    model = WorldModel(WorldSettings.on(scene, spec.seed))
    looking = Looking(model.map)
    vision = PerceptModel(errors, scene.field, scene.goals, spec.seed)
    half = scene.field.length / 2.0 + 0.2, scene.field.width / 2.0 + 0.2
    course = BallCourse(half, spec.seed)
    mate = _Mate(spec.seed) if spec.mate else None
    head = Head(robot)
    arrivals = Channel[Percepts]()
    period = round(1e9 * IMAGE_PERIOD / len(head.cameras))
    rows, exposures, before = [], 0, int(walk.stamp[0])
    model.start((_pose(walk.truth[0]),))
    table = zip(
        walk.stamp.tolist(), walk.odometry.tolist(), walk.torso.tolist(), walk.truth.tolist(),
        strict=True,
    )  # fmt: skip
    for stamp, odometry, torso, true in table:
        time, truth = stamp * 1e-9, _pose(true)
        ball = course.at(time, truth)
        blind = spec.gap is not None and spec.gap.start <= time < spec.gap.end
        if spec.gap is not None and spec.gap.fall:
            model.set_upright(not blind)
        model.add_odometry(stamp, _pose(odometry))
        head.step(torso, (stamp - before) * 1e-9)
        before = stamp
        if stamp >= int(walk.stamp[0]) + exposures * period:
            view = head.view(head.cameras[exposures % len(head.cameras)])
            exposures += 1
            if not blind:
                arrivals.send(stamp + delay, vision.see(stamp, view, truth, ball.position))
        if mate is not None:
            mate.tell(model, stamp, ball)
        for percepts in arrivals.receive(stamp):
            known = percepts if spec.knows_delay else replace(percepts, stamp=stamp)
            model.add_percepts(known)
            state = model.state()
            if state is None:
                continue
            head.control.ask(looking.goal(spec.head, state))
            rows.append(trace_row(state, truth, ball, (stamp - percepts.stamp) * 1e-9))
    return WorldTrace.of(rows)


def run_rendered(spec: WalkSpec, head: HeadMode = HeadMode.AUTO) -> WorldTrace:
    """Walk, render, see and estimate, all in one loop.

    Raises:
        NaoGaitError: The scene has no field, or its images cannot be rendered.
    """
    scene, settings = scene_of(spec), settings_of_scene(spec.scene)
    with make_scene_world(
        scene, plant=spec.plant, engine=spec.engine, noise_seed=spec.seed, cameras=CameraSettings()
    ) as world:
        robot = world.robot
        (gait,) = make_gaits(world)
        eyes = RenderedEyes(robot, gait, settings)
        model = WorldModel(WorldSettings.on(settings, spec.seed))
        looking = Looking(model.map)
        model.start((robot.truth().base_footprint,))
        half = half_of(scene)
        course = BallCourse((half[0] + 0.2, half[1] + 0.2), spec.seed)
        policy = RandomWalk(half, spec.seed, gait, spec.seconds)
        controller = WalkerResponder(world, robot, gait, policy)
        truths: dict[int, tuple[Pose2, BallTruth]] = {}
        rows = []
        stamp: int | None = None
        for tick in run_responder(world, controller, lambda *_: None, past_falls=True):
            place = tick.truth.base_footprint
            ball = course.at(world.time * 1e-9, place)
            world.put_ball(*ball.position, ball.velocity)
            truths[world.time] = place, ball
            status = tick.status
            if status is None or status.stamp == stamp:
                continue
            stamp = status.stamp
            model.add_odometry(stamp, status.base_footprint_in_odom)
            for percepts in eyes.arrived(Sight(world.time, tick.truth, ball.position)):
                model.add_percepts(percepts)
                state = model.state()
                if state is not None and state.stamp in truths:
                    gait.request_look(looking.goal(head, state))
                    delay = (state.stamp - percepts.stamp) * 1e-9
                    rows.append(trace_row(state, *truths[state.stamp], delay))
            for old in [each for each in truths if each < stamp]:
                del truths[old]
    return WorldTrace.of(rows)


class _Mate:
    """A team mate that stands somewhere and sees the ball."""

    def __init__(self, seed: int) -> None:
        self._random = np.random.default_rng((seed, 4))
        self._next = 0

    def tell(self, model: WorldModel, stamp: int, ball: BallTruth) -> None:
        if stamp < self._next:
            return
        self._next = stamp + round(MATE_PERIOD * 1e9)
        x, y = (each + MATE_ERROR * self._random.standard_normal() for each in ball.position)
        variance = MATE_ERROR**2
        told = TeamBall((x, y), ball.velocity, (variance, 0.0, variance), 0.0)
        model.add_mate(TeamMate(2, stamp, (-1.0, 0.0, 0.0), True, ball=told))


def spliced(walk: WalkSamples, other: WalkSamples, time: float, gap: float) -> WalkSamples:
    """A robot that is carried for `gap` [s] to the beginning of another walk; odometry goes on.

    It is taken `time` [s] after its start; what it stands on the other walk is left out.
    """
    step = int(walk.stamp[1] - walk.stamp[0])
    last = int(time * 1e9 / step)
    held = int(gap * 1e9 / step)
    first = int(4e9 / step)
    begin, origin = _pose(walk.odometry[last]), _pose(other.odometry[first])
    odometry = [compose(begin, relative(_pose(each), origin)) for each in other.odometry[first:]]
    count = last + held + len(odometry)

    def joined(name: str) -> FloatArray:
        a, b = getattr(walk, name), getattr(other, name)
        return np.concatenate((a[:last], np.repeat(a[last : last + 1], held, axis=0), b[first:]))

    pieces: dict[str, Any] = {name: joined(name) for name in WalkSamples._fields}
    pieces["stamp"] = walk.stamp[0] + step * np.arange(count)
    pieces["odometry"] = np.concatenate(
        (walk.odometry[:last], np.repeat(walk.odometry[last : last + 1], held, axis=0), odometry)
    )
    return WalkSamples(**pieces)


def turned_after(walk: WalkSamples, time: float, seconds: float, turn: float) -> WalkSamples:
    """A robot that falls, and stands up in place turned by `turn` [rad]; odometry does not know.

    It falls `time` [s] after its start and lies for some seconds.
    """
    step = int(walk.stamp[1] - walk.stamp[0])
    last, held = int(time * 1e9 / step), int(seconds * 1e9 / step)
    before = _pose(walk.truth[last])
    after = [
        compose((*before[:2], before[2] + turn), relative(_pose(each), before))
        for each in walk.truth[last:]
    ]
    index = np.concatenate((np.arange(last), np.full(held, last), np.arange(last, len(walk.stamp))))
    pieces: dict[str, Any] = {name: getattr(walk, name)[index] for name in WalkSamples._fields}
    pieces["stamp"] = walk.stamp[0] + step * np.arange(len(index))
    pieces["truth"] = np.concatenate((walk.truth[:last], np.tile(before, (held, 1)), after))
    return WalkSamples(**pieces)


def _pose(values: Sequence[float] | FloatArray) -> Pose2:
    x, y, yaw = values
    return float(x), float(y), float(yaw)
