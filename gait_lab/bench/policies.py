"""Policies that are compared: the constants of play beside others, changed for one team."""

import textwrap
from collections.abc import Sequence

from gait_lab.bench.options import Option, Options
from nao_soccer.behavior.duel import DuelSettings
from robot_core.errors import NaoGaitError
from robot_core.schema import fields, value_of

POLICIES = {
    "policy": Option(
        (), "change how one team plays beside others; the names are below", "NAME=VALUE",
        ("--policy",),
    ),
    "against": Option((), "the same in the other team", "NAME=VALUE", ("--against",)),
}
"""Options of a suite."""
NAMES = "names of --policy and --against, with their defaults:\n" + "\n".join(
    textwrap.fill(f"{f'{each.default:g} {each.unit}':8}{each.meaning}", 100,
                  initial_indent=f"  {each.name:15}", subsequent_indent=25 * " ")
    for each in fields(DuelSettings)
)  # fmt: skip
"""For the help of a suite."""


def policies(options: Options) -> tuple[DuelSettings, DuelSettings]:
    """Of the judged team and of the other one; raises NaoGaitError."""
    return policy_of(options.policy), policy_of(options.against)


def policy_of(settings: Sequence[str]) -> DuelSettings:
    """The constants that these `NAME=VALUE` change; raises NaoGaitError."""
    values = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals:
            raise NaoGaitError("policy", setting, "NAME=VALUE, such as contested=0")
        values[name] = value_of(text)
    return DuelSettings.from_mapping(values, "policy: ")
