"""The largest impulse that is survived from each side, by bisection."""

from collections.abc import Sequence

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.push_cells import SURVIVAL, Kind, push_all

LADDER = tuple(0.25 * step for step in range(3, 15))
"""Impulses among which the largest survived one is looked for [N s]."""


def push_until_lost(wanted: Sequence[tuple[Kind, str, float]], options: BenchOptions) -> None:
    """`push_all`, but the later robots only where the first ones leave a chance to pass."""
    first = max(1, options.robots // 4)
    bearable = int((1.0 - SURVIVAL) * options.robots * options.phases + 1e-9)
    push_all(wanted, options, slice(first))
    left = []
    for kind, direction, impulse in wanted:
        cell = kind.cells[direction, impulse]
        if cell.pushed - cell.survived <= bearable:
            left.append((kind, direction, impulse))
        else:
            cell.given_up = first < options.robots
    if left and first < options.robots:
        push_all(left, options, slice(first, None))


def search_largest(kinds: Sequence[Kind], directions: Sequence[str], options: BenchOptions) -> None:
    """Bisect the ladder in every direction, all of them in the same rounds."""
    # Index of the largest impulse that passes and of the smallest that does not.
    spans = {(index, direction): (-1, len(LADDER)) for index in range(len(kinds))
             for direction in directions}  # fmt: skip
    while True:
        asked = {key: (low + high) // 2 for key, (low, high) in spans.items() if high - low > 1}
        if not asked:
            return
        push_until_lost(
            [(kinds[index], direction, LADDER[step])
             for (index, direction), step in asked.items()],
            options,
        )  # fmt: skip
        for key, step in asked.items():
            index, direction = key
            low, high = spans[key]
            passes = kinds[index].cells[direction, LADDER[step]].passes
            spans[key] = (step, high) if passes else (low, step)
