"""`name=value` settings of the gait, as typed on a command line."""

from collections.abc import Iterable

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import BY_NAME, GaitParameters


def overridden(parameters: GaitParameters, settings: Iterable[str]) -> GaitParameters:
    """Parameters with `name=value` settings applied, as typed on a command line."""
    changes: dict[str, float | bool | str] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        parameter = BY_NAME.get(name)
        if parameter is None or not equals:
            raise NaoGaitError("set", setting, f"name=value, name one of {', '.join(BY_NAME)}")
        words = {"true": True, "false": False}
        if parameter.is_switch:
            if text.lower() not in words:
                raise NaoGaitError(name, text, parameter.allowed)
            changes[name] = words[text.lower()]
        elif parameter.choices:
            changes[name] = text
        else:
            try:
                changes[name] = float(text)
            except ValueError:
                raise NaoGaitError(name, text, parameter.allowed) from None
    return parameters.replace(**changes)
