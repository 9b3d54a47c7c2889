"""Percepts are used at the time of their image; those that are unusable are refused."""

import math
from dataclasses import replace

import numpy as np
import pytest

from nao_soccer.vision.percepts import Kind
from nao_soccer.world.field_map import FieldMap
from nao_soccer.world.looking import Looking, gains
from nao_soccer.world.model import WorldModel
from nao_soccer.world.obstacles import ObstacleFilter
from nao_soccer.world.odometry import OdometryHistory
from nao_soccer.world.settings import WorldSettings
from nao_soccer.world.state import (
    HeadMode,
    Obstacle,
    TeamBall,
    TeamMate,
    TeamRobot,
    WorldState,
)
from pitch_percepts import GOALS, SMALL, Eyes, nothing, percept
from robot_core.errors import NaoGaitError
from robot_core.geometry import compose, relative
from robot_core.head_goals import Follow, LookAt, Search
from robot_core.types import Point2, Pose2

SETTINGS = WorldSettings(field=SMALL, goals=GOALS)
MS = 1_000_000
START = (-1.2, -0.3, 0.0)
ODOM_START = (5.0, -3.0, 1.0)


class Run:
    """A robot that turns on a small circle, with images every 100 ms that arrive late.

    Args:
        delay: Of the images [ms].
        knows_delay: Percepts have the time of their image.
        ball: On the field [m].
        color: Of the own team.
    """

    def __init__(
        self,
        delay: int = 0,
        *,
        knows_delay: bool = True,
        ball: Point2 | None = (0.3, 0.2),
        color: str = "",
    ) -> None:
        self.world = WorldModel(SETTINGS, color)
        self.looking = Looking(self.world.map)
        self.world.start((START,))
        self.truth: Pose2 = START
        self.stamp = 10_000 * MS
        self.jump: Pose2 = (0.0, 0.0, 0.0)
        self.eyes = Eyes(deviation=0.01)
        self._delay, self._knows, self._ball = delay, knows_delay, ball
        self._coming: list = []

    def go(
        self, seconds: float, *, sees: bool = True, turn: float = 0.8, speed: float = 0.1
    ) -> WorldState:
        """Walk for a time; the state at its end."""
        for _ in range(round(seconds * 100)):
            self.stamp += 10 * MS
            self.truth = compose(self.truth, (0.01 * speed, 0.0, 0.01 * turn))
            self.world.add_odometry(self.stamp, self.odometry)
            if sees and self.stamp % (100 * MS) == 0:
                self._coming.append(self.eyes.see(self.stamp, self.truth, self._ball))
            while self._coming and self._coming[0].stamp + self._delay * MS <= self.stamp:
                seen = self._coming.pop(0)
                self.world.add_percepts(
                    seen if self._knows else replace(seen, stamp=self.stamp)
                )
        state = self.world.state()
        assert state is not None
        return state

    def show(self, kind: Kind, place: Pose2) -> None:
        """See one more object, at a pose in the field."""
        x, y, _ = relative(place, self.truth)
        seen = self.eyes.see(self.stamp, self.truth)
        self.world.add_percepts(replace(seen, objects=(*seen.objects, percept(kind, (x, y)))))

    @property
    def odometry(self) -> Pose2:
        """The pose by odometry."""
        return compose(compose(ODOM_START, self.jump), relative(self.truth, START))

    def place_error(self, state: WorldState) -> float:
        """[m] plus [rad] of the own pose."""
        x, y, yaw = state.own.pose
        turn = math.remainder(yaw - self.truth[2], math.tau)
        return math.dist((x, y), self.truth[:2]) + abs(turn)

    def ball_error(self, state: WorldState) -> float:
        """[m] of the ball in base_footprint."""
        assert state.ball is not None
        assert self._ball is not None
        x, y, _ = relative((*self._ball, 0.0), self.truth)
        return math.dist(state.ball.position, (x, y))


def test_late_images_are_as_good_as_early_ones():
    errors = {}
    for delay in (0, 100, 300):
        run = Run(delay)
        run.go(0.6)
        states = [run.go(0.05) for _ in range(12)]
        errors[delay] = run.place_error(states[-1]), run.ball_error(states[-1])
    assert max(errors[300]) < 0.06
    ignorant = Run(300, knows_delay=False)
    state = ignorant.go(1.2)
    assert ignorant.place_error(state) > 3.0 * errors[300][0]
    assert ignorant.ball_error(state) > 3.0 * errors[300][1]


