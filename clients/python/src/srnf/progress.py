"""Progress on standard error: bars on a terminal, a line now and then elsewhere, nothing if it is not wanted."""

from __future__ import annotations

import shutil
import sys
import threading
import time
from types import TracebackType
from typing import Optional, TextIO, Type

#: Seconds between two lines where there is no terminal.
LINE_SECONDS = 15.0
_BAR = 24
#: The bars on terminals, the innermost last.
_bars: "list[Progress]" = []


class Progress:
    """One bar: ``done`` of ``total`` pieces, of which the current ones are done by parts.

        with Progress("encode", 12) as bar:
            bar.update(3.5)

    ``on=None`` shows bars on terminals and lines elsewhere, True and False do and do not. Any thread may call it.
    """

    def __init__(
        self, title: str, total: float, on: Optional[bool] = None, out: Optional[TextIO] = None
    ) -> None:
        self.title, self.total, self.done = title, max(total, 1e-9), 0.0
        self._out = out or sys.stderr
        self._shown = on is not False
        self._terminal = self._shown and bool(getattr(self._out, "isatty", lambda: False)())
        self._began = time.monotonic()
        self._last = self._began if not self._terminal else 0.0
        self._note = ""
        self._width = 0
        self._lock = threading.Lock()  # of what is written

    def __enter__(self) -> "Progress":
        if self._terminal:
            _bars.append(self)
            self._draw()
        return self

    def __exit__(
        self,
        kind: Optional[Type[BaseException]],
        error: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None:
        with self._lock:
            if self in _bars:
                _bars.remove(self)
            if not self._shown:
                return
            if kind is None and self._terminal:
                self._clear()
            if kind is None:
                took = time.monotonic() - self._began
                many = "" if self.total == 1 else f"{_count(self.total)} "
                self._write(f"{self.title}: {many}done in {_clock(took)}{self._note}\n")
            elif self._terminal:
                self._write("\n")

    def update(self, done: float, note: str = "") -> None:
        """Sets how much is done, in pieces, and a few words that stay at the end of the line."""
        with self._lock:
            self.done = min(max(done, 0.0), self.total)
            self._note = f", {note}" if note else self._note
            now = time.monotonic()
            if self._shown and now - self._last >= (0.1 if self._terminal else LINE_SECONDS):
                self._last = now
                self._draw()

    def say(self, text: str) -> None:
        """A line of its own, above the bar."""
        with self._lock:
            if self._shown:
                if self._terminal:
                    self._clear()
                self._write(text + "\n")
                if self._terminal:
                    self._draw()

    def _left(self) -> str:
        spent = time.monotonic() - self._began
        if self.done <= 0 or spent < 2:
            return ""
        return f", about {_clock(spent * (self.total - self.done) / self.done)} left"

    def _draw(self) -> None:
        part = self.done / self.total
        done = f"{100 * part:.0f} %" if self.total == 1 else f"{_count(self.done)}/{_count(self.total)}"
        text = f"{done}{self._left()}{self._note}"
        if not self._terminal:
            self._write(f"{self.title}: {text}\n")
            return
        full = int(part * _BAR)
        line = f"{self.title:<16.16} [{'#' * full}{'.' * (_BAR - full)}] {text}"
        line = line[: shutil.get_terminal_size((80, 24)).columns - 1]
        self._write("\r" + line.ljust(self._width))
        self._width = len(line)

    def _clear(self) -> None:
        self._write("\r" + " " * self._width + "\r")
        self._width = 0

    def _write(self, text: str) -> None:
        try:
            self._out.write(text)
            self._out.flush()
        except (OSError, ValueError):
            self._shown = False  # nobody reads it any more


def announce(text: str) -> None:
    """A line on standard error, above the bar if there is one."""
    for bar in _bars[-1:]:
        bar.say(text)
        return
    print(text, file=sys.stderr, flush=True)


def _count(value: float) -> str:
    return str(int(value + 1e-9))


def _clock(seconds: float) -> str:
    whole = int(round(seconds))
    if whole >= 3600:
        return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d} h"
    return f"{whole // 60}:{whole % 60:02d} min" if whole >= 60 else f"{seconds:.0f} s"
