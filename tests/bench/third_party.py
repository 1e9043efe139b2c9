#!/usr/bin/python3
"""Files of other people's programs, read by the service; and its own files, read by them.

    third_party.py FOLDER URL       makes the files in FOLDER, sends each to the service at URL, and prints a table

Needs, of Debian: python3-vtk9 python3-nibabel python3-skimage python3-meshio python3-stl python3-open3d
python3-gmsh assimp-utils admesh openctm-tools libgts-bin openscad pcl-tools connectome-workbench, meshlab with xvfb and
xauth; of npm, in FOLDER/node_modules: three
@gltf-transform/core. What is not there is left out and named. No part of make check: tests/data/third_party has a few of
the files.

The surface is a bent ellipsoid of 258 vertices and 512 triangles away from the origin, in millimetres. What the service
says of a file is compared with that: faces, area, volume, and where it is. A row ends in 'exactly', in the repairs that
the report names, in 'refused' with the reason, or in WRONG.
"""

import base64
import gzip
import json
import os
import struct
import subprocess
import sys
import urllib.error
import urllib.request
import zipfile

import numpy as np

FOLDER = os.path.abspath(sys.argv[1])
URL = sys.argv[2]
ROWS = []  # tool, file, precision, kind of surface
MISSING = []


def sphere(times):
    """Vertices and triangles of an octahedron cut `times` times, on the unit sphere."""
    v = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    f = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    v = [np.array(p, float) for p in v]
    for _ in range(times):
        middle, cut = {}, []
        for a, b, c in f:
            m = []
            for p, q in ((a, b), (b, c), (c, a)):
                key = (min(p, q), max(p, q))
                if key not in middle:
                    x = v[p] + v[q]
                    middle[key] = len(v)
                    v.append(x / np.linalg.norm(x))
                m.append(middle[key])
            cut += [(a, m[0], m[2]), (b, m[1], m[0]), (c, m[2], m[1]), (m[0], m[1], m[2])]
        f = cut
    return np.array(v), np.array(f, np.int64)


def bent():
    v, f = sphere(3)
    x = v * (30.0, 18.0, 12.0)
    x[:, 2] += 0.005 * x[:, 0] ** 2 + 0.1 * x[:, 1]
    # Exact in single precision and in five decimals.
    return np.round((x + (10.5, -20.25, 35.0)) * 64) / 64, f


V, F = bent()


def measures(v, f):
    a, b, c = v[f[:, 0]], v[f[:, 1]], v[f[:, 2]]
    return (np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2,
            abs(np.einsum("ij,ij->i", a - v.mean(0), np.cross(b - v.mean(0), c - v.mean(0))).sum() / 6))


AREA, VOLUME = measures(V, F)


def path(name):
    return os.path.join(FOLDER, name)


def row(tool, name, precision=1e-6, turned=False):
    if os.path.exists(path(name)):
        ROWS.append((tool, name, precision, turned))


def attempt(name):
    """A maker of files; one that cannot run is named."""
    def run(function):
        try:
            function()
        except (Exception, SystemExit) as problem:  # whatever is missing or fails here is another's
            MISSING.append(f"{name}: {str(problem).splitlines()[0][:100] if str(problem) else type(problem).__name__}")
    return run


def command(*words):
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=120, cwd=FOLDER)


def base():
    """The surface as an OBJ and an STL of our own, which command-line tools read."""
    with open(path("base.obj"), "w") as out:
        for p in V:
            out.write("v %.6f %.6f %.6f\n" % tuple(p))
        for t in F + 1:
            out.write("f %d %d %d\n" % tuple(t))
    with open(path("base.stl"), "wb") as out:
        out.write(b"base".ljust(80) + struct.pack("<I", len(F)))
        for t in F:
            out.write(struct.pack("<12fH", 0, 0, 0, *V[t].ravel(), 0))