def test_an_older_image_of_another_camera_is_carried_on():
    run = Run()
    run.go(0.95, turn=0.3)
    old = run.eyes.see(run.stamp, run.truth, (0.3, 0.2))
    run.go(0.2, turn=0.3)
    run.world.add_percepts(old)
    state = run.world.state()
    assert run.ball_error(state) < 0.05
    assert run.place_error(state) < 0.1


def test_the_same_input_gives_the_same_state():
    assert Run().go(0.7) == Run().go(0.7)


BAD = [
    ("future", lambda p: replace(p, stamp=p.stamp + 3600_000 * MS), "header.stamp"),
    ("old", lambda p: replace(p, stamp=p.stamp - 5_000 * MS), "header.stamp"),
    ("nan", lambda p: replace(p, ball=percept(Kind.BALL, (math.nan, 0.0))), "percepts ball"),
    ("far", lambda p: replace(p, ball=percept(Kind.BALL, (40.0, 0.0))), "percepts ball"),
    ("sure", lambda p: replace(p, ball=percept(Kind.BALL, (1.0, 0.0), variance=0.0)), "ball"),
    ("vague", lambda p: replace(p, ball=percept(Kind.BALL, (1.0, 0.0), variance=1e30)), "ball"),
    (
        "vague robot",
        lambda p: replace(
            p, objects=(percept(Kind.ROBOT_RED, (1.0, 0.0))._replace(covariance=(1e30, 0.0, 0.1)),)
        ),
        "percepts robot",
    ),
    (
        "vague line",
        lambda p: replace(
            p, line_points=np.ones((1, 2)), line_covariances=np.array(((0.1, 0.0, 1e30),))
        ),
        "line point",
    ),
    (
        "post",
        lambda p: replace(p, objects=(percept(Kind.GOAL_POST, (1.0, math.inf)),)),
        "percepts goal_post",
    ),
    (
        "line",
        lambda p: replace(
            p, line_points=np.array(((1.0, np.nan),)), line_covariances=np.ones((1, 3))
        ),
        "line point",
    ),
    (
        "outside",
        lambda p: replace(p, ball=percept(Kind.BALL, (9.0, 0.0))),
        "percepts ball in field",
    ),
]


@pytest.mark.parametrize(("change", "field"), [each[1:] for each in BAD], ids=[b[0] for b in BAD])
def test_bad_percepts_are_refused_in_one_line_and_the_next_ones_are_used(change, field):
    run = Run()
    run.go(0.9)
    with pytest.raises(NaoGaitError, match=field) as refusal:
        run.world.add_percepts(change(run.eyes.see(run.stamp, run.truth)))
    assert "\n" not in str(refusal.value)
    state = run.go(0.5)
    assert state.own.valid
    assert run.place_error(state) < 0.1


def test_percepts_before_odometry_are_refused():
    with pytest.raises(NaoGaitError, match="odom before percepts"):
        WorldModel(SETTINGS).add_percepts(nothing(0))


@pytest.mark.parametrize(
    ("stamp", "shift", "field"),
    [
        (10, (3.0, 0.0, 0.0), "odom pose"),
        (10, (0.0, 0.0, 2.0), "odom pose"),
        (10, (math.nan, 0.0, 0.0), "odom pose"),
        (-9_000, (0.0, 0.0, 0.0), "header.stamp"),
        (5_000, (0.0, 0.0, 0.0), "odom"),
    ],
    ids=["jump", "turn", "nan", "new clock", "gap"],
)
def test_after_bad_odometry_the_pose_is_found_again(stamp: int, shift: Pose2, field: str):
    run = Run()
    assert run.go(3.0, turn=0.3).own.valid
    run.stamp += stamp * MS
    with pytest.raises(NaoGaitError, match=field):
        run.world.add_odometry(run.stamp, compose(run.odometry, shift))
    if not math.isnan(shift[0]):
        before = relative(run.truth, START)
        run.jump = relative(compose(run.odometry, shift), ODOM_START)
        run.jump = compose(run.jump, relative((0.0, 0.0, 0.0), before))
        assert not run.world.state().own.valid
    state = run.go(6.0, turn=0.3)
    assert state.own.valid
    assert run.place_error(state) < 0.1


