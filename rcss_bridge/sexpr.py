"""Symbolic expressions, as the server writes them: `(GS (t 0.0)(pm PlayOn))`.

An expression is a list of atoms (text without spaces and brackets) and expressions.
"""

import re
from collections.abc import Iterator, Sequence
from typing import Any

from robot_core.errors import NaoGaitError

DEPTH_MAX = 16
"""Brackets within brackets; the server writes four."""
_TOKEN = re.compile(r"[()]|[^()\s]+", re.ASCII)
_ATOM = re.compile(r"[^()\s]+")

Expression = list[Any]
"""Atoms (str) and expressions."""


def parse(message: bytes) -> Expression:
    """The expressions of a message.

    Raises:
        NaoGaitError: Its brackets do not match or are too deep, or it is not UTF-8.
    """
    try:
        text = message.decode()
    except UnicodeDecodeError as error:
        raise _refused(message, f"UTF-8 ({error.reason})") from error
    inner: Expression = []
    stack = [inner]
    for token in _TOKEN.findall(text):
        if token == "(":
            if len(stack) > DEPTH_MAX:
                raise _refused(message, f"at most {DEPTH_MAX} brackets within each other")
            stack.append([])
            inner.append(stack[-1])
            inner = stack[-1]
        elif token == ")":
            if len(stack) == 1:
                raise _refused(message, "matching brackets")
            stack.pop()
            inner = stack[-1]
        else:
            inner.append(token)
    if len(stack) > 1:
        raise _refused(message, "matching brackets")
    return inner


def write(expressions: Sequence[Any]) -> bytes:
    """The message of some expressions; numbers are atoms, too.

    Raises:
        NaoGaitError: An atom has a bracket or a space in it, or is empty.
    """
    return _joined(expressions).encode()


def _joined(items: Sequence[Any]) -> str:
    text, after_atom = [], False
    for item in items:
        if isinstance(item, list | tuple):
            text.append(f"({_joined(item)})")
            after_atom = False
            continue
        atom = str(item)
        if not _ATOM.fullmatch(atom):
            raise NaoGaitError("message", atom[:40], "an atom without spaces and brackets")
        text.append(f" {atom}" if after_atom else atom)
        after_atom = True
    return "".join(text)


def named(expression: Expression, name: str) -> Iterator[Expression]:
    """The expressions in an expression that begin with a name."""
    return (each for each in expression if isinstance(each, list) and each and each[0] == name)


def _refused(message: bytes, allowed: str) -> NaoGaitError:
    text = f"{len(message)} bytes that begin with {message[:24]!r}"
    return NaoGaitError("message", text, allowed)
