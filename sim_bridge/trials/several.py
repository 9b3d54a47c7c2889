"""Trials of several robots in one world: each has its own gait and its own policy."""

from collections.abc import Callable, Iterator, Sequence

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.presets import DEFAULT, preset_for
from sim_bridge.cameras.camera import CameraSettings
from sim_bridge.plant import Plant, load_plant
from sim_bridge.scene import Scene
from sim_bridge.trials.compiled import check_fresh
from sim_bridge.trials.trial import (
    CONTROL_PERIOD,
    Policy,
    Tick,
    Walker,
    WalkerResponder,
    run_responders,
)
from sim_bridge.world import World


def make_scene_world(
    scene: Scene, *, plant: str | Plant = "reference", engine: str = "mujoco", noise_seed: int = 0,
    cameras: CameraSettings | None = None,
) -> World:
    """The world of a scene; the caller closes it.

    Args:
        scene: Field and robots.
        plant: The plant, or its name or file.
        engine: `pybullet` or `mujoco`.
        noise_seed: Seed of the first robot's sensor noise; the next ones have the seeds after it.
        cameras: Of all robots; None = none.

    Returns:
        The robots at rest, at time 0.
    """
    return World.of_scene(
        scene,
        load_plant(plant) if isinstance(plant, str) else plant,
        engine=engine,
        noise_seed=noise_seed,
        control_period=CONTROL_PERIOD,
        cameras=cameras,
    )


def make_gaits(world: World) -> list[Gait]:
    """A gait for each robot of the world, with the preset of its kind."""
    check_fresh()
    return [
        Gait(robot.description, preset_for(robot.description, DEFAULT))
        for robot in world.robots
    ]


def run_several(
    world: World,
    walkers: Sequence[Walker],
    policies: Sequence[Policy],
    disturb: Callable[[World, Sequence[Tick]], None] | None = None,
) -> Iterator[tuple[Tick, ...]]:
    """Step a world and the walkers of all its robots by control periods, past falls.

    Args:
        world: The robots; time counts from now.
        walkers: Answer the robots' sensor frames, in the order of the robots.
        policies: Command the walkers, in the same order. Their `disturb` is not called.
        disturb: Acts on the world at the beginning of each control period; it gets the last ticks.

    Yields:
        The state at rest, then the ticks of all robots once per control period, until a policy
        ends the trial.
    """
    responders = [
        WalkerResponder(world, robot, walker, policy)
        for robot, walker, policy in zip(world.robots, walkers, policies, strict=True)
    ]
    yield from run_responders(world, responders, disturb or _nothing, past_falls=True)


def _nothing(world: World, ticks: Sequence[Tick]) -> None:
    """Does not disturb the world."""