def test_an_empty_image_for_a_minute_ends_validity_and_it_comes_back():
    run = Run()
    assert run.go(2.0, turn=0.3).own.valid
    for _ in range(6):
        run.world.add_percepts(nothing(run.stamp))
        state = run.go(10.0, sees=False, turn=0.0, speed=0.0)
    assert not state.own.valid
    state = run.go(4.0, turn=0.3)
    assert state.own.valid
    assert run.place_error(state) < 0.15


def test_without_images_the_robot_is_blind_until_the_next_one():
    run = Run()
    assert not run.go(1.0).blind
    state = run.go(3.0, sees=False)
    assert state.image_age == pytest.approx(3.0, abs=0.11)
    assert state.blind
    with pytest.raises(NaoGaitError, match=r"header\.stamp"):
        run.world.add_percepts(replace(nothing(0), stamp=run.stamp + 1_000 * MS))
    assert run.go(0.1, sees=False).blind
    assert not run.go(0.3).blind


def test_who_sees_nothing_in_its_images_is_blind_later_and_not_while_it_lies():
    run = Run()
    run.go(1.0)
    for _ in range(10):
        run.world.add_percepts(nothing(run.stamp))
        state = run.go(1.0, sees=False)
    assert not state.blind
    assert state.sight_age == pytest.approx(10.0, abs=0.2)
    run.world.set_upright(False)
    run.go(1.0, sees=False)
    run.world.set_upright(True)
    assert run.go(0.1, sees=False).sight_age < 0.2
    for _ in range(16):
        run.world.add_percepts(nothing(run.stamp))
        state = run.go(1.0, sees=False)
    assert state.blind
    assert not run.go(0.3).blind


def test_who_may_be_anywhere_finds_its_place_again():
    run = Run()
    assert run.go(2.0).own.valid
    run.world.forget_place()
    assert not run.go(0.1).own.valid


def test_a_robot_that_has_fallen_holds_no_valid_pose_and_no_ball():
    run = Run()
    assert run.go(2.0).ball is not None
    run.world.set_upright(False)
    state = run.go(0.5)
    assert not state.own.valid
    assert state.ball is None
    run.world.set_upright(True)
    assert run.go(6.0, turn=0.3).own.valid


# -- team ------------------------------------------------------------------------------------------


def mate(run: Run, place: Point2) -> TeamMate:
    """A team mate that sees the ball at a place on the field now."""
    ball = TeamBall(place, (0.0, 0.0), (0.01, 0.0, 0.01), 0.0)
    return TeamMate(2, run.stamp, (1.0, 0.0, 0.0), True, ball=ball)


def test_a_ball_that_only_a_team_mate_sees_is_used_and_not_told_again():
    run = Run(ball=None)
    run.go(1.0)
    run.world.add_mate(mate(run, (1.0, 0.5)))
    state = run.world.state()
    assert state.ball is not None
    assert state.ball.by_team
    assert not state.ball.seen_recently
    assert math.dist(state.ball.position_in_field, (1.0, 0.5)) < 0.01
    x, y, _ = compose(state.own.pose, (*state.ball.position, 0.0))
    assert math.dist((x, y), (1.0, 0.5)) < 0.01
    assert state.ball_from_self is None


def test_the_owneyes_come_before_a_team_mate():
    run = Run(ball=(0.3, 0.2))
    run.go(0.8)
    run.world.add_mate(mate(run, (1.5, 1.0)))
    state = run.world.state()
    assert not state.ball.by_team
    assert run.ball_error(state) < 0.05


def test_of_a_robot_the_newest_place_counts_whoever_saw_it():
    run = Run(ball=None)
    run.go(1.0)
    old = compose(run.truth, (0.9, 0.3, 0.0))
    for _ in range(3):
        run.show(Kind.ROBOT_BLUE, old)
        run.go(0.05)
    moved = old[0] + 0.35, old[1]
    behind = compose(run.truth, (-0.4, 0.0, 0.0))[:2]
    for age, place in ((5.0, old[:2]), (0.2, moved)):
        run.go(0.5, sees=False)
        told = tuple(TeamRobot(each, age) for each in (moved, behind, run.truth[:2]))
        run.world.add_mate(TeamMate(2, run.stamp, (1.8, 1.2, 0.0), True, robots=told))
        state = run.world.state()
        seen, *others = (each for each in state.obstacles if each.team == "blue")
        assert others == []
        assert seen.by_team == (age < 1.0)
        assert math.dist(seen.position_in_field, place) < 0.1
        x, y, _ = compose(state.own.pose, (*seen.position, 0.0))
        assert math.dist((x, y), place) < 0.1
        # Where no robot was seen one is told of; the one at the own place is this robot.
        unseen = [each for each in state.obstacles if each.team is None]
        assert len(unseen) == 1 + (age < 1.0)  # the mate itself, always
        assert all(math.hypot(*each.position) > 0.3 for each in unseen)


