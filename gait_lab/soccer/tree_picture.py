"""Draws the tree of options into docs/soccer.md."""

import sys
from pathlib import Path

from nao_soccer.behavior.option_tree import mermaid
from nao_soccer.behavior.options import PLAYER

DOCS = Path("docs") / "soccer.md"
BEGIN, END = "<!-- tree -->\n", "<!-- end of tree -->"


def with_tree(text: str) -> str:
    """The text with the present tree between its two marks."""
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    return f"{before}{BEGIN}```mermaid\n{mermaid(PLAYER)}```\n{END}{after}"


def main() -> int:
    """Write the file again."""
    DOCS.write_text(with_tree(DOCS.read_text(encoding="utf-8")), encoding="utf-8")
    sys.stdout.write(f"wrote {DOCS}\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
