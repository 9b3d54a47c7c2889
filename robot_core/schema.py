"""Settings that check themselves: the one schema behind every YAML file and ROS parameter.

A group of settings is a frozen attrs class derived from `Settings`. Each field is made by one of
the functions below and holds its default, range, unit and meaning:

    @attrs.frozen
    class Contact(Settings):
        rigid: bool = switch(meaning="hard floor")
        damping: float = number(minimum=0.0, maximum=1e5, unit="N s/m", meaning="of one corner")

Every field is checked however the group is made: in code, from a mapping or from a YAML file. A
refusal is one NaoGaitError with the path of the field, its value and what is allowed.
"""

import contextlib
import itertools
import math
import os
import re
import stat
from abc import ABC, abstractmethod
from collections.abc import Mapping
from enum import StrEnum
from numbers import Integral, Real
from pathlib import Path
from typing import Any, Self

import attrs
import yaml

from robot_core.errors import NaoGaitError, is_number

REQUIRED: Any = attrs.NOTHING
"""Default of a field that has none."""
LARGEST_FILE = 256 * 1024
"""[bytes] of a YAML file, or characters of a YAML text from a topic."""
MOST_NODES, DEEPEST, LONGEST_TEXT = 20_000, 32, 10_000
"""Values of a YAML text with its aliases replaced, their depth, characters of one of them."""
_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""The one in C, where PyYAML has it, is ten times as fast."""


class Kind(ABC):
    """What a field can hold."""

    @property
    @abstractmethod
    def allowed(self) -> str:
        """What is allowed, for error messages."""

    @abstractmethod
    def check(self, where: str, value: Any) -> Any:
        """Return the value in its own type, or raise NaoGaitError; `where` is the field's path."""


@attrs.frozen
class Number(Kind):
    """A finite number in [minimum, maximum]; `whole` accepts integers only."""

    minimum: float = -math.inf
    maximum: float = math.inf
    unit: str = ""
    whole: bool = False

    @property
    def span(self) -> str:
        """The range with its unit."""
        if math.isinf(self.minimum) and math.isinf(self.maximum):
            return ""
        if math.isinf(self.maximum):
            return f"of at least {self.minimum:.10g} {self.unit}".rstrip()
        return f"from {self.minimum:.10g} to {self.maximum:.10g} {self.unit}".rstrip()

    @property
    def allowed(self) -> str:
        """What is allowed, for error messages."""
        return f"{'a whole number' if self.whole else 'a number'} {self.span}".rstrip()

    def check(self, where: str, value: Any) -> float:
        """Return a float, or an int if `whole`; numpy's numbers count as Python's."""
        given = value
        if isinstance(value, Real) and not isinstance(value, int | float):
            value = int(value) if isinstance(value, Integral) else float(value)
        if is_number(value) and self.minimum <= value <= self.maximum:
            if not self.whole:
                return float(value)
            if isinstance(value, int):
                return value
        raise NaoGaitError(where, given, self.allowed)


@attrs.frozen
class Switch(Kind):
    """true or false."""

    @property
    def allowed(self) -> str:
        """What is allowed, for error messages."""
        return "true or false"

    def check(self, where: str, value: Any) -> bool:
        """Return a bool."""
        if isinstance(value, bool):
            return value
        raise NaoGaitError(where, value, self.allowed)


@attrs.frozen
class Choice(Kind):
    """One of some words, returned as `result` (str or a StrEnum)."""

    choices: tuple[str, ...]
    result: type[str] = str

    @property
    def allowed(self) -> str:
        """What is allowed, for error messages."""
        return f"one of {', '.join(self.choices)}"

    def check(self, where: str, value: Any) -> str:
        """Return one of the choices."""
        if isinstance(value, str) and value in self.choices:
            return self.result(value)
        raise NaoGaitError(where, value, self.choices)


@attrs.frozen
class Text(Kind):
    """A text; with a `pattern` it must match completely."""

    empty: bool = False
    pattern: str = r"[\s\S]*"
    description: str = "a text"

    @property
    def allowed(self) -> str:
        """What is allowed, for error messages."""
        return self.description

    def check(self, where: str, value: Any) -> str:
        """Return the text without surrounding white space."""
        if isinstance(value, str) and (value.strip() or self.empty):
            text = value.strip()
            if re.fullmatch(self.pattern, text):
                return text
        raise NaoGaitError(where, value, self.allowed)


NAME = Text(pattern="[a-z_][a-z0-9_]*", description="a name of lowercase letters, digits and _")
"""A name that can also be a file name or a command line argument."""


