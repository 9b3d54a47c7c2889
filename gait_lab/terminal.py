"""Output and exit statuses of the subcommands."""

import codecs
import sys

EXIT_OK = 0
EXIT_FAILED = 1
EXIT_USAGE = 2
EXIT_INTERRUPTED = 130


def say(text: str) -> None:
    """Print one line, without buffering."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def accept_any_locale() -> None:
    """Let output in an encoding that lacks a character be written all the same."""
    codecs.register_error(_REPLACED, _replacement)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors=_REPLACED)


_REPLACED = "nao_gait"
_SIMPLER = str.maketrans(
    {"−": "-", "–": "-", "—": "-", "×": "x", "·": "-", "°": " deg", "²": "2", "±": "+-", "µ": "u",
     "→": "->", "≤": "<=", "≥": ">=", "…": "..."}
)  # fmt: skip


def _replacement(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end].translate(_SIMPLER)
    return text.encode("ascii", "backslashreplace").decode("ascii"), error.end
