"""One root for everything this package refuses."""


class NaoGaitError(ValueError):
    """A refused input: says which field, what it held and what would have been allowed."""

    def __init__(self, field: str, value: object, allowed: str) -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        super().__init__(f"{field}: got {value!r}; allowed: {allowed}")

    def __reduce__(self) -> tuple[type, tuple[str, object, str]]:
        """Keep the evidence when the error crosses a process boundary."""
        return type(self), (self.field, self.value, self.allowed)
