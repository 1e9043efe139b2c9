"""The usual processes as methods. Each runs, waits and returns its ``Result``; all other options go by name.

``Client.inputs("register")`` has every option with its unit, limits and default. Where a surface is wanted a mesh will
do, which is then encoded with the default options.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Iterable, Mapping, Optional, Sequence, Union

from .documents import Result
from .records import Cohort, Mesh, Model, Surface, Volume

Shape = Union[Surface, Mesh, str]
Group = Union[Cohort, str, Sequence[Shape]]
Subject = Union[Shape, Mapping[str, Shape]]
Subjects = Union[Group, Shape, Mapping[str, Shape], Sequence[Mapping[str, Shape]]]


def _group(group: Group) -> dict[str, Any]:
    if isinstance(group, (Cohort, str)):
        return {"cohort": group}
    return {"surfaces": list(group)}


def _subject(subject: Subject) -> dict[str, Any]:
    if isinstance(subject, (Surface, Mesh, str)):
        return {"surface": subject}
    return {"parts": dict(subject)}


def _subjects(group: Subjects) -> dict[str, Any]:
    if isinstance(group, (Cohort, str)):
        return {"cohort": group}
    if isinstance(group, (Surface, Mesh)):  # records are mappings too
        return {"surfaces": [group]}
    if isinstance(group, Mapping):
        return {"parts": dict(group)}
    listed = list(group)
    if listed and isinstance(listed[0], Mapping) and not isinstance(listed[0], (Surface, Mesh)):
        return {"parts": listed}
    return {"surfaces": listed}


class Processes:
    """What ``Client`` has besides requests and records."""

    if TYPE_CHECKING:

        def run(self, process: str, inputs: Optional[Mapping[str, Any]] = None, **more: Any) -> Result:
            """``Client.run``."""

    def extract(self, volume: Union[Volume, str], labels: Iterable[int], **options: Any) -> Result:
        """The closed mesh of labels of a segmentation, in millimetres: ``mesh``, ``changed``, ``volumeChange``."""
        return self.run("extract", volume=volume, labels=list(labels), **options)

    def repair(self, mesh: Union[Mesh, str], **options: Any) -> Result:
        """The mesh mended as asked (``orient=True``, ``holes=12.0``, ..): ``mesh``, ``changes``, ``distance``."""
        return self.run("repair", mesh=mesh, **options)

    def encode(self, mesh: Union[Mesh, Cohort, str], **options: Any) -> Result:
        """The mesh as a surface of degree ``lmax`` (4..127): ``surface``, and ``fit`` in the units of the mesh.

        Of a ``Cohort`` of meshes: ``cohort``, that of their surfaces, and ``rows``, one for each member.
        """
        return self.run("encode", {"cohort" if isinstance(mesh, Cohort) else "mesh": mesh}, **options)

    def mirror(self, shape: Shape, **options: Any) -> Result:
        """The mirror image of a mesh or surface, in the plane x = 0 or another (``plane``): ``mesh``, ``surface``."""
        surface = isinstance(shape, Surface) or (isinstance(shape, str) and shape.startswith("surf-"))
        return self.run("mirror", {"surface" if surface else "mesh": shape}, **options)

    def register(self, template: Shape, moving: Shape, **options: Any) -> Result:
        """``moving`` laid on ``template``: ``surface``, ``distance``, ``rotation`` (3, 3), ``truncationError``.

        ``landmarks={"template": [..], "moving": [..]}``, vertices or positions, are met, or weighed (``"weight"``).
        """
        return self.run("register", template=template, moving=moving, **options)

    def distances(self, group: Group, **options: Any) -> Result:
        """Distances of all pairs: ``matrix`` of shape (n, n), and ``labels``. Unit-area surfaces are at most 2 apart."""
        return self.run("distances", **_group(group), **options)

    def neighbours(self, group: Group, k: Optional[int] = None, **options: Any) -> Result:
        """The nearest others of each member: ``indices`` and ``distances`` of shape (n, k), and ``pairs`` registered.

        Without ``k`` ten, or all others where there are fewer.
        """
        if k is not None:
            options["k"] = k
        return self.run("neighbours", **_group(group), **options)

    def geodesic(self, from_: Shape, to: Shape, **options: Any) -> Result:
        """The path between two: ``surfaces`` (``steps`` of them), ``times`` 0..1, ``distance``, ``length``."""
        return self.run("geodesic", {"from": from_, "to": to}, **options)

    def invert(self, surface: Shape, **options: Any) -> Result:
        """The surface that has the SRNF of a surface: ``surface``, ``relativeEnergy``, ``certificate``."""
        return self.run("invert", srnf={"surface": getattr(surface, "id", surface)}, **options)

    def mean(self, group: Group, **options: Any) -> Result:
        """The Karcher mean: ``surface``, ``converged``, ``relativeEnergy``."""
        return self.run("mean", **_group(group), **options)

    def pca(self, group: Group, **options: Any) -> Result:
        """Mean and principal components, kept as ``model``."""
        return self.run("pca", **_group(group), **options)

    def pca_parts(self, cohort: Union[Cohort, str], **options: Any) -> Result:
        """Joint components of several structures of each subject: ``model``, ``scores``, ``shares``, ``parts``, ``modes``.

        Members have a subject, and the name of their part as covariate ``part`` (``by``).
        """
        return self.run("pca-parts", cohort=cohort, **options)

    def classify_parts(self, cohort: Union[Cohort, str], **options: Any) -> Result:
        """Labels of subjects from all their structures together: ``methods``, and ``parts``, what each says alone.

        Members as of :meth:`pca_parts`, with a label; ``covariates`` and ``scale`` add numbers beside shape.
        """
        return self.run("classify-parts", cohort=cohort, **options)

    def modes(self, model: Union[Model, str], mode: int = 1, **options: Any) -> Result:
        """Surfaces along component ``mode`` (from 1), at ``coefficients`` in standard deviations."""
        return self.run("modes", model=model, mode=mode, **options)

    def sample(self, model: Union[Model, str], count: int, **options: Any) -> Result:
        """Random surfaces of the model: ``surfaces``, ``scores`` (count, components)."""
        return self.run("sample", model=model, count=count, **options)

    def project(self, model: Union[Model, str], surface: Subject, **options: Any) -> Result:
        """Scores of a surface in a model, and whether it belongs: ``scores``, ``residual``, ``typicality``.

        A model of several structures takes a surface for each by its name, and has ``parts`` in the result.
        """
        return self.run("project", {"model": model, **_subject(surface)}, **options)

    def score(self, model: Union[Model, str], surface: Subject, **options: Any) -> Result:
        """How odd a surface is beside a model's members: ``percentile``, ``pValue``, ``zMap`` (a surface with maps).

        A model of several structures takes a surface for each by its name, and each of ``parts`` has its ``zMap``.
        """
        return self.run("score", {"model": model, **_subject(surface)}, **options)

    def evaluate_model(self, model: Union[Model, str], **options: Any) -> Result:
        """``compactness``, ``generalisation`` and ``specificity`` over the number of components."""
        return self.run("evaluate-model", model=model, **options)

    def compare_groups(self, cohort: Union[Cohort, str], **options: Any) -> Result:
        """Whether the two labels differ, and where: ``pValue``, ``leastSignificance``, ``surface`` with maps."""
        return self.run("compare-groups", cohort=cohort, **options)

    def regress(self, cohort: Union[Cohort, str], formula: str, **options: Any) -> Result:
        """A linear model of shape, ``shape ~ age + sex``: ``terms``, ``coefficients``, ``predictions`` (``at=[..]``)."""
        return self.run("regress", cohort=cohort, formula=formula, **options)

    def change(self, cohort: Union[Cohort, str], **options: Any) -> Result:
        """What happens between two times, within subjects: ``pValue``, ``change``, ``perSubject``, ``surface`` with maps."""
        return self.run("change", cohort=cohort, **options)

    def asymmetry(self, cohort: Union[Cohort, str], **options: Any) -> Result:
        """How left and right differ: ``directional``, ``fluctuating``, ``pValue``, ``surface`` with maps."""
        return self.run("asymmetry", cohort=cohort, **options)

    def trajectories(self, cohort: Union[Cohort, str], formula: Optional[str] = None, **options: Any) -> Result:
        """How subjects change with time: ``slope``, ``perSubject``; by ``formula`` ``terms``; ``predictions`` (``at=[..]``)."""
        if formula is not None:
            options["formula"] = formula
        return self.run("trajectories", cohort=cohort, **options)

    def classify(self, cohort: Union[Cohort, str], **options: Any) -> Result:
        """Labels predicted, each subject left out in turn: ``methods`` with ``accuracy`` and its interval."""
        return self.run("classify", cohort=cohort, **options)

    def train(self, cohort: Union[Cohort, str], **options: Any) -> Result:
        """A classifier that is kept: ``model``, and ``validation``, nested, with intervals and a calibration table.

        ``scale="shape-and-size"`` and ``covariates=["age", ..]`` count beside shape.
        """
        return self.run("train", cohort=cohort, **options)

    def train_parts(self, cohort: Union[Cohort, str], **options: Any) -> Result:
        """A classifier of all structures of a subject together, kept as :meth:`train` keeps one: ``model``, ``parts``.

        Members as of :meth:`classify_parts`; ``weights={"left": 2}`` of the parts, by their names.
        """
        return self.run("train-parts", cohort=cohort, **options)

    def predict(self, model: Union[Model, str], group: Subjects, **options: Any) -> Result:
        """Labels of a surface, a list of them or a cohort by a classifier: ``predictions`` with ``probabilities`` and ``typicality``.

        ``covariates=[{"age": 63}, ..]``, one for each surface, where the classifier takes some; a cohort has its own.
        A classifier of several structures takes a surface for each by its name, a list of such subjects, or a cohort.
        """
        return self.run("predict", {"model": model, **_subjects(group)}, **options)

    def report(self, of: Union[Cohort, str, Sequence[str]], **options: Any) -> Result:
        """Jobs, by their ids, or all analyses of a cohort as one page that opens offline: ``html``, ``bytes``.

        A text is the name of a cohort, or the id of one job.
        """
        if isinstance(of, str) and of.startswith("job-"):
            of = [of]
        if isinstance(of, (Cohort, str)):
            return self.run("report", cohort=of, **options)
        return self.run("report", jobs=list(of), **options)

    def shoot(self, surface: Shape, velocity: Any, **options: Any) -> Result:
        """A geodesic followed from a surface; ``velocity`` a surface to go toward, or coefficients (3, n)."""
        return self.run("shoot", surface=surface, velocity=_vector(velocity), **options)

    def transport(self, from_: Shape, to: Shape, vector: Any, **options: Any) -> Result:
        """A vector carried from one surface to another: ``surface`` reached from there, ``norm``, ``residual``."""
        return self.run("transport", {"from": from_, "to": to, "vector": _vector(vector)}, **options)

    def transfer(self, source: Shape, deformed: Shape, target: Shape, **options: Any) -> Result:
        """The deformation of ``source`` into ``deformed``, applied to ``target``: ``surface``, ``sizeRatio``."""
        return self.run("transfer", source=source, deformed=deformed, target=target, **options)


def _vector(given: Any) -> Any:
    if isinstance(given, (Surface, Mesh, str)):
        return {"toward": getattr(given, "id", given)}
    if isinstance(given, Mapping):
        return given
    import numpy as np

    x, y, z = np.asarray(given, dtype=np.float64)
    lmax = int(round(np.sqrt(x.size))) - 1
    return {"coefficients": {"lmax": lmax, "x": x.tolist(), "y": y.tolist(), "z": z.tolist()}}
