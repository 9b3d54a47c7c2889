"""The suite `render`: what one image of a robot's camera costs.

All robots of a scene stand, and each of their cameras renders a few images. CPU time counts, of all
threads of the renderer.
"""

from collections.abc import Iterator

import numpy as np

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.suites.compute import cpu_time
from gait_lab.bench.suites.vision import can_render
from sim_bridge.cameras.camera import CameraSettings, SimulatedCamera
from sim_bridge.robot import SimulatedRobot
from sim_bridge.scene import load_scene
from sim_bridge.trials.trial import CONTROL_PERIOD
from sim_bridge.world import World

SETTLE = 20
"""Control periods before the first image."""


@suite(
    "render", "Cost of an image", "CPU time of an image of each camera of a scene",
    options={
        "scene": "pitch",
        "images": Option(10, "images of each camera", "N", minimum=1),
        "width": Option(320, "columns of an image", "PX", minimum=16),
        "height": Option(240, "rows of an image", "PX", minimum=16),
    },
    gait=False, quick=({"images": 3},), applies=can_render,
)  # fmt: skip
def render(options: Options) -> Iterator[Row | str]:
    """CPU time of an image of each camera, and of a control period of the same world."""
    settings = CameraSettings(width=options.width, height=options.height)
    costs = []
    with World.of_scene(
        load_scene(options.scene), options.made_plant, engine=options.engine,
        control_period=CONTROL_PERIOD, cameras=settings,
    ) as world:  # fmt: skip
        for robot in world.robots:
            for camera in robot.cameras:
                camera.enabled = False
        ticks = [cpu_time(world.step) for _ in range(SETTLE)]
        for robot in world.robots:
            for camera in robot.cameras:
                costs.append(_cost(world, robot, camera, options.images))
                ticks += [cpu_time(world.step) for _ in range(SETTLE)]
    tick = 1e-6 * float(np.median(ticks))
    renders, effects = 1e-6 * np.array(costs).T
    yield from rows_of(
        "",
        ("render_median", "ms", float(np.median(renders))),
        ("render_worst", "ms", float(renders.max())),
        ("effects_median", "ms", float(np.median(effects))),
        ("physics_tick", "ms", tick),
        ("render_worst_in_ticks", "", float(renders.max()) / tick),
    )
    yield (
        f"CPU time of images of {options.width} x {options.height}, {len(costs)} cameras; of each "
        f"the median of {options.images}. A tick is a control period of the same world without "
        "images; effects: motion blur, vignette, noise."
    )


def _cost(
    world: World, robot: SimulatedRobot, camera: SimulatedCamera, count: int
) -> tuple[float, float]:
    """Median CPU time [ns] of rendering an image, and of the camera's effects on it."""
    state = robot.state
    view = camera.view(state)
    image = world.render(view)
    camera.enabled = True
    renders, effects = [], []
    for _ in range(count):
        renders.append(cpu_time(world.render, view))
        camera.restart(-int(1e12))
        effects.append(cpu_time(camera.observe, world.time, state, lambda _: image))
    camera.enabled = False
    camera.restart(world.time)
    return float(np.median(renders)), float(np.median(effects))
