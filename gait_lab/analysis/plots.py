"""The common style of all figures that are written as PNG."""

from pathlib import Path
from typing import Any

BLACK, RED, BLUE, GREY, ORANGE = "#111111", "#d1495b", "#00798c", "#9a9a9a", "#edae49"
"""Of different lightness, so that they differ also without colour vision."""


def pyplot() -> Any:
    """Matplotlib's pyplot, without a window and in one style."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.rcParams.update(
        {
            "font.size": 10,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.grid": True,
            "grid.color": "#e4e4e4",
            "axes.axisbelow": True,
            "legend.frameon": False,
            "figure.dpi": 110,
        }
    )
    return plt


def save(figure: Any, path: Path) -> Path:
    """Write a figure and free it."""
    figure.savefig(path)
    pyplot().close(figure)
    return path
