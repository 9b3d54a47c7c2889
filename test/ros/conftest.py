"""Every test in here starts processes; each gets a probe in a ROS domain of its own."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from ros_probe import Probe

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # helpers of the tests without nodes


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    here = Path(__file__).parent
    for item in items:
        if here in item.path.parents:
            item.add_marker(pytest.mark.ros)


@pytest.fixture
def probe(tmp_path: Path) -> Iterator[Probe]:
    probe = Probe(tmp_path)
    try:
        yield probe
    finally:
        probe.close()