@pytest.mark.parametrize("sees", ["this robot", "the mate"])
def test_a_robot_in_the_wrong_half_turns_when_it_and_its_mate_see_each_other(sees: str):
    run = Run(ball=None, color="red")
    run.world.start((compose((0.0, 0.0, math.pi), START),))
    run.go(0.5)
    assert run.place_error(run.world.state()) > 2.0
    mate = 0.3, 0.6, 0.0
    for _ in range(16):
        run.go(0.5)
        told = ()
        if sees == "the mate":
            told = TeamRobot(run.truth[:2], 0.0, mate=True), TeamRobot((1.2, 0.3), 0.0)
        else:
            for kind, place in ((Kind.ROBOT_RED, mate), (Kind.ROBOT_BLUE, (-0.3, -0.6, 0.0))):
                run.show(kind, place)
        run.world.add_mate(TeamMate(2, run.stamp, mate, True, robots=told))
    assert run.place_error(run.go(0.5)) < 0.1


def test_opponents_at_the_mirror_pose_do_not_count():
    run = Run(ball=None, color="red")
    run.go(0.5)
    for _ in range(20):
        state = run.go(0.5)
        there = TeamRobot((-run.truth[0], -run.truth[1]), 0.0)
        run.world.add_mate(TeamMate(2, run.stamp, (-0.5, 0.5, 0.0), True, robots=(there,)))
    assert state.own.valid
    assert run.place_error(state) < 0.1


def test_an_old_ball_of_a_team_mate_is_not_used():
    run = Run(ball=None)
    run.go(0.5)
    run.world.add_mate(mate(run, (1.0, 0.5)))
    assert run.go(3.5).ball is None


@pytest.mark.parametrize("told_first", [False, True])
def test_team_mates_tell_which_half_the_robot_is_in(told_first):
    """By a ball that was seen shortly before their message, or is seen shortly after it."""
    run = Run(ball=(0.3, 0.2))
    x, y, yaw = START
    run.world.start(((-x, -y, yaw + math.pi),))

    def stand(seconds, *, sees):
        return run.go(seconds, sees=sees, turn=0.0, speed=0.0)

    assert run.place_error(stand(1.0, sees=True)) > 2.0
    for _ in range(20):
        if told_first:
            stand(1.6, sees=False)  # the ball was not seen lately
            run.world.add_mate(mate(run, (0.3, 0.2)))
            stand(0.3, sees=True)
        else:
            stand(0.3, sees=True)
            run.world.add_mate(mate(run, (0.3, 0.2)))
            stand(3.5, sees=False)  # then the message is too old
    state = stand(0.3, sees=True)
    again = run.world.state()
    assert again is not None
    assert again.own == state.own
    assert run.place_error(state) < 0.15


def test_the_head_looks_all_around_for_robots_and_at_one_that_may_have_moved():
    run = Run()
    state = replace(run.go(0.5), obstacles=())
    looking = Looking(FieldMap(SMALL, GOALS))
    bearings = []
    for tick in range(45):
        goal = looking.goal(HeadMode.AHEAD, replace(state, stamp=state.stamp + 50 * tick * MS))
        assert isinstance(goal, LookAt)
        bearings.append(math.atan2(goal.point[1], goal.point[0]))
    assert max(bearings) > 0.8
    assert min(bearings) < -0.8
    assert sum(bearing == 0.0 for bearing in bearings) > 15
    for age, looked_at in ((1.0, True), (0.1, False)):
        place, none = (0.2, -0.4), (0.0, 0.0)
        robot = Obstacle(place, none, (0.01, 0.0, 0.01), none, "blue", fallen=False, age=age)
        goal = looking.goal(HeadMode.AHEAD, replace(state, obstacles=(robot,)))
        assert isinstance(goal, LookAt)
        assert (goal.point[:2] == place) == looked_at


