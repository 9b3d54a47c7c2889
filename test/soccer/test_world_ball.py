"""The ball filter against closed forms, and its covariance against its errors."""

import math

import numpy as np
import pytest

from nao_soccer.vision.percepts import Kind
from nao_soccer.world.ball import FORGET, BallFilter
from nao_soccer.world.odometry import Displacement
from nao_soccer.world.planar_track import PlanarTrack, inside, mixture
from pitch_percepts import VIEW, percept

AT_REST = Displacement((0.0, 0.0, 0.0), np.zeros((3, 3)))
SLOWDOWN = 0.3


def test_repeated_sightings_of_a_place_are_averaged():
    places = np.random.default_rng(0).normal((1.0, 0.5), 0.1, (20, 2))
    variance = 0.01
    track = PlanarTrack.at(tuple(places[0]), (variance, 0.0, variance), 0.0)
    for place in places[1:]:
        track.correct(tuple(place), (variance, 0.0, variance))
    assert np.allclose(track.mean[:2], places.mean(axis=0))
    assert np.allclose(track.covariance[:2, :2], variance / 20 * np.eye(2))


def test_a_track_is_the_least_squares_line_through_its_sightings():
    random = np.random.default_rng(1)
    times, dt, sigma = np.arange(15) * 0.1, 0.1, 0.05
    x = 0.4 + 0.7 * times + sigma * random.standard_normal(15)
    track = PlanarTrack.at((x[0], 0.0), (sigma**2, 0.0, sigma**2), 1e3)
    for place in x[1:]:
        track.predict(dt, 1.0, 0.0)
        track.correct((place, 0.0), (sigma**2, 0.0, sigma**2))
    design = np.column_stack((np.ones(15), times - times[-1]))
    expected, *_ = np.linalg.lstsq(design, x, rcond=None)
    assert track.mean[[0, 2]] == pytest.approx(expected, abs=1e-5)
    spread = np.linalg.inv(design.T @ design) * sigma**2
    assert np.allclose(track.covariance[np.ix_([0, 2], [0, 2])], spread, rtol=1e-4)


def test_the_robot_s_own_motion_is_taken_out():
    track = PlanarTrack.at((1.0, 0.0), (0.01, 0.0, 0.04), 0.0)
    track.mean[2:] = 0.5, 0.0
    track.carry(Displacement((1.0, 0.0, math.pi / 2.0), np.zeros((3, 3))))
    assert track.mean == pytest.approx((0.0, 0.0, 0.0, -0.5), abs=1e-12)
    assert np.diag(track.covariance)[:2] == pytest.approx((0.04, 0.01))


def test_noise_of_the_own_motion_is_that_of_drawn_motions():
    random = np.random.default_rng(2)
    spread = np.diag((0.02, 0.03, 0.05)) ** 2
    motion = Displacement((0.2, 0.1, 0.3), spread)
    track = PlanarTrack.at((1.5, 0.4), (1e-9, 0.0, 1e-9), 0.0)
    track.carry(motion)
    drawn = []
    for dx, dy, turn in random.multivariate_normal(motion.offset, spread, 4000):
        c, s = math.cos(turn), math.sin(turn)
        drawn.append(np.array(((c, s), (-s, c))) @ (1.5 - dx, 0.4 - dy))
    assert np.allclose(track.covariance[:2, :2], np.cov(np.array(drawn).T), atol=2e-4)


def test_a_mixture_has_the_moments_of_its_parts():
    random = np.random.default_rng(3)
    a = PlanarTrack(np.array((0.0, 1.0, 0.0, 0.0)), np.eye(4))
    b = PlanarTrack(np.array((2.0, 0.0, 1.0, 0.0)), 0.5 * np.eye(4))
    both = mixture([a, b], [0.3, 0.7])
    chosen = random.random(20000) < 0.3
    parts = [random.multivariate_normal(t.mean, t.covariance, 20000) for t in (a, b)]
    drawn = np.where(chosen[:, None], *parts)
    assert np.allclose(both.mean, drawn.mean(axis=0), atol=0.04)
    assert np.allclose(both.covariance, np.cov(drawn.T), atol=0.06)


def roll(seed: int, speed: float, seconds: float, sigma: float = 0.03, rate: float = 0.1):
    """A ball at rest for 2 s, then rolling away; yields filter, true x and true speed."""
    random = np.random.default_rng(seed)
    ball, x, v = BallFilter(SLOWDOWN), 0.6, 0.0
    for tick in range(round(seconds / rate)):
        if tick == round(2.0 / rate):
            v = speed
        after = max(0.0, v - SLOWDOWN * rate)
        x, v = x + 0.5 * (v + after) * rate, after
        ball.advance(AT_REST, rate)
        place = x + sigma * random.standard_normal(), sigma * random.standard_normal()
        ball.see(percept(Kind.BALL, place, variance=sigma**2))
        yield ball.ball.estimate, x, v


