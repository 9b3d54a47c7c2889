"""What a suite runs on: robots, plant, engine, parameters, and how much of it."""

import math
from dataclasses import dataclass
from pathlib import Path

from gait_lab.trials.tasks import SPEED_TASKS
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import GaitParameters
from sim_bridge.plant import PlantOption, option_text

OPEN_LOOP = ("beside", "off", "only")
IMPULSE_MAX = 100.0
"""[N s]"""


@dataclass(frozen=True, slots=True)
class BenchOptions:
    """What a suite runs on; each suite reads what concerns it."""

    robots: int = 8
    seed: int = 0
    """Seed of the first robot; robots are seed, seed + 1, ..."""
    engine: str = "pybullet"
    plant: str = "reference"
    plant_options: tuple[PlantOption, ...] = ()
    """Options of the plant that are replaced."""
    urdf: str = "nao_h21_v33"
    parameters: GaitParameters = GaitParameters()
    tasks: tuple[str, ...] = SPEED_TASKS
    window: float = 20.0
    """Seconds at speed."""
    open_loop: str = "beside"
    """`beside` the closed loop, `off`, or `only`."""
    jobs: int | None = None
    ingredients: tuple[str, ...] = ()
    """What the suite `plant` varies; empty = every ingredient."""
    impulses: tuple[float, ...] = ()
    """[N s] of the suite `push`; empty = search for the largest one that is survived."""
    directions: tuple[str, ...] = ()
    """Of the pushes; empty = all eight."""
    phases: int = 8
    """Pushes per gait cycle of two steps."""
    half_speed: bool = True
    """Suite `speed`: the same tasks also at half their speed."""
    metres: float = 50.0
    """Suite `endurance`: what each robot walks."""
    experiments: tuple[str, ...] = ()
    """Of the suites `posture` and `rough`; empty = all."""
    changes: Path | None = None
    """Suite `ablation`: a list of changes of the gait; None = the shipped one."""
    placo_python: str | None = None
    """Suite `peers`: the Python of an environment that has placo; None = without placo."""
    attempts: int = 5
    """Suites `getup` (from each side) and `kick`: attempts of each robot."""
    runs: int = 2000
    """Suite `faults`: walks with a fault each."""
    faults: tuple[str, ...] = ()
    """Suite `faults`: only these classes; empty = all."""
    loss: float = 10.0
    """Suite `loss`: share of all messages that are lost [%]."""
    ticks: int = 1_000_000
    """Suite `fuzz`."""
    minutes: float = 30.0
    """Suite `soak`: simulated."""
    show: bool = True
    """Show a progress bar (on a terminal)."""

    def __post_init__(self) -> None:
        if self.robots < 1:
            raise NaoGaitError("robots", self.robots, "at least 1")
        if self.seed < -1:
            raise NaoGaitError("seed", self.seed, "at least -1 (the nominal robot)")
        if not 0.0 < self.window <= 3600.0:
            raise NaoGaitError("seconds", self.window, "over 0 to 3600 s")
        if self.open_loop not in OPEN_LOOP:
            raise NaoGaitError("open-loop", self.open_loop, "beside, off or only")
        if not 1 <= self.phases <= 100:
            raise NaoGaitError("phases", self.phases, "1 to 100")
        if not 1 <= self.attempts <= 1000:
            raise NaoGaitError("attempts", self.attempts, "1 to 1000")
        if not 0.0 < self.metres <= 1e5:
            raise NaoGaitError("metres", self.metres, "over 0 to 100000 m")
        if not 1 <= self.runs <= 10_000_000:
            raise NaoGaitError("runs", self.runs, "1 to 10000000")
        if not 0.0 <= self.loss <= 100.0:
            raise NaoGaitError("loss", self.loss, "0 to 100 %")
        if not 1 <= self.ticks <= 10**12:
            raise NaoGaitError("ticks", self.ticks, "1 to 10^12")
        if not 0.05 <= self.minutes <= 1e5:
            raise NaoGaitError("minutes", self.minutes, "0.05 to 100000")
        for impulse in self.impulses:
            if not (math.isfinite(impulse) and 0.0 <= impulse <= IMPULSE_MAX):
                raise NaoGaitError("impulse", impulse, f"0 to {IMPULSE_MAX:g} N s")

    @property
    def plant_title(self) -> str:
        """The plant with its replaced options."""
        return " ".join((self.plant, *(option_text(option) for option in self.plant_options)))

    @property
    def seeds(self) -> range:
        """Seeds of the robots."""
        return range(self.seed, self.seed + self.robots)

    @property
    def loops(self) -> tuple[bool, ...]:
        """Closed (true) and open (false) loop, as far as wanted."""
        wanted = {"beside": (True, False), "off": (True,), "only": (False,)}
        return wanted[self.open_loop]

    def loop_parameters(self, closed: bool) -> GaitParameters:
        """The gait's parameters in closed or open loop."""
        return self.parameters.replace(feedback=self.parameters.feedback and closed)

    @property
    def title(self) -> str:
        """Robots, plant, engine and model, for the head of a table."""
        last = self.seed + self.robots - 1
        robots = f"robots {self.seed}-{last}" if self.robots > 1 else f"robot {last}"
        return f"{robots}, plant {self.plant_title}, {self.engine}, {self.urdf}"
