"""Writes the page about one bag, or about two."""

from collections.abc import Callable
from dataclasses import asdict
from html import escape
from pathlib import Path

from gait_lab.report.analysis import Analysis, analyse
from gait_lab.report.compare import compare_page, compared, summary
from gait_lab.report.figures import SECTIONS
from gait_lab.report.page import blocks_of, key_numbers_html, list_html, page, verdict_html
from gait_lab.report.plot import ArrayStore
from gait_lab.report.replay import replay
from gait_lab.report.verdict import findings, headline, key_numbers
from gait_lab.terminal import EXIT_FAILED, EXIT_OK
from robot_core.schema import write_text

STAGE = (
    '<div class="card stage"><div id="now"></div>'
    '<button id="glass" title="show the pendulum inside the robot">see through</button>'
    '<div id="replay"></div>'
    '<p class="note">Drag to turn, scroll to come nearer. Blue: the pendulum from its origin to '
    "the CoM; red and green: where the soles stood.</p></div>"
)


def command(
    bag: Path, after: Path | None, out: Path, robot: str, say: Callable[[str], None]
) -> int:
    """Write the page of one bag or of two; the exit status."""
    if after is None:
        return EXIT_OK if write_report(bag, out, say, robot) else EXIT_FAILED
    return EXIT_OK if write_comparison(bag, after, out, say, robot) else EXIT_FAILED


def write_report(bag: Path, out: Path, say: Callable[[str], None], robot: str = "") -> bool:
    """Write the page of one bag; false if it holds no walk."""
    analysis = analyse(bag, robot)
    write_text(out, report_page(analysis), "output")
    tell(analysis, say)
    say(f"{out}: {out.stat().st_size / 1e6:.1f} MB")
    return analysis.has_motion


def write_comparison(
    before: Path, after: Path, out: Path, say: Callable[[str], None], robot: str = ""
) -> bool:
    """Write the page that compares bag A with bag B; false if one of them holds no walk."""
    analyses = analyse(before, robot), analyse(after, robot)
    write_text(out, compare_page(*analyses), "output")
    head, found = summary(compared(*analyses), *analyses)
    for name, analysis in zip("AB", analyses, strict=True):
        say(f"{name} {analysis.walk.name}: {headline(analysis).text}")
        for lacking in (*analysis.walk.remarks, *analysis.walk.missing):
            say(f"  {name} {lacking}")
    say(head.text)
    for finding in found:
        say(f"  {'better' if finding.grade == 'good' else 'worse':6s} {finding.text}")
    say(f"{out}: {out.stat().st_size / 1e6:.1f} MB")
    return all(analysis.has_motion for analysis in analyses)


def tell(analysis: Analysis, say: Callable[[str], None]) -> None:
    """Print the verdict, with what is wrong with the bag and what it lacks."""
    say(headline(analysis).text)
    for finding in findings(analysis):
        say(f"  {finding.grade:5s} {finding.text}")
    for remark in analysis.walk.remarks:
        say(f"  bag   {remark}")
    for missing in analysis.walk.missing if analysis.walk.bag.topics else ():
        say(f"  lacks {missing}")


def report_page(analysis: Analysis) -> str:
    """The HTML of one bag."""
    store, walk = ArrayStore(), analysis.walk
    scene, blocks, numbers = None, [], ""
    if analysis.has_motion:
        blocks = blocks_of(analysis, SECTIONS, store)
        scene = replay(analysis, store)
        numbers = f'<div class="keys wide">{key_numbers_html(key_numbers(analysis))}</div>'
    verdict = verdict_html(headline(analysis), findings(analysis))
    stage = f'<div class="box missing"><h3>No 3D replay</h3>{escape(analysis.robot_remark)}</div>'
    top = (
        f'<div class="card verdict">{verdict}</div>{stage if scene is None else STAGE}{numbers}'
        + list_html("What was wrong with this bag", walk.remarks, "damage")
        + list_html("Not in this bag", walk.missing)
    )
    data = {
        "begin": 0.0,
        "end": walk.duration,
        "show": _first_look(analysis),
        "events": [asdict(event) for event in analysis.events],
        "replay": scene,
    }
    subtitle = (
        f"{walk.bag.path} · {sum(topic.count for topic in walk.bag.topics.values())} messages of "
        f"{len(walk.bag.topics)} topics · {walk.duration:.1f} s"
    )
    return page(f"Walk report: {walk.name}", subtitle, top, blocks, data, store)


def _first_look(analysis: Analysis) -> float:
    """[s] a moment of walking, at which the page begins."""
    for stretch in analysis.stretches:
        if stretch.command is not None and not stretch.command.is_zero:
            return 0.5 * (stretch.start + stretch.end)
    walked = analysis.walked
    return 0.5 * sum(walked) if walked else 0.0
