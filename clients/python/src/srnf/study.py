"""A study: a folder of meshes and a table, from upload to figures, tables and a report.

    study = srnf.Study.from_folder("hearts", labels="labels.csv", lmax=15)
    study.run()                     # everything below, as far as the members allow it
    study.report()

Each step is computed when it is first asked for, and what it needs before it. ``out`` (FOLDER-study) has the state by
which an interrupted study goes on, and all that is written.
"""

from __future__ import annotations

import itertools
import json
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Callable, Mapping, Optional, Sequence, Union

from .client import Client
from .documents import Result
from .errors import FilesRefused, InputError, JobFailed, NotFound, Problem
from .jobs import Job
from .labels import Member, own_table, read_members, stem
from .records import Cohort, Mesh, Model, PathLike, Surface
from .state import State, digest, file_digest

REGISTER = ("mean", "template", "none")
#: Pairs of members up to which distances that register every pair are part of ``run``.
MANY_PAIRS = 200
#: The steps of ``run``, in order.
STEPS = ("encode", "register", "distances", "pca", "modes", "groups", "classify")
#: Words of labels that name a side, which distances look for.
_SIDES = frozenset(
    side + more for more in ("", "h", "t", "hs", "hemi") for side in "lr"
) | {"left", "right", "sinister", "dexter"}


@dataclass(frozen=True)
class Options:
    """How a study is computed. What is None is left to the server's defaults.

    ``lmax``: harmonic degree, 4..127. ``register``: "mean" lays all on the mean in each statistic; "template" lays all
    on one member once, ``template`` (a file's name) or else the first, with ``degree``; "none" takes them as they are
    parameterized. ``common_pose``: the meshes share a pose, and nothing is rotated. ``mirror_right``: right sides are
    mirrored. ``skip_refused``: files that cannot be used are left out instead of ending the study. ``extract``: the
    files are label volumes (NIfTI, NRRD), and this label's value is the shape of each.
    """

    lmax: Optional[int] = None
    parameterization: Optional[str] = None
    register: str = "mean"
    template: Optional[str] = None
    degree: Optional[int] = None
    common_pose: bool = False
    mirror_right: bool = False
    skip_refused: bool = False
    extract: Optional[int] = None


@dataclass(frozen=True)
class Step:
    """How a step of ``run`` ended: ``status`` is done, left out or failed, ``detail`` a sentence."""

    name: str
    status: str
    detail: str


