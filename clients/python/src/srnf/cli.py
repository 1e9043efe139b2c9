"""The command ``srnf``.

Results go to standard output, as text or, with --json, as one JSON document; progress and messages go to standard
error. Exit status: 0 all done; 1 the server refused, or a job failed; 2 the command line is wrong; 3 files or labels
are; 4 no server, or one that stays busy; 5 not admitted; 6 a quota is used up or the disk full; 7 a study of which a
step failed; 130 interrupted.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
from types import FrameType
from typing import Any, Optional, Sequence

from . import __version__, commands
from .client import DEFAULT_SERVER, Client
from .completion import SHELLS
from .errors import InputError, NotAllowed, Problem, QuotaExceeded, SrnfError, Unreachable
from .study import REGISTER, STEPS

Parsers = "argparse._SubParsersAction[argparse.ArgumentParser]"

_EXITS = """\
exit status:
  0 done   1 refused by the server, or a job failed   2 wrong command line   3 wrong files or labels
  4 no server, or it stays busy   5 not admitted   6 quota used up, or disk full   7 a step of the study failed
  130 interrupted
"""
_ENVIRONMENT = """\
environment:
  SRNF_SERVER      address of the server, http://127.0.0.1:8080 without it
  SRNF_TOKEN_FILE  file with a token in its first line; or SRNF_TOKEN, the token itself
  SRNF_CA_FILE     certificates to trust besides the system's (PEM)
