#!/usr/bin/python3
"""A large cohort: time and memory of a process on it, by a daemon of its own.

    tests/bench/bench_large.py build/srnfd [--members 2000] [--degree 15] [--process pca] [--options JSON] [--meshes DIR]
                               [--kill SECONDS]

Members are samples of a model. With --meshes, of the principal components of the coefficients of those meshes, encoded as
they are (../shared/data/lv_endocardium_ed has 100 ventricles); without, of ellipsoids with bumps. Each is turned in space at
random, so that there is no common pose. --kill ends the daemon that long after the job began, by SIGKILL, and starts it again.
Nothing is downloaded; everything is in a temporary directory.
"""
import argparse
import json
import os
import pathlib
import re
import signal
import subprocess
import tempfile
import time
import urllib.request

import numpy

arguments = argparse.ArgumentParser()
arguments.add_argument('program')
arguments.add_argument('--members', type=int, default=2000)
arguments.add_argument('--degree', type=int, default=15)
arguments.add_argument('--process', default='pca')
arguments.add_argument('--options', default='{"components":50}')
arguments.add_argument('--meshes')
arguments.add_argument('--kill', type=float)
asked = arguments.parse_args()
random = numpy.random.default_rng(16)


class Daemon:
    def __init__(self, data):
        self.data = data
        self.start()

    def start(self):
        self.log = open(f'{self.data}/log', 'ab')
        size = self.log.tell()
        self.child = subprocess.Popen([asked.program, 'serve', '--listen', '127.0.0.1:0', '--data', f'{self.data}/data'],
                                      stderr=self.log)
        self.address = None
        while not self.address:
            time.sleep(0.1)
            text = pathlib.Path(f'{self.data}/log').read_text()[size:]
            found = re.search(r'"event":"listening".*?"address":"([^"]+)"', text)
            self.address = found and found.group(1)

    def status(self, name):
        text = pathlib.Path(f'/proc/{self.child.pid}/status').read_text()
        return int(re.search(rf'{name}:\s+(\d+) kB', text).group(1)) / 1024

    def ask(self, method, path, body=None, kind='application/json', **headers):
        data = body if isinstance(body, (bytes, type(None))) else json.dumps(body).encode()
        request = urllib.request.Request(f'http://{self.address}{path}', data, {'Content-Type': kind, **headers}, method=method)
        try:
            with urllib.request.urlopen(request) as answer:
                return json.loads(answer.read())
        except urllib.error.HTTPError as error:
            raise SystemExit(f'{method} {path}: {error.read().decode()}') from error


def rotation():
    q, r = numpy.linalg.qr(random.normal(size=(3, 3)))
    q *= numpy.sign(numpy.diag(r))
    return q * numpy.linalg.det(q)


def coefficients(daemon, identity):
    body = daemon.ask('GET', f'/v1/surfaces/{identity}/coefficients')
    return numpy.array([body[c] for c in 'xyz'])


def model_of_meshes(daemon):
    shapes = []
    for path in sorted(pathlib.Path(asked.meshes).iterdir()):
        if path.suffix not in ('.ply', '.obj', '.off', '.stl', '.vtk'):
            continue
        mesh = daemon.ask('POST', f'/v1/meshes?format={path.suffix[1:]}', path.read_bytes(), 'application/octet-stream')
        done = daemon.ask('POST', '/v1/processes/encode/execution', {'inputs': {'mesh': mesh['id'], 'lmax': asked.degree}},
                          Prefer='wait=60')
        shapes.append(coefficients(daemon, done['surface']['id']).ravel())
    shapes = numpy.array(shapes)
    mean = shapes.mean(axis=0)
    _, values, modes = numpy.linalg.svd(shapes - mean, full_matrices=False)
    keep = min(30, len(shapes) - 1)
    return mean.reshape(3, -1), (values[:keep, None] * modes[:keep] / numpy.sqrt(len(shapes) - 1)).reshape(keep, 3, -1)


def model_of_bumps():
    """An ellipsoid, and bumps that fall off with their degree."""
    count = (asked.degree + 1) ** 2
    mean = numpy.zeros((3, count))
    for axis, place, length in ((0, 3, 1.0), (1, 1, 0.8), (2, 2, 0.6)):
        mean[axis, place] = length
    degree = numpy.sqrt(numpy.arange(count)).astype(int)
    modes = random.normal(size=(30, 3, count)) * numpy.where(degree > 1, 0.12 / (1.0 + degree) ** 2, 0.0)
    return mean, modes


def main(directory):
    daemon = Daemon(directory)
    mean, modes = model_of_meshes(daemon) if asked.meshes else model_of_bumps()
    began = time.time()
    members = []
    for i in range(asked.members):
        shape = rotation() @ (mean + numpy.tensordot(random.normal(size=len(modes)), modes, 1))
        body = {'coefficients': {'lmax': asked.degree, **{c: list(shape[k]) for k, c in enumerate('xyz')}}}
        members.append({'id': daemon.ask('POST', '/v1/surfaces', body)['id'], 'subject': f's{i}'})
    daemon.ask('POST', '/v1/cohorts', {'name': 'large', 'members': members})
    print(f'{asked.members} members of degree {asked.degree} stored in {time.time() - began:.1f} s', flush=True)
    before = daemon.status('VmRSS')
    began = time.time()
    job = daemon.ask('POST', f'/v1/processes/{asked.process}/execution',
                     {'inputs': {'cohort': 'large', **json.loads(asked.options)}}, Prefer='respond-async')
    if asked.kill:
        time.sleep(asked.kill)
        daemon.child.send_signal(signal.SIGKILL)
        daemon.child.wait()
        daemon.start()
    while job['status'] in ('accepted', 'running'):
        time.sleep(0.2)
        job = daemon.ask('GET', f"/v1/jobs/{job['id']}")
    print(f"{asked.process} {asked.options}: {job['status']} after {time.time() - began:.1f} s, attempt {job['attempt']}")
    print(f"memory before {before:.0f} MiB, at most {daemon.status('VmHWM'):.0f} MiB")
    if job['status'] != 'successful':
        raise SystemExit(json.dumps(job['exception']))
    with urllib.request.urlopen(f"http://{daemon.address}/v1/jobs/{job['id']}/results") as answer:
        text = answer.read()
    document = json.loads(text)
    print(f'result {len(text) / 2**20:.1f} MiB; iterations {document.get("iterations")}, '
          f'iterations took {document.get("seconds") or 0:.1f} s, warnings {[w["code"] for w in document["warnings"]]}')
    if 'model' in document:
        print(f'{document["model"]["components"]} components, bound {document.get("eigenvalueBound")}')
    size = sum(f.stat().st_size for f in pathlib.Path(f'{directory}/data').rglob('*') if f.is_file())
    print(f'data directory {size / 2**20:.0f} MiB; processor time of the daemon '
          f'{sum(map(int, pathlib.Path(f"/proc/{daemon.child.pid}/stat").read_text().split()[13:15])) / os.sysconf("SC_CLK_TCK"):.1f} s')
    daemon.child.terminate()
    daemon.child.wait()


with tempfile.TemporaryDirectory() as place:
    main(place)
