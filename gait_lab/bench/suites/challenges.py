"""The suite `challenges`: technical challenges of the RoboCup SPL, with its published rules."""

from collections.abc import Iterator, Sequence

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import median
from gait_lab.soccer.challenge_rules import LIMIT, PENALTY
from gait_lab.soccer.challenges import CHALLENGES, ChallengeResult, ChallengeSpec, play_challenge

NAMES = tuple(CHALLENGES)
WALKS = "walk straight", "walk slalom"
CONTROL, KICK = "ball control", "best kick"
TARGETS = "centre mark", "penalty mark", "corner"


@suite(
    "challenges", "Technical challenges",
    "fastest walk (straight and slalom), ball control and best kick by the SPL's rules",
    options={
        "robots": 20,
        "challenges": Option(NAMES, "which one", "NAME", ("--challenge",), choices=NAMES),
        "limit": Option(LIMIT, "time [s] for one attempt", "T", minimum=1.0, maximum=3600.0),
    },
    gait=False, quick=({"robots": 4},),
)  # fmt: skip
def challenges(options: Options) -> Iterator[Row | str]:
    """Each robot has one attempt at each challenge."""
    specs = [ChallengeSpec(name=name, seed=seed, limit=options.limit, **options.play)
             for name in options.challenges for seed in options.seeds]  # fmt: skip
    results: list[ChallengeResult] = options.map(
        play_challenge, specs, label="challenges",
        note=lambda each: f"{each.spec.name}, robot {each.spec.seed}: {each.doing}",
    )  # fmt: skip
    of = {name: [each for each in results if each.spec.name == name] for name in options.challenges}
    for name, mine in of.items():
        kind = f"{name} sum" if name == KICK else name
        yield from _rows(kind, "m" if name == KICK else "s", [each.score for each in mine])
        if name == CONTROL:
            penalties = median(each.penalties for each in mine)
            yield Row(name.replace(" ", "_"), "penalties_median", "penalties", penalties)
    if set(WALKS) <= set(of):
        both = zip(*(of[name] for name in WALKS), strict=True)
        sums = [None if one.score is None or two.score is None else one.score + two.score
                for one, two in both]  # fmt: skip
        yield from _rows("walk sum", "s", sums)
    for index, target in enumerate(TARGETS if KICK in of else ()):
        yield from _rows(f"kick to {target}", "m", [each.parts[index] for each in of[KICK]])
    yield (
        "One attempt each. Walks: from touchline to touchline, in line with the penalty mark; "
        "slalom: around four standing robots, which must not be touched. Ball control: until robot "
        f"and ball are beyond the other touchline, with {PENALTY:g} s for each penalty. Best kick: "
        "sum of the distances from the resting ball to three targets, 3.9, 7.1 and 8.9 m away. "
        "Median of those who have done it; worst only if all have."
    )


def _rows(name: str, unit: str, scores: Sequence[float | None]) -> list[Row]:
    done = [each for each in scores if each is not None]
    score = "seconds_" if unit == "s" else ""
    return rows_of(
        name.replace(" ", "_"),
        ("done", "%", 100.0 * len(done) / len(scores)),
        (f"{score}median", unit, median(done)),
        (f"{score}worst", unit, max(done, default=None) if len(done) == len(scores) else None),
    )