class Study:
    """Members, options, and results as they come. ``members`` are those in use, in the order of the table."""

    def __init__(
        self,
        members: Sequence[Member],
        out: PathLike,
        name: str,
        client: Optional[Client] = None,
        options: Options = Options(),
    ) -> None:
        if options.register not in REGISTER:
            raise InputError(f"register is one of {', '.join(REGISTER)}, not {options.register!r}")
        self.members, self.name, self.options = list(members), name, options
        self.out = Path(out)
        self.client = client or Client()
        self.state = State(self.out, self.client.http.server)
        self.refused: list[dict[str, str]] = []
        self.steps: list[Step] = []
        self.results: dict[str, Result] = {}
        self.encoded: list[Surface] = []
        self._surfaces: list[Surface] = []  # the same, or as they were registered to the template
        self._keys: dict[str, str] = {}  # of the results: what they were asked for by
        self._cohort: Optional[Cohort] = None
        if options.mirror_right:
            for member in self.members:
                member.mirror = member.mirror or member.side == "right"

    @classmethod
    def from_folder(
        cls,
        folder: PathLike,
        labels: Optional[PathLike] = None,
        *,
        label_column: Optional[str] = None,
        out: Optional[PathLike] = None,
        name: Optional[str] = None,
        client: Optional[Client] = None,
        **options: Any,
    ) -> "Study":
        """The study of the meshes below a folder; ``labels`` is their table (see ``srnf.labels``).

        Without one, a ``labels.csv`` or ``labels.tsv`` in the folder itself is the table.
        ``label_column`` is the column of the table that has the labels, where that is not ``label``. ``options`` are those of ``Options``.
        """
        unknown = sorted(set(options) - set(Options.__dataclass_fields__))
        if unknown:
            there = ", ".join(Options.__dataclass_fields__)
            raise InputError(f"a study has no option {unknown[0]!r}; it has: {there}")
        path = Path(folder)
        table = Path(labels) if labels is not None else own_table(path)
        members = read_members(path, table, label_column, options.get("extract") is not None)
        called = name or re.sub(r"[^A-Za-z0-9._-]+", "-", path.resolve().name)[:80] or "study"
        return cls(members, out or f"{path.resolve()}-study", called, client, Options(**options))

    def subset(self, name: str, chosen: Callable[[Member], bool]) -> "Study":
        """The study of some of the members, with its own results in a folder of ``out``; the surfaces are shared."""
        members = [replace(m, covariates=dict(m.covariates)) for m in self.members if chosen(m)]
        if not members:
            raise InputError(f"the subset {name!r} has no members")
        part = Study(members, self.out / name, f"{self.name}-{name}", self.client, self.options)
        for kind in ("meshes", "surfaces"):
            part.state.put(kind, self.state.data[kind])
        return part

    # ---- meshes and surfaces -------------------------------------------------------------------

    def upload(self) -> list[str]:
        """Uploads what the server does not have, and returns the ids of the meshes in the order of the members.

        Raises ``FilesRefused`` for files that are no meshes and meshes that cannot be analysed, all at once.
        """
        if self.members and all(member.mesh for member in self.members):
            return [member.mesh for member in self.members]
        label = "" if self.options.extract is None else f"-{self.options.extract}"
        digests = {member.path: file_digest(member.path) + label for member in self.members}
        for member in self.members:
            known = self.state.get("meshes", digests[member.path])
            member.mesh = known if known and self._there("meshes", known) else ""
        wanted = [member for member in self.members if not member.mesh]
        refusals: dict[Path, tuple[str, str]] = {}

        def keep(path: PathLike, got: Union[Mesh, Problem]) -> None:
            if isinstance(got, Problem):
                refusals[Path(path)] = (got.code, got.detail)
            elif not got.analysable:
                refusals[Path(path)] = _why(got)
            else:
                self.state.put("meshes", {digests[Path(path)]: got.id})

        if wanted and self.options.extract is not None:
            self._extract([member.path for member in wanted], self.options.extract, keep)
        elif wanted:
            self.client.upload_all([member.path for member in wanted], keep)
        for member in wanted:
            member.mesh = self.state.get("meshes", digests[member.path])
        self._refuse(refusals)
        return [member.mesh for member in self.members]

    def _extract(
        self, paths: Sequence[Path], label: int, keep: Callable[[PathLike, Union[Mesh, Problem]], None]
    ) -> None:
        """Uploads label volumes and makes a mesh of one label of each."""
        volumes: dict[Path, str] = {}
        for path in paths:
            try:
                volumes[path] = self.client.upload_volume(path).id
            except Problem as problem:
                if problem.status not in (413, 415, 422):
                    raise
                keep(path, problem)
        asked = [{"volume": volume, "labels": [label]} for volume in volumes.values()]
        for path, job in zip(volumes, self._jobs_of("extract", asked)):
            keep(path, job if isinstance(job, Problem) else job.result(progress=False).mesh)

    def _jobs_of(self, process: str, asked: Sequence[Mapping[str, Any]]) -> list[Union[Job, Problem]]:
        """The jobs when all have ended, each well, or the problem instead."""
        try:
            jobs: list[Union[Job, Problem]] = list(self.client.submit_all(process, asked))
        except Problem as problem:  # one is refused at once: which one?
            if problem.status != 422:
                raise
            jobs = []
            for inputs in asked:
                try:
                    jobs.append(self.client.submit(process, inputs).wait())
                except Problem as refused:
                    jobs.append(refused)
        for i, job in enumerate(jobs):
            try:
                if isinstance(job, Job):
                    job.check()
            except JobFailed as failed:
                jobs[i] = failed
        return jobs

    def encode(self) -> list[Surface]:
        """The members as surfaces, in order, made by one job."""
        if self.encoded:
            return self.encoded
        meshes = self.upload()
        asked: list[dict[str, Any]] = []
        for member, mesh in zip(self.members, meshes):
            given = {"mesh": mesh, "lmax": self.options.lmax, "parameterization": self.options.parameterization}
            asked.append({k: v for k, v in given.items() if v is not None})
            if member.mirror:
                asked[-1]["mirror"] = True
        made, failures = self._encode_all(asked)
        self._refuse({self.members[i].path: (p.code, p.detail) for i, p in failures.items()})
        self.encoded = [made[i] for i in sorted(made)]
        return self.encoded

    def register(self) -> list[Surface]:
        """The surfaces laid on the template; as they were encoded where no template registers them."""
        if self._surfaces:
            return self._surfaces
        surfaces = self.encode()
        if self.options.register != "template":
            self._surfaces = list(surfaces)
            return self._surfaces
        first = self._template()
        more: dict[str, Any] = {"degree": self.options.degree, "commonPose": self.options.common_pose or None}
        options = {k: v for k, v in more.items() if v is not None}
        moving = [i for i in range(len(surfaces)) if surfaces[i].id != surfaces[first].id]
        asked = [{"template": surfaces[first].id, "moving": surfaces[i].id, **options} for i in moving]
        made, failures = self._surfaces_of("register", asked)
        for number, problem in failures.items():
            name = self.members[moving[number]].path.name
            raise JobFailed("", {**problem.document, "detail": f"{name}: {problem.detail}"})
        self._surfaces = list(surfaces)
        for number, surface in made.items():
            self._surfaces[moving[number]] = surface
        return self._surfaces

    def cohort(self) -> Cohort:
        """The members as a cohort of the study's name, or with a few letters more where that is taken."""
        if self._cohort is None:
            self._cohort = self._cohort_of(self.name, range(len(self.register())))
            self.state.note(cohort=self._cohort.name, name=self.name)
        return self._cohort

    # ---- statistics ----------------------------------------------------------------------------

    def distances(self, **options: Any) -> Result:
        """Distances of all pairs; see ``Client.distances``. Those of other labels are theirs as well."""
        asked = {**self._how(pose=False), **options}
        cohort = self.cohort()
        subjects = [m.subject for m in self.members]
        sides = [m.label if _names_side(m.label or "") else None for m in self.members]
        key = digest(["distances", asked, [s.id for s in self._surfaces], subjects, sides])
        result = self._result("distances", "distances", {"cohort": cohort.name, **asked}, key)
        result.raw["groups"] = [m.label for m in self.members]
        self._write("distances", result)
        return result

    def mean(self, **options: Any) -> Result:
        """The mean; see ``Client.mean``. ``pca`` has it too, as ``model.mean``."""
        return self._compute("mean", "mean", {**self._how(), **options})

    def pca(self, **options: Any) -> Result:
        """Mean and principal components; see ``Client.pca``."""
        return self._compute("pca", "pca", {**self._how(), **options})

    def model(self) -> Model:
        """The model of ``pca``."""
        return self.pca().model

    def modes(self, mode: int = 1, coefficients: Sequence[float] = (-2, 0, 2)) -> Result:
        """Surfaces along a component, at coefficients in standard deviations."""
        inputs = {"model": self.model().id, "mode": mode, "coefficients": list(coefficients)}
        return self._result(f"mode-{mode}", "modes", inputs)

    def compare_groups(
        self, first: Optional[str] = None, second: Optional[str] = None, **options: Any
    ) -> Result:
        """Whether two labels differ; they need not be named where there are only two.

        A comparison of other options is a result of its own: groups, groups-2, ..
        """
        cohort, name = self.cohort(), "groups"
        if first is not None and second is not None and len(self.labels()) != 2:
            chosen = [i for i, m in enumerate(self.members) if m.label in (first, second)]
            name = f"groups-{_slug(first)}-{_slug(second)}"
            cohort = self._cohort_of(f"{self.name}-{_slug(first)}-{_slug(second)}"[:90], chosen)
        inputs = {"cohort": cohort.name, **self._how(), **options}
        key, number = self._key("compare-groups", inputs), 1
        called = name
        while self._keys.get(called, key) != key:
            number += 1
            called = f"{name}-{number}"
        return self._result(called, "compare-groups", inputs)

    def classify(self, method: Union[str, Sequence[str], None] = None, **options: Any) -> Result:
        """Labels predicted, each subject left out in turn; see ``Client.classify``."""
        if method is not None:
            options["method"] = method if isinstance(method, str) else list(method)
        if self.options.common_pose:
            options.setdefault("commonPose", True)
        return self._compute("classify", "classify", options)

    def project(self, mesh: PathLike, **encoding: Any) -> Result:
        """A new subject in the model: scores, residual, typicality, and warnings where it does not belong."""
        given = {"lmax": self.options.lmax, "parameterization": self.options.parameterization, **encoding}
        options = {k: v for k, v in given.items() if v is not None}
        surface = self.client.encode(self.client.upload(mesh), **options).surface
        return self._result(
            f"project-{_slug(stem(Path(mesh)))}", "project", {"model": self.model().id, "surface": surface.id}
        )

    def labels(self) -> list[str]:
        """The labels, each once, in order of their first member."""
        return list(dict.fromkeys(m.label for m in self.members if m.label is not None))

    def names(self) -> list[str]:
        """A name for each member: that of its file, with its folder where two files have the same."""
        names = [stem(member.path) for member in self.members]
        twice = {name for name in names if names.count(name) > 1}
        return [f"{m.path.parent.name}/{n}" if n in twice else n for m, n in zip(self.members, names)]

    # ---- all of it -----------------------------------------------------------------------------

    def run(
        self,
        steps: Sequence[str] = STEPS,
        permutations: Optional[int] = None,
        method: Union[str, Sequence[str], None] = None,
        covariates: Sequence[str] = (),
    ) -> list[Step]:
        """Computes the steps that the members allow, and says of each how it ended.

        What a study does not allow, such as a comparison where there is one label, is left out, with the reason.
        """
        groups: dict[str, Any] = {"permutations": permutations, "covariates": list(covariates) or None}
        asked = {k: v for k, v in groups.items() if v is not None}
        work: dict[str, Callable[[], object]] = {
            "encode": lambda: self.encode(),
            "register": lambda: self.register(),
            "distances": lambda: self.distances(),
            "pca": lambda: self.pca(),
            "modes": lambda: [self.modes(k + 1) for k in range(min(3, len(self.model().eigenvalues)))],
            "groups": lambda: [self.compare_groups(a, b, **asked) for a, b in self.pairs()],
            "classify": lambda: self.classify(method),
        }
        self.steps = []
        for name in STEPS:
            if name not in steps:
                continue
            reason = self._why_not(name, tuple(steps) != STEPS)
            if reason:
                self.steps.append(Step(name, "left out", reason))
                continue
            try:
                work[name]()
            except Problem as problem:
                if name in ("encode", "register") or problem.status not in (0, 422):
                    raise
                self.steps.append(Step(name, "failed", str(problem)))
            else:
                self.steps.append(Step(name, "done", ""))
        return self.steps

    def pairs(self) -> list[tuple[str, str]]:
        """The pairs of labels that are compared."""
        return list(itertools.combinations(self.labels(), 2))

    def _why_not(self, step: str, asked: bool = False) -> str:
        """Why a step is left out, or nothing; ``asked``: by its name."""
        count, labels = len(self.members), self.labels()
        if step == "register" and self.options.register != "template":
            return "each analysis registers what it needs; --register template lays all on one member first"
        if step in ("distances", "pca", "modes") and count < 2:
            return "there is one member only"
        pairs = count * (count - 1) // 2
        if step == "distances" and self.options.register == "mean" and pairs > MANY_PAIRS and not asked:
            return (
                f"{pairs} pairs would each be registered; register all to one template (--register template), or ask"
                " for it by name (--steps distances)"
            )
        if step in ("groups", "classify"):
            if any(member.label is None for member in self.members):
                return "some members have no label" if labels else "no member has a label" + self._offer()
            if len(labels) < 2:
                return f"all members have the label {labels[0]!r}"
            if step == "groups" and len(labels) > 4:
                return f"{len(labels)} labels make {len(self.pairs())} pairs; compare those that matter one by one"
        return ""

    def _offer(self) -> str:
        """The column that looks like that of the labels."""
        for name in dict.fromkeys(n for member in self.members for n in member.covariates):
            values = sorted({str(m.covariates[name]) for m in self.members if name in m.covariates})
            if name.lower() in ("group", "diagnosis", "class") and 1 < len(values) <= 10:
                return f"; {name} has {', '.join(values)}: it is the label with --label-column {name}"
        return ""

    def warnings(self) -> list[dict[str, str]]:
        """All reasons to doubt a number: ``where``, ``code`` and ``detail``."""
        found = []
        for member, surface in zip(self.members, self.encoded):
            for one in surface.raw.get("warnings") or []:
                found.append({"where": member.path.name, "code": one["code"], "detail": one["detail"]})
        for name, result in self.results.items():
            for warned in result.warnings:
                found.append({"where": name, "code": warned.raw["code"], "detail": warned.raw["detail"]})
        return found

    def tables(self) -> list[Path]:
        """Writes members, scores, distances, compactness, classification and warnings as CSV."""
        from .tables import write_tables

        return write_tables(self, self.out / "tables")

    def figures(self) -> list[Path]:
        """Writes figures as PNG; needs matplotlib."""
        from .figures import write_figures

        return write_figures(self, self.out / "figures")

    def report(self, to: Optional[PathLike] = None) -> Path:
        """Writes the report: one HTML file with figures and tables in it, which needs no network."""
        from .report import write_report

        return write_report(self, Path(to) if to is not None else self.out / "report.html")

    # ---- how --------------------------------------------------------------------------------------

    def _how(self, pose: bool = True) -> dict[str, Any]:
        if self.options.register != "mean":
            return {"register": False}
        return {"commonPose": True} if pose and self.options.common_pose else {}

    def _compute(self, name: str, process: str, options: Mapping[str, Any]) -> Result:
        return self._result(name, process, {"cohort": self.cohort().name, **options})

    def _key(self, process: str, inputs: Mapping[str, Any]) -> str:
        cohort = {"members": digest([s.id for s in self._surfaces])} if "cohort" in inputs else {}
        return digest([process, dict(inputs), cohort])

    def _result(self, name: str, process: str, inputs: Mapping[str, Any], key: str = "") -> Result:
        """The results of a job that was asked for before, in whichever run, or of a new one.

        ``key`` names all that they depend on, where that is not all inputs.
        """
        key = key or self._key(process, inputs)
        if self._keys.get(name) == key:
            return self.results[name]
        job = self._known_job(key) or self.client.submit(process, inputs)
        self.state.put("jobs", {key: job.id})
        self.state.note(steps={**self.state.data.get("steps", {}), name: job.id})
        result = job.result()
        self._write(name, result)
        self.results[name], self._keys[name] = result, key
        return result

    def _write(self, name: str, result: Result) -> None:
        folder = self.out / "results"
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.json").write_text(json.dumps(result.raw, indent=1), encoding="utf-8")

    def _known_job(self, key: str) -> Optional[Job]:
        known = self.state.get("jobs", key)
        try:
            job = self.client.job(known) if known else None
        except NotFound:
            return None
        return None if job is None or job.status in ("failed", "dismissed") else job

    def _known_surfaces(self, keys: Sequence[str]) -> dict[int, Surface]:
        found: dict[int, Surface] = {}
        for i, key in enumerate(keys):
            known = self.state.get("surfaces", key)
            there = self._there("surfaces", known) if known else None
            if there is not None:
                found[i] = Surface(there, self.client)
        return found

    def _encode_all(
        self, asked: Sequence[Mapping[str, Any]]
    ) -> tuple[dict[int, Surface], dict[int, Problem]]:
        """Surfaces of meshes: those that are not there yet by one job, of a cohort that goes away again."""
        keys = [digest(["encode", dict(one)]) for one in asked]
        made = self._known_surfaces(keys)
        left = [i for i in range(len(asked)) if i not in made]
        failures: dict[int, Problem] = {}
        if not left:
            return made, failures
        members = {keys[i]: {"id": asked[i]["mesh"], "mirror": asked[i].get("mirror", False)} for i in left}
        options = {k: v for k, v in asked[0].items() if k not in ("mesh", "mirror")}
        result = self._encoded_cohort(list(members.values()), options)
        for key, row in zip(members, result.raw["rows"]):
            for i in (i for i in left if keys[i] == key):
                if row.get("surface"):
                    made[i] = self.client.surface(row["surface"])
                else:
                    failures[i] = JobFailed(result.job, row.get("problem") or {})
        self.state.put("surfaces", {keys[i]: made[i].id for i in left if i in made})
        return made, failures

    def _encoded_cohort(self, members: Sequence[Mapping[str, Any]], options: Mapping[str, Any]) -> Result:
        key = digest(["encode", list(members), dict(options)])
        job = self._known_job(key)
        if job is not None:
            return job.result()
        name = f"{self.name[:70]}-meshes-{key}"
        try:
            cohort = self.client.cohort(name, members)
        except Problem as problem:
            if problem.code != "cohort-exists":
                raise
            cohort = self.client.cohort(name)  # of a run that was interrupted
        job = self.client.submit("encode", cohort=name, **options)
        self.state.put("jobs", {key: job.id})
        self.state.note(steps={**self.state.data.get("steps", {}), "encode": job.id})
        try:
            return job.result()
        finally:
            if job.ended:
                cohort.delete()

    def _surfaces_of(
        self, process: str, asked: Sequence[Mapping[str, Any]]
    ) -> tuple[dict[int, Surface], dict[int, Problem]]:
        keys = [digest([process, dict(one)]) for one in asked]
        made = self._known_surfaces(keys)
        left = [i for i in range(len(asked)) if i not in made]
        failures: dict[int, Problem] = {}
        if left:
            for i, job in zip(left, self.client.submit_all(process, [asked[i] for i in left])):
                try:
                    made[i] = job.result(progress=False).surface
                except JobFailed as failed:
                    failures[i] = failed
        self.state.put("surfaces", {keys[i]: made[i].id for i in left if i in made})
        return made, failures

    def _there(self, kind: str, id: str) -> Optional[dict[str, Any]]:
        try:
            found: dict[str, Any] = self.client.get(f"/v1/{kind}/{id}")
        except NotFound:
            return None
        return found

    def _template(self) -> int:
        name = self.options.template
        for i, member in enumerate(self.members):
            if name in (None, member.path.name, stem(member.path)):
                return i
        raise InputError(f"The template {name!r} is none of the members' files")

    def _cohort_of(self, name: str, chosen: Sequence[int]) -> Cohort:
        rows = [self.members[i].row(self._surfaces[i].id, True) for i in chosen]
        try:
            return self.client.cohort(name, rows)
        except Problem as problem:
            if problem.code != "cohort-exists":
                raise
        return self.client.cohort(f"{name}-{digest(rows)[:8]}", rows)

    def _refuse(self, refusals: Mapping[Path, tuple[str, str]]) -> None:
        if not refusals:
            return
        refused = [
            {"file": m.path.name, "code": refusals[m.path][0], "detail": refusals[m.path][1]}
            for m in self.members
            if m.path in refusals
        ]
        if not self.options.skip_refused:
            lines = "\n".join(f"  {one['file']}: {one['detail']} ({one['code']})" for one in refused)
            raise FilesRefused(
                f"{len(refused)} of {len(self.members)} files cannot be used:\n{lines}\n"
                "Mend them (see the process repair), or leave them out with skip_refused (--skip-refused).",
                refused,
            )
        self.refused += refused
        self.members = [m for m in self.members if m.path not in refusals]
        if not self.members:
            raise FilesRefused("None of the files can be used.", refused)


def _why(mesh: Mesh) -> tuple[str, str]:
    """The first problem of a mesh that cannot be analysed: its code, and what it says."""
    mesh.refresh()
    problems = mesh.raw.get("report", {}).get("problems") or []
    if not problems:
        return "not-analysable", "the mesh cannot be analysed"
    return str(problems[0].get("code")), str(problems[0].get("detail"))


def _names_side(label: str) -> bool:
    words = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", label)
    return any(word.lower() in _SIDES for word in words)


def _slug(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9._-]+", "-", text)[:40] or "x"


__all__ = ["Options", "STEPS", "Step", "Study"]
