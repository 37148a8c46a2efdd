"""The look that all pictures share, and pictures as text to put into a page."""

import base64
import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

INK, SOFT, RULE, PAPER = "#1f262d", "#68717a", "#d9d6cd", "#ffffff"
BEFORE, AFTER, NOISE, SCATTER = "#c4532d", "#0f7672", "#d8d8d3", "#f0ddd0"
ERROR_MAP = LinearSegmentedColormap.from_list("muslin", ["#e9ebe6", "#f3d39c", "#e58f4f", "#b93b22", "#5e1412"])

_RC: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "svg.fonttype": "none",
    "axes.edgecolor": SOFT,
    "axes.linewidth": 0.7,
    "axes.labelcolor": SOFT,
    "axes.titlesize": 9,
    "text.color": INK,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
}


@contextmanager
def look(salt: str = "") -> Iterator[None]:
    """Draw and save inside this block; the settings of the process are as before afterwards."""
    with matplotlib.rc_context({**_RC, "svg.hashsalt": salt or "muslin"}):
        yield


def new_figure(width: float, height: float) -> Figure:
    """A figure of this size [inch] that belongs to no global state."""
    return Figure(figsize=(width, height), facecolor=PAPER, layout="constrained")


def bare(axes: Axes) -> None:
    """No frame, no ticks."""
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(False)


def svg(figure: Figure, alt: str) -> str:
    """Inline SVG, as wide as its place in the page; text stays text in the font of the page.

    Args:
        figure: to draw.
        alt: what it shows, for who cannot see it (escaped here).
    """
    FigureCanvasSVG(figure)
    buffer = io.StringIO()
    empty = {"Creator": None, "Date": None, "Format": None, "Type": None}
    figure.savefig(buffer, format="svg", metadata=empty)
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.S)
    text = re.sub(r' xmlns(:xlink)?="[^"]*"', "", text)
    used = set(re.findall(r"#([\w-]+)", text))
    text = re.sub(r' id="([^"]*)"', lambda m: m.group(0) if m.group(1) in used else "", text)
    text = text.replace("'DejaVu Sans'", "inherit").replace("&quot;DejaVu Sans&quot;", "inherit")
    text = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", text, count=1)
    text = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text, count=1)
    safe = alt.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;").replace('"', "&quot;")
    widest = round(figure.get_figwidth() * 96 * 1.25)
    return text.replace("<svg", f'<svg role="img" aria-label="{safe}" style="max-width:{widest}px"', 1)


def png(figure: Figure, dpi: int = 170) -> bytes:
    """Raster picture of all that is drawn: titles above axes of equal scales may reach beyond the figure."""
    FigureCanvasAgg(figure)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi, metadata={"Software": None}, bbox_inches="tight", pad_inches=0.05)
    return buffer.getvalue()


def data_uri(image: bytes) -> str:
    """A PNG as an address that needs no network."""
    return "data:image/png;base64," + base64.b64encode(image).decode("ascii")