def test_a_resting_ball_has_no_speed():
    *_, (estimate, x, _) = roll(0, 0.0, 4.0)
    assert np.hypot(*estimate.mean[2:]) < 0.03
    assert abs(estimate.mean[0] - x) < 0.03


def test_the_speed_of_a_rolling_ball_is_found_and_fades():
    errors = [
        abs(estimate.mean[2] - v)
        for seed in range(10)
        for tick, (estimate, _, v) in enumerate(roll(seed, 0.9, 5.0))
        if 25 <= tick < 45
    ]
    assert np.median(errors) < 0.1


def test_the_covariance_of_the_ball_describes_its_error():
    squares = []
    for seed in range(30):
        for tick, (estimate, x, _) in enumerate(roll(seed, 0.8, 4.0)):
            if tick % 8 == 7:
                error = estimate.mean[:2] - (x, 0.0)
                squares.append(error @ np.linalg.solve(estimate.covariance[:2, :2], error))
    assert 1.0 < np.mean(squares) < 2.6  # 2 by definition; the gate is slightly pessimistic


def test_a_ball_that_jumps_is_found_again_and_one_false_ball_is_not_accepted():
    ball = BallFilter(SLOWDOWN)

    def see(x: float, times: int) -> float:
        for _ in range(times):
            ball.advance(AT_REST, 0.1)
            ball.see(percept(Kind.BALL, (x, 0.0)))
        return float(ball.ball.estimate.mean[0])

    assert see(1.0, 10) == pytest.approx(1.0)
    assert see(2.5, 1) == pytest.approx(1.0)
    assert see(1.0, 5) == pytest.approx(1.0, abs=0.02)
    assert see(0.2, 10) == pytest.approx(0.2, abs=0.02)


def swaps(shown: list[int], apart: float) -> int:
    """How often the ball changes place while two are shown in turn, ten times a second."""
    ball, sides = BallFilter(SLOWDOWN), []
    for side in shown:
        ball.advance(AT_REST, 0.1)
        ball.see(percept(Kind.BALL, (1.0, apart * (side - 0.5))))
        sides.append(ball.ball.estimate.mean[1] > 0.0)
    return int(np.count_nonzero(np.diff(sides)))


@pytest.mark.parametrize("apart", [0.4, 1.2, 3.0])
@pytest.mark.parametrize("images", [1, 2, 3, 5, 10, 15])
def test_two_balls_that_are_seen_in_turn_do_not_change_places(images: int, apart: float):
    assert swaps([tick // images % 2 for tick in range(600)], apart) <= 1


@pytest.mark.parametrize("share", [0.5, 0.6, 0.8])
def test_two_balls_that_are_seen_at_random_hardly_change_places(share: float):
    shown = np.random.default_rng(0).random(600) < share
    assert swaps(shown.astype(int).tolist(), 1.2) <= 3  # in a minute


def test_of_two_balls_the_one_that_is_left_is_the_ball():
    alone = [1] * 30
    assert swaps([0, 1] * 50 + alone, 1.2) == 1
    assert swaps([1, 0] * 50 + alone, 1.2) == 0


def test_a_ball_is_forgotten_where_the_camera_does_not_see_it():
    ball = BallFilter(SLOWDOWN)
    ball.see(percept(Kind.BALL, (1.0, 0.0)))
    ball.miss(VIEW)
    assert ball.ball is not None
    for _ in range(6):
        ball.miss(VIEW - (0.0, 5.0))  # it looks elsewhere
    assert ball.ball is not None
    for _ in range(6):
        ball.miss(VIEW)
    assert ball.ball is None


def test_a_ball_that_is_not_seen_is_forgotten_in_time():
    ball = BallFilter(SLOWDOWN)
    ball.see(percept(Kind.BALL, (1.0, 0.0)))
    for _ in range(round(FORGET / 0.1) + 2):
        ball.advance(AT_REST, 0.1)
    assert ball.ball is None


def test_inside_a_polygon_with_a_margin():
    square = np.array(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)))
    for polygon in (square, square[::-1]):
        assert inside(polygon, np.array((0.5, 0.5)), 0.4)
        assert not inside(polygon, np.array((0.5, 0.95)), 0.1)
        assert not inside(polygon, np.array((1.5, 0.5)), 0.0)
