"""Walk with a CoM observer of your own, here an alpha-beta filter, beside the Kalman filter."""

import argparse
from collections.abc import Callable, Sequence

import numpy as np

from nao_lipm_gait import Gait, NaoGaitError, Simulation, Velocity
from nao_lipm_gait.walks.lipm.com_observer import ComCorrection, ComObserver
from nao_lipm_gait.walks.lipm.kalman_observer import kalman_observer
from nao_lipm_gait.walks.lipm.parameters import LipmParameters
from nao_lipm_gait.walks.lipm.state import WalkState


class AlphaBeta:
    """Constant gains on the innovation: `alpha` for the position, `beta` / dt for the velocity."""

    def __init__(self, parameters: LipmParameters, alpha: float = 0.1, beta: float = 0.005):
        self._alpha, self._beta, self._dt = alpha, beta, 0.01

    def predict(self, expected: WalkState, dt: float) -> None:
        """The walk has predicted the state; here only the time [s] between two ticks is used."""
        self._dt = dt

    def correct(self, dx: float, dy: float) -> ComCorrection:
        """Filtered minus expected state, from the measured minus the expected CoM [m]."""
        velocity = self._beta / self._dt
        return ComCorrection(self._alpha * dx, self._alpha * dy, velocity * dx, velocity * dy)


def walk(make: Callable[[LipmParameters], ComObserver], seconds: int) -> tuple[float, float, bool]:
    """Forward distance [m], mean lateral |expected - measured| CoM [m], and whether it fell."""
    gait, errors = Gait("nao_h21_v33", make_observer=make), []
    with Simulation("nao_h21_v33", seed=40) as sim:
        obs, targets = sim.reset(), None
        for tick in range(100 * seconds):
            obs = sim.step(targets)
            if obs.frame:
                targets = gait.step(obs.frame, Velocity(0.2 if tick > 99 else 0.0))
                status = gait.status
                errors.append(abs(status.com_expected_in_q[1] - status.com_measured_in_q[1]))
    return obs.truth.base_footprint[0], float(np.mean(errors)), obs.fallen


def main(args: Sequence[str] | None = None) -> dict[str, tuple[float, float, bool]]:
    """Print and return what each observer reaches."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="5 s of each, not 20 s")
    options = parser.parse_args(args)
    found = {}
    for name, make in (("Kalman", kalman_observer), ("alpha-beta", AlphaBeta)):
        found[name] = way, error, fell = walk(make, 5 if options.quick else 20)
        print(f"{name:10s} {way:5.2f} m, CoM error {1000 * error:.1f} mm{', fell' * fell}")
    return found


if __name__ == "__main__":
    try:
        main()
    except NaoGaitError as error:
        raise SystemExit(str(error)) from None
