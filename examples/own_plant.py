"""Walk on plants of your own: the reference plant with other options, and one from a file."""

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

from nao_lipm_gait import Gait, NaoGaitError, Simulation, Velocity
from sim_bridge.plant import Plant, load_plant, with_options

SLOW_MOTORS = """
base: reference
motor: {lag: 0.03}
"""


def walk(plant: Plant, seconds: int) -> tuple[float, bool]:
    """How far [m] the robot comes on a plant, and whether it fell."""
    gait = Gait("nao_h21_v33")
    with Simulation("nao_h21_v33", plant=plant) as sim:
        obs, targets = sim.reset(), None
        for tick in range(100 * seconds):
            obs = sim.step(targets)
            if obs.frame:
                targets = gait.step(obs.frame, Velocity(0.2 if tick > 99 else 0.0))
    return obs.truth.base_footprint[0], obs.fallen


def main(args: Sequence[str] | None = None) -> dict[str, tuple[float, bool]]:
    """Print and return what the robot reaches on each plant."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plant", help="a shipped name or your YAML file, in addition")
    parser.add_argument("--quick", action="store_true", help="4 s of each, not 15 s")
    options = parser.parse_args(args)
    reference = load_plant("reference")
    plants = {
        "reference": reference,
        "late sensors": with_options(reference, [("sensors.delay", 0.06)]),
    }
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "slow_motors.yaml"
        file.write_text(SLOW_MOTORS)
        plants["slow motors"] = load_plant(str(file))
    if options.plant:
        plants[options.plant] = load_plant(options.plant)
    found = {}
    for name, plant in plants.items():
        found[name] = way, fell = walk(plant, 4 if options.quick else 15)
        print(f"{name:14s} {way:5.2f} m{', fell' * fell}")
    return found


if __name__ == "__main__":
    try:
        main()
    except NaoGaitError as error:
        raise SystemExit(str(error)) from None
