"""What the gait has measured of its sensors' constant errors, as a report of the diagnostics.

Its numbers have full precision, because `nao_gait calibrate` reads them there.
"""

from collections.abc import Mapping
from math import degrees
from typing import Self

import attrs

from nao_lipm_gait.calibration import Calibration
from nao_lipm_gait.gait import Gait
from robot_core.errors import NaoGaitError
from robot_core.log import Level, Report
from robot_core.schema import Field, fields, number, parse_yaml, switch

CALIBRATION = "calibration"
"""Name of the report."""
DEVIATION_KNOWN = 0.006
"""Standard deviation [rad] below which the tilt of the soles is known; that of the roll stays above
0.003, because it depends on the softness of the ground."""
NOT_APPLIED_MAX = 0.001
"""Learned tilt [rad] that need not be applied yet where the soles count as level."""


_ZEROS = "joint zero"
"""Label of the wrong zeros, whose text is a mapping in YAML."""


@attrs.frozen
class Measurement(Calibration):
    """What has been measured so far."""

    sole_pitch_deviation: float = number(0.0, unit="rad", meaning="Its standard deviation.")
    sole_roll_deviation: float = number(0.0, unit="rad", meaning="Its standard deviation.")
    sole_pitch_applied: float = number(0.0, unit="rad", meaning="What the gait corrects now.")
    sole_roll_applied: float = number(0.0, unit="rad", meaning="What the gait corrects now.")
    ground_softness: float = number(0.0, meaning="Relative to the expected ground.")
    stand_time: float = number(0.0, unit="s", meaning="Duration of the present quiet stand.")
    steps_measure: bool = switch(False, "A walk measures the soles.")

    @classmethod
    def of(cls, gait: Gait, *, steps_measure: bool) -> Self:
        """What a gait has measured; NaoGaitError for a number that no calibration may have."""
        levelling = gait.levelling
        pitch_deviation, roll_deviation = levelling.sigma
        return cls(
            **gait.calibration.as_dict(),
            sole_pitch_deviation=pitch_deviation,
            sole_roll_deviation=roll_deviation,
            sole_pitch_applied=levelling.applied_pitch,
            sole_roll_applied=levelling.applied_roll,
            ground_softness=levelling.softness,
            stand_time=gait.stand_time,
            steps_measure=steps_measure,
        )

    @classmethod
    def read(cls, values: Mapping[str, str]) -> Self:
        """Read what `values` has written; NaoGaitError names what is missing or wrong."""
        texts = {each: values.get(_label(each), "") for each in fields(cls)}
        return cls.from_mapping({each.name: _parsed(each, text) for each, text in texts.items()})

    def values(self) -> dict[str, str]:
        """Text by label, exact."""
        values = {_label(each): repr(getattr(self, each.name)) for each in fields(type(self))}
        zeros = ", ".join(f"{joint}: {zero:.6f}" for joint, zero in self.joint_zero)
        return {**values, _ZEROS: f"{{{zeros}}}"}

    @property
    def calibration(self) -> Calibration:
        """The part that a calibration file holds."""
        values = {each.name: getattr(self, each.name) for each in fields(Calibration)}
        return Calibration.from_mapping(values)

    @property
    def soles_known(self) -> bool:
        """Whether the tilt of the soles is known well."""
        return max(self.sole_pitch_deviation, self.sole_roll_deviation) < DEVIATION_KNOWN

    @property
    def soles_level(self) -> bool:
        """Whether it is known and corrected."""
        left = (self.sole_pitch - self.sole_pitch_applied, self.sole_roll - self.sole_roll_applied)
        return self.soles_known and max(abs(each) for each in left) < NOT_APPLIED_MAX

    @property
    def soles(self) -> str:
        """Tilt of the soles with its deviation, in words."""
        return (
            f"the left sole is pitched by {degrees(self.sole_pitch):+.2f} deg and rolled by "
            f"{degrees(self.sole_roll):+.2f} deg relative to the right one (standard deviations "
            f"{degrees(self.sole_pitch_deviation):.2f} and "
            f"{degrees(self.sole_roll_deviation):.2f} deg)"
        )


def _label(field: Field) -> str:
    words = field.name.replace("_", " ")
    return f"{words} [{field.unit}]" if field.unit else words


def _parsed(field: Field, text: str) -> object:
    if _label(field) == _ZEROS:
        return parse_yaml(text, _ZEROS)
    if field.is_switch:
        return {"True": True, "False": False}.get(text, text)
    try:
        return float(text)
    except ValueError:
        raise NaoGaitError(_label(field), text, field.allowed) from None


def calibration_report(gait: Gait, *, steps_measure: bool) -> Report:
    """The report of now; steps_measure: the parameters let a walk measure the soles."""
    try:
        measured = Measurement.of(gait, steps_measure=steps_measure)
    except NaoGaitError as error:
        return Report(CALIBRATION, Level.OK, f"no usable measurement: {error}", {})
    if measured.soles_known:
        message = measured.soles
    elif steps_measure:
        message = "the tilt of the soles is not known before some steps"
    else:
        message = "the tilt of the soles is not measured: level_soles or feedback is false"
    return Report(CALIBRATION, Level.OK, message, measured.values())
