"""The walk engines. To add one, write its folder and add one line to `WALKS`.

The parameter `walk` takes its choices from here, so this module imports no engine; `make_walk` of
`nao_lipm_gait.walks.base` loads the requested one.
"""

from typing import NamedTuple


class WalkKind(NamedTuple):
    """Where a walk engine is.

    Attributes:
        module: Its module.
        name: Its class in the module, called as `name(parameters, control_period)`; a
            `nao_lipm_gait.walks.base.Walk`.
        meaning: One phrase for the documentation of the parameter `walk`.
        flat_stance: The stance sole of an undisturbed walk stays flat on the ground, so that it
            shows the vertical; it then reveals a jump of the gyro's bias.
    """

    module: str
    name: str
    meaning: str
    flat_stance: bool = False


_WALKS = "nao_lipm_gait.walks"

# The first one is the default.
WALKS = {
    "lipm": WalkKind(
        f"{_WALKS}.lipm.walk", "LipmWalk", "observed linear inverted pendulum of the first paper",
        flat_stance=True,
    ),
    "zmp": WalkKind(f"{_WALKS}.zmp.walk", "ZmpWalk", "ZMP trajectories of the second paper"),
    "preview": WalkKind(f"{_WALKS}.preview.walk", "PreviewWalk", "ZMP preview control"),
}
