"""How the tests are shared out over processes (pytest-xdist), and in which order.

A file goes to one process as a whole, which makes its fixtures once. Tests of processes, in `ros`,
go one by one: they are long, and wait. Beside each other they would leave processors idle, so the
files and tests of each folder are spread evenly over the run.
"""

from typing import Any

import pytest

ALONE = "ros"
"""Folder of the tests that are shared out one by one."""
FEW = 20
"""Files per process up to which all tests are, as those of a single file or the slow ones."""


def unit_of(nodeid: str) -> str:
    """What goes to one process: a file, or a test."""
    file = nodeid.partition("::")[0]
    return nodeid if f"/{ALONE}/" in file else file


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Share out by `unit_of`."""
    from xdist.scheduler import LoadGroupScheduling

    class Scheduling(LoadGroupScheduling):
        def schedule(self) -> None:
            collected = next(iter(self.registered_collections.values()))
            files = {nodeid.partition("::")[0] for nodeid in collected}
            few = len(files) <= FEW * len(self.nodes)
            self._one_by_one = few or config.option.markexpr == "slow"
            super().schedule()

        def _split_scope(self, nodeid: str) -> str:
            return str(super()._split_scope(nodeid)) if self._one_by_one else unit_of(nodeid)

    config.option.loadscopereorder = False
    return Scheduling(config, log)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Spread the units of each folder over the run, in each process of several."""
    if not hasattr(config, "workerinput"):
        return
    folders: dict[tuple[str, bool], dict[str, list[pytest.Item]]] = {}
    for item in items:
        # Those that are slow may be deselected after this.
        folder = str(item.path.parent), item.get_closest_marker("slow") is not None
        folders.setdefault(folder, {}).setdefault(unit_of(item.nodeid), []).append(item)
    places = [
        ((index + 0.5) / len(units), unit)
        for units in folders.values() for index, unit in enumerate(units.values())
    ]  # fmt: skip
    items[:] = [item for _, unit in sorted(places, key=lambda place: place[0]) for item in unit]
