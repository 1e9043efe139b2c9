"""Documents of the service as Python values: numbers as arrays, records as objects, rows as columns for pandas."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Iterable, Iterator, Mapping, Optional

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .client import Client
    from .records import Mesh, Model, Surface

Floats = NDArray[np.float64]


def camel(name: str) -> str:
    """``max_iterations`` as ``maxIterations``; a trailing underscore goes, so that ``from_`` is ``from``."""
    return re.sub(r"_+([a-zA-Z0-9])", lambda m: m.group(1).upper(), name.rstrip("_"))


def numeric(value: Any) -> Optional[NDArray[Any]]:
    """Nested lists of numbers as an array, with NaN for null; None for anything else, ragged lists too.

    Whole numbers stay whole (int64) where nothing is null.
    """
    whole = [True]
    some = [False]

    def number(one: Any) -> bool:
        if isinstance(one, list):
            return len(one) > 0 and all(number(each) for each in one)
        if isinstance(one, bool) or not (one is None or isinstance(one, (int, float))):
            return False
        whole[0] = whole[0] and isinstance(one, int)
        some[0] = some[0] or one is not None
        return True

    if not isinstance(value, list) or not number(value) or not some[0]:
        return None
    try:
        return np.array(value, dtype=np.int64 if whole[0] else np.float64)
    except (ValueError, TypeError, OverflowError):
        return None


SHOWN = 900  # characters of a printed document, from where on members are named alone
NAMED = 40  # members that are named
VALUE = 160  # characters of a member, up to which what is nested is shown
LISTED = 4  # entries of a list that are shown
TEXT = 60  # characters of a text


def _more(entries: Any, shown: int = LISTED) -> list[str]:
    return [f"… {len(entries) - shown} more"] if len(entries) > shown else []


def _cut(text: str, length: int = TEXT) -> str:
    return text if len(text) <= length else text[: length - 1] + "…"


def _value(value: Any, depth: int) -> str:
    """A JSON value in a few words; objects and lists within are opened to this depth."""
    if isinstance(value, Mapping):
        from .records import record

        known = record(value, None)
        if known is not None:
            return repr(known)
        if depth == 0:
            return "{…}" if value else "{}"
        shown = [f"{_cut(name)}: {_value(value[name], depth - 1)}" for name in list(value)[: 2 * LISTED]]
        return "{" + ", ".join(shown + _more(value, 2 * LISTED)) + "}"
    if isinstance(value, list):
        if depth == 0 and value:
            return f"[… {len(value)}]"
        return "[" + ", ".join([_value(one, depth - 1) for one in value[:LISTED]] + _more(value)) + "]"
    if isinstance(value, float):
        return f"{value:.6g}" if len(repr(value)) > 8 else repr(value)
    return repr(_cut(value) if isinstance(value, str) else value)


def _members(raw: Mapping[str, Any], room: int) -> str:
    """``name=value`` of each member, as deep as it is short; where the room ends, names alone."""
    shown: list[str] = []
    length = 0
    for name in list(raw)[:NAMED]:
        text = _cut(name)
        if length < room:
            values = (_value(raw[name], depth) for depth in (3, 2, 1, 0))
            text += "=" + next((one for one in values if len(one) <= VALUE), "…")
        shown.append(text)
        length += len(text) + 2
    return ", ".join(shown + _more(raw, NAMED))


class Document(Mapping[str, Any]):
    """A JSON object: ``document["pValue"]``, ``document.pValue`` and ``document.p_value`` are the same.

    Lists of numbers come as arrays, lists of objects as ``Rows``, records as ``Mesh``, ``Surface``, ``Model``.
    ``raw`` is the JSON as it came.
    """

    def __init__(self, raw: Mapping[str, Any], client: "Optional[Client]" = None) -> None:
        self.raw: dict[str, Any] = dict(raw)
        self._client = client

    def __getitem__(self, name: str) -> Any:
        return convert(self.raw[name], self._client)

    def __iter__(self) -> Iterator[str]:
        return iter(self.raw)

    def __len__(self) -> int:
        return len(self.raw)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        for candidate in (name, camel(name)):
            if candidate in self.raw:
                return self[candidate]
        raise AttributeError(f"there is no {name!r} here; there are: {', '.join(self.raw)}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(name for name in self.raw if name.isidentifier())]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({_members(self.raw, SHOWN)})"


class Rows(list[Document]):
    """Objects of one kind. ``columns()`` is what ``pandas.DataFrame`` takes."""

    def __repr__(self) -> str:
        shown = []
        for one in self[:LISTED]:
            short = f"{type(one).__name__}({_members(one.raw, SHOWN // LISTED)})"
            shown.append(short if type(one).__repr__ is Document.__repr__ else repr(one))
        return f"[{', '.join(shown + _more(self))}]"

    def columns(self) -> dict[str, list[Any]]:
        """A list for each member, nested members as ``outer.inner``; None where a row lacks one."""
        return columns(row.raw for row in self)


def columns(rows: Iterable[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Rows of JSON objects as columns of one length, nested objects flattened with a point between."""
    flat = [_flatten(row) for row in rows]
    names = list(dict.fromkeys(name for row in flat for name in row))
    return {name: [row.get(name) for row in flat] for name in names}


def _flatten(row: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in row.items():
        if isinstance(value, Mapping):
            found.update(_flatten(value, f"{before}{name}."))
        else:
            found[before + name] = value
    return found


def convert(value: Any, client: "Optional[Client]") -> Any:
    """JSON as what this package gives for it; see ``Document``."""
    if isinstance(value, Mapping):
        from .records import record

        return record(value, client) or Document(value, client)
    if isinstance(value, list):
        array = numeric(value)
        if array is not None:
            return array
        if value and all(isinstance(one, Mapping) for one in value):
            converted = [convert(one, client) for one in value]
            return Rows(converted) if all(isinstance(c, Document) for c in converted) else converted
        return [convert(one, client) for one in value]
    return value


class Warned(Document):
    """A reason to doubt a number: ``code``, ``detail``, and the ``figures`` behind it."""

    def __str__(self) -> str:
        return f"{self.raw.get('code')}: {self.raw.get('detail')}"


class Result(Document):
    """What a process gave, by the names of its outputs; ``job`` is the id of the job that made it."""

    def __init__(self, raw: Mapping[str, Any], client: "Optional[Client]", job: str = "") -> None:
        super().__init__(raw, client)
        self.job = job

    @property
    def warnings(self) -> list[Warned]:
        """Reasons to doubt a number of this result; empty where nothing was found."""
        return [Warned(one, self._client) for one in self.raw.get("warnings") or []]

    @property
    def surface(self) -> "Surface":
        """The surface that was made."""
        found: "Surface" = self["surface"]
        return found

    @property
    def surfaces(self) -> "list[Surface]":
        """The surfaces that were made, in order."""
        return list(self["surfaces"])

    @property
    def mesh(self) -> "Mesh":
        """The mesh that was made."""
        found: "Mesh" = self["mesh"]
        return found

    @property
    def model(self) -> "Model":
        """The model that was made."""
        found: "Model" = self["model"]
        return found

    @property
    def labels(self) -> list[str]:
        """A name for each member, in order; no two are the same."""
        return [str(one) for one in self.raw.get("labels") or []]

    @property
    def matrix(self) -> Floats:
        """Distances, shape (members, members). Of unit-area surfaces by SRNF: between 0 and 2."""
        found: Floats = np.array(self.raw["matrix"], dtype=np.float64)
        return found
