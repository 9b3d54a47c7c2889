"""The pendulum walk in an ideal world, where the measured CoM is the committed one."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.walks.lipm.extensions.disturbances import unexplained_acceleration
from nao_lipm_gait.walks.lipm.state import NextSupport, Segment, WalkState, follow
from nao_lipm_gait.walks.lipm.walk import CATCH_UP, LipmWalk
from robot_core.geometry import compose
from robot_core.types import LEFT, STANDSTILL, VelocityCommand

DT = 0.01
P = GaitParameters()
P_DELAY = round(P.feedback_delay / DT)
FORWARD = VelocityCommand(0.1, 0.0, 0.0)
ON_THE_SPOT = VelocityCommand(1e-9, 0.0, 0.0)
"""Not zero, which would be a stop."""


def run(
    walk: LipmWalk,
    command: VelocityCommand,
    ticks: int,
    disturb: dict[int, tuple[float, float]] | None = None,
) -> list[dict[str, float]]:
    """Ticks with exact measurements, shifted by (x, y) [m] at some ticks."""
    rows = []
    for tick in range(ticks):
        expectation = walk.expect()
        x, y = expectation.com_in_q
        dx, dy = (disturb or {}).get(tick, (0.0, 0.0))
        walk.observe(x + dx, y + dy)
        targets = walk.plan(command)
        com = compose(targets.q_in_odom, (*targets.com_in_q[:2], 0.0))
        rows.append(
            {
                "x": com[0],
                "y": com[1],
                "vx": walk.predicted.vx,
                "origin": walk.origin_in_q[0],
                "support": walk.predicted.support,
                "yaw": com[2],
                "left_x": targets.left_sole.x,
                "left_z": targets.left_sole.z,
                "right_z": targets.right_sole.z,
                "steps": walk.predicted.step_count,
            }
        )
    return rows


def started(command: VelocityCommand, parameters: GaitParameters = P) -> LipmWalk:
    walk = LipmWalk(parameters, DT)
    walk.start(command)
    return walk


def test_constant_speed_needs_no_shift_of_the_origin() -> None:
    command = VelocityCommand(0.2, 0.0, 0.0)
    rows = run(started(command), command, 1000)
    assert max(abs(row["origin"]) for row in rows[500:]) < 1e-6
    speed = (rows[-1]["x"] - rows[499]["x"]) / (500 * DT)
    assert speed == pytest.approx(0.2, abs=0.005)


@pytest.mark.parametrize(
    "command",
    [VelocityCommand(-0.15, 0, 0), VelocityCommand(0, 0.05, 0), VelocityCommand(0, 0, 0.6)],
)
def test_reaches_the_commanded_velocity(command: VelocityCommand) -> None:
    rows = run(started(command), command, 1600)
    seconds = 800 * DT
    yaw = rows[-1]["yaw"] - rows[799]["yaw"]
    travelled = math.hypot(rows[-1]["x"] - rows[799]["x"], rows[-1]["y"] - rows[799]["y"])
    wanted = math.hypot(command.x, command.y)
    assert yaw / seconds == pytest.approx(command.yaw, abs=0.05)
    assert travelled / seconds == pytest.approx(wanted, abs=0.01)


@pytest.mark.parametrize("delay", [0.0, 0.02, 0.06, 0.12, 0.2])
def test_any_delay_gives_the_same_walk(delay: float) -> None:
    # Also a delay that reaches over a whole support change, or nearly over a whole step.
    command = VelocityCommand(0.15, 0.02, 0.1)
    reference = run(started(command, P.replace(feedback_delay=0.0)), command, 400)
    # Targets belong to the time at which they take effect, so no delay may show in them.
    delayed = run(started(command, P.replace(feedback_delay=delay)), command, 400)
    for row, wanted in zip(delayed, reference, strict=True):
        assert (row["x"], row["y"]) == pytest.approx((wanted["x"], wanted["y"]), abs=1e-9)


def test_com_moves_without_jumps_over_support_changes() -> None:
    command = VelocityCommand(0.2, 0.03, 0.3)
    rows = run(started(command), command, 600)
    way = np.array([(row["x"], row["y"]) for row in rows])
    acceleration = np.diff(way, 2, axis=0) / DT**2
    # k^2 times the distance to the origin is all that a pendulum can do.
    assert np.abs(acceleration).max() < 9.81 / P.pendulum_height * 0.12


def test_one_foot_is_always_on_the_ground() -> None:
    command = VelocityCommand(0.2, 0.0, 0.0)
    rows = run(started(command), command, 400)
    assert all(min(row["left_z"], row["right_z"]) == 0.0 for row in rows)
    assert max(row["left_z"] for row in rows) == pytest.approx(P.swing_lift, rel=0.05)
    assert max(row["right_z"] for row in rows) == pytest.approx(P.swing_lift, rel=0.05)


def test_left_and_right_are_mirror_images() -> None:
    left = run(started(VelocityCommand(0.1, 0.04, 0.4)), VelocityCommand(0.1, 0.04, 0.4), 500)
    right = run(started(VelocityCommand(0.1, -0.04, -0.4)), VelocityCommand(0.1, -0.04, -0.4), 500)
    for a, b in zip(left, right, strict=True):
        assert (a["x"], a["y"], a["yaw"]) == pytest.approx((b["x"], -b["y"], -b["yaw"]), abs=1e-9)
        assert a["support"] == -b["support"]


def test_a_disturbance_changes_the_step_and_dies_out() -> None:
    command = VelocityCommand(0.1, 0.0, 0.0)
    kick = {tick: (0.015, 0.015) for tick in range(300, 306)}
    kicked = run(started(command), command, 1000, kick)
    calm = run(started(command), command, 1000)
    difference = [abs(a["vx"] - b["vx"]) for a, b in zip(kicked, calm, strict=True)]
    assert max(difference[300:400]) > 0.003
    assert kicked[-1]["vx"] == pytest.approx(
        next(row["vx"] for row in calm[-60:] if abs(row["vx"] - kicked[-1]["vx"]) < 0.01), abs=0.01
    )
    assert max(abs(row["origin"]) for row in kicked[-200:]) < 1e-3


def test_open_loop_ignores_measurements() -> None:
    command = VelocityCommand(0.1, 0.0, 0.0)
    parameters = P.replace(feedback=False)
    kick = {tick: (0.05, -0.05) for tick in range(100, 200)}
    kicked = run(started(command, parameters), command, 400, kick)
    assert kicked == run(started(command, parameters), command, 400)


@pytest.mark.parametrize("ticks", range(150, 200, 7))
def test_stops_at_rest_between_the_feet_from_any_phase(ticks: int) -> None:
    command = VelocityCommand(0.2, 0.02, 0.3)
    walk = started(command)
    run(walk, command, ticks)
    for _ in range(600):
        if walk.finished:
            break
        run(walk, STANDSTILL, 1)
    assert walk.finished
    state = walk.predicted
    assert math.hypot(state.x, state.y) < 0.003
    assert math.hypot(state.vx, state.vy) < 0.015
    rows = run(walk, STANDSTILL, 100)
    assert rows[-1]["left_z"] == rows[-1]["right_z"] == 0.0
    # The robot stands with its feet side by side again.
    assert rows[-1]["left_x"] == pytest.approx(-P.foot_reference_x, abs=0.002)


def test_a_change_of_other_parameters_keeps_what_has_been_learned() -> None:
    def corrections(**changes: float) -> float:
        """What a constant error of 1 cm adds to y [m] in 0.5 s, after 10 s of learning it."""
        walk, total = started(ON_THE_SPOT, P.replace(offset_time=3.0)), 0.0
        error = {0: (0.0, 0.01)}
        for _ in range(1000):
            run(walk, ON_THE_SPOT, 1, error)
        walk.set_parameters(P.replace(**({"offset_time": 3.0} | changes)))
        for _ in range(50):
            run(walk, ON_THE_SPOT, 1, error)
            total += walk.estimated.y - walk.expected.y
        return total

    kept = corrections()
    assert corrections(swing_lift=0.03) == corrections(sway_limit=0.02) == kept
    assert kept < 0.5 * corrections(offset_time=2.0)


def test_the_error_of_the_com_for_which_there_is_torque_is_a_share_of_the_learned_one() -> None:
    walk = started(ON_THE_SPOT, P.replace(offset_time=1.0, lean_torque=0.5))
    for _ in range(800):
        run(walk, ON_THE_SPOT, 1, {0: (0.01, 0.0)})
    assert walk.com_ahead == pytest.approx(0.005, rel=0.2)
    assert started(ON_THE_SPOT).com_ahead == 0.0


def test_a_stop_ends_even_if_the_feedback_keeps_moving_the_feet() -> None:
    walk = started(STANDSTILL)
    rows = []
    for _ in range(800):
        if walk.finished:
            break
        rows += run(walk, STANDSTILL, 1, {0: (0.012, 0.0)})
    assert walk.finished
    # Walking on from there begins with the feet where they are.
    before = run(walk, STANDSTILL, 5)[-1]
    walk.start(FORWARD)
    after = run(walk, FORWARD, 1)[0]
    for name in ("left_x", "x", "y"):
        assert after[name] == pytest.approx(before[name], abs=0.004)


def test_survives_absurd_measurements_with_finite_targets() -> None:
    command = VelocityCommand(0.2, 0.0, 0.0)
    rng = np.random.default_rng(3)
    kicks = {tick: tuple(rng.normal(0.0, 1.0, 2)) for tick in range(600)}
    rows = run(started(command), command, 600, kicks)
    assert all(map(math.isfinite, (value for row in rows for value in row.values())))


@pytest.mark.parametrize("command", [
    VelocityCommand(0.2, 0.1, 0.0), VelocityCommand(-0.2, 0.08, 0.0),
    VelocityCommand(0.2, 0.0, 0.6), VelocityCommand(0.15, 0.0, -1.0),
])  # fmt: skip
def test_an_undisturbed_diagonal_or_curve_needs_hardly_any_origin_shift(
    command: VelocityCommand,
) -> None:
    walk = LipmWalk(GaitParameters(), 0.01)
    walk.start(command)
    shifts = []
    for tick in range(600):
        expected = walk.expect()
        walk.observe(*expected.com_in_q)
        walk.plan(command)
        if tick > 300:
            shifts.append(abs(walk.origin_in_q[0]))
    assert max(shifts) < 0.003


def test_a_pendulum_as_wide_as_its_offset_gives_finite_targets_in_a_curve() -> None:
    walk = LipmWalk(GaitParameters(), 0.01)
    command = VelocityCommand(0.1, 0.08, 0.5)
    walk.start(command)
    for tick in range(400):
        if tick == 100:
            walk.set_parameters(GaitParameters(pendulum_width=0.05, pendulum_offset_y=0.05))
        expected = walk.expect()
        walk.observe(*expected.com_in_q)
        assert all(math.isfinite(value) for value in walk.plan(command).com_in_q)


def test_a_delay_that_wanders_makes_no_step_in_the_walk() -> None:
    random, usual, wandering = np.random.default_rng(3), started(FORWARD), started(FORWARD)
    wanted = [usual.plan(FORWARD).com_in_q for _ in expectations(usual, 300)]
    found: list[tuple[float, float, float]] = []
    late = 0
    for _ in range(200):
        due = max(0, min(1 + random.integers(-3, 4), 1 + 6 - late))
        late += due - 1
        for _ in expectations(wandering, 1):
            found += [wandering.plan(FORWARD, sent=last == due - 1).com_in_q for last in range(due)]
        if due == 0 and late > -4:
            assert wandering.replan().com_in_q == pytest.approx(found[-1], abs=1e-9)
    assert np.array(found) == pytest.approx(np.array(wanted[: len(found)]), abs=1e-9)


def expectations(walk: LipmWalk, ticks: int) -> Iterator[None]:
    """Ticks with exact measurements; the caller plans in each."""
    for _ in range(ticks):
        walk.observe(*walk.expect().com_in_q)
        yield


def test_a_measurement_of_joints_that_held_their_targets_corrects_nothing() -> None:
    walk = started(FORWARD)
    for _ in expectations(walk, 100):
        walk.plan(FORWARD)
    walk.expect()
    walk.plan(FORWARD, sent=False)
    moved = []
    for _ in range(P_DELAY + 4):
        x, y = walk.expect().com_in_q
        walk.observe(x + 0.01, y)
        moved.append(walk.estimated.x > x)
        walk.plan(FORWARD)
    held = P_DELAY - 1
    assert moved == [each < held or each > held + CATCH_UP for each in range(len(moved))]


@pytest.mark.parametrize("yaw", [0.0, 0.4])
def test_the_pendulum_explains_k2_times_its_distance(yaw: float) -> None:
    k, dt = 6.4, 1e-4
    before = WalkState(LEFT, 0.02, -0.01, 0.3, 0.1, (0.0, 0.05, 0.0), (1.0, 2.0, 0.3), 4)
    change = None if yaw == 0.0 else NextSupport((0.0, 0.0, yaw), (0.0, -0.05, 0.0))
    after = follow(before, (Segment(dt, 0.005, 0.05, change),), k)
    explained = -np.array(unexplained_acceleration(before, after, (0.0, 0.0), dt))
    in_q = k * k * np.array([0.02 - 0.005, -0.01 - 0.05])
    turned = [[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]] @ in_q
    assert explained == pytest.approx(turned, rel=1e-2)


def side_steps(extra: dict[int, float]) -> list[float]:
    """s-bar_y [m] of a walk that measures the pendulum's acceleration plus `extra` in y [m/s^2]."""
    walk = started(ON_THE_SPOT)
    before, steps = walk.estimated, []
    for tick in range(150):
        expectation = walk.expect()
        x, y = unexplained_acceleration(before, walk.expected, (0.0, 0.0), DT)
        walk.observe(*expectation.com_in_q, (-x, extra.get(tick, 0.0) - y))
        before = walk.estimated
        walk.plan(ON_THE_SPOT)
        steps.append(walk.step_size[1])
    return steps


