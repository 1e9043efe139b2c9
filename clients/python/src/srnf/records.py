"""What the server keeps, as objects: meshes, volumes, surfaces, models, cohorts."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Mapping, Optional, Sequence, Union

import numpy as np

from .documents import Document, Floats, Rows, columns
from .errors import SrnfError
from .ply import Triangles, read_ply

if TYPE_CHECKING:
    from .client import Client

PathLike = Union[str, Path]


class Record(Document):
    """Something that has an id. A member that was not sent with a result is asked for when it is first used."""

    folder = ""

    def __init__(self, raw: Mapping[str, Any], client: "Optional[Client]") -> None:
        super().__init__(raw, client)
        self._whole = False

    @property
    def id(self) -> str:
        """Its id, which follows from its content."""
        return str(self.raw["id"])

    @property
    def path(self) -> str:
        """Where it is below the server's address."""
        return f"/v1/{self.folder}/{self.id}"

    @property
    def client(self) -> "Client":
        """The client that it came by."""
        if self._client is None:
            raise SrnfError(f"{self.id} came by no client")
        return self._client

    def refresh(self) -> None:
        """Asks the server for the record as it is now."""
        self.raw = dict(self.client.get(self.path))
        self._whole = True

    def __getattr__(self, name: str) -> Any:
        try:
            return super().__getattr__(name)
        except AttributeError:
            if name.startswith("_") or self._whole or self._client is None:
                raise
        self.refresh()
        return super().__getattr__(name)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Record) and other.id == self.id

    def __hash__(self) -> int:
        return hash(self.id)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.id!r}, name={self.raw.get('name', '')!r})"

    def rename(self, name: Optional[str] = None, tags: Optional[list[str]] = None) -> None:
        """Changes its name and its tags; what is not given stays."""
        change = {k: v for k, v in (("name", name), ("tags", tags)) if v is not None}
        self.raw = dict(self.client.send("PATCH", self.path, change))

    def delete(self, cascade: bool = False) -> None:
        """Deletes it; with ``cascade`` also what needs it. Without, ``Problem`` ``in-use`` says what does."""
        self.client.http.request("DELETE", self.path, query={"cascade": cascade or None})

    def _array(self, path: str, **query: Any) -> Floats:
        answer = self.client.http.request("GET", path, query={"format": "npy", **query})
        found: Floats = np.load(io.BytesIO(answer.body), allow_pickle=False)
        return found

    def _save(self, to: PathLike, path: str, **query: Any) -> Path:
        into = Path(to)
        self.client.http.request("GET", path, query=query, into=into)
        return into


class Mesh(Record):
    """A triangle mesh as it was uploaded. Lengths are in the units of its file, areas and volumes in their powers."""

    folder = "meshes"

    @property
    def analysable(self) -> bool:
        """Whether it is one closed surface without handles, which ``encode`` wants."""
        if "analysable" not in self.raw and "report" not in self.raw:
            self.refresh()
        return bool(self.raw.get("analysable", self.raw.get("report", {}).get("analysable")))

    @property
    def problems(self) -> list[Document]:
        """Why it is not analysable: rows of ``code``, ``count``, ``first``, ``detail``."""
        return list(self.report.get("problems") or [])

    def content(self, format: Optional[str] = None) -> bytes:
        """The uploaded bytes, or the prepared mesh in another format (ply, obj, stl, vtk, vtp, gii, glb)."""
        answer = self.client.http.request("GET", f"{self.path}/content", query={"format": format})
        return answer.body

    def save(self, to: PathLike, format: Optional[str] = None) -> Path:
        """Writes the content into a file."""
        return self._save(to, f"{self.path}/content", format=format)

    def triangles(self) -> Triangles:
        """The prepared mesh as arrays: repaired, in the units of its file."""
        return read_ply(self.content("ply"))


