"""Uneven ground in PyBullet: each prism is a convex hull that does not move."""

from collections.abc import Iterable
from typing import Any

from sim_bridge.terrain import Prism


def lay_terrain(
    bullet: Any, client: int, ground: Iterable[Prism], *, collides: bool, visible: bool
) -> list[int]:
    """The bodies of the prisms, in their order.

    Args:
        bullet: the module, which its importer has silenced.
    """
    bodies = []
    for prism in ground:
        vertices = prism.vertices.tolist()
        collision = visual = -1
        if collides:
            collision = bullet.createCollisionShape(
                bullet.GEOM_MESH, vertices=vertices, physicsClientId=client
            )
        if visible:
            # Each triangle with corners of its own: shared ones would blur the edges.
            corners = [vertices[i] for triangle in prism.triangles for i in triangle]
            visual = bullet.createVisualShape(
                bullet.GEOM_MESH,
                vertices=corners,
                indices=list(range(len(corners))),
                rgbaColor=prism.color,
                specularColor=[0.0, 0.0, 0.0],
                physicsClientId=client,
            )
        bodies.append(bullet.createMultiBody(0.0, collision, visual, physicsClientId=client))
        if collides:
            bullet.changeDynamics(
                bodies[-1],
                -1,
                lateralFriction=1.0,
                restitution=0.0,
                collisionMargin=0.0,  # else a plate is 1 mm higher than it looks
                physicsClientId=client,
            )
    return bodies
