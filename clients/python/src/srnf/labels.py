"""The table of a study: which file has which label, subject, time, side and covariates.

CSV or TSV with the columns that ``POST /v1/imports`` has: ``file``, and where they are known ``label``, ``subject``,
``time`` (a number), ``side`` (left or right), ``mirror`` (true or false). Every other column is a covariate. Cells are
separated by commas, semicolons or tabs, whichever the first line has most of; decimal commas are read between
semicolons and tabs, and a number that can be two, as ``1.200`` in a table that has ``41,5``, is refused. Empty cells,
NA, N/A and NaN say nothing.
"""

from __future__ import annotations

import csv
import difflib
import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Optional, Sequence, Union

from .errors import InputError

#: Ends of names that meshes have, apart from FreeSurfer's, which have none; .gz may follow.
MESHES = frozenset(
    "ply obj off stl vtk vtp gii glb gltf mz3 byu msh mesh srf pial white inflated sphere asc".split()
)
_VOLUMES = frozenset({"nii", "nrrd"})
_SIDES = {"left": "left", "l": "left", "lh": "left", "right": "right", "r": "right", "rh": "right"}
_NOTHING = frozenset({"", "na", "n/a", "nan"})
_TRUTHS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
#: Faults of a table that are told.
_TOLD = 20
#: Numbers as they are read, with a decimal point or comma, and those whose mark can stand between thousands.
_DECIMAL = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?")
_GROUPED = {mark: re.compile(rf"[+-]?[1-9]\d{{0,2}}(\{mark}\d{{3}})+") for mark in ".,"}
_OWN = ("file", "label", "subject", "time", "side", "mirror")

Value = Union[str, float, bool]


@dataclass
class Member:
    """One mesh of a study. ``time`` is in whatever unit the study has; ``mesh`` and ``surface`` are ids once known."""

    path: Path
    label: Optional[str] = None
    subject: Optional[str] = None
    time: Optional[float] = None
    side: Optional[str] = None
    mirror: bool = False
    covariates: dict[str, Value] = field(default_factory=dict)
    mesh: str = ""
    surface: str = ""

    def row(self, id: str, mirrored: bool) -> dict[str, Any]:
        """As a member of a cohort, of an id whose mirror image was taken already, or not."""
        given = {"label": self.label, "subject": self.subject, "time": self.time, "side": self.side}
        row: dict[str, Any] = {"id": id, **{k: v for k, v in given.items() if v is not None}}
        if self.mirror and not mirrored:
            row["mirror"] = True
        if self.covariates:
            row["covariates"] = dict(self.covariates)
        return row


def mesh_files(folder: Path, volumes: bool = False) -> list[Path]:
    """The files of a folder whose names are those of meshes, in the order of their names; hidden files are not.

    ``volumes``: those whose names are of label volumes instead.
    """
    if not folder.is_dir():
        raise InputError(f"{folder} is not a folder" if folder.exists() else f"There is no folder {folder}")
    there = [p for p in folder.rglob("*") if p.is_file() and not _hidden(p, folder)]
    found = [p for p in there if (is_volume(p) if volumes else _is_mesh(p))]
    if not found and volumes:
        raise InputError(f"{folder} has no label volumes: no file ends in .{', .'.join(sorted(_VOLUMES))} or .nii.gz")
    if not found and any(is_volume(p) for p in there):
        raise InputError(
            f"{folder} has label volumes, and no meshes: say which label of them is the shape (extract, --extract VALUE)"
        )
    if not found:
        raise InputError(f"{folder} has no meshes: no file ends in .{', .'.join(sorted(MESHES)[:12])}, ..")
    return sorted(found)


def own_table(folder: Path) -> Optional[Path]:
    """The ``labels.csv`` or ``labels.tsv`` of a folder, where it has one of them."""
    found = [folder / name for name in ("labels.csv", "labels.tsv") if (folder / name).is_file()]
    if len(found) > 1:
        raise InputError(f"{folder} has labels.csv and labels.tsv: say which is the table (labels, --labels)")
    return found[0] if found else None


def is_volume(path: Path) -> bool:
    """Whether the name of a file is that of a label volume."""
    name = path.name.lower()
    return name.endswith(".nii.gz") or name.rpartition(".")[2] in _VOLUMES


def _hidden(path: Path, folder: Path) -> bool:
    return any(part.startswith(".") for part in path.relative_to(folder).parts)


