"""What is marked on every time axis: falls and pushes."""

from dataclasses import dataclass

import numpy as np

from gait_lab.analysis.metrics import Trace, fall_tick
from gait_lab.report.walk import Walk

PUSH_DURATION = 0.1
"""[s] for which the simulated robot is pushed, unless told otherwise."""


@dataclass(frozen=True, slots=True)
class Event:
    """A moment on the report's axis [s]."""

    time: float
    kind: str
    """fall, push or alarm."""
    text: str


def find_events(walk: Walk, trace: Trace | None) -> tuple[Event, ...]:
    """In the order of time."""
    events = []
    if len(walk.truth) and trace is not None:
        tick = fall_tick(
            trace.torso_position, trace.torso_quaternion, float(trace.torso_position[0, 2])
        )
        if tick is not None:
            events.append(Event(float(walk.seconds(int(trace.stamp[tick]))), "fall", "fall"))
    for stamp, text in walk.support:
        if text.split(" ")[0] == "fallen":
            time = float(walk.seconds(stamp - walk.age))
            if len(walk.truth):
                events.append(Event(time, "alarm", "the gait feels a fall"))
            else:
                events.append(Event(time, "fall", "fall, as the gait felt it"))
    for stamp, force in zip(walk.push.stamp.tolist(), walk.push.value, strict=True):
        size = float(np.linalg.norm(force))
        direction = np.degrees(np.arctan2(force[1], force[0]))
        text = f"push {size:.0f} N towards {direction:.0f}°"
        events.append(Event(float(walk.seconds(stamp)), "push", text))
    return tuple(sorted(events, key=lambda event: event.time))


def first_fall(events: tuple[Event, ...]) -> float | None:
    """[s]"""
    return next((event.time for event in events if event.kind == "fall"), None)
