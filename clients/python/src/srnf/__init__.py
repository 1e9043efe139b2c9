"""srnf - elastic shape analysis of closed surfaces, by a server that runs srnfd.

    import srnf

    client = srnf.Client()                                  # SRNF_SERVER, or http://127.0.0.1:8080
    mesh = client.upload("heart.ply")                       # any usual format
    surface = client.encode(mesh, lmax=31).surface          # harmonic coefficients, area 1
    print(surface.coefficients().shape)                     # (3, 1024)

    study = srnf.Study.from_folder("hearts", labels="labels.csv", client=client)
    print(study.pca().cumulative, study.compare_groups().p_value)
    study.report()                                          # hearts-study/report.html, figures, tables

Lengths and areas of meshes are in the units of their files. Surfaces are stored with area 1; ``surface.scale``
multiplies their lengths back. Distances between them are of SRNFs, whose squared norm is the area.
"""

from __future__ import annotations

import re
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from .client import Client
from .documents import Document, Result, Rows, columns
from .errors import (
    FilesRefused,
    InputError,
    JobFailed,
    NotAllowed,
    NotFound,
    Problem,
    QuotaExceeded,
    SrnfError,
    Unreachable,
)
from .jobs import Event, Job
from .labels import Member
from .ply import Triangles
from .records import Cohort, Mesh, Model, Shape, Surface, Volume
from .study import Study


def _version() -> str:
    """That of the installed package; in a clone, that of the header which alone has it."""
    try:
        return version("srnf")
    except PackageNotFoundError:
        pass
    try:
        header = Path(__file__).parents[4] / "include" / "srnf" / "base.h"
        found = re.search(r'#define SRNF_VERSION "(.*)"', header.read_text(encoding="ascii"))
    except (OSError, IndexError):
        found = None
    return found.group(1) if found else "0"


__version__ = _version()

__all__ = [
    "Client", "Cohort", "Document", "Event", "FilesRefused", "InputError", "Job", "JobFailed", "Member", "Mesh",
    "Model", "NotAllowed", "NotFound", "Problem", "QuotaExceeded", "Result", "Rows", "Shape", "SrnfError", "Study",
    "Surface", "Triangles", "Unreachable", "Volume", "columns",
]  # fmt: skip