def stem(path: Path) -> str:
    """The name of a file without the end that says its format; FreeSurfer's names stay whole."""
    name = path.name[:-3] if path.name.lower().endswith(".gz") else path.name
    first, _, last = name.rpartition(".")
    whole = not first or first in ("lh", "rh") or last.lower() not in MESHES | _VOLUMES
    return name if whole else first.removesuffix(".surf")


def _is_mesh(path: Path) -> bool:
    ends = path.name.lower().split(".")[1:]
    if ends and ends[-1] == "gz":
        ends.pop()
    return bool(ends) and ends[-1] in MESHES and ends[-2:] != ["nii", "gz"]


def read_table(file: Path) -> list[dict[str, str]]:
    """The rows of a table, by the names of its columns."""
    try:
        text = file.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise InputError(f"The table {file} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"The table {file} is no UTF-8 text; save it as CSV in UTF-8") from None
    lines = text.splitlines()
    if not lines or not lines[0].strip():
        raise InputError(f"The table {file} is empty")
    mark = max(",;\t", key=lines[0].count)
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=mark)]
    names = rows[0]
    # BIDS calls the subject so; scans of one that passed for several would make p-values too good.
    lower = ["subject" if name.lower() == "participant_id" else name.lower() for name in names]
    if "file" not in lower:
        raise InputError(
            f"The table {file} has no column 'file'; its first line has: {', '.join(names)}"
        )
    for name in lower:
        if lower.count(name) > 1:
            raise InputError(f"The table {file} has two columns {name!r}")
    named = [low if low in _OWN else name for low, name in zip(lower, names)]
    found, wrong = [], []
    for number, row in enumerate(rows[1:], 2):
        if not any(row):
            continue
        if len(row) != len(names):
            wrong.append(f"{file}, line {number}: {len(row)} cells, but {len(names)} columns")
            continue
        found.append({**dict(zip(named, row)), "": f"{file}, line {number}", "mark": mark})
    _refuse(wrong)
    if not found:
        raise InputError(f"The table {file} has a head, but no rows")
    return found


def _refuse(wrong: Sequence[str]) -> None:
    """All that is wrong at once, a line each."""
    if wrong:
        more = [f"and {len(wrong) - _TOLD} more"] if len(wrong) > _TOLD else []
        raise InputError("\n".join([*wrong[:_TOLD], *more]))


def _choose_label(rows: Sequence[dict[str, str]], column: str, file: Path) -> None:
    """Makes another column that of the labels."""
    names = [name for name in rows[0] if name not in ("", "mark")]
    chosen = next((name for name in names if name.lower() == column.lower()), None)
    if chosen is None:
        raise InputError(f"The table {file} has no column {column!r}; its first line has: {', '.join(names)}")
    for row in rows:
        row["label"] = row.pop(chosen)


def read_members(
    folder: Path, labels: Optional[Path], label_column: Optional[str] = None, volumes: bool = False
) -> list[Member]:
    """The members of a study: the meshes of a folder, with what a table knows of them, in its order.

    Every mesh needs a row, and every row its mesh. ``label_column`` is the column of the labels, if not ``label``.
    ``volumes``: the members are the label volumes of the folder.
    """
    if label_column is not None and labels is None:
        raise InputError("label_column is a column of a table of labels, and there is none")
    files = mesh_files(folder, volumes)
    if labels is None:
        return [Member(path) for path in files]
    rows = read_table(labels)
    if label_column is not None:
        _choose_label(rows, label_column, labels)
    kinds = {n: _kind([r[n] for r in rows], rows[0]["mark"]) for n in rows[0] if n not in (*_OWN, "", "mark")}
    _refuse_marks({name: [row[name] for row in rows if _said(row[name]) is not None] for name in kinds}, rows, labels)
    members: list[Member] = []
    seen: dict[Path, str] = {}
    wrong: list[str] = []
    for row in rows:
        try:
            path = _find(row, files, folder)
        except InputError as error:
            wrong.append(str(error))
            continue
        if path in seen:
            wrong.append(f"{row['']}: {row['file']} was named before, in {seen[path]}")
        seen.setdefault(path, row[""])
        members.append(_read_row(row, path, kinds, wrong))
    without = [str(path.relative_to(folder)) for path in files if path not in seen]
    if without:
        wrong.append(
            f"{labels} has no row for {len(without)} of {len(files)} meshes in {folder}: {_some(without)}."
            " Add rows for them, or move them out of the folder."
        )
    _refuse(wrong)
    return members