"""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    raw = argparse.RawDescriptionHelpFormatter
    common = argparse.ArgumentParser(add_help=False, argument_default=argparse.SUPPRESS)
    common.add_argument("--server", metavar="URL", help=f"address of the server (SRNF_SERVER, or {DEFAULT_SERVER})")
    common.add_argument("--token-file", metavar="FILE", help="file with a token in its first line (SRNF_TOKEN_FILE)")
    common.add_argument("--ca-file", metavar="FILE", help="certificates to trust besides the system's (SRNF_CA_FILE)")
    common.add_argument(
        "--patience", metavar="SECONDS", type=_seconds, help="how long to wait for a server that went away (300)"
    )
    common.add_argument("--json", action="store_true", help="results as one JSON document")
    common.add_argument("--quiet", action="store_true", help="no progress")
    top = argparse.ArgumentParser(
        prog="srnf",
        parents=[common],
        formatter_class=raw,
        description="Elastic shape analysis of closed surfaces, by a server that runs srnfd.",
        epilog=f"{_ENVIRONMENT}\n{_EXITS}\nsrnf COMMAND --help says more.",
    )
    top.add_argument("--version", action="version", version=f"srnf {__version__}")
    sub = top.add_subparsers(dest="command", metavar="COMMAND", required=True)
    _study(sub, common)
    _records(sub, common)
    _processes(sub, common)
    return top


def _seconds(text: str) -> float:
    value = float(text)
    if not 0 <= value < 1e9:
        raise ValueError
    return value


def _study(sub: Any, common: argparse.ArgumentParser) -> None:
    one = sub.add_parser(
        "study",
        parents=[common],
        help="a folder of meshes: upload, encode, register, statistics, figures, tables, report",
        description="Computes a study. Interrupted, the same command goes on where it was; no work is done twice.",
    )
    one.add_argument("folder", help="folder of meshes")
    one.add_argument("--labels", metavar="FILE", help="CSV or TSV: file, label, subject, time, side, mirror, covariates")
    one.add_argument("--label-column", metavar="NAME", help="the column of the labels, if that is not label")
    one.add_argument("--out", metavar="FOLDER", help="where results go (FOLDER-study)")
    one.add_argument("--name", help="name of the cohort (that of the folder)")
    one.add_argument("--lmax", type=int, help="harmonic degree, 4..127 (the server's default)")
    one.add_argument("--parameterization", choices=("auto", "star", "area"), help="route to the sphere (auto)")
    one.add_argument(
        "--register",
        choices=REGISTER,
        default="mean",
        help="mean: each statistic registers all to its mean (the default, and longest); template: all to one, once;"
        " none: as the meshes are parameterized",
    )
    one.add_argument("--template", metavar="FILE", help="which member is the template (the first)")
    one.add_argument("--degree", type=int, help="of the registration to a template")
    one.add_argument("--common-pose", action="store_true", help="the meshes share a pose: rotate nothing")
    one.add_argument("--mirror-right", action="store_true", help="mirror the members whose side is right")
    one.add_argument(
        "--extract", metavar="VALUE", type=int, help="the files are label volumes: the label that is the shape"
    )
    one.add_argument("--skip-refused", action="store_true", help="leave out files that cannot be used")
    one.add_argument("--steps", metavar="LIST", type=_steps, default=STEPS, help=f"of {','.join(STEPS)} (all)")
    one.add_argument("--method", metavar="LIST", type=lambda text: text.split(","), help="of the classification")
    one.add_argument("--permutations", type=int, help="of the comparison of groups (10000)")
    one.add_argument("--covariates", metavar="LIST", type=lambda text: text.split(","), default=[], help="taken out")
    one.add_argument("--no-figures", action="store_true", help="tables only")
    one.set_defaults(run=commands.study)


def _steps(text: str) -> tuple[str, ...]:
    wrong = [name for name in text.split(",") if name not in STEPS]
    if wrong:
        raise argparse.ArgumentTypeError(f"there is no step {wrong[0]!r}; there are: {', '.join(STEPS)}")
    return tuple(text.split(","))


def _records(sub: Any, common: argparse.ArgumentParser) -> None:
    one = sub.add_parser("status", parents=[common], help="the server and its jobs, a job, or a study")
    one.add_argument("what", nargs="?", help="id of a job, or folder of a study's results")
    one.set_defaults(run=commands.status)
    one = sub.add_parser(
        "fetch",
        parents=[common],
        help="a mesh, surface, model, cohort or result into a file",
        description="Writes a mesh, volume, surface, model, results of a job, or a cohort as a zip, into a file.",
    )
    one.add_argument("id", help="id of a mesh, volume, surface, model or job, or name of a cohort")
    one.add_argument("file", nargs="?", help="where to; the format follows from its name (ID.EXTENSION)")
    one.add_argument("--format", help="instead of that of the name")
    one.add_argument("--space", choices=("normalized", "original"), help="of surfaces: original has units and place")
    one.add_argument("--resolution", type=int, help="of surfaces: triangles along a side (32)")
    one.set_defaults(run=commands.fetch)
    one = sub.add_parser("upload", parents=[common], help="meshes, one id for each")
    one.add_argument("files", nargs="+")
    one.set_defaults(run=commands.upload)
    one = sub.add_parser("cancel", parents=[common], help="stop jobs, or those of a study")
    one.add_argument("what", nargs="+", help="ids of jobs, or folders of studies' results")
    one.set_defaults(run=commands.cancel)


def _processes(sub: Any, common: argparse.ArgumentParser) -> None:
    one = sub.add_parser("processes", parents=[common], help="what can be computed, or the inputs of one process")
    one.add_argument("process", nargs="?")
    one.set_defaults(run=commands.processes)
    one = sub.add_parser(
        "run",
        parents=[common],
        help="a process: srnf run encode mesh=ID lmax=15",
        description="Runs a process and prints its results as JSON. A value is JSON, or else a text; a file of meshes"
        " may be given for an id as @FILE.",
    )
    one.add_argument("process")
    one.add_argument("inputs", nargs="*", metavar="NAME=VALUE")
    one.add_argument("--detach", action="store_true", help="print the job's id and do not wait")
    one.set_defaults(run=commands.run)
    one = sub.add_parser("completion", help="a script that completes commands and options")
    one.add_argument("shell", choices=SHELLS)
    one.set_defaults(run=commands.completion)


def exit_status(error: BaseException) -> int:
    """The exit status that an error stands for."""
    if isinstance(error, Problem) and error.status in (502, 503, 504):
        return 4
    kinds = ((KeyboardInterrupt, 130), (Unreachable, 4), (NotAllowed, 5), (QuotaExceeded, 6), (InputError, 3))
    return next((status for kind, status in kinds if isinstance(error, kind)), 1)


def explain(error: SrnfError) -> str:
    """What a person should read: the message, and what helps."""
    text = str(error)
    if isinstance(error, NotAllowed) and error.status == 401:
        text += "\nGive a token with --token-file FILE, SRNF_TOKEN_FILE or SRNF_TOKEN; `srnfd token add` makes one."
    elif isinstance(error, Problem) and error.request_id and error.status == 500:
        text += f"\nThe server's log has more, at request {error.request_id}."
    return text


def _fail(error: BaseException, as_json: bool, after: str) -> int:
    status = exit_status(error)
    if isinstance(error, KeyboardInterrupt):
        text = f"Interrupted. {after}".strip()
        document: dict[str, Any] = {"code": "interrupted", "detail": text}
    else:
        assert isinstance(error, SrnfError)
        text = explain(error)
        if status in (4, 6) and after:
            text += f"\n{after}"
        document = error.document if isinstance(error, Problem) else {"code": _code(error), "detail": text}
        refused = getattr(error, "refused", None)
        if refused:
            document["refused"] = refused
    if as_json:
        print(json.dumps({"problem": document, "exit": status}))
    print(f"srnf: {text}", file=sys.stderr)
    return status


def _code(error: SrnfError) -> str:
    names = {"InputError": "wrong-input", "FilesRefused": "files-refused", "Unreachable": "no-server"}
    return names.get(type(error).__name__, "failed")


def _terminate(number: int, frame: Optional[FrameType]) -> None:
    raise KeyboardInterrupt


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Runs the command and returns its exit status."""
    given = parser().parse_args(arguments)
    as_json = getattr(given, "json", False)
    if given.run is commands.completion:
        return commands.completion(parser(), given)
    signal.signal(signal.SIGTERM, _terminate)
    client: Optional[Client] = None
    try:
        client = Client(
            getattr(given, "server", None),
            token_file=getattr(given, "token_file", None),
            ca_file=getattr(given, "ca_file", None),
            patience=getattr(given, "patience", 300.0),
            progress=False if getattr(given, "quiet", False) else None,
        )
        status: int = given.run(client, given)
        sys.stdout.flush()
        return status
    except BrokenPipeError:  # such as `| head`: nobody reads on
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (SrnfError, KeyboardInterrupt) as error:
        return _fail(error, as_json, getattr(given, "after", ""))
    finally:
        if client is not None:
            client.close()
