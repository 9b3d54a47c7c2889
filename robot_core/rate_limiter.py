"""Values that follow other values at a limited rate, or from rest to rest."""


def eased(share: float) -> float:
    """3 s^2 - 2 s^3 of a share s of the time, 0 to 1: the share of a way from rest to rest."""
    return share * share * (3.0 - 2.0 * share)


def limited_step(current: float, wanted: float, step: float) -> float:
    """The value nearest to `wanted` that differs from `current` by at most `step` >= 0."""
    low, high = current - step, current + step
    return low if wanted < low else high if wanted > high else wanted


class RateLimiter:
    """Follows a value at a limited rate.

    Args:
        rate: Largest change per second, in the unit of the value.
        value: Start value; None = the first value is taken without a limit.
    """

    def __init__(self, rate: float, value: float | None = None) -> None:
        self._rate = rate
        self._value = value

    def reset(self) -> None:
        """Take the next value without a limit."""
        self._value = None

    def update(self, wanted: float, dt: float) -> float:
        """The limited value, dt [s] after the last call."""
        current = self._value
        value = wanted if current is None else limited_step(current, wanted, self._rate * dt)
        self._value = value
        return value