def test_an_expected_acceleration_moves_no_foot() -> None:
    assert max(map(abs, side_steps({}))) < 1e-6


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_acceleration_of_a_push_moves_the_next_foot(sign: float) -> None:
    steps = side_steps({tick: sign * 6.0 for tick in range(100, 110)})
    assert max(map(abs, steps[:100])) < 1e-6
    assert max(map(abs, steps[100:])) > 0.005


def test_one_step_gets_longer_within_its_limit() -> None:
    def steps(ahead: float) -> list[float]:
        """The sizes [m] of the steps in their middle; the sixth is asked to be longer."""
        walk, sizes, left = started(FORWARD), [], 0.0
        while len(sizes) < 8:
            run(walk, FORWARD, 1)
            if walk.time_left < 0.1 <= left:
                sizes.append(walk.step_size[0])
            if len(sizes) == 5 and walk.time_left > left:
                walk.lengthen(ahead)
            left = walk.time_left
        return sizes

    usual, longer, longest = steps(0.0), steps(0.03), steps(1.0)
    assert longer[:5] == usual[:5]
    assert longer[5] == pytest.approx(usual[5] + 0.03)
    assert longer[6:] == pytest.approx(usual[6:], abs=2e-3)  # and no other one
    assert longest[5] == pytest.approx(P.step_forward_max)
