"""A picture of one crossing: the robot at even times on its field."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from gait_lab.analysis.figures import pyplot, save
from gait_lab.analysis.render import Camera, Harness
from gait_lab.bench.suites.rough import WALKERS
from gait_lab.trials.crossing import CrossingResult, CrossingSpec, cross, plant_of
from gait_lab.trials.trial import Tick, loaded_robot
from nao_lipm_gait.presets import preset_for
from sim_bridge.individual import draw_individual
from sim_bridge.terrain import prisms

FRAMES = 4
CAMERA = Camera(distance=1.25, yaw=35.0, pitch=-28.0, height=0.16)


def draw(spec: CrossingSpec, path: Path, frames: int = FRAMES) -> CrossingResult:
    """Let a robot cross and write `frames` pictures of it, side by side, to `path`."""
    ticks: list[Tick] = []
    result = cross(spec, ticks.append)
    robot, plant = loaded_robot(spec.robot.urdf), plant_of(spec)
    figure, panels = pyplot().subplots(
        1, frames, figsize=(3.3 * frames, 3.7), layout="constrained", squeeze=False
    )
    with Harness(robot, draw_individual(plant, robot, spec.robot_seed)) as stage:
        stage.lay_floor((plant.terrain.start + plant.terrain.length / 2.0, 0.0))
        stage.lay_terrain(prisms(plant.terrain, spec.robot_seed))
        for number, panel in enumerate(panels.flat):
            truth = ticks[(len(ticks) - 1) * (number + 1) // frames].truth
            stage.pose(truth.torso_position, truth.torso_quaternion, truth.joint_position)
            panel.imshow(stage.photograph(truth.torso_position.tolist(), 420, 420, CAMERA))
            panel.set_title(f"{1e-9 * truth.stamp:.1f} s", fontsize=9)
            panel.axis("off")
    save(figure, path)
    return result


def main(args: Sequence[str] | None = None) -> int:
    known = {walker.name: walker for walker in WALKERS}
    parser = argparse.ArgumentParser(
        prog="python -m gait_lab.bench.crossing_picture",
        description="Draw one crossing of the field.",
    )
    parser.add_argument("experiment", choices=tuple(known))
    parser.add_argument("--robot-seed", type=int, default=10, help="the robot and its field (10)")
    parser.add_argument("--engine", default="mujoco")
    parser.add_argument("-o", "--out", type=Path, required=True, help="a PNG file")
    asked = parser.parse_args(args)
    walker = known[asked.experiment]
    parameters = preset_for(loaded_robot(walker.urdf), walker.preset)
    result = draw(
        CrossingSpec(
            walker, parameters=parameters, robot_seed=asked.robot_seed, engine=asked.engine
        ),
        asked.out,
    )
    sys.stdout.write(f"{asked.out}: robot {asked.robot_seed} {result.end}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
