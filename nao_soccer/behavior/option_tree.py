"""A hierarchy of state machines, as section 5.2 of Friedmann et al. (XABSL) describes it.

An *option* is a state machine. A state names what is done while it is active: a subsequent option,
or a *basic behaviour*, which is a function. Its transitions are taken when an *input symbol*, a
function of the situation, becomes true. At every update the tree is walked from the root to a basic
behaviour; the states on the way are the *activation path*.

    SEARCHING = Option(
        "search for the ball",
        State("look around", turn_head, to=[After(3.0, "turn")]),
        State("turn", turn_on_the_spot, to=[After(6.0, "look around")]),
    )
    STRIKER = Option(
        "striker",
        State("search", SEARCHING, to=[When(ball_seen, "approach")]),
        State("approach", walk_to_ball, to=[When(ball_lost, "search")]),
    )
    command, path = OptionTree(STRIKER).update(situation, time)

The first state of an option is its initial one. An option that was not on the activation path of
the last update starts in it. In each option on the path, at most one transition is taken per
update: the first one whose symbol is true.

Nothing here knows soccer: `S` is the type of the situation, `A` that of what a basic behaviour
returns.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

from robot_core.errors import NaoGaitError

S = TypeVar("S")
A = TypeVar("A")

LARGEST_DEPTH = 20
"""Number of options on a path; a deeper tree contains itself."""


class When(NamedTuple, Generic[S]):
    """A transition that is taken when a symbol is true.

    `target` is the name of the state that follows.
    """

    symbol: Callable[[S], bool]
    target: str

    @property
    def label(self) -> str:
        """For pictures."""
        return self.symbol.__name__.replace("_", " ")

    def holds(self, situation: S, time_in_state: float) -> bool:
        """Whether the transition is taken."""
        return self.symbol(situation)


class After(NamedTuple):
    """A transition that is taken after some seconds [s] in the state."""

    seconds: float
    target: str

    @property
    def label(self) -> str:
        """For pictures."""
        return f"after {self.seconds:g} s"

    def holds(self, situation: object, time_in_state: float) -> bool:
        """Whether the transition is taken."""
        return time_in_state >= self.seconds


class State(Generic[S, A]):
    """A state of an option.

    Args:
        name: Unique in its option.
        do: An option, or a function of the situation.
        to: Transitions, the most important first.
    """

    def __init__(
        self,
        name: str,
        do: "Option[S, A] | Callable[[S], A]",
        to: Sequence[When[S] | After] = (),
    ) -> None:
        self.name = name
        self.do = do
        self.to = tuple(to)


class Option(Generic[S, A]):
    """A state machine; the first state is the initial one.

    An option with one state is left by the options above it.

    Raises:
        NaoGaitError: A state is there twice, cannot be reached, has no way out, or a transition
            leads to a state that does not exist.
    """

    def __init__(self, name: str, *states: State[S, A]) -> None:
        self.name = name
        self.states = {state.name: state for state in states}
        self._check(states)

    @property
    def initial(self) -> State[S, A]:
        """The state in which the option starts."""
        return next(iter(self.states.values()))

    def _check(self, states: Sequence[State[S, A]]) -> None:
        where = f"option {self.name}"
        if not states:
            raise NaoGaitError(where, "no states", "at least one state")
        if len(self.states) < len(states):
            raise NaoGaitError(where, [state.name for state in states], "each state once")
        for state in states:
            for transition in state.to:
                if transition.target not in self.states:
                    raise NaoGaitError(f"{where}: {state.name} to", transition.target, self.states)
            others = [each.target for each in state.to if each.target != state.name]
            if len(states) > 1 and not others:
                allowed = "a transition to another state"
                raise NaoGaitError(f"{where}: {state.name}", "no way out", allowed)
        reached, waiting = set[str](), [states[0].name]
        while waiting:
            name = waiting.pop()
            if name not in reached:
                reached.add(name)
                waiting += [transition.target for transition in self.states[name].to]
        for state in states:
            if state.name not in reached:
                raise NaoGaitError(f"{where}: {state.name}", "never reached", "a way into it")


class Activation(NamedTuple):
    """One option on the activation path.

    Attributes:
        option: Its name.
        state: Its active state.
        seconds: [s] in that state.
        left: The state from which a transition led there; empty in the initial state.
        why: Label of that transition.
    """

    option: str
    state: str
    seconds: float
    left: str = ""
    why: str = ""

    def __str__(self) -> str:
        came = f"; {self.left}, {self.why}" if self.left else ""
        return f"{self.option}: {self.state} ({self.seconds:.1f} s{came})"

    @classmethod
    def parsed(cls, text: str) -> "Activation":
        """The inverse of `str`; raises ValueError."""
        place, _, rest = text.removesuffix(")").rpartition(" (")
        option, _, state = place.partition(": ")
        seconds, _, came = rest.partition(" s")
        left, _, why = came.removeprefix("; ").partition(", ")
        return cls(option, state, float(seconds), left, why)


@dataclass(slots=True)
class _Memory:
    """The active state of an option, since when [s], and the transition that led there."""

    state: str
    since: float
    left: str = ""
    why: str = ""


class OptionTree(Generic[S, A]):
    """Walks the tree of options.

    Raises:
        NaoGaitError: An option contains itself.
    """

    def __init__(self, root: Option[S, A]) -> None:
        self.root = root
        for depth, _ in _options(root):
            if depth > LARGEST_DEPTH:
                raise NaoGaitError(f"option {root.name}", "contains itself", "a tree of options")
        self._active: dict[str, _Memory] = {}

    def reset(self) -> None:
        """Start again in the initial states."""
        self._active.clear()

    def update(self, situation: S, time: float) -> tuple[A, tuple[Activation, ...]]:
        """What the basic behaviour returns, and the activation path; `time` [s] rises."""
        before, self._active = self._active, {}
        path: list[Activation] = []
        place, option = "", self.root
        while True:
            place = f"{place}/{option.name}"
            memory = before.get(place) or _Memory(option.initial.name, time)
            state = option.states[memory.state]
            for transition in state.to:
                if transition.holds(situation, time - memory.since):
                    memory = _Memory(transition.target, time, state.name, transition.label)
                    state = option.states[transition.target]
                    break
            self._active[place] = memory
            since = time - memory.since
            path.append(Activation(option.name, state.name, since, memory.left, memory.why))
            place = f"{place}/{state.name}"
            if not isinstance(state.do, Option):
                return state.do(situation), tuple(path)
            option = state.do


def _options(root: Option[S, A], depth: int = 0) -> Iterator[tuple[int, Option[S, A]]]:
    """All options below one, each as often as it is used, with their depth."""
    yield depth, root
    if depth <= LARGEST_DEPTH:
        for state in root.states.values():
            if isinstance(state.do, Option):
                yield from _options(state.do, depth + 1)


def mermaid(root: Option[S, A]) -> str:
    """The tree as a Mermaid state diagram; each option is drawn once."""
    lines = ["stateDiagram-v2"]
    drawn: set[str] = set()
    for _, option in _options(root):
        if option.name not in drawn:
            drawn.add(option.name)
            lines += _drawn(option)
    return "\n".join(lines) + "\n"


def _drawn(option: Option[S, A]) -> Iterator[str]:
    def node(state: str) -> str:
        return f"{option.name}__{state}".replace(" ", "_")

    yield f'  state "{option.name}" as {option.name.replace(" ", "_")} {{'
    yield f"    [*] --> {node(option.initial.name)}"
    for state in option.states.values():
        inner = isinstance(state.do, Option)
        does = state.do.name if isinstance(state.do, Option) else _name_of(state.do)
        yield f"    {node(state.name)}: {state.name}\\n{'→ ' if inner else ''}{does}"
        for transition in state.to:
            yield f"    {node(state.name)} --> {node(transition.target)}: {transition.label}"
    yield "  }"


def _name_of(behavior: Callable[[S], A]) -> str:
    name = getattr(behavior, "__name__", type(behavior).__name__)
    return str(name).replace("_", " ")
