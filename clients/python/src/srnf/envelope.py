"""The frames around what the server answers, read in this one place: lists, jobs, links, descriptions of processes.

Members that a server does not send count as unknown, whether they are absent or null.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Mapping, Optional
from urllib.parse import parse_qs, urlsplit

Json = Mapping[str, Any]

#: The names under which a page of a list has its members.
_LISTS = ("items", "jobs", "processes")


def items(page: Json) -> list[dict[str, Any]]:
    """The members of one page of a list."""
    for name in _LISTS:
        if isinstance(page.get(name), list):
            return list(page[name])
    return []


def total(page: Json) -> Optional[int]:
    """How many members the whole list has, where the server says so."""
    value = page.get("total")
    return int(value) if isinstance(value, (int, float)) else None


def link(document: Json, rel: str) -> Optional[str]:
    """The target of a link, from an array of ``{href, rel}`` or an object of targets by relation."""
    links = document.get("links")
    if isinstance(links, Mapping):
        found = links.get(rel)
        return str(found) if found else None
    for one in links if isinstance(links, list) else []:
        if isinstance(one, Mapping) and one.get("rel") == rel:
            return str(one.get("href"))
    return None


def cursor(page: Json) -> Optional[str]:
    """What to send as ``cursor`` for the page after this one; None at the end."""
    if page.get("next"):
        return str(page["next"])
    following = link(page, "next")
    given = parse_qs(urlsplit(following).query).get("cursor") if following else None
    return given[0] if given else None


def job_id(document: Json) -> str:
    """The id of a job's record."""
    return str(document.get("jobID") or document.get("id") or "")


@dataclass(frozen=True)
class Input:
    """One input of a process: its name, JSON Schema, and whether it must be given."""

    name: str
    schema: dict[str, Any]
    required: bool

    @property
    def description(self) -> str:
        """What it means, with its unit."""
        return str(self.schema.get("description", ""))

    @property
    def default(self) -> Any:
        """What holds where it is not given; None where the server chooses."""
        return self.schema.get("default")

    def takes(self) -> str:
        """Its type and limits in a few words, such as ``integer, 4..127``."""
        schema = self.schema
        if isinstance(schema.get("enum"), list):
            return " | ".join(str(value) for value in schema["enum"])
        kinds = schema.get("type", "value")
        words = " or ".join(str(k) for k in kinds) if isinstance(kinds, list) else str(kinds)
        low, high = schema.get("minimum"), schema.get("maximum")
        if low is not None or high is not None:
            words += f", {'' if low is None else low}..{'' if high is None else high}"
        return words


def inputs(description: Json) -> dict[str, Input]:
    """The inputs of a process, from the map of its description."""
    found = {}
    for name, one in (description.get("inputs") or {}).items():
        schema = dict(one.get("schema") or {})
        schema.setdefault("description", one.get("description") or one.get("title") or "")
        found[name] = Input(name, schema, int(one.get("minOccurs", 1)) > 0)
    return found