def test_a_robot_near_a_fallen_team_mate_is_marked():
    run = Run()
    run.go(1.0)
    ahead = compose(run.truth, (1.0, 0.0, 0.0))
    for _ in range(3):
        run.show(Kind.ROBOT_RED, ahead)
        run.go(0.05)
    (robot,) = run.world.state().obstacles
    assert robot.team == "red"
    assert not robot.fallen
    run.world.add_mate(TeamMate(2, run.stamp, ahead, True, fallen=True))
    (robot,) = run.world.state().obstacles
    assert robot.fallen
    assert run.go(9.0).obstacles == ()


@pytest.mark.parametrize(("far", "known"), [(0.9, True), (3.0, False)])
def test_a_robot_is_missed_only_where_all_of_it_would_be_in_the_image(far: float, known: bool):
    """An image of the ground up to 0.9 m shows the feet of a robot 0.5 m away, not its torso."""
    visible = np.array(((0.1, 0.8), (far, 0.8), (far, -0.8), (0.1, -0.8)))
    robots = ObstacleFilter()
    for _ in range(2):
        robots.see((percept(Kind.ROBOT_BLUE, (0.5, 0.0)),), visible)
    for _ in range(10):
        robots.see((), visible)
    assert bool(robots.robots) == known


# -- head ------------------------------------------------------------------------------------------


def test_the_head_follows_the_ball_and_searches_without_one():
    run = Run()
    state = run.go(0.6)
    goal = run.looking.goal(HeadMode.BALL, state)
    assert isinstance(goal, Follow)
    assert math.dist(goal.point[:2], state.ball.position) < 1e-9
    assert run.looking.goal(HeadMode.FREE, state) is None
    empty = Run(ball=None)
    state = empty.go(0.6)
    assert isinstance(empty.looking.goal(HeadMode.BALL, state), Search)


def test_the_head_looks_at_a_landmark_that_can_be_seen():
    run = Run()
    state = run.go(0.8)
    goal = run.looking.goal(HeadMode.LOCALIZE, state)
    assert isinstance(goal, LookAt)
    x, y, _ = compose(state.own.pose, (*goal.point[:2], 0.0))
    landmarks = np.concatenate(list(run.world.map.landmarks.values()))
    assert np.hypot(landmarks[:, 0] - x, landmarks[:, 1] - y).min() < 1e-3


def test_a_scan_looks_near_and_far_ahead_of_the_turn_to_the_right():
    run = Run()
    looks = []
    for _ in range(16):
        goal = run.looking.goal(HeadMode.SCAN, run.go(0.05))
        assert isinstance(goal, LookAt)
        x, y, _ = goal.point
        assert -1.2 < math.atan2(y, x) < -0.5
        looks.append(math.hypot(x, y))
    near, far = min(looks), max(looks)
    assert near < 1.2
    assert far > 3.0
    assert min(looks.count(near), looks.count(far)) >= 6


def test_landmarks_across_the_uncertain_direction_help_most():
    places = np.array(((1.0, 0.0), (0.3, 1.0)))
    lateral = np.diag((1e-6, 0.04, 1e-6))
    forward = np.diag((0.04, 1e-6, 1e-6))
    assert np.argmax(gains(places, lateral)) == 0  # its bearing shows the lateral error best
    assert np.argmax(gains(places, forward)) == 1
    assert gains(np.array(((9.0, 0.0), (-1.0, 0.0))), forward) == pytest.approx((0.0, 0.0))


# -- odometry --------------------------------------------------------------------------------------


def test_motion_between_two_times_is_interpolated():
    history = OdometryHistory(0.02, 0.06)
    for tick in range(20):
        yaw = math.remainder(3.0 + 0.05 * tick, math.tau)  # passes pi
        history.add(tick * 10 * MS, (0.01 * tick, 0.0, yaw))
    offset, covariance = history.motion(45 * MS, 105 * MS)
    assert math.hypot(*offset[:2]) == pytest.approx(0.06)
    assert offset[2] == pytest.approx(0.3)
    assert np.linalg.eigvalsh(covariance)[0] > 0.0
    assert history.motion(50 * MS, 50 * MS).offset == pytest.approx((0.0, 0.0, 0.0))