def is_name(text: str) -> bool:
    """True for a text that `NAME` allows."""
    return re.fullmatch(NAME.pattern, text) is not None


@attrs.frozen
class Anything(Kind):
    """A value that is checked later."""

    @property
    def allowed(self) -> str:
        """What is allowed, for error messages."""
        return "a value"

    def check(self, where: str, value: Any) -> Any:
        """Return the value."""
        return value


@attrs.frozen
class Optional(Kind):
    """What `kind` allows, or null."""

    kind: Kind

    @property
    def allowed(self) -> str:
        """What is allowed, for error messages."""
        allowed = self.kind.allowed
        return f"null, or {allowed}" if "; " in allowed else f"{allowed}, or null"

    def check(self, where: str, value: Any) -> Any:
        """Return None or what `kind` returns."""
        if value is None:
            return None
        try:
            return self.kind.check(where, value)
        except NaoGaitError as error:
            if error.field != where:
                raise
            raise NaoGaitError(where, value, self.allowed) from error


@attrs.frozen
class Interval(Kind):
    """A pair [low, high] in the range of `number`."""

    number: Number
    strict: bool = False

    @property
    def allowed(self) -> str:
        """What is allowed, for error messages."""
        order = "low < high" if self.strict else "low <= high"
        return f"[low, high] {self.number.span}".rstrip() + f", {order}"

    def check(self, where: str, value: Any) -> tuple[float, float]:
        """Return (low, high)."""
        if isinstance(value, list | tuple) and len(value) == 2 and all(map(is_number, value)):
            low, high = float(value[0]), float(value[1])
            ordered = low < high if self.strict else low <= high
            if ordered and self.number.minimum <= low and high <= self.number.maximum:
                return low, high
        raise NaoGaitError(where, value, self.allowed)


@attrs.frozen
class Sequence(Kind):
    """A list of `minimum` to `maximum` items; `unique` allows each item once."""

    item: Kind
    minimum: int = 0
    maximum: float = math.inf
    unique: bool = False

    @property
    def allowed(self) -> str:
        """What is allowed, for error messages."""
        if self.minimum == self.maximum:
            count = f"{self.minimum} items"
        elif math.isinf(self.maximum):
            count = f"at least {self.minimum} item{'s' * (self.minimum != 1)}"
        else:
            count = f"{self.minimum} to {self.maximum} items"
        only = ", each item once" if self.unique else ""
        return f"a list of {count}{only}; an item is {self.item.allowed}"

    def check(self, where: str, value: Any) -> tuple[Any, ...]:
        """Return a tuple of checked items; paths count items from 1."""
        if not isinstance(value, list | tuple) or not self.minimum <= len(value) <= self.maximum:
            raise NaoGaitError(where, value, self.allowed)
        items = tuple(self.item.check(f"{where}[{n}]", each) for n, each in enumerate(value, 1))
        if self.unique and any(each in items[:n] for n, each in enumerate(items)):
            raise NaoGaitError(where, value, self.allowed)
        return items


@attrs.frozen
class Table(Kind):
    """A mapping of texts to items, with at least `minimum` entries."""

    item: Kind
    minimum: int = 0
    key: Kind = Text()

    @property
    def allowed(self) -> str:
        """What is allowed, for error messages."""
        least = f" with at least {self.minimum} entry" if self.minimum else ""
        return f"a mapping{least}; a value is {self.item.allowed}"

    def check(self, where: str, value: Any) -> dict[str, Any]:
        """Return a dict of checked items."""
        if not isinstance(value, Mapping) or len(value) < self.minimum:
            raise NaoGaitError(where, value, self.allowed)
        return {
            self.key.check(where, key): self.item.check(join(where, str(key)), item)
            for key, item in value.items()
        }


@attrs.frozen
class Group(Kind):
    """A nested group of settings."""

    settings: "type[Settings]"

    @property
    def allowed(self) -> str:
        """What is allowed, for error messages."""
        return f"a mapping of {', '.join(each.name for each in fields(self.settings))}"

    def check(self, where: str, value: Any) -> "Settings":
        """Return an instance of the group."""
        if isinstance(value, self.settings):
            return value
        return self.settings.from_mapping(value, where)


