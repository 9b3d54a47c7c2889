"""A walk that begins where the ground holds the feet, not where the stand would have them."""

from itertools import islice

import pytest

from nao_lipm_gait.parameters import load_preset
from nao_lipm_gait.walks.base import Walk
from nao_lipm_gait.walks.lipm.walk import LipmWalk
from nao_lipm_gait.walks.preview.walk import PreviewWalk
from nao_lipm_gait.walks.zmp.walk import ZmpWalk
from robot_core.types import STANDSTILL, VelocityCommand
from sim_bridge.trials.trial import TimedCommands, TrialSpec, make_gait, make_world, run

DT, INWARD = 0.01, 0.012
FORWARD = VelocityCommand(0.2, 0.0, 0.0)
WALKS = {"default": LipmWalk, "zmp": ZmpWalk, "preview": PreviewWalk}


@pytest.mark.parametrize("preset", WALKS)
def test_the_first_targets_have_the_soles_where_they_are(preset: str) -> None:
    parameters = load_preset(preset)
    walk: Walk = WALKS[preset](parameters, DT)
    walk.start(FORWARD)
    usual = walk.plan(FORWARD)
    walk = WALKS[preset](parameters, DT)
    walk.start(FORWARD, INWARD)
    closer = walk.plan(FORWARD)
    assert closer.left_sole.y == pytest.approx(usual.left_sole.y - INWARD, abs=1e-9)
    assert closer.right_sole.y == pytest.approx(usual.right_sole.y + INWARD, abs=1e-9)


@pytest.mark.parametrize("seed", [3, 40])
def test_an_op3_that_walks_at_once_stays_up(seed: int) -> None:
    """It stands with its legs straight down, 27 mm narrower than it walks."""
    pytest.importorskip("mujoco")
    spec = TrialSpec(
        robot_seed=seed, noise_seed=seed, parameters=load_preset("op3"), urdf="op3", engine="mujoco"
    )
    commands = TimedCommands(lambda time: FORWARD if time > 0.3 else STANDSTILL)
    with make_world(spec) as world:
        for tick in islice(run(world, make_gait(spec), commands), 350):
            place = tick.truth.torso_position
    assert place[2] > 0.2
    assert place[0] > 0.2
