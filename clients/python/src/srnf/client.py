"""The client: uploads, records, processes and jobs of one server."""

from __future__ import annotations

import difflib
import json
import os
import uuid
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any, Callable, Iterable, Iterator, Mapping, Optional, Sequence, Union

import numpy as np

from . import envelope
from .documents import Document, Result, camel
from .errors import InputError, NotFound, Problem
from .jobs import Event, Job, follow, wait_all
from .labels import stem
from .processes import Processes
from .progress import Progress, announce
from .records import Cohort, Mesh, Model, PathLike, Record, Surface, Volume, record
from .transport import Transport

DEFAULT_SERVER = "http://127.0.0.1:8080"
#: Jobs that are queued at once by ``map``; uploads at once by ``upload_all``.
AHEAD, UPLOADS = 64, 4


def _notice(text: str) -> None:
    announce(f"srnf: {text}")


def read_token(file: PathLike) -> str:
    """The token in a file: its first line."""
    try:
        lines = Path(file).read_text(encoding="utf-8").split("\n")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no text"
        raise InputError(f"The token file {file} cannot be read: {reason}") from None
    token = lines[0].strip()
    if not token or not token.isascii() or not token.isprintable() or " " in token:
        raise InputError(f"The token file {file} does not have a token in its first line")
    return token


