"""How figures look: colours, an empty figure, SVG that is the same for the same figure.

Called by `figures.py` and the experiment's page; calls matplotlib, which is imported when the first
figure is drawn. A figure is drawn in light colours; `inline_svg` turns each of them into a CSS
variable, so that a page can show the same drawing in light and dark.
"""

from __future__ import annotations

import io
import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from markupsafe import escape

from forestall.extras import need

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

COLOURS: Mapping[str, tuple[str, str]] = {
    "ink": ("#1f2328", "#e8eaed"),
    "soft": ("#5d646e", "#a3abb6"),
    "line": ("#b9bdc2", "#4a515a"),
    "hair": ("#e6e7e5", "#2a2f36"),
    "card": ("#fefefe", "#1a1d22"),
    "s1": ("#0068a8", "#5fb3ea"),
    "s2": ("#d05600", "#ff8f52"),
    "s3": ("#008a64", "#41c99f"),
    "s4": ("#a9508a", "#e79bcb"),
    "s5": ("#3f9fcf", "#a5dbf9"),
    "s6": ("#c88a00", "#ffca5c"),
    "s7": ("#6b7079", "#b6bcc5"),
    "s8": ("#7a5a3a", "#cfa987"),
    "bad": ("#c2261d", "#ff8379"),
    "good": ("#2f7d5a", "#6cc097"),
}
"""Role → its colour in light and in dark; series after Okabe and Ito, told apart by all eyes."""

SERIES = ("s1", "s2", "s3", "s4", "s5", "s6", "s7", "s8")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "p")
DASHES = ("-", (0, (6, 2)), (0, (2, 1.4)), (0, (7, 2, 1.5, 2)), (0, (4, 1, 1, 1, 1, 1)))

WIDE = 1080.0
"""Pixels of a figure that takes the whole width."""

NOTHING: Final = "none"
"""No line, or no filling."""

_PX = 1 / 72  # of an inch: one unit of the drawing is one pixel
_FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif'
_COLOUR = re.compile("|".join(light for light, _ in COLOURS.values()))
_NAMES = {light: name for name, (light, _) in COLOURS.items()}
_HEAD = re.compile(r"^.*?(?=<svg)|\s*<metadata>.*?</metadata>", re.S)
_FAMILY = re.compile(r"font:([^;\"]*?)(\d+(?:\.\d+)?px)\s[^;\"]*")


def colour(role: str) -> str:
    """The colour of a role as it is drawn."""
    return COLOURS[role][0]


def series_colour(index: int) -> str:
    """The colour of the n-th series."""
    return colour(SERIES[index % len(SERIES)])


def colours_css() -> str:
    """The variables that `inline_svg` speaks of, light and dark."""

    def block(dark: bool) -> str:
        return " ".join(f"--f-{name}: {pair[dark]};" for name, pair in COLOURS.items())

    return (
        f".figure {{ {block(False)} }}\n"
        f"@media (prefers-color-scheme: dark) {{ .figure {{ {block(True)} }} }}\n"
    )


@contextmanager
def styled() -> Iterator[None]:
    """Within it figures are drawn in this style; nothing of it stays behind."""
    need("a figure", "figures")
    import matplotlib as mpl

    settings: dict[Any, Any] = {
        "svg.fonttype": "none",
        "svg.hashsalt": "forestall",
        "font.family": ["DejaVu Sans"],  # comes with matplotlib, so that widths are the same
        "font.size": 11.0,
        "axes.titlesize": 12.0,
        "axes.titlelocation": "left",
        "axes.titlecolor": colour("ink"),
        "axes.labelsize": 11.0,
        "axes.labelcolor": colour("soft"),
        "axes.edgecolor": colour("line"),
        "axes.facecolor": "none",
        "axes.linewidth": 1.0,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "axes.axisbelow": True,
        "axes.unicode_minus": True,
        "grid.color": colour("hair"),
        "grid.linewidth": 1.0,
        "text.color": colour("ink"),
        "text.parse_math": False,
        "text.usetex": False,
        "xtick.color": colour("line"),
        "ytick.color": colour("line"),
        "xtick.labelcolor": colour("soft"),
        "ytick.labelcolor": colour("soft"),
        "xtick.labelsize": 10.5,
        "ytick.labelsize": 10.5,
        "xtick.major.size": 0.0,
        "ytick.major.size": 0.0,
        "legend.frameon": False,
        "legend.fontsize": 10.5,
        "legend.labelcolor": colour("ink"),
        "hatch.color": colour("card"),
        "hatch.linewidth": 1.2,
        "savefig.facecolor": colour("card"),
        "path.simplify": True,
    }
    with mpl.rc_context():
        mpl.rcdefaults()  # a user's own matplotlibrc changes nothing
        mpl.rcParams.update(settings)
        yield


