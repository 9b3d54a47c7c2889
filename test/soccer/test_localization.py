"""Self-localisation: symmetry, convergence, validity."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from nao_soccer.vision.percepts import Kind, Percept, Percepts
from nao_soccer.world.field_map import FieldMap
from nao_soccer.world.likelihood import LINE_WEIGHT, Evidence, log_likelihood, poses_from
from nao_soccer.world.localization import TILT, Localization, mirrored
from nao_soccer.world.odometry import Displacement
from nao_soccer.world.settings import WorldSettings
from pitch_percepts import GOALS, SMALL, VARIANCE, Eyes, nothing
from robot_core.field import Pole, seen_from
from robot_core.geometry import compose
from robot_core.types import Pose2

SETTINGS = WorldSettings(field=SMALL, goals=GOALS)
MAP = FieldMap(SMALL, GOALS)
STEP = 0.1
"""[s] Between two images."""


def course(
    seconds: float, start: Pose2 = (-1.2, -0.3, 0.0)
) -> Iterator[tuple[Pose2, Displacement]]:
    """Poses on an arc, and the measured motion to each."""
    pose, random = start, np.random.default_rng(0)
    spread = np.diag((0.01, 0.01, 0.01)) ** 2
    for _ in range(round(seconds / STEP)):
        step = (0.1 * STEP, 0.0, 0.25 * STEP)
        pose = compose(pose, step)
        measured = tuple(random.multivariate_normal(step, spread / 4).tolist())
        yield pose, Displacement(measured, spread)


def walk(
    localization: Localization, eyes: Eyes, seconds: float, start: Pose2 = (-1.2, -0.3, 0.0)
) -> list[tuple[Pose2, Pose2, bool]]:
    """True pose, estimate and validity after each image."""
    rows = []
    for pose, motion in course(seconds, start):
        localization.move(motion, STEP)
        localization.see(Evidence.of(eyes.see(0, pose), MAP))
        estimate = localization.estimate()
        rows.append((pose, estimate.pose, estimate.valid))
    return rows


def error(pose: Pose2, estimate: Pose2) -> tuple[float, float]:
    """Distance [m] and angle [rad] between two poses."""
    return math.dist(pose[:2], estimate[:2]), abs(math.remainder(pose[2] - estimate[2], math.tau))


def test_the_nearest_line_of_the_map_is_that_of_the_field():
    random = np.random.default_rng(1)
    x, y = random.uniform(-2.2, 2.2, 200), random.uniform(-1.4, 1.4, 200)
    nearest = MAP.nearest(x, y)
    brute = np.full(200, np.inf)
    for line in SMALL.lines():
        points = np.linspace(line.start, line.end, 900)
        away = np.hypot(x[:, None] - points[:, 0], y[:, None] - points[:, 1])
        brute = np.minimum(brute, away.min(axis=1))
    brute = np.minimum(brute, np.abs(np.hypot(x, y) - SMALL.circle_diameter / 2.0))
    assert np.abs(nearest.distance - brute).max() < 0.02
    beside = nearest.distance > 1e-6
    assert np.allclose(np.hypot(nearest.x, nearest.y)[beside], 1.0)


def test_a_pose_and_its_mirror_pose_explain_an_image_alike():
    random = np.random.default_rng(2)
    poses = random.uniform((-2.0, -1.3, -3.0), (2.0, 1.3, 3.0), (50, 3))
    evidence = Evidence.of(Eyes().see(0, (-1.0, 0.4, 0.3)), MAP)
    here, there = (log_likelihood(evidence, each, MAP)[0] for each in (poses, mirrored(poses)))
    assert np.allclose(here, there, atol=0.6)  # the cells of the map are not mirrored exactly
    assert np.corrcoef(here, there)[0, 1] > 0.99


def test_the_true_pose_explains_an_image_best():
    true = np.array(((-1.0, 0.4, 0.3),))
    evidence = Evidence.of(Eyes().see(0, tuple(true[0])), MAP)
    best, share = log_likelihood(evidence, true, MAP)
    around = true + np.random.default_rng(3).normal(0.0, (0.2, 0.2, 0.2), (100, 3))
    others, shares = log_likelihood(evidence, around, MAP)
    assert best[0] > np.percentile(others, 97)
    assert share[0] > 0.9 > np.median(shares)


@pytest.mark.parametrize("kind", [Kind.CROSSING_L, Kind.CROSSING_T, Kind.GOAL_POST])
def test_poses_drawn_from_an_image_hold_the_true_one(kind: Kind):
    true = (-0.2, 0.2, -0.1)
    seen = Eyes(deviation=0.0).see(0, true)
    poses = poses_from(Evidence.of(seen, MAP), MAP)
    assert seen.of(kind)
    away = [sum(error(true, tuple(pose))) for pose in poses]
    assert min(away) < 1e-6


def test_false_points_in_one_place_count_as_one():
    clump = np.random.default_rng(4).uniform((0.02, 0.02), (0.18, 0.18), (20, 2))
    image = replace(
        nothing(0), line_points=clump, line_covariances=np.tile((VARIANCE, 0.0, VARIANCE), (20, 1))
    )
    assert Evidence.of(image, MAP).weight == pytest.approx(1.0)
    assert Evidence.of(Eyes().see(0, (-1.2, -0.3, 0.0)), MAP).line_weight == LINE_WEIGHT
    localization, eyes = Localization(MAP, SETTINGS), Eyes()
    localization.start(((-1.2, -0.3, 0.0),))
    for pose, motion in course(8.0):
        localization.move(motion, STEP)
        localization.see(Evidence.of(eyes.see(0, pose), MAP))
        localization.see(Evidence.of(image, MAP))
        estimate = localization.estimate()
        assert sum(error(pose, estimate.pose)) < 0.3
    assert estimate.valid


def test_weights_are_shares():
    localization = Localization(MAP, SETTINGS)
    for _ in walk(localization, Eyes(), 1.0):
        assert localization.weights.sum() == pytest.approx(1.0)
        assert (localization.weights >= 0.0).all()


def test_from_a_known_start_the_pose_is_followed_and_valid():
    localization = Localization(MAP, SETTINGS)
    localization.start(((-1.2, -0.3, 0.0),))
    rows = walk(localization, Eyes(), 12.0)
    late = [error(pose, estimate) for pose, estimate, _ in rows[30:]]
    assert np.median([place for place, _ in late]) < 0.05
    assert np.median([turn for _, turn in late]) < math.radians(2.0)
    assert all(valid for _, _, valid in rows[30:])


def test_mirrored_starts_end_in_mirror_poses():
    ends = []
    for start in ((-1.2, -0.3, 0.0), (1.2, 0.3, math.pi)):
        localization = Localization(MAP, SETTINGS)
        localization.start((start,))
        ends.append(walk(localization, Eyes(), 5.0)[-1][1])
    x, y, yaw = mirrored(np.array(ends[:1]))[0]
    place, turn = error((x, y, yaw), ends[1])
    assert place < 0.06
    assert turn < 0.06


def test_from_nowhere_the_pose_is_found_up_to_its_mirror_pose_and_not_valid():
    localization = Localization(MAP, SETTINGS)
    rows = walk(localization, Eyes(), 12.0)
    pose, estimate, _ = rows[-1]
    mirror = tuple(mirrored(np.array((estimate,)))[0])
    assert min(sum(error(pose, each)) for each in (estimate, mirror)) < 0.2
    assert not any(valid for _, _, valid in rows)
    # Only a team mate can tell which one it is.
    for _ in range(5):
        right = sum(error(pose, localization.estimate().pose)) < 0.3
        localization.judge_half(2.0 if right else -2.0)
    pose, estimate, valid = walk(localization, Eyes(), 4.0, pose)[-1]
    assert sum(error(pose, estimate)) < 0.2
    assert valid


def test_after_it_was_carried_the_pose_is_invalid_and_then_found():
    localization = Localization(MAP, SETTINGS)
    localization.start(((-1.2, -0.3, 0.0),))
    walk(localization, Eyes(), 6.0)
    rows = walk(localization, Eyes(), 15.0, (-0.2, 0.9, -2.0))
    wrong = [valid for pose, estimate, valid in rows if sum(error(pose, estimate)) > 0.6]
    assert sum(wrong) <= 10  # at most a second until it is noticed
    pose, estimate, _ = rows[-1]
    mirror = tuple(mirrored(np.array((estimate,)))[0])
    assert min(sum(error(pose, each)) for each in (estimate, mirror)) < 0.2


def test_after_a_shove_the_mirror_pose_is_not_valid_until_team_mates_decide():
    localization, eyes = Localization(MAP, SETTINGS), Eyes()
    localization.start(((-0.5, -0.4, 0.5),))
    x, y, yaw = walk(localization, eyes, 3.0, (-0.5, -0.4, 0.5))[-1][0]
    # It stands where its mirror pose is nearer to its belief than its pose, though not near it.
    shoved = -x - 0.75, -y - 0.1, yaw + math.pi + 0.3
    rows = walk(localization, eyes, 8.0, shoved)
    pose, estimate, _ = rows[-1]
    assert sum(error(pose, estimate)) > 2.0
    assert not any(valid for _, _, valid in rows[20:])
    for _ in range(5):
        right = sum(error(pose, localization.estimate().pose)) < 0.3
        localization.judge_half(2.0 if right else -2.0)
    pose, estimate, valid = walk(localization, eyes, 2.0, pose)[-1]
    assert sum(error(pose, estimate)) < 0.2
    assert valid


@pytest.mark.parametrize(
    "shove", [(0.2, 0.1, 0.2), (-0.1, 0.2, -0.3), (0.05, 0.05, 0.9), (0.0, -0.1, -1.0)]
)
def test_after_a_small_shove_history_tells_the_half(shove: Pose2):
    localization, eyes = Localization(MAP, SETTINGS), Eyes()
    localization.start(((-1.2, -0.3, 0.0),))
    pose = walk(localization, eyes, 3.0)[-1][0]
    pose, estimate, valid = walk(localization, eyes, 5.0, compose(pose, shove))[-1]
    assert sum(error(pose, estimate)) < 0.2
    assert valid


def test_while_particles_are_at_several_places_the_last_valid_pose_is_the_estimate():
    localization, eyes = Localization(MAP, SETTINGS), Eyes()
    start = -1.2, -0.3, 0.0
    localization.start((start,))
    still = Displacement((0.0, 0.0, 0.0), np.zeros((3, 3)))
    stayed = 0
    for index in range(80):
        seen_at = start if index < 20 else ((-0.3, 0.8, -1.2), (0.2, -0.9, 1.4))[index % 2]
        localization.move(still, STEP)
        localization.see(Evidence.of(eyes.see(0, seen_at), MAP))
        estimate = localization.estimate()
        away = np.hypot(*(localization.particles[:, :2] - estimate.pose[:2]).T)
        together = localization.weights[away < 0.6].sum()
        assert not estimate.valid or error(start, estimate.pose)[0] < 0.3
        if error(start, estimate.pose)[0] > 0.3:
            assert together > 0.85
        elif index > 25:
            stayed += 1
    assert stayed > 5


def test_who_is_shoved_round_and_then_falls_does_not_take_one_half_for_the_other():
    """The shove leaves the particles at the mirror pose; they are no history for the fall."""
    for seed in range(6):
        localization = Localization(MAP, SETTINGS.replace(seed=seed))
        localization.start(((-0.7, 0.2, 0.0),))
        x, y, yaw = walk(localization, Eyes(), 4.0, (-0.7, 0.2, 0.0))[-1][0]
        shoved = walk(localization, Eyes(), 1.5, (x, y, yaw + 1.9))[-1][0]
        localization.disturb(0.3, 0.5)
        for true, estimate, valid in walk(localization, Eyes(), 5.0, shoved):
            assert not valid or error(true, estimate)[1] < 1.5


def test_without_evidence_the_pose_does_not_stay_valid():
    localization = Localization(MAP, SETTINGS)
    localization.start(((-1.2, -0.3, 0.0),))
    walk(localization, Eyes(), 4.0)
    at_rest = Displacement((0.0, 0.0, 0.0), np.zeros((3, 3)))
    for _ in range(300):
        localization.move(at_rest, STEP)
        localization.see(Evidence.of(nothing(0), MAP))
    assert not localization.is_valid


def test_after_a_fall_the_heading_is_found_again():
    for turn in (-1.0, -0.5, 0.6, 1.0):
        localization = Localization(MAP, SETTINGS)
        localization.start(((-1.2, -0.3, 0.0),))
        pose = walk(localization, Eyes(), 4.0)[-1][0]
        localization.disturb(0.3, math.radians(60.0))
        rows = walk(localization, Eyes(), 6.0, (pose[0], pose[1], pose[2] + turn))
        true, estimate, valid = rows[-1]
        assert sum(error(true, estimate)) < 0.2
        assert valid


@pytest.mark.parametrize("pose", [(-1.2, -0.3, 0.0), (0.0, -0.8, 1.2), (0.4, 0.2, -2.0)])
def test_an_error_of_the_tilt_that_lasts_hardly_moves_the_pose(pose: Pose2):
    eyes, at_rest = Eyes(deviation=0.0), Displacement((0.0, 0.0, 0.0), np.diag((1e-5, 1e-5, 1e-5)))
    image = Evidence.of(eyes.see(0, pose), MAP)
    # All percepts are one such deviation too far away, as by a camera that looks lower.
    deviation = TILT * math.sqrt(VARIANCE)
    moved = replace(
        image,
        points=_further(image.points, deviation),
        landmarks=tuple(
            replace(each, position=_further(each.position[None], deviation)[0])
            for each in image.landmarks
        ),
    )
    ends = []
    for evidence in (image, moved):
        localization = Localization(MAP, SETTINGS)
        localization.start((pose,), place=0.05, heading=0.05)
        poses = []
        for _ in range(60):
            localization.move(at_rest, STEP)
            localization.see(evidence)
            poses.append(localization.estimate().pose)
        ends.append(np.mean(poses[20:], axis=0))
    shift = ends[1] - ends[0]
    assert math.hypot(*shift[:2]) < 0.008  # over 0.012 without
    c = localization.estimate().covariance
    assert (shift**2 < 4.0 * np.array((c.xx, c.yy, c.yaw))).all()


def test_a_pose_in_the_wrong_half_is_turned_with_its_whole_covariance():
    localization = Localization(MAP, SETTINGS)
    localization.start(((-1.2, -0.3, 0.0),))
    walk(localization, Eyes(), 5.0)
    before = localization.estimate()
    localization.judge_half(-20.0)
    after = localization.estimate()
    turned = tuple(mirrored(np.array((before.pose,)))[0])
    assert sum(error(turned, after.pose)) == pytest.approx(0.0, abs=1e-9)
    a, b = before.covariance, after.covariance
    assert (b.xx, b.xy, b.yy, b.yaw) == pytest.approx((a.xx, a.xy, a.yy, a.yaw))
    assert (b.x_yaw, b.y_yaw) == pytest.approx((-a.x_yaw, -a.y_yaw))


def _further(places: np.ndarray, by: float) -> np.ndarray:
    """Places (n, 2) that are further away by a distance [m]."""
    return places * (1.0 + by / np.hypot(*places.T))[:, None]


def test_who_is_carried_into_the_other_half_is_found_by_landmarks_that_are_known():
    """Landmarks that are known by name have no mirror pose, wherever the robot was before."""
    poles = tuple(Pole(x=x, y=y) for x in (-4.0, 1.0, 4.0) for y in (-2.5, 0.5, 2.5))
    settings = WorldSettings(poles=poles)
    field = FieldMap(settings.field, settings.goals, poles)
    localization = Localization(field, settings)
    localization.start(((-2.0, 0.3, 0.0),))
    true = np.array((2.0, -0.3, 3.0))
    near = seen_from(tuple(true), np.array([(each.x, each.y) for each in poles]))
    seen = tuple(
        Percept(Kind.POLE, (x, y), (1e-3, 0.0, 1e-3), place=index)
        for index, (x, y) in enumerate(near.tolist())
        if x > 0.0
    )
    for _ in range(40):
        localization.see(Evidence.of(Percepts(0, objects=seen), field))
    own = localization.estimate()
    assert own.valid
    assert own.pose[:2] == pytest.approx(true[:2], abs=0.1)
    assert own.pose[2] == pytest.approx(true[2], abs=0.05)


def test_one_landmark_that_is_known_tells_the_half_of_who_knows_its_place():
    """A ball near the middle, seen badly by team mates, does not make its pose doubtful."""
    poles = (Pole(x=2.0, y=1.0), Pole(x=-2.0, y=-1.0))  # each other's mirror images
    settings = WorldSettings(poles=poles)
    field = FieldMap(settings.field, settings.goals, poles)
    localization = Localization(field, settings)
    localization.start(((0.5, 0.3, 0.0),), place=0.05, heading=0.05)
    seen = (Percept(Kind.POLE, (1.5, 0.7), (1e-3, 0.0, 1e-3), place=0),)
    localization.judge_half(-11.0)
    assert not localization.estimate().valid
    localization.see(Evidence.of(Percepts(0, objects=seen), field))
    assert localization.estimate().valid
    for _ in range(3):
        localization.judge_half(-11.0)
    own = localization.estimate()
    assert own.valid
    assert own.pose[:2] == pytest.approx((0.5, 0.3), abs=0.1), "not turned into the other half"
    for _ in range(20):  # the other one: it is somewhere else
        other = (Percept(Kind.POLE, (1.5, 0.7), (1e-3, 0.0, 1e-3), place=1),)
        localization.see(Evidence.of(Percepts(0, objects=other), field))
    assert not localization.estimate().valid


def _pole_seen(pole: Pole, index: int, pose: Pose2, further: float = 0.0) -> Percepts:
    """An image of one pole, `further` standard deviations too far away; known by its place."""
    ((x, y),) = seen_from(pose, np.array([(pole.x, pole.y)])).tolist()
    far = math.hypot(x, y)
    along, across = 0.03 * far * far, 0.02 * far
    scale = 1.0 + further * along / far
    ux, uy = x / far, y / far
    difference = along**2 - across**2
    covariance = (
        across**2 + difference * ux * ux, difference * ux * uy, across**2 + difference * uy * uy
    )
    pole_seen = Percept(Kind.POLE, (scale * x, scale * y), covariance, place=index)
    return Percepts(0, objects=(pole_seen,))


@pytest.mark.parametrize("further", [-1.0, 1.0])
def test_a_camera_whose_tilt_is_wrong_is_noticed_by_landmarks_near_and_far(further: float):
    """No pose explains that all of them are too far, or too near; an error of the tilt does."""
    poles = tuple(Pole(x=x, y=y) for x, y in ((1.5, 0.5), (6.0, -1.0), (0.0, 5.0), (-0.5, -1.5)))
    settings = WorldSettings(poles=poles)
    field = FieldMap(settings.field, settings.goals, poles)
    localization = Localization(field, settings)
    localization.start(((0.2, 0.1, 0.3),))
    for count in range(240):
        localization.move(Displacement((0.0, 0.0, 0.0), np.eye(3) * 1e-8), 0.04)
        index = count // 10 % len(poles)
        image = _pole_seen(poles[index], index, (0.2, 0.1, 0.3), further)
        localization.see(Evidence.of(image, field))
        if count >= 120:  # 0.03 m without
            assert localization.estimate().pose[:2] == pytest.approx((0.2, 0.1), abs=0.02)


def test_a_lost_robot_that_sees_one_known_landmark_at_a_time_finds_its_place():
    poles = (Pole(x=0.0, y=3.0), Pole(x=0.0, y=-3.0))
    settings = WorldSettings(poles=poles)
    field = FieldMap(settings.field, settings.goals, poles)
    localization = Localization(field, settings)
    localization.start(((1.5, 1.0, 2.5),))
    true = (-0.7, -0.5, -0.4)
    for count in range(150):
        index = count // 5 % 2
        localization.see(Evidence.of(_pole_seen(poles[index], index, true), field))
    own = localization.estimate()
    assert own.valid
    assert own.pose == pytest.approx(true, abs=0.25)
