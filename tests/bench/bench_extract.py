#!/usr/bin/python3
"""Surfaces of the structures of AAL by the daemon and by VTK: genus, volume, distance; encoded, and a geodesic.

    tests/bench/bench_extract.py URL [aal.nii.gz]

VTK (Debian's python3-vtk9): discrete flying edges of the label and windowed sinc, 30 iterations, pass-band 0.01. Distances are
those of the vertices of either mesh from the other one, in voxels of 1 mm. The volume of VTK's is compared with that of the voxels, as ours.
"""
import json
import sys
import time
import urllib.request

import nibabel
import numpy
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

url = sys.argv[1]
path = sys.argv[2] if len(sys.argv) > 2 else '/usr/share/mricron/templates/aal.nii.gz'
LABELS = {37: 'L hippocampus', 38: 'R hippocampus', 41: 'L amygdala', 42: 'R amygdala', 71: 'L caudate', 72: 'R caudate',
          73: 'L putamen', 74: 'R putamen', 75: 'L pallidum', 76: 'R pallidum', 77: 'L thalamus', 78: 'R thalamus'}


def post(where, body, kind):
    request = urllib.request.Request(url + where, body, {'Content-Type': kind, 'Prefer': 'wait=300'})
    with urllib.request.urlopen(request) as answer:
        return json.load(answer)


def execute(process, **inputs):
    return post(f'/v1/processes/{process}/execution', json.dumps({'inputs': inputs}).encode(), 'application/json')


def of_vtk(values, affine, label):
    image = vtk.vtkImageData()
    image.SetDimensions(values.shape)
    mask = numpy.ascontiguousarray((values == label).ravel(order='F').astype(numpy.uint8))
    image.GetPointData().SetScalars(numpy_to_vtk(mask, deep=1))
    edges = vtk.vtkDiscreteFlyingEdges3D()
    edges.SetInputData(image)
    edges.SetValue(0, 1)
    sinc = vtk.vtkWindowedSincPolyDataFilter()
    sinc.SetInputConnection(edges.GetOutputPort())
    sinc.SetNumberOfIterations(30)
    sinc.SetPassBand(0.01)
    sinc.NonManifoldSmoothingOn()
    sinc.NormalizeCoordinatesOn()
    sinc.Update()
    mesh = vtk.vtkPolyData()
    mesh.DeepCopy(sinc.GetOutput())
    points = vtk_to_numpy(mesh.GetPoints().GetData()) @ affine[:3, :3].T + affine[:3, 3]
    mesh.GetPoints().SetData(numpy_to_vtk(points.astype(float), deep=1))
    return mesh


def of_daemon(identity):
    with urllib.request.urlopen(f'{url}/v1/meshes/{identity}/content') as answer:
        data = answer.read()
    with open('/tmp/bench_extract.ply', 'wb') as file:
        file.write(data)
    reader = vtk.vtkPLYReader()
    reader.SetFileName('/tmp/bench_extract.ply')
    reader.Update()
    return reader.GetOutput()


def distances(a, b):
    implicit = vtk.vtkImplicitPolyDataDistance()
    implicit.SetInput(b)
    return numpy.abs([implicit.EvaluateFunction(a.GetPoint(i)) for i in range(a.GetNumberOfPoints())])


def euler(mesh):
    faces = vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    pairs = numpy.sort(numpy.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    return len(numpy.unique(faces)) - len(numpy.unique(pairs, axis=0)) + len(faces)


def volume(mesh):
    mass = vtk.vtkMassProperties()
    mass.SetInputData(mesh)
    return mass.GetVolume()


with open(path, 'rb') as file:
    record = post('/v1/volumes?name=AAL', file.read(), 'application/octet-stream')
image = nibabel.load(path)
values = numpy.asarray(image.dataobj)
counts = {int(v): int(n) for v, n in zip(*numpy.unique(values[values != 0], return_counts=True))}
assert counts == {label['value']: label['voxels'] for label in record['labels']}, 'labels as nibabel has them'
assert numpy.allclose(record['affine'], image.affine[:3])
print(f'{len(counts)} labels, as nibabel counts them')
print('| structure | voxels | changed | genus | volume | vtk volume | vtk Euler | mean, max distance | fit | volume of encoding | s |')
print('|---|---|---|---|---|---|---|---|---|---|---|')
meshes = {}
for label, name in LABELS.items():
    start = time.time()
    result = execute('extract', volume=record['id'], labels=[label])
    took = time.time() - start
    mesh = result['mesh']
    meshes[label] = mesh['id']
    ours, theirs = of_daemon(mesh['id']), of_vtk(values, image.affine, label)
    far = numpy.concatenate([distances(ours, theirs), distances(theirs, ours)])
    encoded = execute('encode', mesh=mesh['id'])
    voxels = counts[label]
    print(f"| {name} | {voxels} | {result['changed']['voxels']} | {mesh['report']['genus']} | "
          f"{100 * (result['volume'] / voxels - 1):.4f} % | {100 * (volume(theirs) / voxels - 1):.2f} % | {euler(theirs)} | "
          f"{far.mean():.3f}, {far.max():.2f} | {100 * encoded['fit']['relativeToDiagonal']['rms']:.2f} % | "
          f"{100 * encoded['fit']['volumeDifference']:.3f} % | {took:.2f} |", flush=True)
geodesic = execute('geodesic', **{'from': meshes[37], 'to': meshes[71]})
print(f"geodesic from the left hippocampus to the left caudate: distance {geodesic['distance']:.4f}, "
      f"length {geodesic['length']:.4f}, {len(geodesic['surfaces'])} surfaces")