def _refuse_marks(columns: dict[str, list[str]], rows: Sequence[dict[str, str]], file: Path) -> None:
    """Refuses numbers that can be two, as the service does."""
    marked: dict[str, dict[str, list[str]]] = {".": {}, ",": {}}
    for name, cells in columns.items():
        if not all(_DECIMAL.fullmatch(cell) for cell in cells):
            continue
        for mark, found in marked.items():
            if any(mark in cell for cell in cells):
                found[name] = [cell for cell in cells if mark in cell]
    for name in marked[","]:
        if name in marked["."]:
            raise InputError(f"The table {file}: column {name} has numbers with points and with commas")
        if rows[0]["mark"] == ",":
            raise InputError(
                f"The table {file}: column {name} has commas in its numbers, and the table is separated by commas;"
                " write decimals with points"
            )
    for mark, other in ((".", ","), (",", ".")):
        for name, cells in marked[mark].items():
            if marked[other] and all(_GROUPED[mark].fullmatch(cell) for cell in cells):
                beside, there = next(iter(marked[other].items()))
                raise InputError(
                    f"The table {file}: {cells[0]!r} of column {name} can be two numbers, since column {beside} has"
                    f" {there[0]!r}; write all numbers with the same decimal mark, and thousands without one"
                )


def _find(row: dict[str, str], files: Sequence[Path], folder: Path) -> Path:
    name = row["file"]
    whole = [p for p in files if str(p.relative_to(folder)) == name or p == Path(name)]
    last = whole or [p for p in files if p.name == Path(name).name]
    found = last or [p for p in files if stem(p) == name]
    if len(found) == 1:
        return found[0]
    if found:
        raise InputError(f"{row['']}: {name} may be {_some([str(p.relative_to(folder)) for p in found])}")
    if (folder / name).is_file():
        raise InputError(f"{row['']}: {name} is in {folder}, but its name is not that of a mesh")
    # Names that differ in their case alone come first: l_ is nearer to R_ than it should be.
    same = [p.name for p in files if name.casefold() in (p.name.casefold(), stem(p).casefold())]
    near = same or difflib.get_close_matches(name, [p.name for p in files], 1)
    hint = f"; did you mean {near[0]}?" if near else ""
    raise InputError(f"{row['']}: there is no mesh {name!r} in {folder}{hint}")


def _read_row(row: dict[str, str], path: Path, kinds: dict[str, str], wrong: list[str]) -> Member:
    member = Member(path, label=_said(row.get("label")), subject=_said(row.get("subject")))
    time, side, mirror = (_said(row.get(name)) for name in ("time", "side", "mirror"))
    if time is not None:
        member.time = _number(time, row["mark"])
        if member.time is None:
            wrong.append(f"{row['']}: the time {time!r} is no number")
    if side is not None:
        member.side = _SIDES.get(side.lower())
        if member.side is None:
            wrong.append(f"{row['']}: the side {side!r} is neither left nor right")
    if mirror is not None:
        member.mirror = _TRUTHS.get(mirror.lower(), False)
        if mirror.lower() not in _TRUTHS:
            wrong.append(f"{row['']}: mirror is {mirror!r}, which is neither true nor false")
    for name, kind in kinds.items():
        cell = _said(row[name])
        if cell is not None:
            member.covariates[name] = _value(cell, kind, row["mark"])
    return member


def _said(cell: Optional[str]) -> Optional[str]:
    return None if cell is None or cell.lower() in _NOTHING else cell


def _kind(cells: Sequence[str], mark: str) -> str:
    said = [cell for cell in cells if _said(cell) is not None]
    if said and all(cell.lower() in ("true", "false") for cell in said):
        return "truth"
    return "number" if said and all(_number(cell, mark) is not None for cell in said) else "text"


def _value(cell: str, kind: str, mark: str) -> Value:
    number = _number(cell, mark) if kind == "number" else None
    if number is not None:
        return number
    return cell.lower() == "true" if kind == "truth" else cell


def _number(cell: str, mark: str) -> Optional[float]:
    text = cell.replace(",", ".") if mark != "," and cell.count(",") == 1 else cell
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")
