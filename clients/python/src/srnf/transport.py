"""Requests over HTTP that survive a server that is busy, restarts, or goes away and returns.

A request is repeated after a lost connection, 408, 502, 503, 504 and 429, and while a request of the same
Idempotency-Key is being answered (409). Before the next try the client waits for as long as Retry-After says, or else
a time that doubles from a quarter of a second to eight. It gives up when ``patience`` seconds have passed without an
answer that is final. A server that never answered is not waited for: then the address is wrong, or it does not run.

Repeating is safe here: content is named by what it is, the same execution joins the job that runs, and each execution
carries one Idempotency-Key through all its tries.

One connection is kept for each thread.
"""

from __future__ import annotations

import http.client
import json
import os
import random
import socket
import ssl
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Callable, Mapping, Optional, Union
from urllib.parse import urlencode, urlsplit

from .errors import Canceled, InputError, SrnfError, Unreachable, problem_of

#: Seconds without a byte after which a connection counts as lost.
SILENCE = 330.0
#: Seconds to the first try after a failure, and the longest between two.
FIRST_PAUSE, LONGEST_PAUSE = 0.25, 8.0
_RETRIED = frozenset({408, 429, 502, 503, 504})
_LOST = (ConnectionError, http.client.HTTPException, socket.timeout, OSError)

Query = Mapping[str, Union[str, int, float, bool, None]]
Body = Union[bytes, None]


@dataclass
class Response:
    """A final answer. ``body`` is empty where it was written into a file."""

    status: int
    headers: Mapping[str, str]
    body: bytes

    def json(self) -> Any:
        """The body as JSON."""
        return json.loads(self.body)


