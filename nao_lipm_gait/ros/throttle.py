"""Keep a flood of equal warnings readable."""

_MAX_KEYS = 256


class Throttle:
    """Lets one message per key and period through and counts the ones that it held back."""

    def __init__(self, period: float = 2.0) -> None:
        self._period = period
        self._seen: dict[str, tuple[float, int]] = {}

    def allow(self, key: str, now: float) -> int | None:
        """None to keep quiet; else how many of this key were held back since the last one.

        now: any monotonic time [s].
        """
        last, held_back = self._seen.get(key, (None, 0))
        if last is not None and now - last < self._period:
            self._seen[key] = (last, held_back + 1)
            return None
        if key not in self._seen and len(self._seen) >= _MAX_KEYS:
            self._seen.clear()  # keys come from outside: never grow without bound
        self._seen[key] = (now, 0)
        return held_back