class Client(Processes):
    """A server.

        client = srnf.Client()                        # SRNF_SERVER, or http://127.0.0.1:8080
        surface = client.encode(client.upload("heart.ply"), lmax=31).surface

    ``server`` is its address, ``token`` or ``token_file`` what it admits you by (or SRNF_TOKEN, SRNF_TOKEN_FILE).
    ``patience`` is how many seconds a request waits for a server that is busy or went away. ``progress`` shows bars:
    None on terminals, True always, False never. ``ca_file`` has certificates to trust besides the system's (PEM).

    Threads may share a client.
    """

    def __init__(
        self,
        server: Optional[str] = None,
        *,
        token: Optional[str] = None,
        token_file: Optional[PathLike] = None,
        patience: float = 300.0,
        progress: Optional[bool] = None,
        ca_file: Optional[str] = None,
        notice: Callable[[str], None] = _notice,
    ) -> None:
        address = server or os.environ.get("SRNF_SERVER") or DEFAULT_SERVER
        named = token_file or (None if token else os.environ.get("SRNF_TOKEN_FILE"))
        given = read_token(named) if named else token or os.environ.get("SRNF_TOKEN")
        self.patience, self.progress, self.notice = patience, progress, notice
        self.http = Transport(
            address, given, patience, notice, ca_file or os.environ.get("SRNF_CA_FILE")
        )
        self._descriptions: dict[str, dict[str, Any]] = {}

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Ends its connections. Jobs at the server go on."""
        self.http.close()

    # ---- plain requests ------------------------------------------------------------------------

    def get(self, path: str, **query: Any) -> Any:
        """GET, as JSON where the answer is JSON, else as bytes."""
        answer = self.http.request("GET", path, query=query)
        return answer.json() if "json" in answer.headers.get("content-type", "") else answer.body

    def send(
        self, method: str, path: str, document: Any, headers: Optional[Mapping[str, str]] = None
    ) -> Any:
        """Sends a JSON document and returns the JSON of the answer, or None."""
        body = None if document is None else json.dumps(plain(document)).encode()
        kind = {"Content-Type": "application/json"} if body is not None else {}
        answer = self.http.request(method, path, body=body, headers={**kind, **(headers or {})})
        return answer.json() if answer.body else None

    def pages(self, path: str, **query: Any) -> Iterator[dict[str, Any]]:
        """All members of a list, page by page, as JSON."""
        query = {"limit": 200, **query}
        while True:
            page = self.get(path, **query)
            yield from envelope.items(page)
            following = envelope.cursor(page)
            if not following:
                return
            query["cursor"] = following

    # ---- what is kept --------------------------------------------------------------------------

    def upload(self, mesh: Union[PathLike, bytes], name: Optional[str] = None) -> Mesh:
        """Uploads a mesh, from a file or bytes, in any format that the server reads; the same bytes are the same mesh.

        Its ``report`` says whether it can be analysed; a mesh that cannot is kept all the same. It is called ``name``;
        without one a new mesh has the file's, and one that is there keeps its own.
        """
        return Mesh(self._post_content("/v1/meshes", mesh, name), self)

    def _post_content(self, path: str, given: Union[PathLike, bytes], name: Optional[str]) -> dict[str, Any]:
        body, called = _content(given, name)
        answer = self.http.request("POST", path, query={"name": name}, body=body)
        record: dict[str, Any] = answer.json()
        if name is None and called and answer.status == 201:
            record = self.send("PATCH", f"{path}/{record['id']}", {"name": called})
        return record

    def upload_all(
        self,
        meshes: Sequence[PathLike],
        each: Optional[Callable[[PathLike, Union[Mesh, Problem]], None]] = None,
    ) -> list[Union[Mesh, Problem]]:
        """Uploads many files, several at once: for each, in order, the mesh or the problem that refuses it.

        ``each`` gets them as they come. What is no fault of a file (a token, a quota) is raised.
        """
        found: dict[int, Union[Mesh, Problem]] = {}
        pool = ThreadPoolExecutor(UPLOADS, thread_name_prefix="srnf-upload")
        try:
            with Progress("upload", len(meshes), self.progress) as bar:
                waiting = {pool.submit(self._upload_one, m): i for i, m in enumerate(meshes)}
                for done in as_completed(waiting):
                    index = waiting[done]
                    found[index] = done.result()
                    if each:
                        each(meshes[index], found[index])
                    bar.update(len(found))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        pool.shutdown()
        return [found[i] for i in range(len(meshes))]

    def _upload_one(self, mesh: PathLike) -> Union[Mesh, Problem]:
        try:
            return self.upload(mesh)
        except Problem as problem:
            if problem.status in (413, 415, 422):
                return problem
            raise

    def upload_volume(self, volume: Union[PathLike, bytes], name: Optional[str] = None) -> Volume:
        """Uploads a label volume (NIfTI, NRRD), called as a mesh is; ``extract`` makes meshes of its labels."""
        return Volume(self._post_content("/v1/volumes", volume, name), self)

    def add_surface(self, coefficients: Any, name: Optional[str] = None, **options: Any) -> Surface:
        """Adds a surface by its coefficients, shape (3, (lmax + 1)^2)."""
        x, y, z = np.asarray(coefficients, dtype=np.float64)
        lmax = int(round(np.sqrt(x.size))) - 1
        document = {"coefficients": {"lmax": lmax, "x": x, "y": y, "z": z}, "name": name, **options}
        given = {k: v for k, v in document.items() if v is not None}
        return Surface(self.send("POST", "/v1/surfaces", given), self)

    def import_study(
        self, archive: PathLike, cohort: Optional[str] = None, partial: bool = False
    ) -> Document:
        """Uploads an archive (zip, tar, tar.gz) of meshes with a table, or the zip of an export."""
        answer = self.http.request(
            "POST",
            "/v1/imports",
            query={"cohort": cohort, "partial": partial or None},
            body=_content(archive, "")[0],
        )
        return Document(answer.json(), self)

    def cohort(
        self,
        name: str,
        members: Optional[Iterable[Union[Record, str, Mapping[str, Any]]]] = None,
        **copied: Any,
    ) -> Cohort:
        """The cohort of a name; with ``members`` it is made: records, ids, or ``{"id", "label", "subject", ..}``.

        ``from_="other", where={..}`` copies another one, or those of its members that are like ``where``.
        """
        if members is None and not copied:
            return Cohort(self.get(f"/v1/cohorts/{name}"), self)
        document: dict[str, Any] = {"name": name, **{camel(k): v for k, v in copied.items()}}
        if members is not None:
            document["members"] = [_member(one) for one in members]
        return Cohort(self.send("POST", "/v1/cohorts", document), self)

    def mesh(self, id: str) -> Mesh:
        """The mesh of an id."""
        return Mesh(self.get(f"/v1/meshes/{id}"), self)

    def surface(self, id: str) -> Surface:
        """The surface of an id."""
        return Surface(self.get(f"/v1/surfaces/{id}"), self)

    def model(self, id: str) -> Model:
        """The model of an id."""
        return Model(self.get(f"/v1/models/{id}"), self)

    def volume(self, id: str) -> Volume:
        """The volume of an id."""
        return Volume(self.get(f"/v1/volumes/{id}"), self)

    def job(self, id: str) -> Job:
        """The job of an id."""
        return Job(self.get(f"/v1/jobs/{id}"), self)

    def meshes(self, **query: Any) -> list[Mesh]:
        """All meshes, newest first; the query's members are those of the list."""
        return [Mesh(one, self) for one in self.pages("/v1/meshes", **query)]

    def surfaces(self, **query: Any) -> list[Surface]:
        """All surfaces, newest first."""
        return [Surface(one, self) for one in self.pages("/v1/surfaces", **query)]

    def models(self, **query: Any) -> list[Model]:
        """All models, newest first."""
        return [Model(one, self) for one in self.pages("/v1/models", **query)]

    def volumes(self, **query: Any) -> list[Volume]:
        """All volumes, newest first."""
        return [Volume(one, self) for one in self.pages("/v1/volumes", **query)]

    def cohorts(self, **query: Any) -> list[Cohort]:
        """All cohorts, newest first, without their members."""
        return [Cohort(one, self) for one in self.pages("/v1/cohorts", **query)]

    def jobs(self, **query: Any) -> list[Job]:
        """All jobs, newest first: ``status="running"``, ``process="pca"``, .. choose."""
        return [Job(one, self) for one in self.pages("/v1/jobs", **query)]

    def events(self, after: str = "") -> Iterator[Event]:
        """The changes of all jobs that the caller sees, as they happen; a lost connection is taken up again.

        It begins with now, told by an event of kind ``start``, or behind the event of the id ``after``. It does not
        end by itself. A later ``start`` says that changes were missed: ``jobs()`` has what holds then.
        """
        return follow(self, "/v1/events", after)

    def ticket(self) -> Document:
        """A ``ticket`` for one stream of events, for a page in a browser that must not have the token.

        The page opens ``/v1/events?ticket=..``, or a job's events, within ``expiresInSeconds``, once.
        """
        return Document(self.send("POST", "/v1/tickets", None), self)

    def caller(self) -> Document:
        """Whose token this client has: ``name`` and ``role``; ``tokens`` is whether the server asks for one."""
        return Document(self.get("/v1/caller"), self)

    def users(self) -> list[Document]:
        """For admins: who has tokens, and the jobs and bytes of each; none where the server asks for no token."""
        return [Document(one, self) for one in envelope.items(self.get("/v1/users"))]

    # ---- processes -----------------------------------------------------------------------------

    def describe(self, process: str) -> dict[str, Any]:
        """The server's description of a process."""
        if process not in self._descriptions:
            try:
                self._descriptions[process] = self.get(f"/v1/processes/{process}")
            except NotFound:
                there = self.processes()
                raise InputError(
                    f"There is no process {process!r}{_like(process, there)}; there are: {', '.join(there)}"
                ) from None
        return self._descriptions[process]

    def processes(self) -> list[str]:
        """The ids of all processes of this server."""
        return [str(one["id"]) for one in envelope.items(self.get("/v1/processes"))]

    def inputs(self, process: str) -> dict[str, envelope.Input]:
        """The inputs of a process, with their schemas, defaults and descriptions."""
        return envelope.inputs(self.describe(process))

    def estimate(
        self, process: str, inputs: Optional[Mapping[str, Any]] = None, **more: Any
    ) -> Document:
        """What a process would take with these inputs, without starting it; what would be refused raises.

        ``estimatedSeconds`` of one processor, ``estimatedBytes`` of memory, either None where the server knows none.
        """
        document = {"inputs": self._named(process, {**(inputs or {}), **more})}
        return Document(self.send("POST", f"/v1/processes/{process}/estimate", document), self)

    def submit(
        self,
        process: str,
        inputs: Optional[Mapping[str, Any]] = None,
        *,
        wait: float = 0,
        name: Optional[str] = None,
        **more: Any,
    ) -> Job:
        """Starts a process and returns its job; a request that was made before returns the same work.

        ``wait`` is how many seconds the server may take to answer with results at once, ``name`` that of the job.
        """
        document: dict[str, Any] = {"inputs": self._named(process, {**(inputs or {}), **more})}
        if name is not None:
            document["name"] = name
        prefer = "respond-async" + (f", wait={int(wait)}" if wait >= 1 else "")
        answer = self.http.request(
            "POST",
            f"/v1/processes/{process}/execution",
            body=json.dumps(document).encode(),
            headers={
                "Content-Type": "application/json",
                "Prefer": prefer,
                "Idempotency-Key": str(uuid.uuid4()),
            },
        )
        if answer.status != 200:
            return Job(answer.json(), self)
        monitor = answer.headers.get("link", "").partition("<")[2].partition(">")[0]
        known = {"id": monitor.rpartition("/")[2], "processID": process, "status": "successful"}
        return Job(known, self, answer.json())

    def run(
        self, process: str, inputs: Optional[Mapping[str, Any]] = None, **more: Any
    ) -> Result:
        """Runs a process and waits for its results: ``client.run("encode", mesh=mesh, lmax=15)``.

        Inputs are those of the server's description, also in snake_case (``max_iterations``; ``from_`` for ``from``).
        Records stand for their ids, arrays for nested lists.
        """
        return self.submit(process, inputs, wait=2, **more).result()

    def map(self, process: str, inputs: Sequence[Mapping[str, Any]]) -> list[Result]:
        """Runs a process for many inputs, as many at once as the server takes; results in their order."""
        return [job.result() for job in self.submit_all(process, inputs)]

    def submit_all(
        self,
        process: str,
        inputs: Sequence[Mapping[str, Any]],
        each: Optional[Callable[[int, Job], None]] = None,
    ) -> list[Job]:
        """Runs a process for many inputs and returns their jobs when all have ended, well or not.

        A few dozen are queued at a time. ``each`` gets the number and the job as soon as it is queued.
        """
        jobs: list[Job] = []
        bar = Progress(process, len(inputs), self.progress)
        with bar:
            for index, one in enumerate(inputs):
                if index >= AHEAD:
                    before = jobs[index - AHEAD]
                    wait_all([before], Progress(process, 1, False))
                jobs.append(self.submit(process, one))
                if each:
                    each(index, jobs[-1])
                bar.update(sum(job.part for job in jobs))
            quiet = Progress(process, 1, False)
            for index, job in enumerate(jobs):
                wait_all([job], quiet)
                bar.update(index + 1 + sum(later.part for later in jobs[index + 1 :]))
        return jobs

    def _named(self, process: str, given: Mapping[str, Any]) -> dict[str, Any]:
        known = self.inputs(process)
        named = {}
        for key, value in given.items():
            name = next((n for n in (key, camel(key)) if n in known), None)
            if name is None:
                raise InputError(
                    f"{process} has no input {key!r}{_like(camel(key), known)}; it has: {', '.join(known)}"
                )
            named[name] = plain(value)
        missing = [n for n, one in known.items() if one.required and n not in named]
        if missing:
            raise InputError(f"{process} needs {' and '.join(missing)}")
        return named


def plain(value: Any) -> Any:
    """A value as JSON: records as their ids, arrays as lists, NaN and infinities refused."""
    if isinstance(value, Record):
        return value.id
    if isinstance(value, Document):
        return plain(value.raw)
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    if isinstance(value, float) and not np.isfinite(value):
        raise InputError(f"an input has the value {value}, which is no number")
    return value


def _content(given: Union[PathLike, bytes], name: Optional[str]) -> tuple[bytes, Optional[str]]:
    if isinstance(given, bytes):
        return given, name
    path = Path(given)
    try:
        return path.read_bytes(), stem(path) if name is None else name
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from None


def _member(one: Union[Record, str, Mapping[str, Any]]) -> Any:
    if isinstance(one, (Record, str)):
        return {"id": plain(one)}
    return plain(one)


def _like(name: str, there: Iterable[str]) -> str:
    near = difflib.get_close_matches(name, list(there), 1)
    return f" (did you mean {near[0]!r}?)" if near else ""


__all__ = ["Client", "plain", "read_token", "record"]
