"""The page as its reader sees it: opened in a real browser, played, zoomed and clicked."""

from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("rclpy")
pytest.importorskip("mujoco")
pytest.importorskip("plotly")

from browser import Tab, open_tab
from gait_lab.report.command import write_comparison, write_report
from sim_bridge.trials.rollout import RolloutSpec
from sim_bridge.trials.tasks import TASKS
from sim_bridge.trials.trial import Push
from walk_bag import write_walk

pytestmark = pytest.mark.xdist_group("report_browser")  # one browser for all
PUSH = Push(time=4.0, impulse=12.0, direction=1.5)
SPEC = RolloutSpec(task=TASKS["forward"].lasting(1.0), engine="mujoco", robot_seed=1, push=PUSH)

DRAWN = """Object.fromEntries([...document.querySelectorAll('.plot')].map((plot) => [plot.id,
    plot.querySelectorAll('.trace, .scatterlayer path, .heatmaplayer image, .barlayer path')
    .length]))"""
CURSOR = "document.querySelector('#speeds .cursor').style"
THERE = f"""((x) => {CURSOR}.display === 'block' &&
    Math.abs(parseFloat({CURSOR}.left) - x._offset - x.d2p(report.state.time)) < 1)(
    document.getElementById('speeds')._fullLayout.xaxis)"""
"""The cursor of the plot is at the time."""
ROBOT = "Array.from(document.getElementById('replay').data[0].x.slice(0, 40))"


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_walk(tmp_path_factory.mktemp("walk") / "bag", SPEC).bag


@pytest.fixture(scope="module")
def tab(bag: Path) -> Iterator[Tab]:
    page = bag.parent / "report.html"
    assert write_report(bag, page, lambda _: None)
    with open_tab(page) as tab:
        tab.wait("document.documentElement.dataset.ready === 'yes'")
        yield tab


def test_the_page_opens_without_a_complaint_and_without_network(tab: Tab) -> None:
    assert tab.complaints == []
    assert all(url.startswith(("file:", "data:", "blob:")) for url in tab.requests)


def test_every_plot_is_drawn(tab: Tab) -> None:
    drawn = tab.run(DRAWN)
    assert set(drawn) >= {"speeds", "com", "path", "steps", "origins", "joints", "torques"}
    assert all(count > 0 for count in drawn.values()), drawn
    for plot in drawn:
        box = tab.run(f"document.getElementById('{plot}').getBoundingClientRect().toJSON()")
        assert box["width"] > 300, plot
        assert box["height"] > 150, plot


def test_the_robot_is_drawn_and_moves_with_the_slider(tab: Tab) -> None:
    assert tab.run("document.querySelector('#replay canvas').width") > 300
    tab.run("window.scrollTo(0, 0)")
    poses = []
    for time in (2.0, 3.1):
        tab.run(
            f"""(() => {{ const s = document.getElementById('slider'); s.value = {time};
            s.dispatchEvent(new Event('input')); }})()"""
        )
        assert tab.run("report.state.time") == pytest.approx(time)
        before = poses[-1] if poses else None
        tab.wait(f"document.getElementById('now').textContent.includes('{time:.2f} s')")
        if before is not None:
            tab.wait(f"JSON.stringify({ROBOT}) !== JSON.stringify({before})")
        poses.append(tab.run(ROBOT))
    assert poses[0] != poses[1]


def test_the_cursor_of_every_time_plot_follows(tab: Tab) -> None:
    tab.run("document.getElementById('s-speeds').scrollIntoView({behavior: 'instant'})")
    places = []
    for time in (1.0, 4.0):
        tab.run(f"report.setTime({time})")
        tab.wait(THERE)  # a plot follows when its observer has been told that it is visible
        places.append(tab.run(f"parseFloat({CURSOR}.left)"))
    assert places[1] > places[0] + 100


def test_a_click_into_a_plot_sets_the_time(tab: Tab) -> None:
    tab.run("document.getElementById('s-torso').scrollIntoView({behavior: 'instant'})")
    tab.run("report.setTime(0.5)")
    box = tab.run("document.getElementById('torso').getBoundingClientRect().toJSON()")
    tab.page.mouse.click(box["x"] + 0.6 * box["width"], box["y"] + 0.35 * box["height"])
    tab.wait("report.state.time > 1.0")


def test_a_zoom_is_a_zoom_in_every_time_plot(tab: Tab) -> None:
    tab.run("Plotly.relayout('speeds', {'xaxis.range': [1, 2]})")
    tab.wait("document.getElementById('torso')._fullLayout.xaxis.range[1] === 2")
    tab.run("document.getElementById('whole').click()")
    tab.wait("document.getElementById('torso')._fullLayout.xaxis.range[1] > 2")


def test_it_plays_to_the_end(tab: Tab) -> None:
    tab.run("window.scrollTo(0, 0)")
    tab.run("report.setTime(report.data.end - 0.4)")
    tab.run("document.getElementById('play').click()")
    tab.wait("!report.state.playing && report.state.time === report.data.end")
    assert tab.complaints == []


def test_push_and_fall_are_marked_on_every_time_axis(tab: Tab) -> None:
    kinds = {event["kind"] for event in tab.run("report.data.events")}
    assert {"push", "fall"} <= kinds
    for plot in tab.run("report.plots.filter((p) => p.figure.time).map((p) => p.element.id)"):
        marks = tab.run(
            f"document.getElementById('{plot}').layout.shapes.map((shape) => shape.name)"
        )
        assert {"push", "fall"} <= set(marks), plot


def test_a_comparison_opens_too(bag: Path, tab: Tab, tmp_path: Path) -> None:
    page = tmp_path / "c.html"
    assert write_comparison(bag, bag, page, lambda _: None)
    other = tab.other(page)
    other.wait("document.documentElement.dataset.ready === 'yes'")
    assert other.complaints == []
    assert all(count > 0 for count in other.run(DRAWN).values())
    other.page.close()
