"""The walk engines. To add one, write its folder and add one line to `WALKS`.

The parameter `walk` takes its choices from here, so this module imports no engine; `make_walk` of
`nao_lipm_gait.walks.base` loads the requested one.
"""

from importlib import import_module
from typing import Any, NamedTuple


class WalkKind(NamedTuple):
    """Where a walk engine is.

    Attributes:
        engine: Its class with its module, called as `engine(parameters, control_period)`; a
            `nao_lipm_gait.walks.base.Walk`.
        meaning: One phrase for the documentation of the parameter `walk`.
        flat_stance: The stance sole of an undisturbed walk stays flat on the ground, so that it
            shows the vertical; it then reveals a jump of the gyro's bias.
    """

    engine: str
    parameters: str
    meaning: str
    flat_stance: bool = False


def load_class(path: str) -> Any:
    """The class of a path `module.Class`."""
    module, _, name = path.rpartition(".")
    return getattr(import_module(module), name)


_WALKS = "nao_lipm_gait.walks"
_LIPM_PARAMETERS = f"{_WALKS}.lipm.parameters.LipmParameters"
_ZMP_PARAMETERS = f"{_WALKS}.zmp.parameters.ZmpParameters"

# The first one is the default.
WALKS = {
    "lipm": WalkKind(
        f"{_WALKS}.lipm.walk.LipmWalk", _LIPM_PARAMETERS,
        "observed linear inverted pendulum of the first paper", flat_stance=True,
    ),
    "zmp": WalkKind(
        f"{_WALKS}.zmp.walk.ZmpWalk", _ZMP_PARAMETERS, "ZMP trajectories of the second paper"
    ),
    "preview": WalkKind(
        f"{_WALKS}.preview.walk.PreviewWalk", _ZMP_PARAMETERS, "ZMP preview control"
    ),
}
