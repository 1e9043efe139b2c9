"""What the commands of ``srnf`` do. Each prints its results and returns the exit status."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any, Iterable, Optional, Sequence

from .client import Client
from .completion import script
from .errors import InputError, NotFound, Problem, SrnfError
from .jobs import ENDED, Job
from .records import Record
from .study import Study

#: The record of an id, by what it begins with, and the format of its file if none is named.
_KINDS = (("mesh-", "mesh", ""), ("surf-", "surface", "ply"), ("model-", "model", "zip"), ("job-", "job", "json"))


def show(given: argparse.Namespace, document: Any, lines: Iterable[str]) -> None:
    """Prints a document as JSON, or lines of text."""
    if getattr(given, "json", False):
        print(json.dumps(document, indent=1))
        return
    for line in lines:
        print(line)


def columns(rows: Sequence[Sequence[Any]]) -> list[str]:
    """Rows of cells as lines with the columns below each other."""
    texts = [["" if cell is None else str(cell) for cell in row] for row in rows]
    widths = [max(len(row[k]) for row in texts) for k in range(len(texts[0]))] if texts else []
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in texts]


# ---- a study ------------------------------------------------------------------------------------


def study(client: Client, given: argparse.Namespace) -> int:
    """Computes a study and writes what it gave."""
    one = Study.from_folder(
        given.folder,
        given.labels,
        label_column=given.label_column,
        out=given.out,
        name=given.name,
        client=client,
        lmax=given.lmax,
        parameterization=given.parameterization,
        register=given.register,
        template=given.template,
        degree=given.degree,
        common_pose=given.common_pose,
        mirror_right=given.mirror_right,
        skip_refused=given.skip_refused,
        extract=given.extract,
    )
    given.after = (
        f"What was queued goes on at the server. The same command goes on where it was; srnf status {one.out} shows"
        f" the jobs, srnf cancel {one.out} stops them."
    )
    steps = one.run(given.steps, given.permutations, given.method, given.covariates)
    if steps and all(step.status == "left out" for step in steps):
        raise InputError("\n".join(["Nothing was computed.", *(f"  {step.name}: {step.detail}" for step in steps)]))
    tables = one.tables()
    report = None if given.no_figures else one.report()
    document = {
        "out": str(one.out),
        "members": len(one.members),
        "cohort": one.state.data.get("cohort"),
        "steps": [vars(step) for step in one.steps],
        "jobs": {name: result.job for name, result in one.results.items()},
        "refused": one.refused,
        "warnings": one.warnings(),
        "tables": [str(path) for path in tables],
        "report": str(report) if report else None,
    }
    show(given, document, _summary(one, report))
    return 7 if any(step.status == "failed" for step in one.steps) else 0


def _summary(one: Study, report: Optional[Path]) -> Iterable[str]:
    counts = ", ".join(f"{sum(m.label == label for m in one.members)} {label}" for label in one.labels())
    yield f"{one.name}: {len(one.members)} members" + (f" ({counts})" if counts else "")
    for refused in one.refused:
        yield f"left out   {refused['file']}: {refused['detail']} ({refused['code']})"
    for step in one.steps:
        if step.status != "done":
            yield f"{step.status:<10} {step.name}: {step.detail}"
    yield from _figures(one)
    warnings = one.warnings()
    if warnings:
        yield f"{len(warnings)} reasons to doubt a number:"
        for found in warnings[:10]:
            yield f"  {found['where']}: {found['detail']} ({found['code']})"
        if len(warnings) > 10:
            yield f"  and {len(warnings) - 10} more: {one.out / 'tables' / 'warnings.csv'}"
    yield f"report     {report}" if report else f"tables     {one.out / 'tables'}"


def _figures(one: Study) -> Iterable[str]:
    for name, result in one.results.items():
        raw = result.raw
        if name == "distances":
            matrix, called = result.matrix, one.names()
            pairs = sorted((matrix[i, j], i, j) for i in range(len(matrix)) for j in range(i))
            (least, a, b), (most, c, d) = pairs[0], pairs[-1]
            yield f"distances  {least:.3g} ({called[b]}, {called[a]}) to {most:.3g} ({called[d]}, {called[c]})"
        elif name == "pca":
            shares = ", ".join(f"{100 * share:.0f} %" for share in raw["model"]["explained"][:3])
            converged = "" if raw.get("converged") else "; the mean did NOT converge"
            yield f"components {shares} of the variance{converged}"
        elif name.startswith("groups"):
            floor = ", the smallest that is possible" if raw.get("pValueIsFloor") else ""
            names = " and ".join(str(label) for label in raw.get("groups") or [])
            yield f"groups     {names}: p = {raw['pValue']:.3g}{floor}; map: least p {raw['leastSignificance']:.3g}"
        elif name == "classify":
            for method, found in raw["methods"].items():
                low, high = found["confidenceInterval"]
                yield (
                    f"classify   {method}: {100 * found['accuracy']:.0f} % right ({100 * low:.0f} to {100 * high:.0f} %),"
                    f" against {100 * raw['majorityRate']:.0f} % for the larger label"
                )


def _study_jobs(client: Client, folder: str) -> dict[str, Optional[Job]]:
    path = Path(folder) / "study.json"
    try:
        state = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{folder} has no study: {path}: {getattr(error, 'strerror', None) or error}") from None
    if state.get("server") != client.http.server:
        raise InputError(f"The study in {folder} is at {state.get('server')}; give --server {state.get('server')}")
    found: dict[str, Optional[Job]] = {}
    for name, id in state.get("steps", {}).items():
        try:
            found[name] = client.job(id)
        except NotFound:
            found[name] = None
    for job in client.jobs(status="running") + client.jobs(status="accepted"):
        if job.id not in [known.id for known in found.values() if known]:
            found[f"{job.processID} {job.id}"] = job
    return found


# ---- the server and its jobs -----------------------------------------------------------------------


def _job_row(job: Job) -> list[Any]:
    part = f"{100 * job.part:.0f} %" if job.status == "running" else ""
    left = job.raw.get("estimatedSecondsLeft")
    wait = f"{left:.0f} s left" if isinstance(left, (int, float)) and not job.ended else ""
    why = (job.raw.get("exception") or {}).get("detail", "") if job.ended else wait
    return [job.id, job.raw.get("processID"), job.status, part, job.raw.get("created", "")[:19], why]


def status(client: Client, given: argparse.Namespace) -> int:
    """The server and its last jobs; one job; or the jobs of a study."""
    what = given.what
    if what and what.startswith("job-"):
        job = client.job(what)
        show(given, job.raw, columns([_job_row(job)]))
        return 1 if job.status in ("failed", "dismissed") else 0
    if what:
        found = _study_jobs(client, what)
        rows = [[name, *(_job_row(job) if job else ["", "", "deleted"])] for name, job in found.items()]
        width = max((len(row) for row in rows), default=0)
        records = {name: job.raw if job else None for name, job in found.items()}
        show(given, records, columns([[*row, *[""] * (width - len(row))] for row in rows]))
        return 0
    try:
        ready = client.get("/readyz")
    except Problem as problem:
        if problem.status != 503:
            raise
        ready = problem.document
    version = client.get("/v1/version")
    jobs = [Job(one, client) for one, _ in zip(client.pages("/v1/jobs", limit=10), range(10))]
    document = {"server": client.http.server, "ready": ready, "version": version, "jobs": [j.raw for j in jobs]}
    lines = [f"{client.http.server}: srnfd {version.get('version')}, {ready.get('status', 'not ready')}"]
    show(given, document, lines + columns([_job_row(job) for job in jobs]))
    return 0


def cancel(client: Client, given: argparse.Namespace) -> int:
    """Stops jobs, or all of a study that have not ended."""
    jobs = []
    for what in given.what:
        if what.startswith("job-"):
            jobs.append(client.job(what))
        else:
            jobs += [job for job in _study_jobs(client, what).values() if job]
    canceled = [job.cancel() for job in jobs if job.status not in ENDED]
    lines = columns([_job_row(job) for job in canceled]) or ["Nothing was running."]
    show(given, [job.raw for job in canceled], lines)
    return 0


def fetch(client: Client, given: argparse.Namespace) -> int:
    """Writes one thing into a file."""
    kind, end = next(((k, e) for start, k, e in _KINDS if given.id.startswith(start)), ("cohort", "zip"))
    if given.id.startswith("vol"):
        kind, end = "volume", "bin"
    found: Record = getattr(client, kind)(given.id)
    if kind == "mesh":
        end = given.format or str(found.raw.get("format", "bin"))
    to = Path(given.file or f"{given.id}.{given.format or end}")
    if kind == "surface":
        found.save(to, given.format, given.resolution, given.space)
    elif kind == "mesh":
        asked = given.format or (to.suffix[1:].lower() if given.file else "")
        found.save(to, None if asked in ("", found.raw.get("format")) else asked)
    elif kind == "job":
        found.check()
        found.save(to, given.format)
    elif kind in ("model", "cohort"):
        found.export(to)
    else:
        found.save(to)
    show(given, {"id": given.id, "file": str(to), "bytes": to.stat().st_size}, [str(to)])
    return 0


def upload(client: Client, given: argparse.Namespace) -> int:
    """Uploads meshes and prints an id for each, or why there is none."""
    found = client.upload_all(given.files)
    rows, documents, wrong = [], [], 0
    for file, one in zip(given.files, found):
        if isinstance(one, Problem):
            rows.append(["refused", file, f"{one.detail} ({one.code})"])
            documents.append({"file": file, "problem": one.document})
            wrong += 1
        else:
            rows.append([one.id, file, "" if one.analysable else "cannot be analysed: srnf run repair"])
            documents.append({"file": file, "mesh": one.raw})
    show(given, documents, columns(rows))
    return 3 if wrong else 0


# ---- processes -------------------------------------------------------------------------------------


def processes(client: Client, given: argparse.Namespace) -> int:
    """Lists processes, or the inputs of one."""
    if given.process is None:
        every = [client.describe(name) for name in client.processes()]
        show(given, every, columns([[one["id"], one.get("title", "")] for one in every]))
        return 0
    described = client.describe(given.process)
    lines = [str(described.get("description", "")), ""]
    for one in client.inputs(given.process).values():
        default = "required" if one.required else "" if one.default is None else f"= {json.dumps(one.default)}"
        lines += [f"  {one.name} ({one.takes()}) {default}".rstrip(), f"      {one.description}"]
    show(given, described, lines)
    return 0


def _value(client: Client, text: str) -> Any:
    if text.startswith("@"):
        return client.upload(text[1:]).id
    try:
        return json.loads(text)
    except ValueError:
        return text


def run(client: Client, given: argparse.Namespace) -> int:
    """Runs a process and prints its results."""
    inputs = {}
    for one in given.inputs:
        name, mark, text = one.partition("=")
        if not mark or not name:
            raise InputError(f"{one!r} is not NAME=VALUE")
        inputs[name] = _value(client, text)
    job = client.submit(given.process, inputs, wait=0 if given.detach else 2)
    given.after = f"{job.id} goes on at the server; srnf fetch {job.id} has its results, srnf cancel {job.id} stops it."
    if given.detach:
        show(given, job.raw, [job.id])
        return 0
    result = job.result()
    for warned in result.warnings:
        print(f"srnf: {warned}", file=sys.stderr)
    print(json.dumps(result.raw, indent=1))
    return 0


def completion(top: argparse.ArgumentParser, given: argparse.Namespace) -> int:
    """Prints a script for a shell."""
    print(script(given.shell, top))
    return 0


__all__ = ["SrnfError", "cancel", "completion", "fetch", "processes", "run", "status", "study", "upload"]