def with_vtk():
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    points, cells, poly = vtk.vtkPoints(), vtk.vtkCellArray(), vtk.vtkPolyData()
    points.SetData(numpy_to_vtk(V.astype(np.float64), deep=True))
    cells.SetCells(len(F), numpy_to_vtkIdTypeArray(np.insert(F, 0, 3, axis=1).ravel().astype(np.int64), deep=True))
    poly.SetPoints(points)
    poly.SetPolys(cells)
    scalars = numpy_to_vtk(V[:, 2].copy(), deep=True)
    scalars.SetName("height")
    poly.GetPointData().SetScalars(scalars)
    names = vtk.vtkStringArray()
    names.SetName("who made it")
    names.InsertNextValue("somebody")
    names.InsertNextValue("else")
    poly.GetFieldData().AddArray(names)
    bits = vtk.vtkBitArray()
    bits.SetName("bits")
    for i in range(11):
        bits.InsertNextValue(i % 2)
    poly.GetFieldData().AddArray(bits)
    for order in ("Little", "Big"):
        for header in (32, 64):
            for mode, set_mode in (("ascii", "SetDataModeToAscii"), ("binary", "SetDataModeToBinary"),
                                   ("appended", "SetDataModeToAppended"), ("raw", "SetDataModeToAppended")):
                for packed in (False, True):
                    if (mode == "ascii" and (packed or order == "Big" or header == 32)):
                        continue
                    if order == "Big" and header == 32:
                        continue
                    writer = vtk.vtkXMLPolyDataWriter()
                    name = f"vtk_{mode}_{order.lower()}{header}{'_zlib' if packed else ''}.vtp"
                    writer.SetFileName(path(name))
                    writer.SetInputData(poly)
                    getattr(writer, set_mode)()
                    writer.SetEncodeAppendedData(mode == "appended")
                    if packed:
                        writer.SetCompressorTypeToZLib()
                    else:
                        writer.SetCompressorTypeToNone()
                    getattr(writer, f"SetByteOrderTo{order}Endian")()
                    getattr(writer, f"SetHeaderTypeToUInt{header}")()
                    writer.Write()
                    row("VTK", name)
    writer = vtk.vtkXMLPolyDataWriter()
    writer.SetFileName(path("vtk_lz4.vtp"))
    writer.SetInputData(poly)
    writer.SetCompressorTypeToLZ4()
    writer.Write()
    row("VTK", "vtk_lz4.vtp")
    strips = vtk.vtkStripper()
    strips.SetInputData(poly)
    strips.Update()
    for what, data in (("", poly), ("_strips", strips.GetOutput())):
        for mode in ("ASCII", "Binary"):
            for version in (42, 51):
                writer = vtk.vtkPolyDataWriter()
                name = f"vtk{what}_{mode.lower()}_{version}.vtk"
                writer.SetFileName(path(name))
                writer.SetInputData(data)
                getattr(writer, f"SetFileTypeTo{mode}")()
                writer.SetFileVersion(version)
                writer.Write()
                row("VTK", name)
    writer = vtk.vtkXMLPolyDataWriter()
    writer.SetFileName(path("vtk_strips.vtp"))
    writer.SetInputData(strips.GetOutput())
    writer.Write()
    row("VTK", "vtk_strips.vtp")
    grid = vtk.vtkAppendFilter()
    grid.AddInputData(poly)
    grid.Update()
    for mode in ("ASCII", "Binary"):
        writer = vtk.vtkUnstructuredGridWriter()
        writer.SetFileName(path(f"vtk_grid_{mode.lower()}.vtk"))
        writer.SetInputData(grid.GetOutput())
        getattr(writer, f"SetFileTypeTo{mode}")()
        writer.Write()
        row("VTK", f"vtk_grid_{mode.lower()}.vtk")
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetFileName(path("vtk_grid.vtu"))
    writer.SetInputData(grid.GetOutput())
    writer.Write()
    row("VTK", "vtk_grid.vtu")
    for kind, ending in (("PLYWriter", "ply"), ("STLWriter", "stl"), ("BYUWriter", "byu"), ("OBJWriter", "obj")):
        for mode in ("ASCII", "Binary"):
            writer = getattr(vtk, "vtk" + kind)()
            if not hasattr(writer, "SetFileTypeTo" + mode) and mode == "Binary":
                continue
            name = f"vtk_{mode.lower()}.{ending}"
            if ending == "byu":
                writer.SetGeometryFileName(path(name))
            else:
                writer.SetFileName(path(name))
            if hasattr(writer, "SetFileTypeTo" + mode):
                getattr(writer, "SetFileTypeTo" + mode)()
            writer.SetInputData(poly)
            writer.Write()
            row("VTK", name, 2e-5)
    writer = vtk.vtkMNIObjectWriter()
    for mode in ("ASCII", "Binary"):
        normals = vtk.vtkPolyDataNormals()
        normals.SetInputData(poly)
        normals.SplittingOff()
        normals.ConsistencyOff()
        normals.Update()
        writer.SetInputData(normals.GetOutput())
        writer.SetFileName(path(f"vtk_mni_{mode.lower()}.obj"))
        getattr(writer, f"SetFileTypeTo{mode}")()
        writer.Write()
        row("VTK", f"vtk_mni_{mode.lower()}.obj", 2e-5)
    writer = vtk.vtkIVWriter()
    writer.SetInputData(poly)
    writer.SetFileName(path("vtk.iv"))
    writer.Write()
    row("VTK", "vtk.iv")


