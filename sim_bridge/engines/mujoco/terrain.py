"""Uneven ground in MuJoCo: each prism is a convex mesh, the same to a foot as the floor."""

from collections.abc import Iterable

import mujoco

from sim_bridge.terrain import Prism


def add_terrain(
    spec: mujoco.MjSpec, ground: Iterable[Prism], *, contype: int, group: int
) -> None:
    for index, prism in enumerate(ground):
        name = f"terrain_{index}"
        spec.add_mesh(name=name, uservert=prism.vertices.ravel().tolist())
        spec.worldbody.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            contype=contype,
            conaffinity=0,
            condim=3,
            friction=[0.0, 0.0, 0.0],  # as the floor's
            group=group,
            rgba=prism.color,
        )
