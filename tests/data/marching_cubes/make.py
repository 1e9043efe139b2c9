#!/usr/bin/python3
"""Surfaces of 8-bit volumes as programs of marching cubes write them.

    make.py             the few that are kept here, which make check reads
    make.py FOLDER      all combinations of image, level and tool, for tests/bench/bench_marching_cubes.c

Needs python3-skimage and python3-vtk9 (Debian). The images are made here, from formulas, except for
caudate and thalamus, which are meshes of tests/data/aal_subcortex put back into voxels. Each PLY is what the tool
gave: vertices and faces are neither merged nor sorted. A level that some voxel has exactly is where
these programs put several vertices at one place: the crossings of all edges that meet in the voxel.
MANIFEST.tsv has for each file the image, the level, the tool, and the volume that the image's
formula gives at that level (0 where there is none).
"""

import os
import sys

import numpy as np
from skimage import measure
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkFiltersCore import (vtkFlyingEdges3D, vtkMarchingCubes, vtkPolyDataNormals,
                                       vtkSynchronizedTemplates3D)
from vtkmodules.vtkFiltersGeneral import vtkDiscreteFlyingEdges3D, vtkDiscreteMarchingCubes
from vtkmodules.vtkIOPLY import vtkPLYWriter

HERE = os.path.dirname(os.path.abspath(__file__))


