"""What a campaign of faults covers: the gait, the players of a match, or the nodes of a robot."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from gait_lab.faults.campaign import (
    COMPARISON_FAULTS,
    FAULTS,
    OUTCOMES,
    STOPPED,
    VIOLATED,
    WENT_ON,
    FaultResult,
    FaultRun,
    run_fault,
)
from gait_lab.faults.harness import Fault
from gait_lab.faults.node_faults import NODE_FAULTS, run_node_fault
from gait_lab.faults.soccer_faults import SOCCER_FAULTS, run_soccer_fault


@dataclass(frozen=True, slots=True)
class Scope:
    """One campaign.

    Attributes:
        run: Runs one fault; picklable.
    """

    classes: Mapping[str, type[Fault]]
    others: Mapping[str, type[Fault]]
    run: Callable[[FaultRun], FaultResult]
    usual: int
    outcomes: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def all_classes(self) -> Mapping[str, type[Fault]]:
        """Every class that can be named."""
        return {**self.classes, **self.others}


SCOPES: Mapping[str, Scope] = {
    "gait": Scope(
        FAULTS,
        COMPARISON_FAULTS,
        run_fault,
        2000,
        OUTCOMES,
        (
            "walks: upright and walking at the end. stopped: upright, and a report says why. fell: "
            "the robot fell.",
            "violated: a command that is not finite, beyond the limits of a joint or too fast; an "
            "exception; a hang; a stop without a report; stiff commands after a fall that the gait "
            "did not detect.",
            "The gait measures the age of its sensors (`sensor_age`), and walks on while they are "
            "missing (`coast`); both are off by default in the node.",
        ),
    ),
    "soccer": Scope(
        SOCCER_FAULTS,
        {},
        run_soccer_fault,
        5 * len(SOCCER_FAULTS),
        (WENT_ON, STOPPED, VIOLATED),
        (
            "Matches of 50 s with a fault of one player's cameras, vision, team mate, referee or "
            "process. went on: it plays at the end, or does as the referee or its role asks. "
            "stopped: it stands, and its report names the fault. Half of the faults last to the "
            "end, the others for 2 to 15 s.",
            "violated: an exception; a walk that is not finite; a robot that walks on although it "
            "has seen nothing for longer than it may; a team of which nobody moves for 25 s and "
            "nobody reports the fault.",
        ),
    ),
    "robot": Scope(
        NODE_FAULTS,
        {},
        run_node_fault,
        2 * len(NODE_FAULTS),
        (WENT_ON, STOPPED, VIOLATED),
        (
            "went on: in the last 8 s the robot walks, kicks, gets up or stands as the referee "
            "wants it. stopped: it does not, and a diagnostic or a warning in a log names the "
            "fault. violated: another node ended or raised an exception; a stop without such a "
            "warning. The nodes run by the wall clock, so a run depends on more than its seed.",
        ),
    ),
}
