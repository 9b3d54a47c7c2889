"""The suite `abilities`: single situations of the soccer papers."""

from collections.abc import Iterator

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import median
from gait_lab.soccer.abilities import ABILITIES, AbilityResult, AbilitySpec, play_ability

NAMES = tuple(ABILITIES)


@suite(
    "abilities", "Abilities", "backheel with the goal behind, two at the ball",
    options={
        "robots": 20,
        "abilities": Option(NAMES, "which ability", "NAME", ("--ability",), choices=NAMES),
    },
    gait=False, quick=({"robots": 4},),
)  # fmt: skip
def abilities(options: Options) -> Iterator[Row | str]:
    """Each robot plays each situation once."""
    specs = [AbilitySpec(name=name, seed=seed, **options.play)
             for name in options.abilities for seed in options.seeds]  # fmt: skip
    results: list[AbilityResult] = options.map(
        play_ability, specs, label="abilities",
        note=lambda result: f"{result.spec.name}, robot {result.spec.seed}: {result.doing}",
    )  # fmt: skip
    for name in options.abilities:
        mine = [each for each in results if each.spec.name == name]
        done = sum(each.done for each in mine)
        times = [each.seconds for each in mine if each.seconds is not None]
        yield from rows_of(
            name.replace(" ", "_"),
            ("done", "%", 100.0 * done / len(mine)),
            ("seconds_median", "s", median(times)),
            ("seconds_worst", "s", max(times, default=None) if done == len(mine) else None),
        )
    yield (
        "backheel: the goal is behind the robot, unseen; it scores by a kick backwards. two at the "
        "ball: the nearer robot goes on, the other one steps back (judged 4 to 10 s later)."
    )