def with_nibabel():
    import nibabel
    from nibabel.gifti import GiftiDataArray, GiftiImage
    for encoding in ("ASCII", "B64BIN", "B64GZ"):
        image = GiftiImage(darrays=[
            GiftiDataArray(V.astype(np.float32), "NIFTI_INTENT_POINTSET", encoding="GIFTI_ENCODING_" + encoding),
            GiftiDataArray(F.astype(np.int32), "NIFTI_INTENT_TRIANGLE", encoding="GIFTI_ENCODING_" + encoding)])
        nibabel.save(image, path(f"nibabel_{encoding.lower()}.surf.gii"))
        row("nibabel", f"nibabel_{encoding.lower()}.surf.gii")
    with open(path("nibabel_b64gz.surf.gii"), "rb") as plain, gzip.open(path("nibabel.surf.gii.gz"), "wb") as out:
        out.write(plain.read())
    row("nibabel, gzip", "nibabel.surf.gii.gz")
    nibabel.freesurfer.io.write_geometry(path("lh.nibabel"), V, F)
    row("nibabel", "lh.nibabel")
    nibabel.freesurfer.io.write_morph_data(path("lh.curv"), V[:, 2])
    row("nibabel", "lh.curv")
    nibabel.save(nibabel.Nifti1Image(np.zeros((4, 4, 4), np.uint8), np.eye(4)), path("volume.nii"))
    nibabel.save(nibabel.Nifti1Image(np.zeros((4, 4, 4), np.uint8), np.eye(4)), path("volume.nii.gz"))
    row("nibabel", "volume.nii")
    row("nibabel", "volume.nii.gz")


