"""Without an IMU the loads on the soles reveal a fall."""

from nao_lipm_gait.runtime.sensor_outage import LIGHT_TIME
from nao_lipm_gait.runtime.sole_loads import SoleLoads

MS = 1_000_000


def test_soles_that_carry_nothing_for_a_while_mean_a_fall() -> None:
    loads = SoleLoads(mass=5.0)
    assert loads.light_time(0) == 0, "no load is known"

    def add(ms: int, left: float, right: float) -> bool:
        loads.add(0, ms * MS, left)
        loads.add(1, ms * MS, right)
        return loads.light_time(ms * MS) >= LIGHT_TIME

    assert not any(add(ms, 25.0, 24.0) for ms in range(0, 200, 10))
    assert not any(add(ms, 0.0, 0.0) for ms in range(200, 250, 10)), "in the air between two steps"
    assert not add(250, 49.0, 0.0)
    assert [add(ms, 3.0, 2.0) for ms in range(260, 380, 10)].count(True) == 2
    assert loads.light_time(2_000 * MS) == 0, "old loads say nothing"
