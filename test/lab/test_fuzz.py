"""A short part of the fuzzing; `nao_gait bench fuzz` runs a million ticks."""

import math
import re
from typing import Any

import pytest

pytest.importorskip("hypothesis")

from gait_lab.faults import fuzz_bytes
from gait_lab.faults.fuzz import FILES, GAIT, LOLA, TARGETS, FuzzRun, fuzz
from gait_lab.faults.fuzz_gait import MOTION_FILES, Rig, run
from nao_lipm_gait.gait import Gait
from robot_core.errors import is_number


@pytest.mark.parametrize("target", TARGETS)
def test_no_message_and_no_file_violates_an_invariant(target: str) -> None:
    found = fuzz(FuzzRun(target, 0, 100 if target == FILES else 3000))
    assert found.violations == ()
    assert found.passed > {GAIT: 2000, LOLA: 2999, FILES: 5}[target], "most goes on"
    assert found.refused > {GAIT: 500, LOLA: 300, FILES: 40}[target], "much was invalid"


def fails(*_: Any) -> Any:
    raise ZeroDivisionError("on purpose")


@pytest.fixture
def broken(target: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A target with a fault that most examples find."""
    if target == GAIT:
        monkeypatch.setattr(Gait, "step", fails)
    elif target == LOLA:
        monkeypatch.setattr("gait_lab.faults.fuzz_bytes.decode_sensors", fails)
    else:
        monkeypatch.setitem(fuzz_bytes.LOADERS, "config/gait/paper.yaml", fails)


@pytest.mark.usefixtures("broken")
@pytest.mark.parametrize("target", TARGETS)
def test_a_fault_is_found_with_the_smallest_example(target: str) -> None:
    (text,) = fuzz(FuzzRun(target, 3, 400)).violations
    assert "on purpose" in text
    smallest = {
        GAIT: {"seed": 0, "coasts": False, "bad": [], "requests": []},
        LOLA: {"seed": 0, "numbers": [], "damage": []},
        FILES: {"file": "config/gait/paper.yaml", "values": [], "damage": ([], 1.0)},
    }
    assert text.endswith(str(smallest[target]))


def test_a_seed_gives_the_same_run() -> None:
    again = FuzzRun(GAIT, 5, 700)
    assert fuzz(again) == fuzz(again)


@pytest.mark.parametrize("name", MOTION_FILES)
def test_a_motion_file_that_cannot_be_read_is_one_line(name: str) -> None:
    rig = Rig()
    rig.tick()
    controller = rig.controller
    output = controller.run("~/motion", lambda: controller.request_motion(name))
    while controller.loads_file:
        output = controller.watch()
    assert controller.reporter.unexpected == 0
    (line,) = output.log
    assert re.search(
        r"allowed: (a readable file|at most 1000 printable characters); message ignored$",
        line.text,
    )
    assert len(line.text) < 1000


@pytest.mark.parametrize("value", [10**400, math.nan, math.inf, True, "1", None, [1.0]])
def test_values_that_are_not_finite_floats_are_not_numbers(value: Any) -> None:
    assert not is_number(value)


def test_a_gait_that_starts_again_goes_on_from_its_last_targets() -> None:
    """A parameter that needs a restart, and wrong angles of a joint in the messages after it."""
    wrong = [("joint_states", {"position": {9: 1.2}})]
    restart = [(0.5 + 0.001 * n, ("parameters", ({"feedback_delay": 0.3 + 0.01 * n},)))
               for n in range(30)]  # fmt: skip
    answers, _ = run(400, bad=wrong, requests=restart)
    assert answers > 200