def with_workbench():
    if not os.path.exists(path("nibabel_b64gz.surf.gii")):
        with_nibabel()
    command("wb_command", "-set-structure", "nibabel_b64gz.surf.gii", "CORTEX_LEFT")
    for encoding in ("ASCII", "BASE64_BINARY", "GZIP_BASE64_BINARY", "EXTERNAL_FILE_BINARY"):
        name = f"workbench_{encoding.lower()}.surf.gii"
        command("wb_command", "-gifti-convert", encoding, "nibabel_b64gz.surf.gii", name)
        row("Workbench", name)
    with open(path("identity.txt"), "w") as out:
        out.write("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
    command("wb_command", "-surface-apply-affine", "nibabel_b64gz.surf.gii", "identity.txt", "workbench_affine.surf.gii")
    row("Workbench", "workbench_affine.surf.gii")
    command("wb_command", "-surface-vertex-areas", "nibabel_b64gz.surf.gii", "workbench_areas.shape.gii")
    row("Workbench", "workbench_areas.shape.gii")


def with_meshlab():
    for kind in ("ply", "stl", "off", "obj", "wrl", "dae", "json", "x3d"):
        command("xvfb-run", "-a", "meshlabserver", "-i", "base.stl", "-o", "meshlab." + kind)
        row("MeshLab", "meshlab." + kind, 2e-5)


def with_meshio():
    import meshio
    mesh = meshio.Mesh(V, [("triangle", F)])
    for name, options in (("meshio_ascii.ply", dict(binary=False)), ("meshio_binary.ply", dict(binary=True)),
                          ("meshio_ascii.stl", dict(binary=False)), ("meshio_binary.stl", dict(binary=True)),
                          ("meshio.obj", {}), ("meshio.off", {}),
                          ("meshio_22a.msh", dict(file_format="gmsh22", binary=False)),
                          ("meshio_22b.msh", dict(file_format="gmsh22", binary=True)),
                          ("meshio_41a.msh", dict(file_format="gmsh", binary=False)),
                          ("meshio_41b.msh", dict(file_format="gmsh", binary=True)),
                          ("meshio_51a.vtk", dict(file_format="vtk", binary=False)),
                          ("meshio_51b.vtk", dict(file_format="vtk", binary=True)),
                          ("meshio_42b.vtk", dict(file_format="vtk42", binary=True)),
                          ("meshio.vtu", {}), ("meshio.mesh", dict(file_format="medit")), ("meshio.inp", {})):
        try:
            meshio.write(path(name), mesh, **options)
        except (Exception, SystemExit) as problem:
            MISSING.append(f"meshio {name}: {str(problem)[:80]}")
        row("meshio", name)


def with_open3d():
    import open3d
    mesh = open3d.geometry.TriangleMesh(open3d.utility.Vector3dVector(V), open3d.utility.Vector3iVector(F))
    mesh.compute_vertex_normals()
    for name, ascii_too in (("open3d.ply", True), ("open3d.stl", False), ("open3d.obj", False), ("open3d.off", False),
                            ("open3d.gltf", False), ("open3d.glb", False)):
        open3d.io.write_triangle_mesh(path(name), mesh)
        row("Open3D", name, 2e-5)
        if ascii_too:
            open3d.io.write_triangle_mesh(path("ascii_" + name), mesh, write_ascii=True)
            row("Open3D", "ascii_" + name, 2e-5)


def with_numpy_stl():
    from stl import mesh, Mode
    data = np.zeros(len(F), dtype=mesh.Mesh.dtype)
    data["vectors"] = V[F]
    for name, mode in (("numpy-stl_ascii.stl", Mode.ASCII), ("numpy-stl_binary.stl", Mode.BINARY)):
        mesh.Mesh(data.copy()).save(path(name), mode=mode)
        row("numpy-stl", name)


def with_gmsh():
    import gmsh
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.merge(path("base.stl"))
    for version in (1, 2.2, 4.0, 4.1):
        for binary in (0, 1):
            name = f"gmsh_{version}_{binary}.msh"
            gmsh.option.setNumber("Mesh.MshFileVersion", version)
            gmsh.option.setNumber("Mesh.Binary", binary)
            if version == 4.0 and binary:
                continue  # which Gmsh does not write
            gmsh.write(path(name))
            row("Gmsh", name)
    for name in ("gmsh.stl", "gmsh.ply2", "gmsh.vtk", "gmsh.off", "gmsh.unv"):
        gmsh.write(path(name))
        row("Gmsh", name)
    gmsh.finalize()


def with_assimp():
    for kind in ("obj", "stl", "stlb", "ply", "plyb", "gltf2", "glb2", "collada", "x3d", "fbx", "3mf", "stp", "3ds"):
        name = f"assimp_{kind}." + {"stlb": "stl", "plyb": "ply", "gltf2": "gltf", "glb2": "glb", "collada": "dae"}.get(
            kind, kind)
        command("assimp", "export", "base.obj", name, "-f" + kind)
        row("assimp", name, 2e-5)


def with_admesh():
    for option, name in (("-a", "admesh_ascii.stl"), ("-b", "admesh_binary.stl")):
        command("admesh", "-c", option + name, "base.stl")
        row("ADMesh", name, 2e-5)


def with_openctm():
    for name in ("openctm.ply", "openctm.stl", "openctm.obj", "openctm.off", "openctm.wrl", "openctm.dae", "openctm.ctm"):
        command("ctmconv", "base.obj", name)
        row("OpenCTM", name, 2e-5)


def with_openscad():
    with open(path("import.scad"), "w") as out:
        out.write('import("base.stl");')
    for name in ("openscad.stl", "openscad.off", "openscad.3mf", "openscad.amf"):
        command("openscad", "-o", name, "import.scad")
        row("OpenSCAD", name, 2e-5)


def with_gts():
    with open(path("base_ascii.stl"), "w") as out:
        out.write("solid\n")
        for t in F:
            out.write("facet normal 0 0 0\nouter loop\n" + "".join("vertex %r %r %r\n" % tuple(map(float, V[i])) for i in t) +
                      "endloop\nendfacet\n")
        out.write("endsolid\n")
    with open(path("base_ascii.stl")) as source, open(path("gts.gts"), "w") as out:
        subprocess.run(["stl2gts"], stdin=source, stdout=out, check=True, timeout=60)
    with open(path("gts.gts")) as source, open(path("gts.stl"), "w") as out:
        subprocess.run(["gts2stl"], stdin=source, stdout=out, check=True, timeout=60)
    row("GTS", "gts.gts")
    row("GTS", "gts.stl", 2e-5)


def with_pcl():
    command("pcl_obj2ply", "base.obj", "pcl.ply")
    command("pcl_obj2vtk", "base.obj", "pcl.vtk")
    row("PCL", "pcl.ply", 2e-5)
    row("PCL", "pcl.vtk", 2e-5)


JS = r"""
import { readFileSync, writeFileSync } from 'fs';
globalThis.FileReader = class {
    readAsArrayBuffer(blob) { blob.arrayBuffer().then(b => { this.result = b; this.onloadend(); }); }
    readAsDataURL(blob) { blob.arrayBuffer().then(b => {
        this.result = 'data:' + blob.type + ';base64,' + Buffer.from(b).toString('base64'); this.onloadend(); }); }
};
globalThis.requestAnimationFrame = f => f();
const THREE = await import('three');
const get = async n => (await import('three/examples/jsm/exporters/' + n + '.js'))[n];
const { v, f } = JSON.parse(readFileSync('base.json'));
const g = new THREE.BufferGeometry();
g.setAttribute('position', new THREE.BufferAttribute(new Float32Array(v), 3));
g.setIndex(f); g.computeVertexNormals();
const mesh = new THREE.Mesh(g, new THREE.MeshStandardMaterial());
// A scene whose transforms cancel each other, and one that mirrors.
const scene = new THREE.Scene(), outer = new THREE.Group();
outer.position.set(5, 6, 7); outer.rotation.set(0.1, 0.2, 0.3); outer.scale.set(2, 2, -2); outer.updateMatrix();
mesh.applyMatrix4(outer.matrix.clone().invert()); outer.add(mesh); scene.add(outer); scene.updateMatrixWorld(true);
const plain = new THREE.Mesh(g, mesh.material);
writeFileSync('three_binary.stl', Buffer.from(new (await get('STLExporter'))().parse(plain, { binary: true }).buffer));
writeFileSync('three_ascii.stl', new (await get('STLExporter'))().parse(plain));
writeFileSync('three.obj', new (await get('OBJExporter'))().parse(plain));
const PLY = await get('PLYExporter');
writeFileSync('three_ascii.ply', new PLY().parse(plain, () => {}, {}));
writeFileSync('three_binary.ply', Buffer.from(new PLY().parse(plain, () => {}, { binary: true, littleEndian: true })));
const GLTF = await get('GLTFExporter');
writeFileSync('three.gltf', JSON.stringify(await new GLTF().parseAsync(plain)));
writeFileSync('three_nodes.gltf', JSON.stringify(await new GLTF().parseAsync(scene)));
writeFileSync('three.glb', Buffer.from(await new GLTF().parseAsync(plain, { binary: true })));
writeFileSync('three_nodes.glb', Buffer.from(await new GLTF().parseAsync(scene, { binary: true })));
const U = await get('USDZExporter');
try { writeFileSync('three.usdz', Buffer.from(await new U().parseAsync(plain))); } catch (e) { console.error(e.message); }
const { Document, NodeIO } = await import('@gltf-transform/core');
const doc = new Document(), buffer = doc.createBuffer();
const position = doc.createAccessor().setType('VEC3').setArray(new Float32Array(v)).setBuffer(buffer);
const index = doc.createAccessor().setType('SCALAR').setArray(new Uint16Array(f)).setBuffer(buffer);
const prim = doc.createPrimitive().setAttribute('POSITION', position).setIndices(index);
doc.createScene().addChild(doc.createNode().setMesh(doc.createMesh().addPrimitive(prim)));
writeFileSync('gltf-transform.glb', await new NodeIO().writeBinary(doc));
await new NodeIO().write('gltf-transform.gltf', doc);
"""


def with_npm():
    with open(path("base.json"), "w") as out:
        json.dump({"v": V.ravel().tolist(), "f": F.ravel().tolist()}, out)
    with open(path("make.mjs"), "w") as out:
        out.write(JS)
    done = subprocess.run(["node", "make.mjs"], cwd=FOLDER, timeout=120, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if done.returncode:
        MISSING.append("npm: " + done.stdout.decode()[-200:].replace("\n", " "))
    for name in ("three_binary.stl", "three_ascii.stl", "three.obj", "three_ascii.ply", "three_binary.ply", "three.gltf",
                 "three_nodes.gltf", "three.glb", "three_nodes.glb", "three.usdz"):
        row("three.js", name, 2e-5)
    for name in ("gltf-transform.glb", "gltf-transform.gltf"):
        row("gltf-transform", name)


def by_hand():
    """What no program at hand writes, and what programs break."""
    with open(path("base.stl"), "rb") as source:
        stl = source.read()
    broken = {"count_zero.stl": stl[:80] + struct.pack("<I", 0) + stl[84:],
              "count_more.stl": stl[:80] + struct.pack("<I", len(F) + 7) + stl[84:],
              "trailing.stl": stl + b"written by a program that adds a line\n",
              "cut.stl": stl[:-7],
              "twice.ply.gz.gz": gzip.compress(gzip.compress(b"ply")),
              "cut.stl.gz": gzip.compress(stl)[:-50],
              "packed.stl.gz": gzip.compress(stl)}
    broken["header.mz3"] = struct.pack("<HHIII", 0x5A4D, 3, len(F), len(V), 0) + F.astype("<i4").tobytes() + V.astype(
        "<f4").tobytes()
    broken["header.mz3.gz"] = gzip.compress(broken["header.mz3"])
    for name, data in broken.items():
        with open(path(name), "wb") as out:
            out.write(data)
        row("by hand", name)
    with zipfile.ZipFile(path("meshes.zip"), "w") as archive:
        archive.write(path("base.obj"), "base.obj")
    row("Python zipfile", "meshes.zip")
    subprocess.run(["tar", "cf", path("meshes.tar"), "-C", FOLDER, "base.obj"], check=True)
    row("GNU tar", "meshes.tar")


def send(data):
    request = urllib.request.Request(URL + "/v1/meshes", data=data, method="POST",
                                     headers={"Content-Type": "application/octet-stream"})
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status, json.load(answer)
    except urllib.error.HTTPError as problem:
        return problem.code, json.load(problem)


def points_of(mesh):
    """The mesh as the service hands it on, in OBJ."""
    with urllib.request.urlopen(f"{URL}/v1/meshes/{mesh}/content?format=obj", timeout=60) as answer:
        lines = answer.read().decode().splitlines()
    return np.array([[float(x) for x in line.split()[1:]] for line in lines if line.startswith("v ")])


def verdict(name, precision):
    """A sentence, and whether it is one of the three that may be."""
    with open(path(name), "rb") as source:
        status, answer = send(source.read())
    if status >= 300:
        return "refused: " + answer.get("detail", "?"), status == 422
    report = answer["report"]
    points = points_of(answer["id"])
    wrong = []
    if answer["faces"] != len(F):
        wrong.append(f"{answer['faces']} faces")
    if abs(report["area"] / AREA - 1) > 10 * precision:
        wrong.append(f"area {report['area'] / AREA:.6f}")
    if abs(abs(report["volume"]) / VOLUME - 1) > 10 * precision:
        wrong.append(f"volume {report['volume'] / VOLUME:.6f}")
    size = np.abs(V).max()
    if np.abs(points.min(0) - V.min(0)).max() > 2 * precision * size or np.abs(
            points.max(0) - V.max(0)).max() > 2 * precision * size:
        wrong.append(f"place {points.min(0)} to {points.max(0)}")
    elif {tuple(np.round(p, 2)) for p in points} != {tuple(np.round(p, 2)) for p in V} and len(points) != len(V):
        wrong.append("points")
    if wrong:
        return f"WRONG ({answer['format']}): " + ", ".join(wrong), False
    repairs = [f"{r['code']} {r['count']}" for r in report["repairs"]]
    return f"{answer['format']}, " + (", ".join(repairs) if repairs else "exactly"), True


def read_back():
    """Our own files of the uploaded base, read by others: the same points and faces, in the same place."""
    with open(path("base.obj"), "rb") as source:
        mesh = send(source.read())[1]["id"]
    names = {}
    for kind in ("ply", "obj", "stl", "vtk", "vtp", "gii", "glb"):
        names[kind] = path("ours." + kind)
        urllib.request.urlretrieve(f"{URL}/v1/meshes/{mesh}/content?format={kind}", names[kind])

    def compare(tool, kind, points, faces):
        area = measures(points, faces)[0]
        same = len(faces) == len(F) and abs(area / AREA - 1) < 1e-5 and np.abs(points.min(0) - V.min(0)).max() < 1e-4
        print(f"| {tool} | ours.{kind} | {'the same place and units' if same else 'WRONG'} |")
        return same

    def of_vtk(reader, kind):
        from vtk.util.numpy_support import vtk_to_numpy
        reader.SetFileName(names[kind])
        reader.Update()
        data = reader.GetOutput()
        return compare("VTK", kind, vtk_to_numpy(data.GetPoints().GetData()).astype(float),
                       vtk_to_numpy(data.GetPolys().GetData()).reshape(-1, 4)[:, 1:])

    ok = True

    @attempt("VTK reads")
    def _():
        nonlocal ok
        import vtk
        for kind, reader in (("ply", vtk.vtkPLYReader()), ("obj", vtk.vtkOBJReader()), ("stl", vtk.vtkSTLReader()),
                             ("vtk", vtk.vtkPolyDataReader()), ("vtp", vtk.vtkXMLPolyDataReader())):
            ok = of_vtk(reader, kind) and ok

    @attempt("nibabel reads")
    def _():
        nonlocal ok
        import nibabel
        image = nibabel.load(names["gii"])
        ok = compare("nibabel", "gii", image.darrays[0].data.astype(float), image.darrays[1].data) and ok

    @attempt("Workbench reads")
    def _():
        nonlocal ok
        import nibabel
        command("wb_command", "-gifti-convert", "ASCII", "ours.gii", "ours_workbench.surf.gii")
        command("wb_command", "-surface-vertex-areas", "ours.gii", "ours_areas.shape.gii")
        image = nibabel.load(path("ours_workbench.surf.gii"))
        areas = nibabel.load(path("ours_areas.shape.gii")).darrays[0].data.astype(float)
        ok = compare("Workbench", "gii", image.darrays[0].data.astype(float), image.darrays[1].data) and ok
        ok = abs(areas.sum() / AREA - 1) < 1e-5 and ok

    @attempt("MeshLab reads")
    def _():
        nonlocal ok
        import meshio
        for kind in ("ply", "stl"):  # Debian's build stops in an assertion of its own on any OBJ
            command("xvfb-run", "-a", "meshlabserver", "-i", "ours." + kind, "-o", f"ours_{kind}_meshlab.stl")
            mesh = meshio.read(path(f"ours_{kind}_meshlab.stl"))
            ok = compare("MeshLab", kind, mesh.points.astype(float), mesh.cells[0].data) and ok

    @attempt("meshio reads")
    def _():
        nonlocal ok
        import meshio
        for kind in ("ply", "obj", "stl"):  # it reads no legacy polydata
            mesh = meshio.read(names[kind])
            ok = compare("meshio", kind, mesh.points.astype(float), mesh.cells[0].data) and ok

    @attempt("Open3D reads")
    def _():
        nonlocal ok
        import open3d
        for kind in ("ply", "obj", "stl", "glb"):
            mesh = open3d.io.read_triangle_mesh(names[kind])
            ok = compare("Open3D", kind, np.asarray(mesh.vertices), np.asarray(mesh.triangles)) and ok

    @attempt("assimp reads")
    def _():
        nonlocal ok
        import meshio
        for kind in ("ply", "obj", "stl", "glb"):
            command("assimp", "export", "ours." + kind, f"ours_{kind}_assimp.stl", "-fstlb")
            mesh = meshio.read(path(f"ours_{kind}_assimp.stl"))
            ok = compare("assimp", kind, mesh.points.astype(float), mesh.cells[0].data) and ok

    @attempt("three.js reads")
    def _():
        nonlocal ok
        script = ("import { readFileSync } from 'fs'; globalThis.self = globalThis;"
                  "const { GLTFLoader } = await import('three/examples/jsm/loaders/GLTFLoader.js');"
                  "const b = readFileSync('ours.glb');"
                  "new GLTFLoader().parse(b.buffer.slice(b.byteOffset, b.byteOffset + b.length), '', g => {"
                  "let m; g.scene.traverse(o => { if (o.isMesh) m = o; });"
                  "console.log(JSON.stringify({ v: [...m.geometry.attributes.position.array],"
                  " f: [...m.geometry.index.array] })); }, e => { console.error(e); process.exit(1); });")
        with open(path("read.mjs"), "w") as out:
            out.write(script)
        data = json.loads(subprocess.run(["node", "read.mjs"], cwd=FOLDER, check=True, stdout=subprocess.PIPE,
                                         timeout=60).stdout)
        ok = compare("three.js", "glb", np.array(data["v"]).reshape(-1, 3), np.array(data["f"]).reshape(-1, 3)) and ok
    return ok


def main():
    os.makedirs(FOLDER, exist_ok=True)
    base()
    for name, maker in (("VTK", with_vtk), ("nibabel", with_nibabel), ("meshio", with_meshio), ("Open3D", with_open3d),
                        ("numpy-stl", with_numpy_stl), ("Gmsh", with_gmsh), ("assimp", with_assimp),
                        ("ADMesh", with_admesh), ("OpenCTM", with_openctm), ("OpenSCAD", with_openscad),
                        ("GTS", with_gts), ("PCL", with_pcl),
                        ("Workbench", with_workbench), ("MeshLab", with_meshlab), ("npm", with_npm), ("by hand", by_hand)):
        attempt(name)(maker)
    wrong = 0
    print("| tool | file | verdict |\n|---|---|---|")
    for tool, name, precision, _ in ROWS:
        sentence, good = verdict(name, precision)
        wrong += not good
        print(f"| {tool} | {name} | {sentence} |")
    good = read_back()
    print(f"\n{len(ROWS)} files of {len({tool for tool, *_ in ROWS})} tools, {wrong} wrong; read back: "
          f"{'all right' if good else 'WRONG'}")
    for line in MISSING:
        print("left out:", line)
    sys.exit(wrong > 0 or not good)


main()
