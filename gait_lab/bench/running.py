"""Run suites: check what was asked for, measure, print the tables, write JSON and page."""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from gait_lab.bench.catalogue import EVERY_SUITE, SUITES, runs
from gait_lab.bench.command import command_line
from gait_lab.bench.document import Section, write
from gait_lab.bench.settings import overridden
from gait_lab.compiled import is_compiled
from gait_lab.trials.tasks import find_task
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.presets import preset_for
from nao_lipm_gait.robot import load_robot
from sim_bridge.plant import load_plant, with_options


def run(
    suite: str,
    asked: Mapping[str, Any],
    *,
    preset: str = "default",
    settings: Sequence[str] = (),
    json_file: Path | None = None,
    page: Path | None = None,
    out: Callable[[str], None] = print,
) -> None:
    """Run a suite (or all), print its tables, write its JSON and a page of everything.

    `asked`: the options of `BenchOptions` that shall not be the suite's usual ones.
    """
    planned = runs(suite, asked)
    # What is wrong with the input shall be said before the work, not after it.
    parameters = {
        urdf: overridden(preset_for(load_robot(urdf), preset), settings)
        for urdf in dict.fromkeys(each.options.urdf for each in planned)
    }
    for each in planned:
        with_options(load_plant(each.options.plant), each.options.plant_options)
        for task in each.options.tasks:
            find_task(task)
        SUITES[each.suite].check(each.options)
    for file, name in ((json_file, "json"), (page, "report")):
        if file is not None:
            _check_writable(file, name)
    if is_compiled():
        out("with the compiled gait\n")
    rows: list[dict[str, Any]] = []
    sections: list[Section] = []
    for each in planned:
        began = time.monotonic()
        options = replace(each.options, parameters=parameters[each.options.urdf])
        report = SUITES[each.suite].measure(options)
        rows += report.as_json(options)
        reads = EVERY_SUITE | SUITES[each.suite].reads
        given = {name: value for name, value in each.given.items() if name in reads}
        command = command_line(each.suite, given, preset, settings)
        sections.append(Section(each.suite, command, options, report))
        out(f"{report.text}\n{each.suite}: took {time.monotonic() - began:.0f} s\n")
    if json_file is not None:
        json_file.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        out(f"wrote {json_file}")
    if page is not None:
        whole = command_line(suite, asked, preset, settings) + f" --report {page}"
        out(f"wrote {', '.join(map(str, write(page, sections, whole)))}")


def _check_writable(path: Path, name: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8"):
            pass
    except OSError as error:
        raise NaoGaitError(name, str(path), f"a file that can be written ({error})") from error