class Volume(Record):
    """A label volume as it was uploaded; ``labels`` are rows of ``value``, ``voxels`` and ``name``."""

    folder = "volumes"

    def save(self, to: PathLike) -> Path:
        """Writes the uploaded bytes into a file."""
        return self._save(to, f"{self.path}/content")


class Surface(Record):
    """A surface over the sphere, by harmonic coefficients up to degree ``lmax``.

    As it is stored it has area 1 (unless it was encoded with ``scale="none"``) and is centred; ``scale`` is what
    multiplies its lengths back to the units of the mesh.
    """

    folder = "surfaces"

    def coefficients(self) -> Floats:
        """Real harmonic coefficients, shape (3, (lmax + 1)^2): x, y and z, in the stored scale."""
        return self._array(f"{self.path}/coefficients")

    def grid(self, n_theta: Optional[int] = None, n_phi: Optional[int] = None) -> Floats:
        """Points on a grid of colatitudes and longitudes, shape (n_theta, n_phi, 3), in the stored scale."""
        return self._array(f"{self.path}/grid", nTheta=n_theta, nPhi=n_phi)

    def srnf(self, n_theta: Optional[int] = None, n_phi: Optional[int] = None) -> Floats:
        """The square-root normal field, shape (n_theta, n_phi, 3); its squared norm is the area."""
        return self._array(f"{self.path}/srnf", nTheta=n_theta, nPhi=n_phi)

    def triangles(self, resolution: int = 32, space: str = "normalized") -> Triangles:
        """Triangles with the maps that the surface carries. ``space="original"``: units and place of the input."""
        query: dict[str, Any] = {"format": "ply", "resolution": resolution, "space": space}
        return read_ply(self.client.http.request("GET", f"{self.path}/mesh", query=query).body)

    def save(
        self,
        to: PathLike,
        format: Optional[str] = None,
        resolution: Optional[int] = None,
        space: Optional[str] = None,
    ) -> Path:
        """Writes it as a mesh; the format follows from the name (.ply, .obj, .stl, .vtk, .vtp, .gii, .glb)."""
        kind = format or Path(to).suffix.lstrip(".").lower() or "ply"
        return self._save(to, f"{self.path}/mesh", format=kind, resolution=resolution, space=space)


@dataclass(frozen=True)
class Shape:
    """The surface at a point of a model.

    ``coefficients`` are harmonic ones, shape (3, (lmax + 1)^2), in the stored scale. ``relative_energy`` is the squared
    distance between its SRNF and the point over the squared norm of the point, ``offset`` the distance over that of
    the point from the mean: where it is a good part of 1, the shape asked for does not exist.
    """

    coefficients: Floats
    lmax: int
    relative_energy: float
    offset: float


def _listed(coefficients: Sequence[float]) -> str:
    return ",".join(repr(float(one)) for one in coefficients)


