"""Keep a flood of equal warnings readable."""

_MAX_KEYS = 256


class Throttle:
    """Lets a few messages per key and period through and counts the ones that it held back."""

    def __init__(self, period: float = 2.0) -> None:
        """period [s]"""
        self._period = period
        self._windows: dict[str, list[float]] = {}  # key -> [begin, messages in the window]

    def allow(self, key: str, now: float, burst: int = 1) -> int | None:
        """None to keep quiet; else how many of this key were held back in the last period.

        now: any monotonic time [s]. burst: messages per period; more than one where a key stands
        for faults that differ.
        """
        window = self._windows.get(key)
        if window is None:
            if len(self._windows) >= _MAX_KEYS:
                self._windows.clear()  # keys come from outside: never grow without bound
            self._windows[key] = [now, 1]
            return 0
        begin, count = window
        if now - begin < self._period:
            window[1] = count + 1
            return 0 if count < burst else None
        self._windows[key] = [now, 1]
        return max(0, int(count) - burst)
