"""Reads the binary PLY files that the service writes: triangles, and values at the vertices."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .errors import SrnfError

_TYPES = {
    "char": "i1", "uchar": "u1", "short": "<i2", "ushort": "<u2", "int": "<i4", "uint": "<u4",
    "float": "<f4", "double": "<f8",
}  # fmt: skip


@dataclass
class Triangles:
    """A triangle mesh.

    ``vertices`` has shape (n, 3), in the units of what it was asked of; ``faces`` shape (m, 3), indices of vertices,
    counterclockwise from outside. ``fields`` are values at the vertices by name, each of shape (n,).
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    fields: dict[str, NDArray[np.float64]] = field(default_factory=dict)


def read_ply(content: bytes) -> Triangles:
    """Reads a little-endian binary PLY of triangles."""
    head, mark, body = content.partition(b"end_header\n")
    lines = head.decode("ascii", "replace").split("\n")
    if not mark or lines[:2] != ["ply", "format binary_little_endian 1.0"]:
        raise SrnfError("the server sent something else than a binary PLY file")
    counts: dict[str, int] = {}
    names: list[tuple[str, str]] = []
    listed = ("u1", "<i4")
    element = ""
    for line in lines:
        words = line.split()
        if words[:1] == ["element"]:
            element = words[1]
            counts[element] = int(words[2])
        elif words[:2] == ["property", "list"]:
            listed = (_TYPES[words[2]], _TYPES[words[3]])
        elif words[:1] == ["property"] and element == "vertex":
            names.append((words[2], _TYPES[words[1]]))
    points = np.frombuffer(body, dtype=np.dtype(names), count=counts["vertex"])
    triangle = np.dtype([("count", listed[0]), ("of", listed[1], (3,))])
    faces = np.frombuffer(body, triangle, counts.get("face", 0), points.nbytes)
    if np.any(faces["count"] != 3):
        raise SrnfError("the file has faces that are no triangles")
    place = ("x", "y", "z")
    rest = [n for n, _ in names if n not in (*place, "nx", "ny", "nz")]
    return Triangles(
        np.stack([points[n].astype(np.float64) for n in place], axis=1),
        faces["of"].astype(np.int64),
        {n: points[n].astype(np.float64) for n in rest},
    )
