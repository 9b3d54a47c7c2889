"""Output and exit statuses of the subcommands."""

import sys

EXIT_OK = 0
EXIT_FAILED = 1
EXIT_USAGE = 2
EXIT_INTERRUPTED = 130


def say(text: str) -> None:
    """Print one line, without buffering."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()
