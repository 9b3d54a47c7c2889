"""Plot a bag, of `nao_gait record` or `make demo`: height and way of the torso, loads of the soles.

plot_bag.py out/demo/bag --out walk.html
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from plotly.subplots import make_subplots

from gait_lab.analysis.recorded_trace import read_trace
from nao_lipm_gait import NaoGaitError
from sim_bridge.trials.trace import Trace


def plot(trace: Trace, out: Path) -> None:
    """Write a page with three plots over time."""
    titles = "torso height [m]", "way forward, left [m]", "load, left, right sole [N]"
    figure = make_subplots(rows=3, shared_xaxes=True, subplot_titles=titles)
    time, position = trace.time, trace.torso_position
    lines = (
        (1, "height", position[:, 2]),
        (2, "forward", position[:, 0]),
        (2, "left", position[:, 1]),
        (3, "left sole", trace.sole_force[:, 0]),
        (3, "right sole", trace.sole_force[:, 1]),
    )
    for row, name, values in lines:
        figure.add_scatter(x=time, y=values, name=name, row=row, col=1)
    figure.update_xaxes(title_text="time [s]", row=3)
    figure.write_html(out, include_plotlyjs=True)


def main(args: Sequence[str] | None = None) -> Trace:
    """Write the page; what the bag holds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bag", type=Path)
    parser.add_argument("--out", type=Path, default=Path("walk.html"))
    parser.add_argument("--quick", action="store_true", help="only the first 2 s")
    options = parser.parse_args(args)
    trace = read_trace(options.bag)
    if trace is None:
        raise NaoGaitError("bag", str(options.bag), "a bag with ground truth")
    trace = trace.between(0.0, 2.0) if options.quick else trace
    plot(trace, options.out)
    print(f"{trace.time[-1] - trace.time[0]:.1f} s in {options.out}")
    return trace


if __name__ == "__main__":
    try:
        main()
    except NaoGaitError as error:
        raise SystemExit(str(error)) from None
