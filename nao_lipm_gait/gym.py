"""Registers the Gymnasium environment `nao_lipm_gait/Walk-v0`; needs the extra `gym`.

`import nao_lipm_gait` does it too, if Gymnasium is imported before it.
"""

import gymnasium

WALK = "nao_lipm_gait/Walk-v0"

gymnasium.register(WALK, "sim_bridge.walk_env:WalkEnv", max_episode_steps=1000)
