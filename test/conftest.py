"""What most tests walk on: the shipped NAO, the shipped plants, the engines."""

from collections.abc import Iterator
from contextlib import suppress

import pytest
from hypothesis import HealthCheck, settings

import gait_lab  # noqa: F401  chooses the kernels of OpenBLAS, before NumPy is imported
from engine_bench import Bench, weightless
from robot_core.robot import RobotDescription, load_robot
from sharing import pytest_collection_modifyitems, pytest_xdist_make_scheduler  # noqa: F401
from sim_bridge.engines import registry as engines
from sim_bridge.plant import Plant, load_plant

# The same examples on every machine, and no wall clock: a busy one takes seconds for any of them.
settings.register_profile(
    "any machine", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("any machine")
with suppress(ImportError):  # Constants of the modules that other tests loaded would be drawn, too.
    from hypothesis.internal.conjecture import providers

    providers.is_local_module_file = lambda path: False  # type: ignore[attr-defined]


@pytest.fixture(scope="session")
def robot() -> RobotDescription:
    return load_robot()


@pytest.fixture(scope="session")
def reference() -> Plant:
    return load_plant("reference")


@pytest.fixture(scope="session")
def ideal() -> Plant:
    return load_plant("ideal")


@pytest.fixture(params=engines.ENGINES)
def engine(request: pytest.FixtureRequest) -> str:
    """Each engine that is installed."""
    if not engines.installed(request.param):
        pytest.skip(f"{request.param} is not installed")
    return str(request.param)


@pytest.fixture
def mujoco_only() -> None:
    if not engines.installed("mujoco"):
        pytest.skip("mujoco is not installed")


@pytest.fixture
def floating(engine: str, robot: RobotDescription, reference: Plant) -> Iterator[Bench]:
    bench = Bench(engine, robot, weightless(reference))
    yield bench
    bench.backend.close()
