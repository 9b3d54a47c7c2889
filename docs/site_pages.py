"""Hook of mkdocs: brings the pages and files outside of docs/ that the documents link to."""

import re
from pathlib import Path

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
PAGES = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "urdf/README.md": "robots.md",
}
"""Page of the repository -> its name in the site."""
_DIAGRAM = re.compile(r"^\[[^\]]*\]\((\S+\.mmd)\)$", re.MULTILINE)
"""A line that only links to a diagram shows it in the site."""
_LINK = re.compile(r"(\]\()([^)#\s]+)(#[^)\s]*)?(\))")


def on_files(files: Files, config: dict) -> Files:
    """Add the pages, and the files that any page links to."""
    linked: set[str] = set()
    for source, target in PAGES.items():
        text = _moved(ROOT / source, linked)
        files.append(File.generated(config, target, content=text))
    for path in (ROOT / "docs").glob("*.md"):
        _moved(path, linked)
    for name in sorted(linked):
        files.append(File.generated(config, name, abs_src_path=str(ROOT / name)))
    return files


def on_page_markdown(markdown: str, page: object, **_: object) -> str:
    """Links of a page of docs/ as they are in the site."""
    path = ROOT / "docs" / page.file.src_uri  # type: ignore[attr-defined]
    shown = _DIAGRAM.sub(_mermaid, markdown)
    return _linked(shown, path, set()) if path.is_file() else shown


def _mermaid(link: re.Match[str]) -> str:
    return f"```mermaid\n{(ROOT / 'docs' / link[1]).read_text(encoding='utf-8')}```"


def _moved(path: Path, linked: set[str]) -> str:
    return _linked(path.read_text(encoding="utf-8"), path, linked)


def _linked(text: str, path: Path, linked: set[str]) -> str:
    """The text with its links as they are in the site; files outside of docs/ go into `linked`."""

    def link(match: re.Match[str]) -> str:
        before, target, anchor, after = match.groups()
        if re.match(r"[a-z]+:", target):
            return match[0]
        name = (path.parent / target).resolve().relative_to(ROOT).as_posix()
        if name in PAGES:
            name = PAGES[name]
        elif name.startswith("docs/"):
            name = name.removeprefix("docs/")
        else:
            linked.add(name)
        return f"{before}{name}{anchor or ''}{after}"

    return _LINK.sub(link, text)