class Model(Record):
    """Principal components about a mean surface: ``mean``, ``eigenvalues``, ``explained``, ``cumulative``.

    One of several structures (``kind`` is parts) has ``parts``, each with its ``name``, ``weight`` and ``mean``.
    """

    folder = "models"

    def scores(self) -> Floats:
        """Of the members, shape (members, components); a component's variance is its eigenvalue."""
        return self._array(f"{self.path}/scores")

    def scores_table(self) -> dict[str, list[Any]]:
        """The scores as columns for pandas: ``label``, ``group``, ``component 1``, .."""
        document = self.client.get(f"{self.path}/scores")
        names = document["labels"]
        table: dict[str, list[Any]] = {"label": list(names)}
        table["group"] = list(document.get("groups") or [None] * len(names))
        for k, values in enumerate(zip(*document["scores"])):
            table[f"component {k + 1}"] = list(values)
        return table

    def modes(self, part: Optional[str] = None) -> Floats:
        """The components as fields on the grid, shape (components, n_theta, n_phi, 3), each of norm 1.

        Of a model of several structures what they have of ``part``: the weighted squares of all are 1 together.
        """
        return self._array(f"{self.path}/modes", part=part)

    def shape(self, coefficients: Sequence[float], part: Optional[str] = None) -> Shape:
        """The surface at a point of the model: one number for each of the first components, in standard deviations.

        Of a model of several structures that of ``part``. Computed while the request waits, and not kept;
        ``client.modes`` makes surfaces that are.
        """
        document = self.client.get(f"{self.path}/shape", coefficients=_listed(coefficients), part=part)
        surface = document["surface"]
        return Shape(
            np.array([surface[axis] for axis in "xyz"], dtype=np.float64),
            int(surface["lmax"]),
            float(document["relativeEnergy"]),
            float(document["offset"]),
        )

    def save_shape(
        self,
        to: PathLike,
        coefficients: Sequence[float],
        format: Optional[str] = None,
        resolution: Optional[int] = None,
        part: Optional[str] = None,
    ) -> Path:
        """Writes the surface at a point of the model as a mesh; the format follows from the name, as for a surface."""
        kind = format or Path(to).suffix.lstrip(".").lower() or "ply"
        query = {"coefficients": _listed(coefficients), "format": kind, "resolution": resolution, "part": part}
        return self._save(to, f"{self.path}/shape", **query)

    def export(self, to: PathLike) -> Path:
        """Writes the model, its members and the jobs that made them into one zip, which another server restores."""
        return self._save(to, f"{self.path}/export")


class Cohort(Record):
    """An ordered list of meshes and surfaces, by name. ``members`` are rows with ``id``, ``label``, ``subject``, .."""

    folder = "cohorts"

    @property
    def id(self) -> str:
        """Its name, which is the user's."""
        return str(self.raw["name"])

    @property
    def name(self) -> str:
        """The same."""
        return self.id

    def table(self) -> dict[str, list[Any]]:
        """All members as columns for pandas."""
        return columns(self.client.pages(f"{self.path}/members"))

    def set_members(self, csv: Union[str, bytes]) -> None:
        """Replaces the members by a CSV table."""
        body = csv.encode() if isinstance(csv, str) else csv
        answer = self.client.http.request(
            "PUT", f"{self.path}/members", body=body, headers={"Content-Type": "text/csv"}
        )
        self.raw = dict(answer.json())

    def change(self, etag: Optional[str] = None, **changes: Any) -> None:
        """Adds, removes, changes members, or renames: ``change=[{"id":..,"time":1}]``, ``add=[..]``, ``remove=[..]``.

        ``etag`` is what ``tag()`` gave: another's change in between is then refused with ``precondition-failed``.
        """
        headers = {"If-Match": etag} if etag else {}
        self.raw = dict(self.client.send("PATCH", self.path, changes, headers))

    def tag(self) -> str:
        """The ETag of the cohort as it is now."""
        return self.client.http.request("GET", self.path).headers.get("etag", "")

    def export(self, to: PathLike) -> Path:
        """Writes the study into one zip: members, what was made of them, jobs, RO-Crate metadata."""
        return self._save(to, f"{self.path}/export")

    def save_members(self, to: PathLike) -> Path:
        """Writes the members into a CSV table."""
        return self._save(to, f"{self.path}/members", format="csv")


_KINDS = {"mesh-": Mesh, "surf-": Surface, "model-": Model, "vol-": Volume, "volume-": Volume}


def record(value: Mapping[str, Any], client: "Optional[Client]") -> Optional[Record]:
    """The object for a JSON object that is a record; None for any other."""
    name = value.get("id")
    for prefix, kind in _KINDS.items():
        if isinstance(name, str) and name.startswith(prefix) and ("name" in value or "links" in value):
            return kind(value, client)
    return None


def rows(values: list[dict[str, Any]], client: "Optional[Client]") -> Rows:
    """JSON objects as rows."""
    return Rows(record(value, client) or Document(value, client) for value in values)
