"""What a set of parameters is tried on: named protocols with checked options.

A protocol lets one robot walk and returns `Measures`. Add one by a function and a row in
`PROTOCOLS`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from gait_lab.tune import com_error, growing_stride, omni
from gait_lab.tune.measures import Measures
from gait_lab.tune.walker import Setting
from nao_lipm_gait.errors import NaoGaitError, is_number

Options = Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Option:
    """A number that a study may set."""

    default: float
    minimum: float
    maximum: float
    unit: str
    whole: bool = False

    def check(self, field: str, value: Any) -> float:
        allowed = f"a number from {self.minimum:g} to {self.maximum:g} {self.unit}".rstrip()
        if not is_number(value) or not self.minimum <= value <= self.maximum:
            raise NaoGaitError(field, value, allowed)
        if self.whole and value != int(value):
            raise NaoGaitError(field, value, f"a whole number, {allowed[2:]}")
        return float(value)


@dataclass(frozen=True, slots=True)
class Protocol:
    """How parameters are tried, and what is measured."""

    name: str
    run: Callable[[Setting, Options], Measures]
    options: Mapping[str, Option]
    measures: Mapping[str, str]
    """Name and unit of what it measures."""

    def checked(self, field: str, given: Mapping[str, Any]) -> dict[str, float]:
        """All options, the given ones checked; NaoGaitError for an unknown or a bad one."""
        for name in given:
            if name not in self.options:
                raise NaoGaitError(f"{field}.{name}", given[name], ", ".join(self.options))
        return {
            name: option.check(f"{field}.{name}", given.get(name, option.default))
            for name, option in self.options.items()
        }


PROTOCOLS: Mapping[str, Protocol] = {
    protocol.name: protocol
    for protocol in (
        Protocol(
            "growing_stride",
            growing_stride.run,
            {
                "steps": Option(52, 4, 400, "", whole=True),
                "first": Option(0.05, 0.0, 0.4, "m"),
                "last": Option(0.24, 0.0, 0.4, "m"),
                "hold": Option(0.0, 0.0, 120.0, "s"),
            },
            growing_stride.MEASURES,
        ),
        Protocol(
            "com_error",
            com_error.run,
            {
                "speed": Option(0.15, 0.0, 0.5, "m/s"),
                "window": Option(8.0, 1.0, 60.0, "s"),
            },
            com_error.MEASURES,
        ),
        Protocol(
            "omni",
            omni.run,
            {
                "forward": Option(0.25, 0.01, 0.6, "m/s"),
                "back": Option(0.20, 0.01, 0.6, "m/s"),
                "side": Option(0.09, 0.01, 0.4, "m/s"),
                "turn": Option(45.0, 1.0, 150.0, "deg/s"),
                "window": Option(5.0, 1.0, 60.0, "s"),
                "impulse": Option(1.0, 0.0, 5.0, "N s"),
            },
            omni.MEASURES,
        ),
    )
}


def find_protocol(name: Any) -> Protocol:
    protocol = PROTOCOLS.get(name) if isinstance(name, str) else None
    if protocol is None:
        raise NaoGaitError("protocol.name", name, f"one of {', '.join(PROTOCOLS)}")
    return protocol
