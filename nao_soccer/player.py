"""One player: what it perceives becomes a world state and a direction for its head.

Behaviour stands between two calls: it reads the state and chooses a `HeadMode`.

    player = Player(settings)
    player.world.add_odometry(stamp, pose)
    player.world.add_percepts(percepts)
    state = player.state()
    goal = player.look(HeadMode.AUTO)
"""

from nao_lipm_gait.head.goals import Goal
from nao_soccer.world.looking import Looking
from nao_soccer.world.model import WorldModel
from nao_soccer.world.settings import WorldSettings
from nao_soccer.world.state import HeadMode, WorldState


class Player:
    """World model and head of one robot.

    Args:
        settings: Of the world model.

    Attributes:
        world: Takes percepts, odometry, falls and team messages.
    """

    def __init__(self, settings: WorldSettings) -> None:
        self.world = WorldModel(settings)
        self._looking = Looking(self.world.map)
        self._state: WorldState | None = None

    def state(self) -> WorldState | None:
        """The world at the time of the last odometry; None before the first."""
        self._state = self.world.state()
        return self._state

    def look(self, mode: HeadMode) -> Goal | None:
        """Where the head looks, by the last state; None leaves it to the gait."""
        if self._state is None or not self._state.upright:
            return None
        return self._looking.goal(mode, self._state)
