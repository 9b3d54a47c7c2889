"""Starts rcsssmj, in the Python environment that has it; arguments are the server's.

Two faults of rcsssmj 0.2.1 end it; they are answered here:
- A K1 touches the ball: the server asks for the name of the part, and K1's parts have none.
- A player joins before the first step: the places of the speakers have the wrong shape until then.
"""

from typing import Any

import numpy as np
from rcsssmj.__main__ import soccer_sim
from rcsssmj.resources.spec_provider import ModelSpecProvider
from rcsssmj.sim.simulation import BaseSimulation

_load, _init = ModelSpecProvider.load_robot_spec, BaseSimulation.init


def _with_names(self: Any, *args: Any, **options: Any) -> Any:
    spec = _load(self, *args, **options)
    for index, geom in enumerate(() if spec is None else spec.geoms):
        if not geom.name:
            geom.name = f"part-{index}"
    return spec


def _with_speakers(self: Any) -> bool:
    done = bool(_init(self))
    if done:
        self._a_data.origins = np.zeros((3, 0))
    return done


if __name__ == "__main__":
    ModelSpecProvider.load_robot_spec = _with_names
    BaseSimulation.init = _with_speakers
    soccer_sim()