@attrs.frozen
class Field:
    """One field of a group.

    Attributes:
        name: Key in a mapping and attribute of the group.
        default: Value if none is given; `REQUIRED` if there is no default.
        kind: What it can hold.
        meaning: One sentence for documentation and ROS descriptors.
        section: Title of the part of the group that begins with this field, or empty.
    """

    name: str
    default: Any
    kind: Kind
    meaning: str = ""
    section: str = ""

    @property
    def allowed(self) -> str:
        """What is allowed, for error messages."""
        return self.kind.allowed

    @property
    def is_switch(self) -> bool:
        """True for a field that holds true or false."""
        return isinstance(self.kind, Switch)

    @property
    def is_number(self) -> bool:
        """True for a field that holds a number."""
        return isinstance(self.kind, Number)

    @property
    def unit(self) -> str:
        """Unit of a number; empty for other fields."""
        return self.kind.unit if isinstance(self.kind, Number) else ""

    @property
    def minimum(self) -> float:
        """Smallest value of a number."""
        return self._number.minimum

    @property
    def maximum(self) -> float:
        """Largest value of a number."""
        return self._number.maximum

    @property
    def choices(self) -> tuple[str, ...]:
        """The words that it can hold; empty for other fields."""
        return self.kind.choices if isinstance(self.kind, Choice) else ()

    @property
    def _number(self) -> Number:
        if not isinstance(self.kind, Number):
            raise TypeError(f"{self.name} is not a number")
        return self.kind

    def check(self, value: Any) -> Any:
        """Return the value in its own type; NaoGaitError if it is not allowed."""
        return self.kind.check(self.name, value)


