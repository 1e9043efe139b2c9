"""Jobs: what the server computes, or will."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, Iterator, Mapping, Optional, Sequence, Union

from . import envelope
from .documents import Document, Floats, Result
from .errors import JobFailed, Problem, SrnfError, Unreachable
from .progress import Progress
from .records import Record

if TYPE_CHECKING:
    from .client import Client

#: Seconds between two looks at a job: at first, and at most.
FIRST_LOOK, LONGEST_LOOK = 0.05, 1.5
ENDED = frozenset({"successful", "failed", "dismissed"})


class Job(Record):
    """A computation that was asked for: ``status``, ``progress`` (per cent), ``processID``, ``created``, .."""

    folder = "jobs"

    def __init__(
        self,
        raw: Mapping[str, Any],
        client: "Optional[Client]",
        results: Optional[Mapping[str, Any]] = None,
    ) -> None:
        super().__init__(raw, client)
        self._results = dict(results) if results is not None else None

    @property
    def id(self) -> str:
        """Its id."""
        return envelope.job_id(self.raw)

    @property
    def status(self) -> str:
        """accepted, running, successful, failed or dismissed, as last seen; ``refresh()`` looks again."""
        return str(self.raw.get("status", "accepted"))

    @property
    def ended(self) -> bool:
        """Whether nothing will change any more, as last seen."""
        return self._results is not None or self.status in ENDED

    @property
    def part(self) -> float:
        """How much is done, 0 to 1, as last seen."""
        return 1.0 if self.ended else float(self.raw.get("progress") or 0.0) / 100.0

    def wait(self, seconds: Optional[float] = None, progress: Optional[bool] = None) -> "Job":
        """Waits until the job has ended, or for so many seconds (TimeoutError)."""
        title = str(self.raw.get("processID", "job"))
        wait_all([self], Progress(title, 1, self.client.progress if progress is None else progress), seconds)
        return self

    def result(self, seconds: Optional[float] = None, progress: Optional[bool] = None) -> Result:
        """Waits for the results. Raises ``JobFailed`` where there are none."""
        self.wait(seconds, progress)
        if self._results is None:
            self.check()
            self._results = dict(self.client.get(f"{self.path}/results"))
        return Result(self._results, self.client, self.id)

    def check(self) -> None:
        """Raises ``JobFailed`` if the job ended without results."""
        if self._results is not None or self.status not in ("failed", "dismissed"):
            return
        document = dict(self.raw.get("exception") or {})
        document.setdefault("code", "job-dismissed" if self.status == "dismissed" else "job-failed")
        document.setdefault("detail", f"The job {self.id} was {self.status}.")
        raise JobFailed(self.id, document)

    def matrix(self, condensed: bool = False) -> Floats:
        """The matrix of distances of a job that has ended, shape (members, members); condensed: the entries above its
        diagonal, row by row, as scipy takes them."""
        return self._array(f"{self.path}/results", **({"condensed": "true"} if condensed else {}))

    def save(self, to: Union[str, Path], format: Optional[str] = None, condensed: bool = False) -> Path:
        """Writes the results into a file: JSON, or a matrix as CSV or .npy by the name of the file.

        condensed: of the matrix, as .npy, the entries above its diagonal alone, row by row, as ``matrix`` gives them.
        """
        kind = format or Path(to).suffix.lstrip(".").lower()
        query = {"condensed": "true"} if condensed else {}
        return self._save(to, f"{self.path}/results", format=kind if kind in ("csv", "npy") else None, **query)

    def cancel(self) -> "Job":
        """Asks the server to stop it; a job that has ended stays as it is."""
        self.raw = dict(self.client.send("POST", f"{self.path}/cancel", None))
        return self

    def events(self) -> Iterator[Document]:
        """The job's record at each change, until it has ended; a lost connection is taken up again."""

        def over() -> bool:
            self.refresh()
            return self.ended

        for event in follow(self.client, f"{self.path}/events", "", over):
            self.raw = {**self.raw, **event.job.raw}
            yield event.job
            if self.ended:
                return


@dataclass(frozen=True)
class Event:
    """A change of a job: ``kind`` is status, progress, deleted, or start, where a stream of all jobs begins.

    ``id`` is what such a stream goes on from, ``job`` the job's record: of a deleted one its id alone, of start nothing.
    """

    id: str
    kind: str
    job: Document


def follow(
    client: "Client", path: str, last: str, over: Callable[[], bool] = lambda: False
) -> Iterator[Event]:
    """The events of a stream from ``last`` on. Where it ends or is lost it is taken up again, unless it is ``over``."""
    pause, deadline = 0.25, time.monotonic() + client.patience
    while True:
        try:
            for event in _events(client, path, last):
                last, pause, deadline = event.id, 0.25, time.monotonic() + client.patience
                yield event
            if over():
                return
        except (Unreachable, OSError) as error:
            if time.monotonic() > deadline:
                raise
            client.notice(f"{error} Jobs go on; trying again.")
        except Problem as problem:
            if problem.status != 503 or time.monotonic() > deadline:
                raise
        time.sleep(pause)
        pause = min(2 * pause, 8.0)


def _events(client: "Client", path: str, last: str) -> Iterator[Event]:
    stream = client.http.lines(path, {"Last-Event-ID": last} if last else {})
    with stream:
        event, kind, data = "", "message", []
        for line in stream:
            text = line.decode("utf-8", "replace").rstrip("\r\n")
            if text.startswith("id:"):
                event = text[3:].strip()
            elif text.startswith("event:"):
                kind = text[6:].strip()
            elif text.startswith("data:"):
                data.append(text[5:].strip())
            elif not text and data:
                yield Event(event, kind, Document(json.loads("\n".join(data)), client))
                kind, data = "message", []


def wait_all(
    jobs: Sequence[Job],
    bar: Progress,
    seconds: Optional[float] = None,
    each: Optional[Callable[[Job], None]] = None,
) -> None:
    """Waits until all jobs have ended. ``each`` gets every job as it ends.

    A few of those that have not ended are looked at in turn, as the server takes them in about that order.
    """
    deadline = None if seconds is None else time.monotonic() + seconds
    left = list(jobs)
    pause = FIRST_LOOK
    with bar:
        while True:
            ended = [job for job in left[:8] if job.ended]
            for job in ended:
                left.remove(job)
                if each:
                    each(job)
            bar.update(len(jobs) - len(left) + sum(job.part for job in left[:8]))
            if not left:
                return
            if ended:
                pause = FIRST_LOOK
            if deadline is not None and time.monotonic() > deadline:
                raise TimeoutError(f"{left[0].id} has not ended after {seconds} s; it goes on")
            if not ended:
                time.sleep(pause)
                pause = min(1.4 * pause, LONGEST_LOOK)
            for job in left[:8]:
                if not job.ended:
                    job.refresh()


__all__ = ["ENDED", "Event", "Job", "SrnfError", "follow", "wait_all"]
