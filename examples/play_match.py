"""Two teams play soccer in one process; percepts have the errors that vision has on images."""

import argparse
import math
from collections.abc import Sequence

from gait_lab.soccer.match import Match, MatchSpec
from nao_lipm_gait import NaoGaitError


def main(args: Sequence[str] | None = None) -> tuple[dict[str, int], float]:
    """Print and return the score, and the way [m] that the ball has moved."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="pitch_small", help="field and robots")
    parser.add_argument("--robots", type=int, help="in each team")
    parser.add_argument("--minutes", type=float, default=1.0, help="length of a half")
    parser.add_argument("--seed", type=int, default=0, help="of robots and noise")
    parser.add_argument("--quick", action="store_true", help="one NAO V6 each, until a kick")
    options = parser.parse_args(args)
    robots, kind = (1, "nao_v6") if options.quick else (options.robots, None)
    spec = MatchSpec(
        scene=options.scene, minutes=options.minutes, seed=options.seed, robots=robots, urdf=kind
    )
    way, last, shown = 0.0, None, 0.0
    with Match(spec) as match:
        for snapshot in match.play():
            way += 0.0 if last is None else math.dist(snapshot.ball, last)
            last = snapshot.ball
            if snapshot.time >= shown:
                x, y = snapshot.ball
                print(f"{snapshot.time:5.0f} s  {match.referee.score}  ball {x:5.2f} {y:5.2f}")
                shown += 5.0
            if options.quick and way > 0.5:
                break
        score = dict(match.referee.score)
    return score, way


if __name__ == "__main__":
    try:
        main()
    except NaoGaitError as error:
        raise SystemExit(str(error)) from None
