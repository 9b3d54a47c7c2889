"""Starts rcsssmj, in the Python environment that has it; arguments are the server's.

rcsssmj 0.2.1 ends when a K1 touches the ball: it asks for the name of the part that touched it, and
K1's parts have none. They get names here, when the model is loaded.
"""

from typing import Any

from rcsssmj.__main__ import soccer_sim
from rcsssmj.resources.spec_provider import ModelSpecProvider

_load = ModelSpecProvider.load_robot_spec


def _with_names(self: Any, *args: Any, **options: Any) -> Any:
    spec = _load(self, *args, **options)
    for index, geom in enumerate(() if spec is None else spec.geoms):
        if not geom.name:
            geom.name = f"part-{index}"
    return spec


if __name__ == "__main__":
    ModelSpecProvider.load_robot_spec = _with_names
    soccer_sim()
