"""The walks that the parameter `walk` chooses from."""

from collections.abc import Callable

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.walks.base import Walk
from nao_lipm_gait.walks.lipm.walk import LipmWalk
from nao_lipm_gait.walks.preview.walk import PreviewWalk
from nao_lipm_gait.walks.zmp.walk import ZmpWalk

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
