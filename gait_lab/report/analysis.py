"""Everything that is computed from one bag; a missing topic costs only its part."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gait_lab.analysis.metrics import DOUBLE, LEFT, RIGHT, Metrics, Trace, measure
from gait_lab.report.body import BodyTrack, follow_body, robot_of
from gait_lab.report.events import Event, find_events, first_fall
from gait_lab.report.innovation import Innovation, find_innovation
from gait_lab.report.motors import MotorUse, motor_use
from gait_lab.report.paths import Paths, find_paths
from gait_lab.report.steps import Phase, Step, find_phases, find_steps, origins_under_sole
from gait_lab.report.stretches import Stretch, find_stretches
from gait_lab.report.timing import Timing, find_timing
from gait_lab.report.trace import make_trace
from gait_lab.report.walk import Walk, read_walk
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import FloatArray


@dataclass(frozen=True, slots=True)
class Analysis:
    """One walk, looked at from all sides. None where the bag does not say."""

    walk: Walk
    robot: RobotDescription | None
    robot_remark: str
    body: BodyTrack | None
    phases: tuple[Phase, ...]
    steps: tuple[Step, ...]
    origins: tuple[FloatArray, FloatArray]
    """Pendulum origins under the left and the right sole, see `origins_under_sole`."""
    trace: Trace | None
    stretches: tuple[Stretch, ...]
    walking: Metrics | None
    """Scored from the first step to the last, as one window."""
    events: tuple[Event, ...]
    innovation: Innovation | None
    motors: MotorUse | None
    timing: Timing | None
    paths: Paths | None

    @property
    def fall(self) -> float | None:
        """[s] on the report's axis."""
        return first_fall(self.events)

    @property
    def walked(self) -> tuple[float, float] | None:
        """First and last moment of a step [s]."""
        on_foot = [phase for phase in self.phases if phase.support != DOUBLE]
        if not on_foot:
            return None
        begin, end = on_foot[0].stamp, on_foot[-1].end
        return float(self.walk.seconds(begin)), float(self.walk.seconds(end))

    @property
    def has_motion(self) -> bool:
        """Whether there is anything to report about."""
        walk = self.walk
        tables = (walk.position, walk.truth, walk.odometry, walk.expected, walk.measured,
                  walk.estimated, walk.targets)  # fmt: skip
        return any(len(table) > 1 for table in tables)


def analyse(path: Path) -> Analysis:
    """Read and measure a bag; NaoGaitError for what is none."""
    walk = read_walk(path)
    robot, remark = robot_of(walk)
    body = follow_body(walk, robot) if robot is not None and len(walk.position) > 1 else None
    phases = find_phases(walk)
    trace = make_trace(walk, phases, body)
    analysis = Analysis(
        walk=walk,
        robot=robot,
        robot_remark=remark,
        body=body,
        phases=phases,
        steps=find_steps(walk, phases),
        origins=(
            origins_under_sole(walk, phases, LEFT),
            origins_under_sole(walk, phases, RIGHT),
        ),
        trace=trace,
        stretches=() if trace is None else find_stretches(walk, trace),
        walking=None,
        events=find_events(walk, trace),
        innovation=find_innovation(walk, phases),
        motors=motor_use(walk, robot) if robot is not None and len(walk.effort) > 1 else None,
        timing=find_timing(walk),
        paths=find_paths(walk, body),
    )
    return _with_whole(analysis)


def _with_whole(analysis: Analysis) -> Analysis:
    from dataclasses import replace

    trace = analysis.trace
    if trace is None or not len(trace):
        return analysis
    shift = float(analysis.walk.seconds(int(trace.stamp[0])))
    begin, end = analysis.walked or (shift, np.inf)
    return replace(analysis, walking=measure(trace, max(0.0, begin - shift), end - shift))
