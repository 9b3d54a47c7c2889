"""A fall is said early, and only then."""

import math

from nao_lipm_gait.estimation.fall_detection import TICKS, FallDetector

LIMIT, HORIZON, PERIOD = 0.5, 0.1, 0.01


def tips(tilt_rate: float, until: float, direction: float = 0.0) -> float | None:
    """The tilt [rad] at which a robot that tips at a steady rate [rad/s] is said to fall."""
    detector = FallDetector()
    tilt = 0.0
    cos, sin = math.cos(direction), math.sin(direction)
    while tilt < until:
        # forward for direction 0: the vertical leans back in the torso frame
        up = (-math.sin(tilt) * cos, math.sin(tilt) * sin, math.cos(tilt))
        rate = (tilt_rate * sin, tilt_rate * cos, 0.0)
        if detector.falls(up, tilt, rate, LIMIT, HORIZON):
            return tilt
        tilt += tilt_rate * PERIOD
    return None


def test_a_fast_tilt_is_recognised_long_before_45_degrees() -> None:
    for direction in (0.0, 0.5 * math.pi, math.pi, 4.0):
        found = tips(3.0, math.radians(45.0), direction)
        assert found is not None
        assert found < 0.35


def test_a_tilt_that_gets_smaller_again_is_no_fall() -> None:
    detector = FallDetector()
    for tick in range(100):
        tilt = 0.45 * math.exp(-tick * PERIOD)
        up = (-math.sin(tilt), 0.0, math.cos(tilt))
        assert not detector.falls(up, tilt, (0.0, -0.45, 0.0), LIMIT, HORIZON)


def test_a_jerk_of_the_gyro_is_no_fall() -> None:
    detector = FallDetector()
    for tick in range(50):
        rate = 20.0 if tick % TICKS else 0.0
        up = (-math.sin(0.02), 0.0, math.cos(0.02))
        assert not detector.falls(up, 0.02, (0.0, rate, 0.0), LIMIT, HORIZON)
