"""A world as a MuJoCo model: what surrounds the robots, and the robots."""

from collections.abc import Sequence

import mujoco

from sim_bridge.engines.backend import RobotModel
from sim_bridge.engines.mujoco.pictures import add_background
from sim_bridge.engines.mujoco.robot import RobotParts
from sim_bridge.engines.mujoco.scene import FIXTURE_BIT, ROBOT_BIT, add_ball, add_surroundings
from sim_bridge.surroundings import PLAIN_FLOOR, Surroundings

_IMPEDANCE_RATIO = 10.0
"""Friction is this much harder than the normal contact: at 80 % of what it can hold, a foot creeps
by 0.3 mm/s. With 100 it is 0.1 mm/s, and the solver needs a tenth more time."""
_TOLERANCE = 1e-6
"""Tolerance of the constraint solver, relative to the inertia of the robot."""


class MujocoModel:
    """A compiled model; `MujocoBackend` steps it.

    Attributes:
        parts: The robots, in the order in which they were given.
    """

    def __init__(
        self,
        robots: Sequence[RobotModel],
        surroundings: Surroundings = PLAIN_FLOOR,
        *,
        visual: bool = False,
    ) -> None:
        """Compile the model.

        Args:
            robots: The individuals; all have the same physics and floor.
            surroundings: What is around them.
            visual: With visual shapes and light.

        Raises:
            NaoGaitError: MuJoCo cannot honour an option of the plant.
        """
        spec = mujoco.MjSpec()
        spec.compiler.degree = False
        physics, option = robots[0].plant.physics, spec.option
        option.timestep = physics.step
        option.gravity = [0.0, 0.0, -physics.gravity]
        option.iterations = physics.iterations
        # Implicit integrators modify the torque after the limit is applied, but report the
        # unmodified one.
        option.integrator = mujoco.mjtIntegrator.mjINT_EULER
        option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        option.impratio = _IMPEDANCE_RATIO
        option.tolerance = _TOLERANCE
        # A sparse Jacobian makes a step a quarter faster for one robot alone on its floor.
        option.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
        # Without automatic resets, which hide an unstable simulation.
        flags = mujoco.mjtDisableBit
        option.disableflags = flags.mjDSBL_AUTORESET
        if len(robots) == 1:
            option.disableflags |= flags.mjDSBL_ISLAND  # one robot is one island
        if visual:
            add_background(spec)
        add_surroundings(spec, surroundings, step=physics.step, visible=visual)
        fixed = FIXTURE_BIT if surroundings.fixtures else 0
        parts = []
        for index, robot in enumerate(robots):
            # MuJoCo needs the bit on one side only: each robot meets those before it.
            before = sum(ROBOT_BIT << other for other in range(index))
            parts.append(
                RobotParts(
                    spec,
                    robot,
                    bit=ROBOT_BIT << index if len(robots) > 1 else 0,
                    meets=before | fixed,
                    ball=surroundings.ball is not None,
                    visual=visual,
                )
            )
        if surroundings.ball is not None:
            add_ball(
                spec,
                surroundings.ball,
                step=physics.step,
                gravity=physics.gravity,
                visible=visual,
                meets=fixed,
            )
        self.parts = tuple(parts)
        self.model = spec.compile()
        for each in parts:
            each.set_springs(self.model)
