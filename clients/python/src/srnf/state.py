"""What a study remembers between runs: ``study.json`` in its folder.

So a study that was interrupted, by Ctrl-C, a crash or a server that stayed away, goes on where it was. The server does
no work twice either way, since the same request is the same job; the state also spares uploads, and keeps the results
of one build of the server where it was upgraded in between.
"""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path
from typing import Any, Mapping

from .errors import InputError


def digest(value: Any) -> str:
    """A short name for a JSON value."""
    text = json.dumps(value, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def file_digest(path: Path) -> str:
    """SHA-256 of a file."""
    found = hashlib.sha256()
    try:
        with path.open("rb") as content:
            for block in iter(lambda: content.read(1 << 20), b""):
                found.update(block)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from None
    return found.hexdigest()


class State:
    """Ids by content: of meshes by the digest of their files, of surfaces and jobs by that of their requests."""

    def __init__(self, folder: Path, server: str) -> None:
        self.path = folder / "study.json"
        self.data: dict[str, Any] = {"server": server, "meshes": {}, "surfaces": {}, "jobs": {}}
        try:
            found = json.loads(self.path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return
        except (OSError, ValueError) as error:
            raise InputError(f"{self.path} cannot be read ({error}); remove it to begin anew") from None
        if isinstance(found, dict) and found.get("server") == server:
            self.data.update(found)

    def get(self, kind: str, key: str) -> str:
        """The id that was kept; empty if there is none."""
        return str(self.data[kind].get(key, ""))

    def put(self, kind: str, found: Mapping[str, str]) -> None:
        """Keeps ids, in the file before this returns."""
        self.data[kind].update(found)
        self.save()

    def note(self, **members: Any) -> None:
        """Keeps other members, such as the name of the cohort."""
        self.data.update(members)
        self.save()

    def save(self) -> None:
        """Writes the file: as it was, or as it is now, never half of it."""
        part = self.path.with_suffix(".part")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with part.open("w", encoding="utf-8") as out:
                json.dump(self.data, out, indent=1)
                out.flush()
                os.fsync(out.fileno())
            part.replace(self.path)
        except OSError as error:
            raise InputError(f"{self.path} cannot be written: {error.strerror}") from None
