"""The tables of a study, as CSV that any spreadsheet and ``pandas.read_csv`` take."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Any, Mapping, Sequence

if TYPE_CHECKING:
    from .study import Study

Table = Mapping[str, Sequence[Any]]


def members_table(study: "Study") -> dict[str, list[Any]]:
    """The members: file, label, .., ids, area and volume in the units of the files, fit relative to the diagonal."""
    names = list(dict.fromkeys(n for member in study.members for n in member.covariates))
    found: dict[str, list[Any]] = {}
    for member, surface in zip(study.members, study.encoded):
        scale = float(surface.raw.get("scale") or 1.0)
        fit = ((surface.raw.get("fit") or {}).get("relativeToDiagonal") or {}).get("rms")
        row = {
            "file": member.path.name, "label": member.label, "subject": member.subject, "time": member.time,
            "side": member.side, "mirrored": member.mirror, **{n: member.covariates.get(n) for n in names},
            "mesh": member.mesh, "surface": surface.id, "area": surface.raw["area"] * scale**2,
            "volume": surface.raw["volume"] * scale**3, "fit rms / diagonal": fit,
            "warnings": " ".join(one["code"] for one in surface.raw.get("warnings") or []),
        }  # fmt: skip
        for name, value in row.items():
            found.setdefault(name, []).append(value)
    return found


def classification_table(study: "Study") -> dict[str, list[Any]]:
    """One row for each method: accuracy, its interval, and what it is to be compared with."""
    result = study.results["classify"].raw
    found: dict[str, list[Any]] = {}
    for name, method in (result.get("methods") or {}).items():
        low, high = (method.get("confidenceInterval") or [None, None])[:2]
        row = {
            "method": name, "accuracy": method.get("accuracy"), "interval low": low, "interval high": high,
            "chance": result.get("chance"), "majority rate": result.get("majorityRate"),
            "subjects": result.get("subjects"), "p": method.get("pValue"),
        }  # fmt: skip
        for key, value in row.items():
            found.setdefault(key, []).append(value)
    return found


def groups_table(study: "Study") -> dict[str, list[Any]]:
    """One row for each comparison: p with its interval, and the smallest corrected value of the map."""
    found: dict[str, list[Any]] = {}
    for name, result in study.results.items():
        if not name.startswith("groups"):
            continue
        raw = result.raw
        low, high = (raw.get("pValueInterval") or [None, None])[:2]
        sizes = raw.get("groupSizes") or {}
        row = {
            "groups": " and ".join(str(one) for one in raw.get("groups") or []),
            "covariates taken out": " ".join(raw.get("regressedOut") or []) or "none", "p": raw.get("pValue"),
            "interval low": low, "interval high": high, "least significance": raw.get("leastSignificance"),
            "subjects": " and ".join(str(one) for one in sizes.get("subjects") or []),
        }  # fmt: skip
        for key, value in row.items():
            found.setdefault(key, []).append(value)
    return found


def tables_of(study: "Study") -> dict[str, Table]:
    """All tables that the results so far give, by name."""
    found: dict[str, Table] = {}
    if study.encoded:
        found["members"] = members_table(study)
    if "distances" in study.results:
        names = study.names()
        matrix = study.results["distances"].matrix
        found["distances"] = {"": names, **dict(zip(names, matrix.T.tolist()))}
    if "pca" in study.results:
        model = study.results["pca"].model
        scores = model.scores_table()
        found["scores"] = {"file": study.names(), "label": scores["group"], **dict(list(scores.items())[2:])}
        share = {"eigenvalue": model.raw["eigenvalues"], "explained": model.raw["explained"]}
        numbers = list(range(1, len(model.raw["eigenvalues"]) + 1))
        found["components"] = {"component": numbers, **share, "cumulative": model.raw["cumulative"]}
    if any(name.startswith("groups") for name in study.results):
        found["groups"] = groups_table(study)
    if "classify" in study.results:
        found["classification"] = classification_table(study)
    doubts = study.warnings()
    found["warnings"] = {n: [one[n] for one in doubts] for n in ("where", "code", "detail")}
    if study.refused:
        found["refused"] = {n: [one[n] for one in study.refused] for n in ("file", "code", "detail")}
    return found


def write_tables(study: "Study", folder: Path) -> list[Path]:
    """Writes all tables into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, table in tables_of(study).items():
        path = folder / f"{name}.csv"
        with path.open("w", newline="", encoding="utf-8") as out:
            writer = csv.writer(out)
            writer.writerow(table.keys())
            writer.writerows(zip(*table.values()))
        written.append(path)
    return written
