"""The report of a study: one HTML file with its figures and tables inside, to be read without a network."""

from __future__ import annotations

import base64
import html
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Mapping, Sequence

from .errors import InputError
from .tables import tables_of

if TYPE_CHECKING:
    from .study import Study

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
h1, h2 { line-height: 1.2; } h2 { margin-top: 2.5rem; border-bottom: 1px solid #ddd; }
table { border-collapse: collapse; font-size: 13px; } .wide { overflow-x: auto; }
th, td { padding: .2rem .6rem; text-align: left; border-bottom: 1px solid #eee; white-space: nowrap; }
td.text { white-space: normal; min-width: 24rem; } td.number { text-align: right; font-variant-numeric: tabular-nums; }
img { max-width: 100%; } figure { margin: 1rem 0; } .doubt { background: #fff6e5; padding: .5rem 1rem; }
@media print { .wide { overflow: visible; } }
"""
#: Rows and columns of a table that the report shows; the CSV files have all, and the report says what it leaves out.
_ROWS, _COLUMNS = 200, 60
_TITLES = {
    "members": "Members",
    "distances": "Distances",
    "components": "Mean and components",
    "scores": "Scores",
    "groups": "Do the groups differ?",
    "classification": "Can the label be predicted?",
    "warnings": "Reasons to doubt a number",
    "refused": "Files that were left out",
}
_FIGURES = {
    "members": ("members",),
    "distances": ("distances",),
    "components": ("mean", "components", "mode-"),
    "scores": ("scores",),
    "groups": ("groups",),
    "classification": ("confusion",),
}
_NOTES = {
    "members": "Area and volume are in the units of the files. The fit is the distance between mesh and surface over the"
    " diagonal of the mesh.",
    "groups": "p is that of the global test, with Wilson's interval of 95 % for the relabellings that were drawn; least significance is the smallest corrected value of the map over the surface. The line on the surface and the mark"
    " at its scale are at .05.",
    "classification": "Intervals are Wilson's, of 95 %. Compare the accuracy with the majority rate. If the interval holds the majority rate, the data do"
    " not show that the label can be predicted.",
}


def _cell(value: Any) -> str:
    if value is None:
        return "<td></td>"
    if isinstance(value, bool):
        return f"<td>{'yes' if value else 'no'}</td>"
    if isinstance(value, (int, float)):
        return f'<td class="number">{value:.4g}</td>' if isinstance(value, float) else f'<td class="number">{value}</td>'
    text = str(value)
    return f'<td{" class=text" if len(text) > 60 else ""}>{html.escape(text)}</td>'


def _table(table: Mapping[str, Sequence[Any]]) -> str:
    rows = list(zip(*table.values()))
    if not rows:
        return "<p>None.</p>"
    names = list(table)[:_COLUMNS]
    head = "".join(f"<th>{html.escape(name)}</th>" for name in names)
    body = "".join("<tr>" + "".join(_cell(value) for value in row[:_COLUMNS]) + "</tr>\n" for row in rows[:_ROWS])
    left = []
    if len(rows) > _ROWS:
        left.append(f"{len(rows) - _ROWS} more rows")
    if len(table) > _COLUMNS:
        last = list(table)[-1]
        left.append(f"{len(table) - _COLUMNS} more columns, up to {html.escape(last)}")
    more = f"<p>The CSV file has {' and '.join(left)}.</p>" if left else ""
    return f'<div class="wide"><table><tr>{head}</tr>\n{body}</table></div>{more}'


def _picture(path: Path) -> str:
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    name = html.escape(path.stem)
    return f'<figure><img alt="{name}" src="data:image/png;base64,{data}"></figure>'


def _head(study: "Study") -> str:
    version = study.client.get("/v1/version")
    labels = study.labels()
    counts = ", ".join(f"{sum(m.label == one for m in study.members)} {one}" for one in labels)
    rows = {
        "members": f"{len(study.members)}" + (f": {counts}" if counts else ""),
        "registration": {
            "mean": "each statistic registers all members to its mean",
            "template": "all members registered to one of them, once",
            "none": "none: as the meshes are parameterized",
        }[study.options.register],
        "degree": str(max((s.raw.get("lmax", 0) for s in study.encoded), default="")),
        "cohort": str(study.state.data.get("cohort", "")),
        "server": f"{study.client.http.server}, srnfd {version.get('version', '')}",
        "numerics": str(version.get("numericBuild", "")),
        "written": time.strftime("%Y-%m-%d %H:%M %Z"),
    }
    cells = "".join(f"<tr><th>{k}</th><td class=text>{html.escape(v)}</td></tr>" for k, v in rows.items())
    return f"<table>{cells}</table>"


def write_report(study: "Study", to: Path) -> Path:
    """Writes the report of what was computed so far."""
    try:
        pictures = {path.stem: path for path in study.figures()}
    except InputError as error:
        study.client.notice(f"The report has no figures. {error}")
        pictures = {}
    tables = tables_of(study)
    parts = [_head(study)]
    steps = [s for s in study.steps if s.status != "done"]
    if steps:
        items = "".join(f"<li>{html.escape(s.name)}: {s.status}. {html.escape(s.detail)}</li>" for s in steps)
        parts.append(f"<h2>What was not computed</h2><ul>{items}</ul>")
    order = ["warnings", *(name for name in tables if name != "warnings")]
    for name in order:
        parts.append(f"<h2>{_TITLES.get(name, name)}</h2>")
        if name in _NOTES:
            parts.append(f"<p>{_NOTES[name]}</p>")
        for figure, path in pictures.items():
            if figure.startswith(_FIGURES.get(name, ("\0",))):
                parts.append(_picture(path))
        if name != "distances":
            parts.append(_table(tables[name]))
    title = html.escape(study.name)
    to.parent.mkdir(parents=True, exist_ok=True)
    to.write_text(
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        f"<style>{_STYLE}</style></head><body><h1>{title}</h1>\n" + "\n".join(parts) + "</body></html>\n",
        encoding="utf-8",
    )
    return to
