"""Policies that are compared: the constants of play beside others, changed for one team."""

from collections.abc import Sequence

import attrs

from gait_lab.bench.options import Option, Options
from nao_soccer.behavior.duel import DuelSettings
from robot_core.schema import value_of

_CONSTANTS = ", ".join(each.name for each in attrs.fields(DuelSettings))
POLICIES = {
    "policy": Option(
        (), f"change how one team plays beside others: {_CONSTANTS}", "NAME=VALUE", ("--policy",)
    ),
    "against": Option((), "the same in the other team", "NAME=VALUE", ("--against",)),
}
"""Options of a suite."""


def policies(options: Options) -> tuple[DuelSettings, DuelSettings]:
    """Of the judged team and of the other one; raises NaoGaitError."""
    return _policy(options.policy), _policy(options.against)


def _policy(settings: Sequence[str]) -> DuelSettings:
    words = (setting.partition("=") for setting in settings)
    return DuelSettings.from_mapping({name: value_of(text) for name, _, text in words}, "policy: ")
