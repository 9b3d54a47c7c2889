"""How old the sensors are on arrival, in control periods more or less than the walk is set to."""

AGE_MAX = 0.12
"""[s] Older sensors are treated as this old: a prediction over a longer time is worth nothing."""
AGE_ABSURD = 1.0
"""[s] A larger age, or one below minus a control period, shows that the clocks differ."""
HYSTERESIS = 0.75
"""Control periods by which the age must have changed to count: arrivals jitter by a few ms."""


class SensorAge:
    """Compares stamps of sensors with their arrival.

    The arrival is a part of the input: without it, or on a clock that is not that of the stamps,
    the age is the one that the walk is set to.

    Args:
        period: Control period [s].

    Attributes:
        age: Age [s] of the last frame on arrival; None if it is unknown.
        late: Control periods by which that is older than the usual age, rounded; below 0 fresher.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self._usual = 0.0
        self.restart()

    def set_usual(self, usual: float) -> None:
        """Change the age [s] for which the walk is set."""
        self._usual = usual

    def restart(self) -> None:
        """Forget the last age."""
        self.age: float | None = None
        self.late = 0

    def update(self, stamp: int, arrived: int | None) -> int:
        """Measure the age of a frame; returns `late`.

        Args:
            stamp: Time of its sampling [ns].
            arrived: Time of its arrival [ns], on the same clock; None if it is unknown.
        """
        age = None if arrived is None else (arrived - stamp) * 1e-9
        if age is None or not -self._period <= age <= AGE_ABSURD:
            self.restart()
            return 0
        self.age = age
        late = (min(max(age, 0.0), AGE_MAX) - self._usual) / self._period
        if abs(late - self.late) > HYSTERESIS:
            self.late = round(late)
        return self.late
