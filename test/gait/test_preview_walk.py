"""ZMP preview control: its gains are optimal, its ZMP is tracked, and it walks like a walk."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from nao_lipm_gait.parameters import GaitParameters, load_preset
from nao_lipm_gait.walks.base import BodyTargets, SoleTarget
from nao_lipm_gait.walks.preview.preview_control import (
    PreviewAxis,
    PreviewGains,
    cart_table,
    preview_gains,
    riccati,
)
from nao_lipm_gait.walks.preview.walk import PREVIEW_TIME, PreviewWalk
from robot_core.geometry import compose
from robot_core.types import GRAVITY, STANDSTILL, VelocityCommand

DT = 0.01
HEIGHT = 0.24
HORIZON = 80
WEIGHT = 1e4
PREVIEW = load_preset("preview")
FORWARD = VelocityCommand(0.1, 0.0, 0.0)


# -- model and gains -------------------------------------------------------------------------------


def servo(weight: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """The model with the ZMP's error as its first state, written down from the continuous one."""
    a = np.array([[1, DT, DT**2 / 2], [0, 1, DT], [0, 0, 1]])
    b = np.array([[DT**3 / 6], [DT**2 / 2], [DT]])
    c = np.array([[1, 0, -HEIGHT / GRAVITY]])
    a_1 = np.block([[np.eye(1), c @ a], [np.zeros((3, 1)), a]])
    return a_1, np.vstack((c @ b, b)), np.diag([1.0, 0.0, 0.0, 0.0]), 1.0 / weight**2


def test_the_cart_moves_as_its_matrices_say() -> None:
    table = cart_table(HEIGHT, DT)
    a, b, c = table.matrices()
    state = np.array([0.3, -0.2, 1.5])
    assert table.advance(*state, 7.0) == pytest.approx((a @ state + b[:, 0] * 7.0).tolist())
    assert table.zmp(state[0], state[2]) == pytest.approx(float((c @ state)[0]))


@pytest.mark.parametrize("weight", [100.0, 1e3, WEIGHT, 1e5])
def test_gains_are_those_of_the_riccati_equation(weight: float) -> None:
    a, b, q, r = servo(weight)
    p = solve_discrete_are(a, b, q, np.array([[r]]))
    assert riccati(a, b, q, r) == pytest.approx(p, rel=1e-5)
    gain = np.linalg.solve(r + b.T @ p @ b, b.T @ p @ a)[0]
    gains = preview_gains(HEIGHT, DT, HORIZON, weight)
    assert gains.of_error_sum == pytest.approx(gain[0], rel=1e-5)
    assert gains.of_state == pytest.approx(gain[1:].tolist(), rel=1e-5)
    assert gains.of_preview[0] == pytest.approx(-gain[0], rel=1e-5), "G_p(1) = -G_e"
    closed = a - b @ gain[None, :]
    assert np.abs(np.linalg.eigvals(closed)).max() < 1.0
    for j in (2, 5, 40):
        ahead = np.linalg.matrix_power(closed.T, j - 1) @ p[:, 0]
        expected = -float(b[:, 0] @ ahead) / (r + float((b.T @ p @ b)[0, 0]))
        assert gains.of_preview[j - 1] == pytest.approx(expected, rel=1e-4)


def test_with_a_long_horizon_the_cart_can_rest_anywhere() -> None:
    gains = preview_gains(HEIGHT, DT, 400, WEIGHT)
    assert gains.of_state[0] == pytest.approx(-gains.of_preview.sum(), rel=1e-6)


def test_no_other_control_is_cheaper() -> None:
    """The cost of the preview servo against the same with gains that are a little off."""
    gains = preview_gains(HEIGHT, DT, 200, WEIGHT)
    wanted = np.zeros(900)
    wanted[300:] = 0.05

    def cost(changed: PreviewGains) -> float:
        axis, total, last = PreviewAxis(), 0.0, 0.0
        for k in range(650):
            before = axis.a
            total += (gains.table.zmp(axis.x, axis.a) - wanted[k]) ** 2
            axis.step(wanted[k], wanted[k + 1 : k + 201], changed)
            jerk = (axis.a - before) / DT
            total += ((jerk - last) / WEIGHT) ** 2
            last = jerk
        return total

    best = cost(gains)
    for share in (0.9, 1.1):
        assert cost(replace(gains, of_preview=share * gains.of_preview)) > best
        assert cost(replace(gains, of_error_sum=share * gains.of_error_sum)) > best
        assert cost(replace(gains, of_state=(gains.of_state[0], share * gains.of_state[1],
                                             gains.of_state[2]))) > best  # fmt: skip


def test_the_cart_begins_before_the_zmp_does() -> None:
    gains = preview_gains(HEIGHT, DT, HORIZON, WEIGHT)
    wanted = np.where(np.arange(400) < 150, 0.0, 0.06)
    axis, xs, zmps = PreviewAxis(), [], []
    for k in range(300):
        xs.append(axis.x)
        zmps.append(gains.table.zmp(axis.x, axis.a))
        axis.step(wanted[k], wanted[k + 1 : k + 1 + HORIZON], gains)
    assert xs[149] == pytest.approx(0.03, abs=0.003), "half-way, as the pendulum's symmetry asks"
    assert np.abs(np.array(zmps)[:140]).max() < 0.002
    assert xs[-1] == pytest.approx(0.06, abs=1e-4)
    assert zmps[-1] == pytest.approx(0.06, abs=1e-4)