def coordinates(shape):
    """Voxel centres about the middle of the image, which is a voxel."""
    axes = [np.arange(n, dtype=float) - n // 2 for n in shape]
    return np.meshgrid(*axes, indexing="ij")


def to_bytes(distance, slope):
    """128 on the surface, more inside: a blurred edge, in whole numbers."""
    return np.clip(np.rint(128.0 + slope * distance), 0, 255).astype(np.uint8)


def ball(radius=12.0, slope=16.0):
    x, y, z = coordinates((33, 33, 33))
    return to_bytes(radius - np.sqrt(x * x + y * y + z * z), slope)


def ellipsoid(a=15.0, b=9.0, c=7.0, slope=10.0):
    x, y, z = coordinates((47, 33, 27))
    level = np.sqrt((x / a) ** 2 + (y / b) ** 2 + (z / c) ** 2)
    return to_bytes((1.0 - level) * c, slope)


def bent(slope=12.0):
    """A tube around three quarters of a circle, round at its ends."""
    x, y, z = coordinates((41, 41, 19))
    radius, thick, half = 12.0, 5.0, 0.75 * np.pi
    angle = np.clip(np.arctan2(y, x), -half, half)
    d = np.sqrt((x - radius * np.cos(angle)) ** 2 + (y - radius * np.sin(angle)) ** 2 + z * z)
    return to_bytes(thick - d, slope)


def bumpy(slope=12.0):
    x, y, z = coordinates((37, 37, 37))
    r = np.sqrt(x * x + y * y + z * z) + 1e-12
    u, v, w = x / r, y / r, z / r
    return to_bytes(11.0 + 2.0 * (u * v + v * w - u * w) + 4.0 * u * v * w * w - r, slope)


def flat(slope=0.7):
    """So gentle a slope that the levels are shells of many voxels each."""
    x, y, z = coordinates((31, 31, 31))
    return to_bytes(9.0 - np.sqrt(x * x + 1.5 * y * y + 0.8 * z * z), slope)


def voxels_of(name):
    """The inside of a mesh of tests/data/aal_subcortex, as a label of 0 and 1 in 1 mm voxels."""
    from vtkmodules.vtkIOPLY import vtkPLYReader
    from vtkmodules.vtkImagingStencil import vtkImageStencil, vtkPolyDataToImageStencil
    reader = vtkPLYReader()
    reader.SetFileName(os.path.join(HERE, "..", "aal_subcortex", name))
    reader.Update()
    bounds = reader.GetOutput().GetBounds()
    low = [np.floor(bounds[2 * k]) - 3 for k in range(3)]
    shape = [int(np.ceil(bounds[2 * k + 1]) + 4 - low[k]) for k in range(3)]
    image = to_vtk(np.ones(shape, np.uint8))
    image.SetOrigin(*low)
    stencil = vtkPolyDataToImageStencil()
    stencil.SetInputConnection(reader.GetOutputPort())
    stencil.SetOutputOrigin(image.GetOrigin())
    stencil.SetOutputSpacing(image.GetSpacing())
    stencil.SetOutputWholeExtent(image.GetExtent())
    cut = vtkImageStencil()
    cut.SetInputData(image)
    cut.SetStencilConnection(stencil.GetOutputPort())
    cut.ReverseStencilOff()
    cut.SetBackgroundValue(0)
    cut.Update()
    values = vtk_to_numpy(cut.GetOutput().GetPointData().GetScalars())
    return values.reshape(shape, order="F")


def smoothed(label):
    """A label as it comes out of a blur that keeps 8 bits: 255 inside, binomial weights twice."""
    values = 255.0 * label
    for _ in range(2):
        for k in range(3):
            values = 0.25 * np.roll(values, 1, k) + 0.5 * values + 0.25 * np.roll(values, -1, k)
    return np.rint(values).astype(np.uint8)


def caudate():
    return smoothed(voxels_of("L_caudate.ply"))


def thalamus():
    return smoothed(voxels_of("R_thalamus.ply"))


def to_vtk(image):
    data = vtkImageData()
    data.SetDimensions(*image.shape)
    data.GetPointData().SetScalars(numpy_to_vtk(image.ravel(order="F"), deep=True))
    return data


def contour(filter_class):
    def run(image, level, path):
        tool = filter_class()
        tool.SetInputData(to_vtk(image))
        tool.SetValue(0, level)
        tool.Update()
        write_vtk(tool, path)
    return run


def split_normals(image, level, path):
    """VTK's normals filter, which gives both sides of a sharp edge vertices of their own."""
    tool = vtkMarchingCubes()
    tool.SetInputData(to_vtk(image))
    tool.SetValue(0, level)
    normals = vtkPolyDataNormals()
    normals.SetInputConnection(tool.GetOutputPort())
    normals.SetFeatureAngle(10.0)
    normals.Update()
    write_vtk(normals, path)


def write_vtk(tool, path):
    writer = vtkPLYWriter()
    writer.SetInputConnection(tool.GetOutputPort())
    writer.SetFileName(path)
    writer.SetFileTypeToBinary()
    writer.SetDataByteOrderToLittleEndian()
    writer.Write()


def skimage(method):
    def run(image, level, path):
        vertices, faces, _, _ = measure.marching_cubes(image, level, method=method)
        with open(path, "wb") as out:
            out.write(("ply\nformat binary_little_endian 1.0\nelement vertex %d\n"
                       "property float x\nproperty float y\nproperty float z\n"
                       "element face %d\nproperty list uchar int vertex_indices\nend_header\n"
                       % (len(vertices), len(faces))).encode())
            out.write(vertices.astype("<f4").tobytes())
            rows = np.empty(len(faces), dtype=[("n", "u1"), ("v", "<i4", 3)])
            rows["n"] = 3
            rows["v"] = faces
            out.write(rows.tobytes())
    return run


IMAGES = {"ball": ball, "ellipsoid": ellipsoid, "bent": bent, "bumpy": bumpy, "flat": flat, "caudate": caudate,
          "thalamus": thalamus}
# 128 and 160 are levels that voxels have, 127.5 and 100.25 are levels that none can have.
LEVELS = (128.0, 160.0, 127.5, 100.25)
FLAT_LEVELS = (128.0, 130.0, 127.5)
TOOLS = {"skimage-lewiner": skimage("lewiner"), "skimage-lorensen": skimage("lorensen"),
         "flying-edges": contour(vtkFlyingEdges3D), "vtk-marching-cubes": contour(vtkMarchingCubes),
         "synchronized-templates": contour(vtkSynchronizedTemplates3D),
         "vtk-normals": split_normals}
# Labels as they are: a level of 1/2, and the filters that make it themselves.
LABEL_TOOLS = {"discrete-flying-edges": contour(vtkDiscreteFlyingEdges3D),
               "discrete-marching-cubes": contour(vtkDiscreteMarchingCubes)}
# At the very value of the label, where skimage finds no surface: all vertices of a voxel in it.
EXACT_TOOLS = {name: TOOLS[name] for name in ("flying-edges", "vtk-marching-cubes", "vtk-normals")}


def truth(name, level):
    """Volume of the level set by its formula, where there is one."""
    shift = level - 128.0
    if name == "ball":
        return 4.0 / 3.0 * np.pi * (12.0 - shift / 16.0) ** 3
    if name == "ellipsoid":
        return 4.0 / 3.0 * np.pi * 15.0 * 9.0 * 7.0 * (1.0 - shift / 10.0 / 7.0) ** 3
    if name == "bent":
        r = 5.0 - shift / 12.0
        return np.pi * r * r * 1.5 * np.pi * 12.0 + 4.0 / 3.0 * np.pi * r ** 3
    return 0.0


def everything(folder):
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, "MANIFEST.tsv"), "w") as manifest:
        for name, make in IMAGES.items():
            image = make()
            for level in FLAT_LEVELS if name == "flat" else LEVELS:
                for tool, run in TOOLS.items():
                    file = "%s-%g-%s.ply" % (name, level, tool)
                    run(image, level, os.path.join(folder, file))
                    manifest.write("%s\t%s\t%g\t%s\t%.6f\n"
                                   % (file, name, level, tool, truth(name, level)))
        for name in ("L_caudate", "R_thalamus"):
            label = voxels_of(name + ".ply")
            for level, tools in ((1.0, LABEL_TOOLS), (0.5, TOOLS), (1.0, EXACT_TOOLS)):
                for tool, run in tools.items():
                    file = "%s-%g-%s.ply" % (name, level, tool)
                    run(label, level, os.path.join(folder, file))
                    manifest.write("%s\t%s\t%g\t%s\t0\n" % (file, name, level, tool))


# Kept here: image, level, tool.
KEPT = (("bent", 160.0, "skimage-lewiner"), ("bent", 160.0, "flying-edges"),
        ("ellipsoid", 160.0, "vtk-normals"), ("flat", 130.0, "flying-edges"),
        ("L_caudate", 1.0, "flying-edges"))


def kept():
    for name, level, tool in KEPT:
        image = IMAGES[name]() if name in IMAGES else voxels_of(name + ".ply")
        TOOLS[tool](image, level, os.path.join(HERE, "%s-%g-%s.ply" % (name, level, tool)))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        everything(sys.argv[1])
    else:
        kept()
