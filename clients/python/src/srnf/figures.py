"""Figures by matplotlib: surfaces, modes, maps of comparisons, scores, distances, classifications.

Only this module needs matplotlib, and imports it when a figure is drawn.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Optional, Sequence

import numpy as np
from numpy.typing import NDArray

from .errors import InputError
from .ply import Triangles
from .records import Surface

if TYPE_CHECKING:
    from .study import Study

Floats = NDArray[np.float64]
#: Resolution of the meshes that are drawn: of a surface alone, and of one among others.
ALONE, BESIDE = 24, 12
#: Colors of labels that people with color blindness tell apart (Okabe and Ito).
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
_STONE = np.array([0.80, 0.77, 0.72])
#: Whence surfaces are looked at, in degrees.
_ELEVATION, _AZIMUTH = 20, -60
#: Below it a value of a map of significance is told by a line.
SIGNIFICANT = 0.05


def plotting() -> Any:
    """matplotlib.pyplot, drawing into files."""
    try:
        import matplotlib
        import matplotlib.pyplot as plot
    except ImportError:
        raise InputError("Figures need matplotlib: apt install python3-matplotlib, or pip install matplotlib") from None
    matplotlib.rcParams.update({"figure.dpi": 120, "font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    return plot


def draw(
    axes: Any,
    shape: Triangles,
    values: Optional[Floats] = None,
    scale: Any = None,
    color_map: str = "viridis",
    level: Optional[float] = None,
) -> Any:
    """Draws triangles into 3-D axes, shaded; ``values`` at the vertices color it, between the two of ``scale``.

    ``level``: a line is drawn where the values cross it.
    """
    import matplotlib
    from matplotlib.colors import Normalize
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    corners = shape.vertices[shape.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    light = np.array([0.35, -0.65, 0.68])
    shade = 0.45 + 0.55 * np.clip(normal @ light / np.linalg.norm(light), 0, 1)
    mapped = None
    if values is None:
        colors = np.tile(_STONE, (len(corners), 1))
    else:
        low, high = scale if scale is not None else (float(np.nanmin(values)), float(np.nanmax(values)))
        norm = Normalize(low, high if high > low else low + 1.0)
        mapped = matplotlib.cm.ScalarMappable(norm, color_map)
        colors = mapped.to_rgba(values[shape.faces].mean(axis=1))[:, :3]
    lit = colors * shade[:, None]  # edges too, or the seams show
    axes.add_collection3d(Poly3DCollection(corners, facecolors=lit, edgecolors=lit, linewidths=0.25))
    middle = (shape.vertices.max(axis=0) + shape.vertices.min(axis=0)) / 2
    half = float(np.ptp(shape.vertices, axis=0).max()) / 2
    for k, name in enumerate("xyz"):
        getattr(axes, f"set_{name}lim")(middle[k] - half, middle[k] + half)
    axes.set_box_aspect((1, 1, 1), zoom=1.35)
    axes.set_axis_off()
    axes.view_init(elev=_ELEVATION, azim=_AZIMUTH)
    if level is not None and values is not None:
        _draw_level(axes, shape, values, level, normal, half)
    return mapped


def level_lines(shape: Triangles, values: Floats, level: float) -> tuple[Floats, NDArray[np.int64]]:
    """Where values at the vertices cross a level: segments, shape (n, 2, 3), and the triangle of each."""
    below = values[shape.faces] < level
    crossed = np.flatnonzero(below.any(axis=1) & ~below.all(axis=1))
    ends = []
    for k in range(3):
        a, b = shape.faces[crossed, k], shape.faces[crossed, (k + 1) % 3]
        cut = below[crossed, k] != below[crossed, (k + 1) % 3]
        part = (level - values[a]) / np.where(cut, values[b] - values[a], 1.0)
        ends.append(np.where(cut[:, None], shape.vertices[a] + part[:, None] * (shape.vertices[b] - shape.vertices[a]), np.nan))
    points = np.stack(ends, axis=1)
    there = ~np.isnan(points[:, :, 0])  # two of three sides of each
    segments: Floats = points[there].reshape(-1, 2, 3)
    return segments, crossed


def _draw_level(axes: Any, shape: Triangles, values: Floats, level: float, normal: Floats, size: float) -> None:
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    segments, faces = level_lines(shape, values, level)
    up, round_ = np.radians(_ELEVATION), np.radians(_AZIMUTH)
    eye = np.array([np.cos(up) * np.cos(round_), np.cos(up) * np.sin(round_), np.sin(up)])
    seen = normal[faces] @ eye > 0  # lines are drawn over what is before them
    lifted = segments[seen] + 0.01 * size * normal[faces[seen], None, :]
    if len(lifted):
        axes.add_collection3d(Line3DCollection(lifted, colors="#d55e00", linewidths=1.4))


def share_below(shape: Triangles, values: Floats, level: float) -> float:
    """The part of the area whose triangles have a mean value below a level."""
    a, b, c = (shape.vertices[shape.faces[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return float(areas[values[shape.faces].mean(axis=1) < level].sum() / areas.sum())


def draw_surfaces(
    surfaces: Sequence[Surface],
    titles: Sequence[str],
    field: Optional[str] = None,
    columns: int = 6,
    color_map: str = "viridis",
    title: str = "",
) -> Any:
    """A figure of surfaces in rows. ``field`` names a map that they carry, such as ``deformation``; one scale for all."""
    plot = plotting()
    shapes = [surface.triangles(ALONE if len(surfaces) == 1 else BESIDE) for surface in surfaces]
    maps = [shape.fields.get(field) if field else None for shape in shapes]
    there = [values for values in maps if values is not None]
    scale = (min(float(v.min()) for v in there), max(float(v.max()) for v in there)) if there else None
    level = None
    if field in ("significance", "fdr"):
        scale, level = (0.0, 1.0), SIGNIFICANT  # they are p-values
    wide = min(columns, len(shapes))
    rows = -(-len(shapes) // wide)
    side = 3.4 if len(shapes) == 1 else 1.9
    head = (0.5 if title else 0.2) + (0.2 if level is not None else 0)
    width, height = side * wide + (1.1 if there else 0), side * rows + 0.2 * (rows - 1) + head
    figure = plot.figure(figsize=(width, height))
    mapped = None
    for k, (shape, values) in enumerate(zip(shapes, maps)):
        axes = figure.add_subplot(rows, wide, k + 1, projection="3d")
        mapped = draw(axes, shape, values, scale, color_map, level) or mapped
        below = ""
        if level is not None and values is not None:
            below = f"\nbelow .05 on {100 * share_below(shape, values, level):.0f} % of the area"
        axes.set_title(titles[k] + below, fontsize=8, pad=0)
    figure.subplots_adjust(0, 0, side * wide / width, 1 - head / height, 0, 0.12)
    if mapped is not None:
        bar = figure.colorbar(mapped, cax=figure.add_axes((1 - 1.0 / width, 0.15, 0.15 / width, 0.7)))
        bar.set_label(field)
        if level is not None:
            bar.set_ticks([level, 0.25, 0.5, 0.75, 1.0])
            bar.ax.axhline(level, color="#d55e00", linewidth=1.6)
    if title:
        figure.suptitle(title, fontsize=10)
    return figure


def draw_scores(scores: Floats, groups: Sequence[Optional[str]], explained: Floats, new: Optional[Floats] = None) -> Any:
    """Members by their first two components; ``new`` are the scores of another surface, drawn as a star."""
    plot = plotting()
    figure, axes = plot.subplots(figsize=(4.4, 3.6))
    second = scores[:, 1] if scores.shape[1] > 1 else np.zeros(len(scores))
    for k, group in enumerate(dict.fromkeys(groups)):
        chosen = [one == group for one in groups]
        axes.scatter(scores[chosen, 0], second[chosen], s=28, color=COLORS[k % len(COLORS)], label=group or "no label")
    if new is not None:
        axes.scatter(new[0], new[1] if len(new) > 1 else 0.0, s=150, marker="*", color="black", label="new", zorder=3)
    axes.set_xlabel(f"component 1 ({100 * explained[0]:.0f} % of the variance)")
    axes.set_ylabel(f"component 2 ({100 * explained[1]:.0f} %)" if len(explained) > 1 else "")
    axes.legend(frameon=False)
    figure.tight_layout()
    return figure


def draw_spectrum(explained: Floats, cumulative: Floats) -> Any:
    """The share of the variance that each component has, and that of the first ones together."""
    plot = plotting()
    figure, axes = plot.subplots(figsize=(4.4, 3.0))
    numbers = np.arange(1, len(explained) + 1)
    axes.bar(numbers, 100 * explained, color=COLORS[0], label="each")
    axes.plot(numbers, 100 * cumulative, "o-", color=COLORS[1], markersize=3, label="together")
    axes.set_xlabel("component")
    axes.set_ylabel("per cent of the variance")
    axes.set_ylim(0, 104)
    axes.legend(frameon=False, loc="center right")
    figure.tight_layout()
    return figure


def draw_matrix(matrix: Floats, labels: Sequence[str], numbers: bool = False, title: str = "distance") -> Any:
    """A matrix as colors, with names at its sides; ``numbers`` writes whole numbers into it."""
    plot = plotting()
    side = min(2.2 + 0.28 * len(labels), 11)
    figure, axes = plot.subplots(figsize=(side + 1.0, side))
    image = axes.imshow(matrix, cmap="Blues" if numbers else "viridis")
    names = [name if len(name) <= 24 else name[:23] + "…" for name in labels]
    if len(labels) <= 40:
        axes.set_xticks(range(len(names)), names, rotation=90, fontsize=7)
        axes.set_yticks(range(len(names)), names, fontsize=7)
    if numbers:
        for i, j in np.ndindex(matrix.shape):
            dark = matrix[i, j] > matrix.max() / 2
            axes.text(j, i, f"{matrix[i, j]:.0f}", ha="center", va="center", color="white" if dark else "black")
        axes.set_xlabel("predicted")
        axes.set_ylabel("label")
        axes.set_title(title, fontsize=9)
    else:
        figure.colorbar(image, ax=axes, label=title, fraction=0.046)
    figure.tight_layout()
    return figure


def _of_model(study: "Study") -> dict[str, Any]:
    model = study.results["pca"].model
    explained, cumulative = np.array(model.raw["explained"]), np.array(model.raw["cumulative"])
    groups = list(model.raw.get("groups") or [None] * len(model.raw["labels"]))
    found = {
        "mean": draw_surfaces([model.mean], ["mean"]),
        "components": draw_spectrum(explained, cumulative),
        "scores": draw_scores(np.array(model.raw["scores"]), groups, explained),
    }
    for name in [n for n in study.results if n.startswith("mode-")]:
        result = study.results[name]
        titles = [f"{sd:+g} sd" for sd in np.asarray(result.raw["inputs"]["coefficients"], dtype=float)]
        found[name] = draw_surfaces(result.surfaces, titles, "deformation", title=f"component {name[5:]}")
    return found


def figures_of(study: "Study") -> dict[str, Any]:
    """All figures that the results so far give, by name."""
    found: dict[str, Any] = {}
    if study.encoded:
        shown = study.encoded[:30]
        found["members"] = draw_surfaces(shown, study.names())
    if "distances" in study.results:
        result = study.results["distances"]
        found["distances"] = draw_matrix(result.matrix, study.names())
    if "pca" in study.results:
        found.update(_of_model(study))
    for name, result in study.results.items():
        if name.startswith("groups"):
            fields = [f for f in ("significance", "effect") if f in result.surface.triangles(8).fields]
            for field in fields:
                kind = "viridis_r" if field == "significance" else "viridis"
                title = " and ".join(str(one) for one in result.raw.get("groups") or [])
                found[f"{name}-{field}"] = draw_surfaces([result.surface], [title], field, color_map=kind)
    if "classify" in study.results:
        found.update(_confusions(study.results["classify"].raw))
    return found


def _confusions(result: dict[str, Any]) -> dict[str, Any]:
    found = {}
    for name, method in (result.get("methods") or {}).items():
        confusion = method.get("confusion")
        labels = result.get("labels") or result.get("classes")
        if isinstance(confusion, list) and labels and len(labels) == len(confusion):
            title = f"{name}: {100 * float(method['accuracy']):.0f} % right"
            found[f"confusion-{name}"] = draw_matrix(np.array(confusion), labels, True, title)
    return found


def write_figures(study: "Study", folder: Path) -> list[Path]:
    """Writes all figures into a folder, as PNG."""
    plot = plotting()
    plot.switch_backend("Agg")
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, figure in figures_of(study).items():
        path = folder / f"{name}.png"
        figure.savefig(path, dpi=144)
        plot.close(figure)
        written.append(path)
    return written
