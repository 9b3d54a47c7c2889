"""Which changes of the gait's parameters are taken, and which of them need a standing robot."""

from collections.abc import Mapping

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import BY_NAME, NEEDS_RESET, GaitParameters


def changed_by(
    parameters: GaitParameters, changes: Mapping[str, object], busy: bool
) -> GaitParameters:
    """The parameters with these changes, all or none; other names are not ours.

    busy: the robot walks, or a motion moves or holds it.
    Raises NaoGaitError that names parameter, value and what is allowed.
    """
    checked = {
        name: BY_NAME[name].check(value) for name, value in changes.items() if name in BY_NAME
    }
    changed = parameters.replace(**checked)
    needing = needing_reset(parameters, changed)
    if needing and busy:
        allowed = "no change while walking or in a motion; stand first"
        raise NaoGaitError(needing[0], getattr(changed, needing[0]), allowed)
    return changed


def needing_reset(before: GaitParameters, after: GaitParameters) -> list[str]:
    """Names of the changed parameters with which a gait begins anew."""
    return [name for name in NEEDS_RESET if getattr(after, name) != getattr(before, name)]