# -- the walk --------------------------------------------------------------------------------------


def walked(walk: PreviewWalk, command: VelocityCommand, seconds: float) -> list[BodyTargets]:
    targets = []
    for _ in range(round(seconds / DT)):
        walk.expect()
        walk.observe(0.0, 0.0)
        targets.append(walk.plan(command))
    return targets


def started(command: VelocityCommand, parameters: GaitParameters = PREVIEW) -> PreviewWalk:
    walk = PreviewWalk(parameters, DT)
    walked(walk, STANDSTILL, 0.3)
    walk.start(command)
    return walk


def in_odom(targets: BodyTargets, sole: SoleTarget) -> tuple[float, float, float]:
    return compose(targets.q_in_odom, (sole.x, sole.y, sole.yaw))


def coms(targets: list[BodyTargets]) -> np.ndarray:
    return np.array([compose(t.q_in_odom, (*t.com_in_q[:2], 0.0))[:2] for t in targets])


COMMANDS = [
    VelocityCommand(0.2, 0.0, 0.0),
    VelocityCommand(-0.15, 0.0, 0.0),
    VelocityCommand(0.0, 0.08, 0.0),
    VelocityCommand(0.0, 0.0, 0.7),
    VelocityCommand(0.1, -0.04, 0.4),
]


@pytest.mark.parametrize("command", COMMANDS)
def test_the_zmp_of_the_planned_com_follows_the_desired_zmp(command: VelocityCommand) -> None:
    """From start to stop, by differences of the CoM and not by the walk's own model."""
    walk = started(command)
    wanted, targets = [], []
    for tick in range(900):
        origin = walk.origin_in_q
        walk.expect()
        targets.append(walk.plan(command if tick < 500 else STANDSTILL))
        wanted.append(compose(targets[-1].q_in_odom, (*origin, 0.0))[:2])
    com = coms(targets)
    acceleration = (com[2:] - 2.0 * com[1:-1] + com[:-2]) / DT**2
    error = np.abs(com[1:-1] - HEIGHT / GRAVITY * acceleration - np.array(wanted)[1:-1])
    jumps = np.abs(np.diff(wanted, axis=0)).max(axis=1) > 0.01
    changing = np.convolve(jumps, np.ones(7), mode="same")[:-1] > 0.0  # 30 ms to both sides
    assert np.median(error) < 0.002
    assert error[~changing].mean() < 0.001
    assert error[~changing].max() < 0.012
    assert error[changing].max() < 2.0 * PREVIEW.zmp_offset_y, "the way from foot to foot"


@pytest.mark.parametrize("command", COMMANDS)
def test_it_starts_walks_and_stops_without_a_jump(command: VelocityCommand) -> None:
    walk = started(command)
    targets = walked(walk, command, 4.0) + walked(walk, STANDSTILL, 4.0)
    assert walk.finished
    com = coms(targets)
    assert np.abs(np.diff(com, axis=0)).max() < 0.006
    assert np.abs(np.diff(com, n=2, axis=0)).max() < 20.0 * DT**2
    assert walk.predicted.x == pytest.approx(0.0, abs=1e-4)
    assert walk.predicted.y == pytest.approx(0.0, abs=1e-4)
    assert np.abs(np.diff(com[-20:], axis=0)).max() < 1e-5, "at rest"
    for side in ("left_sole", "right_sole"):
        soles = np.array([in_odom(t, getattr(t, side))[:2] for t in targets])
        up = np.array([getattr(t, side).z > 0.0 for t in targets])
        moved = np.abs(np.diff(soles, axis=0)).max(axis=1) > 1e-9
        assert not (moved & ~up[1:] & ~up[:-1]).any(), "a foot on the ground stands"


def test_the_weight_first_goes_to_the_foot_that_does_not_step() -> None:
    walk = started(VelocityCommand(0.0, 0.08, 0.0))
    ticks = round(PREVIEW_TIME / DT)
    shift = [t.com_in_q[1] for t in walked(walk, VelocityCommand(0.0, 0.08, 0.0), ticks * DT)]
    assert min(shift) < -0.01, "to the right: the left foot leads"
    assert walk.predicted.support == 1 or walk.predicted.phase.name == "SHIFT"
    walked(walk, VelocityCommand(0.0, 0.08, 0.0), 3 * DT)
    assert walk.predicted.support == -1


def test_new_parameters_apply_from_the_next_half_stride_on() -> None:
    changed, same = started(FORWARD), started(FORWARD)
    for walk in (changed, same):
        walked(walk, FORWARD, 2.0)
    changed.set_parameters(PREVIEW.replace(pendulum_height=0.26))
    rest = changed.time_left
    until = walked(changed, FORWARD, rest), walked(same, FORWARD, rest)
    assert np.array_equal(coms(until[0]), coms(until[1]))
    after = walked(changed, FORWARD, 2.0), walked(same, FORWARD, 2.0)
    assert not np.array_equal(coms(after[0]), coms(after[1]))
    assert np.abs(np.diff(coms(after[0]), axis=0)).max() < 0.006
