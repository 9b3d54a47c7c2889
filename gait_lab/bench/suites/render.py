"""The suite `render`: what one image of a robot's camera costs.

All robots of a scene stand, and each of their cameras renders a few images. CPU time counts, of all
threads of the renderer.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from sim_bridge.cameras.camera import CameraSettings, SimulatedCamera
from sim_bridge.engines.opengl import opengl_libraries
from sim_bridge.plant import load_plant, with_options
from sim_bridge.robot import SimulatedRobot
from sim_bridge.scene import load_scene
from sim_bridge.trials.trial import CONTROL_PERIOD
from sim_bridge.world import World

SETTLE = 20
"""Control periods before the first image."""


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `render` runs on."""

    robots: int = 1
    scene: str = option("pitch", "scene: a name or a file", "S")
    images: int = option(10, "images of each camera", "N", minimum=1)
    width: int = option(320, "columns of an image", "PX", minimum=16)
    height: int = option(240, "rows of an image", "PX", minimum=16)


@dataclass(frozen=True, slots=True)
class CameraCost:
    """CPU time of one image [ms]; medians.

    Attributes:
        robot: Name of the robot.
        camera: Name of the camera.
        render: Rendering by the engine.
        effects: Motion blur, vignette, noise.
    """

    robot: str
    camera: str
    render: float
    effects: float


def render(options: Options) -> SuiteResult:
    """CPU time of an image of each camera, and of a control period of the same world."""
    plant = with_options(load_plant(options.plant), options.plant_options)
    settings = CameraSettings(width=options.width, height=options.height)
    with World.of_scene(
        load_scene(options.scene),
        plant,
        engine=options.engine,
        control_period=CONTROL_PERIOD,
        cameras=settings,
    ) as world:
        for robot in world.robots:
            for camera in robot.cameras:
                camera.enabled = False
        ticks = [_milliseconds(world.step) for _ in range(SETTLE)]
        costs = []
        for robot in world.robots:
            for camera in robot.cameras:
                costs.append(_cost(world, robot, camera, options.images))
                ticks += [_milliseconds(world.step) for _ in range(SETTLE)]
    tick = float(np.median(ticks))
    renders = [cost.render for cost in costs]
    effects = [cost.effects for cost in costs]
    columns = (
        Column("robot"), Column("camera"), Column("render", "ms", 1), Column("effects", "ms", 1),
        Column("render", "ticks", 1),
    )  # fmt: skip
    rows = [
        (cost.robot, cost.camera, cost.render, cost.effects, cost.render / tick) for cost in costs
    ]
    return SuiteResult(
        (
            Measurement("render_median", "ms", float(np.median(renders))),
            Measurement("render_worst", "ms", max(renders)),
            Measurement("effects_median", "ms", float(np.median(effects))),
            Measurement("physics_tick", "ms", tick),
            Measurement("render_worst_in_ticks", "", max(renders) / tick),
        ),
        f"{options.width} x {options.height}, scene {options.scene}, {len(costs)} cameras, "
        f"{options.engine}",
        (Table(columns, rows),),
        (
            f"CPU time, medians of {options.images} images of each camera. A tick is a control "
            f"period of the same world without images: {tick:.2f} ms.",
        ),
    )


def _cost(world: World, robot: SimulatedRobot, camera: SimulatedCamera, count: int) -> CameraCost:
    state = robot.state
    view = camera.view(state)
    image = world.render(view)
    camera.enabled = True
    renders, effects = [], []
    for _ in range(count):
        renders.append(_milliseconds(lambda: world.render(view)))
        camera.restart(-int(1e12))
        effects.append(_milliseconds(lambda: camera.observe(world.time, state, lambda _: image)))
    camera.enabled = False
    camera.restart(world.time)
    return CameraCost(
        robot.name, camera.name, float(np.median(renders)), float(np.median(effects))
    )


def _milliseconds(work: Callable[[], object]) -> float:
    """CPU time of a call [ms]."""
    began = time.process_time_ns()
    work()
    return (time.process_time_ns() - began) * 1e-6


SUITE = Suite(
    name="render",
    title="Cost of an image",
    summary="CPU time of an image of each camera of a scene",
    measure=render,
    options=Options,
    gait=False,
    quick=({"images": 3},),
    applies=lambda options: options.engine == "pybullet" or bool(opengl_libraries()),
)
