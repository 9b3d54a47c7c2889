"""The colours of all figures, and the style of those that are written as PNG."""

from pathlib import Path
from typing import Any

INK, RED, BLUE, GREY, GOLD, GREEN = (
    "#16202a", "#d1495b", "#0f7c94", "#9aa3ab", "#e0a030", "#3f8f5b",
)  # fmt: skip
"""Of different lightness, so that they differ also without colour vision."""
LEFT_COLOR, RIGHT_COLOR = "#c8553d", "#2f7f5f"


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
    """Write a figure as PNG, whatever the file is called, and free it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, format="png")
    pyplot().close(figure)
    return path