class Settings:
    """Base of a group of settings; a subclass is decorated with `attrs.frozen`."""

    __slots__ = ()

    def __attrs_post_init__(self) -> None:
        """Check every field and give it its own type."""
        for field in fields(type(self)):
            object.__setattr__(self, field.name, field.check(getattr(self, field.name)))

    @classmethod
    def from_mapping(cls, values: Any, where: str = "") -> Self:
        """Make a group from a mapping; a field that is not named keeps its default.

        Args:
            values: Values by name of the field.
            where: Path of the group, for error messages.

        Returns:
            The group.

        Raises:
            NaoGaitError: `values` is not a mapping, a key is unknown, a required key is missing, or
                a value is not allowed.
        """
        return cls(**cls.checked(values, where))

    @classmethod
    def checked(cls, values: Any, where: str = "", *, partial: bool = False) -> dict[str, Any]:
        """Check a mapping as `from_mapping` does and return its values in their own types.

        Args:
            values: Values by name of the field.
            where: Path of the group, for error messages.
            partial: Required fields may be missing.

        Returns:
            The checked values of the fields that `values` names.

        Raises:
            NaoGaitError: As `from_mapping`.
        """
        known = {field.name: field for field in fields(cls)}
        if not isinstance(values, Mapping):
            allowed = f"a mapping of {', '.join(known)}"
            raise NaoGaitError(where.rstrip(": ") or cls.__name__, values, allowed)
        for key, value in values.items():
            if key not in known:
                allowed = f"one of the keys {', '.join(known)}"
                raise NaoGaitError(join(where, str(key)), value, allowed, known)
        checked = {}
        for name, field in known.items():
            path = join(where, name)
            if name in values:
                checked[name] = field.kind.check(path, values[name])
            elif field.default is REQUIRED and not partial:
                raise NaoGaitError(path, "nothing", f"{field.allowed} (required)")
        return checked

    def as_dict(self) -> dict[str, Any]:
        """Values by name of the field; nested groups stay groups."""
        return {field.name: getattr(self, field.name) for field in fields(type(self))}

    def plain(self) -> dict[str, Any]:
        """Values by name of the field, for YAML: nested groups are mappings, tuples lists."""
        return {name: _plain(value) for name, value in self.as_dict().items()}

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed; NaoGaitError for an unknown name or bad value."""
        return self.from_mapping({**self.as_dict(), **changes})


def _plain(value: object) -> object:
    if isinstance(value, Settings):
        return value.plain()
    if isinstance(value, Mapping):
        return {key: _plain(each) for key, each in value.items()}
    return [_plain(each) for each in value] if isinstance(value, tuple) else value


def fields(settings: type[Settings]) -> tuple[Field, ...]:
    """The fields of a group, in the order of its definition."""
    found = _FIELDS.get(settings)
    if found is None:
        group: Any = settings
        _FIELDS[settings] = found = tuple(
            Field(each.name, each.default, **each.metadata) for each in attrs.fields(group)
        )
    return found


_FIELDS: dict[type[Settings], tuple[Field, ...]] = {}


def join(where: str, key: str) -> str:
    """The path of a key below a path; a path that ends in ": " names a file."""
    return f"{where}{key}" if not where or where.endswith(": ") else f"{where}.{key}"


def read_text(path: Path, what: str, largest: int = LARGEST_FILE) -> str:
    """Read a regular UTF-8 file of at most `largest` bytes; `what` names its kind in errors.

    Raises:
        NaoGaitError: It cannot be read, or is a folder, device or pipe, too large or not UTF-8.
    """
    try:
        return read_bytes(path, what, largest).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise NaoGaitError(f"{what} {path}", str(error), "a readable UTF-8 file") from error


def read_bytes(path: Path, what: str, largest: int) -> bytes:
    """Read a regular file of at most `largest` bytes; `what` names its kind in errors.

    Raises:
        NaoGaitError: It cannot be read, or is a folder, device or pipe, or too large.
    """
    where, allowed = f"{what} {path}", "a readable file"
    try:
        # Without O_NONBLOCK, opening a named pipe waits for its writer.
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise NaoGaitError(where, "a folder, device or pipe", allowed)
            data = file.read(largest + 1)
        if len(data) > largest:
            raise NaoGaitError(where, f"more than {largest} bytes", f"at most {largest} bytes")
        return data
    except NaoGaitError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a path that cannot be one
        raise NaoGaitError(where, str(error), allowed) from error


def write_text(path: Path, text: str, field: str) -> None:
    """Write a file in one step, so that it is never incomplete, and the folders above it.

    Raises:
        NaoGaitError: It cannot be written; `field` names the option that asks for it.
    """
    target = os.path.realpath(path)  # a link is not replaced by a file
    part = Path(f"{target}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if os.path.exists(target) and not os.path.isfile(target):  # nor is a device or pipe
            path.write_text(text, encoding="utf-8")
            return
        part.write_text(text, encoding="utf-8")
        part.replace(target)
    except OSError as error:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
        raise NaoGaitError(field, str(path), f"a file that can be written ({error})") from error


def require_writable(path: Path, field: str, *, folder: bool = False) -> None:
    """Try whether a file, or files of a folder, can be written; leaves everything as it was.

    Raises:
        NaoGaitError: It cannot be written; `field` is the option that names it.
    """
    probe = path / ".nao_gait.part" if folder else path
    made = list(itertools.takewhile(lambda each: not os.path.lexists(each), probe.parents))
    try:
        existed = os.path.lexists(probe)
        probe.parent.mkdir(parents=True, exist_ok=True)
        with probe.open("a", encoding="utf-8"):
            pass
        if not existed:
            probe.unlink()
    except OSError as error:
        allowed = f"a {'folder' if folder else 'file'} that can be written ({error})"
        raise NaoGaitError(field, str(path), allowed) from error
    finally:
        with contextlib.suppress(OSError):
            for each in made:
                each.rmdir()


def parse_yaml(text: str, where: str) -> Any:
    """Parse a YAML text; `where` names its source in the NaoGaitError.

    What aliases stand for counts towards its size, which is limited before anything is made of it.
    """
    if len(text) > LARGEST_FILE:
        raise NaoGaitError(where, f"{len(text)} characters", f"at most {LARGEST_FILE}")
    try:
        _check_size(text, where)
        return _loaded(text, where)
    except NaoGaitError:
        raise
    except Exception as error:  # PyYAML's constructors raise any: AttributeError of a !!timestamp
        reason = " ".join(str(error).split())
        raise NaoGaitError(where, reason, "a readable YAML file") from error


def read_word(kind: Kind, where: str, word: str) -> Any:
    """The value of a word of a command line; NaoGaitError if `kind` does not allow it."""
    value: Any = word
    if isinstance(kind, Number):
        with contextlib.suppress(ValueError):
            value = int(word) if kind.whole else float(word)
    return kind.check(where, value)


def value_of(text: str) -> Any:
    """The value of a word of a command line, as YAML reads it, but that 1e4 is a number."""
    try:
        value = parse_yaml(text, "")
    except NaoGaitError:
        value = text
    if isinstance(value, str):
        with contextlib.suppress(ValueError):
            value = float(value)
    return value


def _loaded(text: str, where: str) -> Any:
    """The value of a YAML text in which no key is given twice, of which YAML takes the last."""
    loader = _Loader(text)
    try:
        node = loader.get_single_node()
        _check_keys(node, where)
        return None if node is None else loader.construct_document(node)
    finally:
        loader.dispose()


def _check_keys(node: yaml.Node | None, where: str) -> None:
    if isinstance(node, yaml.MappingNode):
        seen = set()
        for key, value in node.value:
            _check_keys(value, where)
            if isinstance(key, yaml.ScalarNode) and key.value in seen:
                line = key.start_mark.line + 1
                raise NaoGaitError(where, f"{key.value} twice (line {line})", "each key once")
            seen.add(key.value if isinstance(key, yaml.ScalarNode) else id(key))
    elif isinstance(node, yaml.SequenceNode):
        for value in node.value:
            _check_keys(value, where)


def _check_size(text: str, where: str) -> None:
    """Refuse a YAML text that is too deep or too large once its aliases are replaced."""
    sizes: dict[str, int] = {}
    around: list[tuple[str | None, int]] = []  # anchor and size so far of what is not yet closed
    for event in yaml.parse(text, _Loader):
        anchor, size = None, 0
        if isinstance(event, yaml.CollectionStartEvent):
            around.append((event.anchor, 1))
            if len(around) > DEEPEST:
                raise NaoGaitError(where, f"more than {DEEPEST} levels", f"at most {DEEPEST}")
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, size = around.pop()
        elif isinstance(event, yaml.AliasEvent):
            if event.anchor not in sizes:
                raise NaoGaitError(where, f"*{event.anchor}", "an alias of what is complete before")
            size = sizes[event.anchor]
        elif isinstance(event, yaml.ScalarEvent):
            anchor, size = event.anchor, 1
            if len(event.value) > LONGEST_TEXT:
                allowed = f"texts of at most {LONGEST_TEXT} characters"
                raise NaoGaitError(where, event.value, allowed)
        if anchor is not None:
            sizes[anchor] = size
        if around and size:
            outer, before = around[-1]
            around[-1] = outer, before + size
            if before + size > MOST_NODES:
                raise NaoGaitError(where, f"more than {MOST_NODES} values", f"at most {MOST_NODES}")


def read_yaml(path: Path, what: str) -> Any:
    """Read a YAML file; `what` names the kind of file in the NaoGaitError."""
    return parse_yaml(read_text(path, what), f"{what} {path}")


# -- fields ----------------------------------------------------------------------------------------


def field(kind: Kind, default: Any = REQUIRED, meaning: str = "", section: str = "") -> Any:
    """A field of any kind; a default of None also allows null."""
    if default is None and not isinstance(kind, Optional):
        kind = Optional(kind)
    return attrs.field(
        default=default, metadata={"kind": kind, "meaning": meaning, "section": section}
    )


def number(
    default: Any = REQUIRED,
    minimum: float = -math.inf,
    maximum: float = math.inf,
    unit: str = "",
    meaning: str = "",
    *,
    whole: bool = False,
    optional: bool = False,
    section: str = "",
) -> Any:
    """A field that holds a number.

    Args:
        default: Value if none is given.
        minimum: Smallest value.
        maximum: Largest value.
        unit: Unit, for messages and documentation.
        meaning: One sentence for documentation.
        whole: Accept integers only.
        optional: Also allow null.
        section: Title of the part of the group that begins here.

    Returns:
        An attrs field.
    """
    kind: Kind = Number(minimum, maximum, unit, whole)
    return field(Optional(kind) if optional else kind, default, meaning, section)


def switch(default: Any = REQUIRED, meaning: str = "", *, section: str = "") -> Any:
    """A field that holds true or false."""
    return field(Switch(), default, meaning, section)


def choice(
    choices: tuple[str, ...] | type[StrEnum],
    meaning: str = "",
    *,
    default: Any = None,
    section: str = "",
) -> Any:
    """A field that holds one of some words; the first one is the default unless another is given.

    Args:
        choices: The words, or an enumeration of them.
        meaning: One sentence for documentation.
        default: Another default; `REQUIRED` for none.
        section: Title of the part of the group that begins here.

    Returns:
        An attrs field.
    """
    words = choices if isinstance(choices, tuple) else tuple(each.value for each in choices)
    kind = Choice(words, str if isinstance(choices, tuple) else choices)
    return field(kind, kind.result(words[0]) if default is None else default, meaning, section)


def text(default: Any = REQUIRED, meaning: str = "") -> Any:
    """A field that holds a text. Empty is accepted only if the default is empty."""
    return field(Text(empty=default == ""), default, meaning)


def group(settings: type[Settings], default: Any = REQUIRED, meaning: str = "") -> Any:
    """A field that holds a nested group of settings."""
    return field(Group(settings), default, meaning)