class Transport:
    """Sends requests to one server.

    ``server`` is ``http://HOST:PORT`` or ``https://..``. ``patience`` is in seconds. ``notice`` gets sentences about
    waiting, such as that the server is away; it may be called from any thread.
    """

    def __init__(
        self,
        server: str,
        token: Optional[str],
        patience: float,
        notice: Callable[[str], None],
        ca_file: Optional[str] = None,
    ) -> None:
        parts = urlsplit(server if "//" in server else f"http://{server}")
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise InputError(f"{server!r} is not the address of a server, such as http://127.0.0.1:8080")
        try:
            port = parts.port
        except ValueError:
            raise InputError(f"{server!r} has no valid port") from None
        self.server = f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}"
        self._host, self._port, self._tls = parts.hostname, port, parts.scheme == "https"
        self._prefix = parts.path.rstrip("/")
        self._token, self._patience, self._notice = token, patience, notice
        self._context = ssl.create_default_context(cafile=ca_file) if self._tls else None
        self._local = threading.local()
        self._closed = threading.Event()
        self._answered = False  # whether the server ever has

    def close(self) -> None:
        """Ends what waits in any thread with ``Canceled``, and this thread's connection."""
        self._closed.set()
        self._drop()

    def request(
        self,
        method: str,
        path: str,
        *,
        query: Optional[Query] = None,
        body: Body = None,
        headers: Optional[Mapping[str, str]] = None,
        into: Optional[Path] = None,
    ) -> Response:
        """Sends a request until its answer is final, and returns an answer below 400.

        ``into``: a file that gets the body; it appears under its name only when it is complete. Raises ``Problem`` for
        an answer of 400 and above, ``Unreachable`` where patience ended without any answer.
        """
        given = {k: _text(v) for k, v in (query or {}).items() if v is not None}
        target = self._prefix + path + ("?" + urlencode(given) if given else "")
        sent = {"Accept": "*/*", "User-Agent": "srnf-python", **(headers or {})}
        if self._token:
            sent["Authorization"] = f"Bearer {self._token}"
        deadline = time.monotonic() + self._patience
        pause, told, lost = FIRST_PAUSE, False, False
        while True:
            try:
                answer = self._once(method, target, body, sent, into)
            except ssl.SSLCertVerificationError as error:
                raise Unreachable(f"The certificate of {self.server} is not trusted: {error}") from None
            except _LOST as error:
                failure: SrnfError = self._away(error)
                if not self._answered or time.monotonic() > deadline:
                    raise failure from None
                wait, lost = pause, True
            else:
                if answer.status < 400:
                    return answer
                if method == "DELETE" and answer.status == 404 and lost:
                    return Response(204, {}, b"")  # the answer to the first try was lost
                failure = _failure(answer)
                if not _again(answer) or time.monotonic() > deadline:
                    raise failure
                wait = max(pause, _retry_after(answer) or 0.0)
            if time.monotonic() + wait > deadline + 1:
                raise failure
            if not told and wait + pause > 0.6:
                told = True
                left = max(0, round(deadline - time.monotonic()))
                self._notice(f"{failure} Trying again, for {left} s.")
            if self._closed.wait(wait * random.uniform(0.9, 1.1)):
                raise Canceled("The client was closed.")
            pause = min(2 * pause, LONGEST_PAUSE)

    def lines(self, path: str, headers: Mapping[str, str]) -> "http.client.HTTPResponse":
        """An open stream, read line by line by the caller, who closes it. It has a connection of its own."""
        connection = self._connect()
        sent = {"Accept": "text/event-stream", **headers}
        if self._token:
            sent["Authorization"] = f"Bearer {self._token}"
        try:
            connection.request("GET", self._prefix + path, headers=sent)
            response = connection.getresponse()
        except _LOST as error:
            raise self._away(error) from None
        if response.status >= 400:
            raise _failure(Response(response.status, dict(response.headers), response.read()))
        return response

    # ---- one try -------------------------------------------------------------------------------

    def _connect(self) -> http.client.HTTPConnection:
        if self._tls:
            return http.client.HTTPSConnection(
                self._host, self._port, timeout=SILENCE, context=self._context
            )
        return http.client.HTTPConnection(self._host, self._port, timeout=SILENCE)

    def _drop(self) -> None:
        connection = getattr(self._local, "connection", None)
        self._local.connection = None
        if connection is not None:
            connection.close()

    def _once(
        self, method: str, target: str, body: Body, headers: Mapping[str, str], into: Optional[Path]
    ) -> Response:
        kept = getattr(self._local, "connection", None)
        try:
            return self._try(kept or self._connect(), method, target, body, headers, into)
        except _LOST:
            self._drop()
            if kept is None:
                raise
        # The server closes connections that were idle for long: another one tells whether it is there.
        try:
            return self._try(self._connect(), method, target, body, headers, into)
        except _LOST:
            self._drop()
            raise

    def _try(
        self,
        connection: http.client.HTTPConnection,
        method: str,
        target: str,
        body: Body,
        headers: Mapping[str, str],
        into: Optional[Path],
    ) -> Response:
        if self._closed.is_set():
            raise Canceled("The client was closed.")
        self._local.connection = connection
        try:
            connection.request(method, target, body=body, headers=dict(headers))
        except (BrokenPipeError, ConnectionResetError):
            if not body:
                raise  # a large body may be refused before all of it was sent
        response = connection.getresponse()
        if into is not None and response.status < 300:
            _write(response, into)
            content = b""
        else:
            content = response.read()
        self._answered = True
        if response.will_close:
            self._drop()
        return Response(response.status, {k.lower(): v for k, v in response.getheaders()}, content)

    def _away(self, error: BaseException) -> Unreachable:
        if isinstance(error, socket.gaierror):
            return Unreachable(f"There is no host {self._host!r}.")
        reason = {
            ConnectionRefusedError: "connection refused",
            socket.timeout: "no answer in time",
            http.client.RemoteDisconnected: "it closed the connection",
        }.get(type(error), str(error) or type(error).__name__)
        if self._answered:
            return Unreachable(f"{self.server} does not answer any more: {reason}.")
        return Unreachable(
            f"Nothing answers at {self.server}: {reason}. Is srnfd running there? Name another server with"
            " --server or SRNF_SERVER."
        )


def _write(response: http.client.HTTPResponse, into: Path) -> None:
    part = into.with_name(f".{into.name}.{os.getpid()}.part")
    try:
        out = part.open("wb")
    except OSError as error:
        raise InputError(f"{into} cannot be written: {error.strerror}") from None
    try:
        with out:
            while True:
                block = response.read(1 << 20)
                if not block:
                    break
                _store(out, block, into)
        if response.length:
            raise http.client.IncompleteRead(b"", response.length)
        part.replace(into)
    finally:
        part.unlink(missing_ok=True)


def _store(out: BinaryIO, block: bytes, into: Path) -> None:
    try:
        out.write(block)
        out.flush()
    except OSError as error:
        raise InputError(f"{into} cannot be written: {error.strerror}") from None


def _text(value: Union[str, int, float, bool, None]) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _retry_after(answer: Response) -> Optional[float]:
    try:
        return float(answer.headers.get("retry-after", ""))
    except ValueError:
        return None


def _failure(answer: Response) -> SrnfError:
    try:
        document = json.loads(answer.body)
    except ValueError:
        document = None
    if not isinstance(document, dict):
        text = answer.body[:200].decode("utf-8", "replace").strip()
        document = {"detail": f"The server answered {answer.status}: {text or 'no reason given'}"}
    return problem_of(answer.status, document, _retry_after(answer))


def _again(answer: Response) -> bool:
    return answer.status in _RETRIED or (
        answer.status == 409 and b'"idempotency-key-in-flight"' in answer.body
    )
