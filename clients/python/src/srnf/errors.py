"""What can go wrong, as exceptions. All are ``SrnfError``; ``str()`` of each is a message for people."""

from __future__ import annotations

from typing import Any, Mapping, Optional, Sequence


class SrnfError(Exception):
    """Anything that this package raises by itself."""


class InputError(SrnfError):
    """An input that needs no server to be found wrong: a name, a file, a table of labels."""


class Unreachable(SrnfError):
    """No server answers at the address, or it stayed away for longer than the client's patience."""


class Canceled(SrnfError):
    """The client was closed while one of its threads waited."""


class FilesRefused(InputError):
    """Files that are no meshes, or meshes that cannot be analysed.

    ``refused`` lists them as ``{"file", "code", "detail"}``, in order of the study.
    """

    def __init__(self, message: str, refused: Sequence[Mapping[str, str]]) -> None:
        super().__init__(message)
        self.refused = [dict(one) for one in refused]


class Problem(SrnfError):
    """A problem document (RFC 9457) that the server answered.

    ``code`` is stable and meant for programs, ``detail`` says what to do. ``status`` is that of HTTP, ``errors``
    points at members of the request, and ``document`` has all of it.
    """

    def __init__(
        self, status: int, document: Mapping[str, Any], retry_after: Optional[float] = None
    ) -> None:
        self.status = status
        self.document = dict(document)
        self.code = str(document.get("code", f"http-{status}"))
        self.title = str(document.get("title", ""))
        self.detail = str(document.get("detail", ""))
        self.errors: list[dict[str, Any]] = list(document.get("errors") or [])
        self.request_id = str(document.get("requestId", ""))
        self.retry_after = retry_after
        super().__init__(self._message())

    def _message(self) -> str:
        text = self.detail or self.title or f"the server answered {self.status}"
        more = [
            f"{one.get('pointer', '')}: {one.get('detail', '')}"
            for one in self.errors
            if str(one.get("detail", "")) not in text
        ]
        return "\n  ".join([f"{text} ({self.code})", *more])


class NotAllowed(Problem):
    """401 or 403: a token is missing, wrong, expired or of another role."""


class NotFound(Problem):
    """404: there is nothing of that id, or it belongs to somebody else."""


class QuotaExceeded(Problem):
    """429 or 507: a quota is used up, or the disk is full."""


class JobFailed(Problem):
    """A job that ended without results. ``job`` is its id; the problem is that of the job."""

    def __init__(self, job: str, document: Mapping[str, Any]) -> None:
        self.job = job
        super().__init__(int(document.get("status", 0) or 0), document)


def problem_of(
    status: int, document: Mapping[str, Any], retry_after: Optional[float] = None
) -> Problem:
    """The exception that belongs to the status of an answer."""
    kinds = {401: NotAllowed, 403: NotAllowed, 404: NotFound, 429: QuotaExceeded, 507: QuotaExceeded}
    return kinds.get(status, Problem)(status, document, retry_after)
