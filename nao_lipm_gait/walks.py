"""The walks that the parameter `walk` chooses from."""

from collections.abc import Callable

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.lipm_walk.lipm_walk import LipmWalk
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.preview_walk.preview_walk import PreviewWalk
from nao_lipm_gait.walk import Walk
from nao_lipm_gait.zmp_walk.zmp_walk import ZmpWalk

WALKS: dict[str, Callable[[GaitParameters, float], Walk]] = {
    "lipm": LipmWalk,
    "zmp": ZmpWalk,
    "preview": PreviewWalk,
}


def make_walk(parameters: GaitParameters, control_period: float) -> Walk:
    """The walk of the parameters, standing; control_period [s]."""
    if parameters.walk not in WALKS:
        raise NaoGaitError("walk", parameters.walk, f"one of {', '.join(WALKS)}")
    return WALKS[parameters.walk](parameters, control_period)