def new_figure(width_px: float, height_px: float) -> Figure:
    """An empty figure; no pyplot, hence no window and no list of open figures."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width_px * _PX, height_px * _PX), dpi=72, layout="constrained")


def wrapped(text: str, width: int = 30) -> str:
    """A long name on several lines."""
    return textwrap.fill(text, width)


def percent_axis(axis_of: Axes, which: str) -> None:
    """Shares of 0 to 1 on the "x" or "y" axis, written in per cent."""
    ticks = [0.0, 0.25, 0.5, 0.75, 1.0]
    labels = ["0", "25", "50", "75", "100 %"]
    if which == "x":
        axis_of.set_xlim(-0.02, 1.02)
        axis_of.set_xticks(ticks, labels)
    else:
        axis_of.set_ylim(-0.02, 1.02)
        axis_of.set_yticks(ticks, labels)


def svg_bytes(figure: Figure) -> bytes:
    """The figure as an SVG file, text as text; the same figure gives the same bytes."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue().decode("utf-8")
    text = _FAMILY.sub(lambda m: f"font:{m[1]}{m[2]} {_FONT.replace(chr(34), chr(39))}", text)
    return "\n".join(line.rstrip() for line in text.splitlines()).encode("utf-8") + b"\n"


def inline_svg(svg: bytes, name: str, label: str) -> str:
    """The same drawing for the inside of a page.

    Args:
        svg: as from `svg_bytes`.
        name: of the figure; its ids begin with it, so that figures on one page do not collide.
        label: what the drawing shows, for those who do not see it.
    """
    text = _HEAD.sub("", svg.decode("utf-8"))
    text = re.sub(r'\bid="', f'id="{name}-', text)
    text = text.replace('xlink:href="#', f'xlink:href="#{name}-').replace("url(#", f"url(#{name}-")
    text = _COLOUR.sub(lambda m: f"var(--f-{_NAMES[m[0]]})", text)
    box = re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', text)
    width = float(box[1]) if box else 800.0
    opening = f'<svg role="img" aria-label="{escape(label)}" style="width: {width:.0f}px"'
    text = re.sub(r'\s(?:width|height)="[\d.]+pt"', "", text, count=2)
    return text.replace("<svg", opening, 1).strip()


def patches(entries: Sequence[tuple[str, str | None, str]]) -> list[Artist]:
    """Filled patches for a key."""
    from matplotlib.patches import Patch

    return [
        Patch(
            facecolor=NOTHING if face is None else colour(face),
            edgecolor=colour("line" if face is None else "card"),
            hatch=hatch,
            label=name,
        )
        for name, face, hatch in entries
    ]


def key(figure: Figure, handles: Sequence[Artist]) -> None:
    """A key above the figure."""
    figure.legend(handles=list(handles), loc="outside upper left", ncols=len(handles))


def paper_mark(x: float, y: float) -> Line2D:
    """The paper's value: a hollow mark."""
    from matplotlib.lines import Line2D

    return Line2D(
        *([x], [y]),
        color=colour("ink"),
        marker="d",
        markersize=8,
        markerfacecolor=colour("card"),
        markeredgewidth=1.3,
        linestyle=NOTHING,
        clip_on=False,
        zorder=5,
        label="the paper, on its own scenes",
    )
