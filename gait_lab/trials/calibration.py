"""Calibration of a simulated robot by its own sensors: it stands, steps on the spot, and stands."""

from dataclasses import replace
from functools import lru_cache
from itertools import islice

from gait_lab.trials.tasks import STAND_TIME
from gait_lab.trials.trial import (
    CONTROL_PERIOD,
    TimedCommands,
    TrialSpec,
    make_gait,
    make_world,
    run,
)
from nao_lipm_gait.calibration import NOT_CALIBRATED, Calibration
from nao_lipm_gait.parameters import load_preset
from nao_lipm_gait.types import STANDSTILL, VelocityCommand

STEPPING_TIME = 15.0
"""[s] of stepping on the spot; the soles are level after about 8 s."""
REST_TIME = 8.0
"""[s] of the stand after it, for the IMU."""
STEP_ON_THE_SPOT = VelocityCommand(1e-4, 0.0, 0.0)
"""Slow enough to stay in place; a command of zero would stand."""


def calibrate(spec: TrialSpec) -> Calibration:
    """Calibrate the robot of a trial; the gait's preset for it is `default`.

    Args:
        spec: The robot; its parameters and calibration are not used.

    Returns:
        What the gait has measured; not calibrated if the robot fell.
    """
    return _calibrate(replace(spec, parameters=load_preset("default"), calibration=NOT_CALIBRATED))


@lru_cache(maxsize=256)
def _calibrate(spec: TrialSpec) -> Calibration:
    stepping_end = STAND_TIME + STEPPING_TIME

    def command_at(time: float) -> VelocityCommand:
        return STEP_ON_THE_SPOT if STAND_TIME <= time < stepping_end else STANDSTILL

    gait = make_gait(spec)
    ticks = round((stepping_end + REST_TIME) / CONTROL_PERIOD)
    with make_world(spec) as world:
        for tick in islice(run(world, gait, TimedCommands(command_at)), ticks):
            if tick.fallen:
                return NOT_CALIBRATED
    return gait.calibration
