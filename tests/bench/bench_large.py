#!/usr/bin/python3
"""Large cohorts over HTTP, from meshes to principal components: time, memory and sizes as the number of members grows.

    tests/bench/bench_large.py build/srnfd [--members 200 500 1000 2000] [--degree 15] [--process pca] [--options JSON]
                               [--kill PERCENT] [--serve OPTIONS] [--folder DIR] [--meshes DIR] [--unit]

Members are samples of a model of the star-shaped surfaces in tests/data/aal_subcortex: principal components of the
logarithms of their radii, and waves of low degree beside them, so that there are as many components as are asked for. Each
is put on a triangulation of its own (500 to 650 random points of the sphere, their hull), turned and moved at random, and
packed as a binary PLY. Zips of up to 2000 with a table are imported; their cohorts, as many as one job takes, are encoded;
then the process runs on all. --kill ends the daemon by SIGKILL when the job has come so far, and starts it again: `attempt`
tells that it was resumed. A line for every ten per cent tells how far a run came that did not end.

For each number of members a line says: seconds of the upload, the encoding and the process; processor seconds of the
process a member, which tell on a busy machine what seconds do not; the largest memory of the daemon and of the job's own
account; the scratch file of the job at its largest; database, data directory and result; a digest of the model's scores, by
which a run that was killed can be compared with one that was not. Then the ratio of processor time a member to that of the
first. Nothing is downloaded; everything is in a temporary directory.

--meshes takes the .ply files of a folder instead, labelled by their names up to the number. --process and --options may then
be repeated, in turn. --unit tells processor time in units of one gradient transform of three coordinates at that degree as
well, timed before and after (bench_unit, beside the program).
"""
import argparse
import hashlib
import io
import json
import os
import pathlib
import re
import shlex
import signal
import subprocess
import tempfile
import time
import urllib.error
import urllib.request
import zipfile

import numpy
import scipy.interpolate
import scipy.spatial

arguments = argparse.ArgumentParser()
arguments.add_argument('program')
arguments.add_argument('--members', type=int, nargs='+', default=[200, 500, 1000, 2000])
arguments.add_argument('--degree', type=int, default=15)
arguments.add_argument('--process', nargs='+', default=['pca'])
arguments.add_argument('--options', nargs='+', default=['{"components":50}'])
arguments.add_argument('--kill', type=float)
arguments.add_argument('--serve', default='')
arguments.add_argument('--folder')
arguments.add_argument('--meshes', type=pathlib.Path)
arguments.add_argument('--unit', action='store_true')
asked = arguments.parse_args()
random = numpy.random.default_rng(16)
STARS = ('L_thalamus', 'R_thalamus', 'L_pallidum', 'R_pallidum', 'L_amygdala')
SURFACES = pathlib.Path(__file__).parent.parent / 'data' / 'aal_subcortex'
MIB = 2.0**20
WAVES, PAD = 40, 4
ARCHIVE = 2000  # members of one archive, and of one job that encodes


class Daemon:
    def __init__(self, folder):
        self.folder = folder
        self.processor = 0.0  # seconds of those that were killed
        self.peak = 0.0
        self.start()

    def start(self):
        log = f'{self.folder}/log'
        with open(log, 'ab') as stream:
            size = stream.tell()
            self.child = subprocess.Popen([asked.program, 'serve', '--listen', '127.0.0.1:0', '--data', f'{self.folder}/data',
                                           '--access-log', 'refusals', *shlex.split(asked.serve)], stderr=stream)
        self.address = None
        while not self.address:
            time.sleep(0.1)
            if self.child.poll() is not None:
                raise SystemExit(pathlib.Path(log).read_text()[size:])
            found = re.search(r'"event":"listening".*?"address":"([^"]+)"', pathlib.Path(log).read_text()[size:])
            self.address = found and found.group(1)

    def look(self):
        """Largest memory in MiB and processor seconds so far."""
        text = pathlib.Path(f'/proc/{self.child.pid}/status').read_text()
        self.peak = max(self.peak, int(re.search(r'VmHWM:\s+(\d+) kB', text).group(1)) / 1024)
        ticks = pathlib.Path(f'/proc/{self.child.pid}/stat').read_text().rsplit(')', 1)[1].split()[11:13]
        return self.processor + sum(map(int, ticks)) / os.sysconf('SC_CLK_TCK')

    def kill(self):
        self.processor = self.look()
        self.child.send_signal(signal.SIGKILL)
        self.child.wait()
        self.start()

    def ask(self, method, path, body=None, kind='application/json', **headers):
        data = body if isinstance(body, (bytes, type(None))) else json.dumps(body).encode()
        request = urllib.request.Request(f'http://{self.address}{path}', data, {'Content-Type': kind, **headers}, method=method)
        try:
            with urllib.request.urlopen(request) as answer:
                return answer.read()
        except urllib.error.HTTPError as error:
            raise SystemExit(f'{method} {path}: {error.read().decode()[:2000]}') from error

    def json(self, *arguments, **headers):
        return json.loads(self.ask(*arguments, **headers))

    def run(self, process, inputs, kill=None):
        """The job's record when it has ended, and bytes of its scratch at most."""
        job = self.json('POST', f'/v1/processes/{process}/execution', {'inputs': inputs}, Prefer='respond-async')
        scratch = pathlib.Path(f'{self.folder}/data/scratch/{job["id"]}')
        most, told, began = 0, 10.0, time.time()
        while job['status'] in ('accepted', 'running'):
            time.sleep(0.2)
            if scratch.exists():
                most = max(most, scratch.stat().st_blocks * 512)
            if kill is not None and (job.get('progress') or 0) >= kill:
                self.kill()
                kill = None
            processor = self.look()
            if (job.get('progress') or 0) >= told:
                print(f'    {process}: {job["progress"]:.0f} % ({job.get("message")}) after {time.time() - began:.0f} s, '
                      f'processor {processor:.0f} s, daemon {self.peak:.0f} MiB, scratch {most / MIB:.0f} MiB', flush=True)
                told = 10.0 * (job['progress'] // 10 + 1)
            job = self.json('GET', f"/v1/jobs/{job['id']}")
        if job['status'] != 'successful':
            raise SystemExit(json.dumps(job['exception']))
        return job, most

    def metric(self, name):
        found = re.search(rf'^{re.escape(name)} (\S+)$', self.ask('GET', '/metrics').decode(), re.M)
        return float(found.group(1)) if found else 0.0

    def stop(self):
        self.child.terminate()
        self.child.wait()


# ---- Shapes --------------------------------------------------------------------------------------------------------------


def read_ply(path):
    head, body = path.read_bytes().split(b'end_header\n', 1)
    count = int(re.search(rb'element vertex (\d+)', head).group(1))
    size = 4 * len(re.findall(rb'property float', head))
    rows = numpy.frombuffer(body[:count * size], '<f4').reshape(count, -1)
    return rows[:, :3].astype(float)


def log_radii(points, directions):
    """Of the surface through the points, from the middle of them, in those directions."""
    centred = points - points.mean(axis=0)
    radius = numpy.linalg.norm(centred, axis=1)
    near = scipy.interpolate.NearestNDInterpolator(centred / radius[:, None], numpy.log(radius / radius.mean()))
    tree = scipy.spatial.cKDTree(centred / radius[:, None])
    distance, index = tree.query(directions, k=12)
    weight = numpy.exp(-(distance / 0.15) ** 2) + 1e-12
    return (weight * near.values[index]).sum(axis=1) / weight.sum(axis=1)


class Model:
    """Logarithms of radii: mean, components, and how much of each."""

    def __init__(self):
        self.nodes = sphere(4000)
        rows = numpy.array([log_radii(read_ply(SURFACES / f'{name}.ply'), self.nodes) for name in STARS])
        self.mean = rows.mean(axis=0)
        _, values, modes = numpy.linalg.svd(rows - self.mean, full_matrices=False)
        self.modes = 0.4 * values[:4, None] * modes[:4] / numpy.sqrt(len(rows) - 1)
        self.tree = scipy.spatial.cKDTree(self.nodes)
        self.waves = random.normal(size=(WAVES, 3)) * 2.0
        self.phases = random.uniform(0, 2 * numpy.pi, WAVES)

    def sample(self, directions):
        at = self.mean + numpy.clip(random.normal(size=4), -2, 2) @ self.modes
        distance, index = self.tree.query(directions, k=6)
        weight = numpy.exp(-(distance / 0.04) ** 2) + 1e-12
        smooth = (weight * at[index]).sum(axis=1) / weight.sum(axis=1)
        return smooth + numpy.sin(directions @ self.waves.T + self.phases) @ (0.02 * random.normal(size=WAVES))


def sphere(count):
    """Points evenly on a spiral, from a turn of their own."""
    k = numpy.arange(count) + 0.5
    z = 1.0 - 2.0 * k / count
    angle = numpy.pi * (1 + 5**0.5) * k
    root = numpy.sqrt(1.0 - z * z)
    return numpy.stack([root * numpy.cos(angle), root * numpy.sin(angle), z], axis=1) @ rotation().T


def rotation():
    q, r = numpy.linalg.qr(random.normal(size=(3, 3)))
    q *= numpy.sign(numpy.diag(r))
    return q * numpy.linalg.det(q)


def mesh(model):
    directions = sphere(random.integers(500, 650))
    faces = scipy.spatial.ConvexHull(directions).simplices
    a, b, c = (directions[faces[:, k]] for k in range(3))
    inward = numpy.einsum('ij,ij->i', numpy.cross(b - a, c - a), a + b + c) < 0
    faces[inward] = faces[inward][:, ::-1]
    points = directions * (20.0 * numpy.exp(model.sample(directions)))[:, None] @ rotation().T + random.normal(size=3) * 30.0
    rows = numpy.empty(len(faces), dtype=[('n', 'u1'), ('v', '<i4', 3)])
    rows['n'], rows['v'] = 3, faces
    head = (f'ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\n'
            f'property float z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n')
    return head.encode() + points.astype('<f4').tobytes() + rows.tobytes()


def archive(files):
    """Names without their ending, labels and bytes; packed with a table."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, 'w', zipfile.ZIP_DEFLATED, compresslevel=1) as into:
        into.writestr('table.csv', 'file,subject,label\n' + ''.join(f'{name}.ply,{name},{label}\n' for name, label, _ in files))
        for name, _, data in files:
            into.writestr(f'{name}.ply', data)
    return packed.getvalue()


def samples(count, model):
    return [(f's{i}', 'sample', mesh(model)) for i in range(count)]


def read_files(folder):
    return [(path.stem, re.sub(r'_?\d+.*', '', path.stem), path.read_bytes()) for path in sorted(folder.glob('*.ply'))]


# ---- The run -------------------------------------------------------------------------------------------------------------


def digest(daemon, document):
    found = (document.get('model') or {}).get('id')
    scores = daemon.ask('GET', f'/v1/models/{found}/scores?format=npy') if found else b''
    return hashlib.sha256(scores).hexdigest()[:16] if found else 'none'


def unit():
    """Seconds of one gradient transform."""
    program = pathlib.Path(asked.program).parent / 'tests/bench/bench_unit'
    return float(subprocess.run([program, str(asked.degree)], check=True, capture_output=True).stdout)


def run_process(daemon, process, options, count):
    """One process on the cohort; a line about it. Processor seconds a member."""
    one = unit() if asked.unit else 0.0
    before, began = daemon.look(), time.time()
    job, scratch = daemon.run(process, {'cohort': 'large', **json.loads(options)}, asked.kill)
    seconds, processor = time.time() - began, daemon.look() - before
    result = daemon.ask('GET', f"/v1/jobs/{job['id']}/results")
    document = json.loads(result)
    account = daemon.metric(f'srnfd_job_memory_bytes_sum{{process="{process}"}}') / MIB
    size = sum(f.stat().st_blocks * 512 for f in pathlib.Path(f'{daemon.folder}/data').rglob('*') if f.is_file())
    database = os.path.getsize(f'{daemon.folder}/data/srnfd.db')
    told = f', {processor / (0.5 * (one + unit())) / 1e6:.2f} million U' if asked.unit else ''
    print(f'{process} {options} of {count} members: {seconds:.1f} s, attempt {job["attempt"]}; processor {processor:.1f} s, '
          f'{1000 * processor / count:.1f} ms a member{told}\n'
          f'    memory: daemon {daemon.peak:.0f} MiB, account of the jobs {account:.0f} MiB; scratch {scratch / MIB:.0f} MiB; '
          f'database {database / MIB:.1f} MiB, data directory {size / MIB:.0f} MiB, result {len(result) / MIB:.2f} MiB\n'
          f'    iterations {document.get("iterations")}, components {document.get("model", {}).get("components")}, '
          f'bound {document.get("eigenvalueBound")}, pairs {document.get("pairs")}, scores {digest(daemon, document)}, '
          f'warnings {[w["code"] for w in document["warnings"]]}', flush=True)
    return processor / count


def measure(files, folder):
    """Processor seconds a member of the first process."""
    parts = [files[k:k + ARCHIVE] for k in range(0, len(files), ARCHIVE)]
    packed = [(part, archive(part)) for part in parts]
    daemon = Daemon(folder)
    try:
        upload = encode = processor = 0.0
        members = []
        for k, (part, archived) in enumerate(packed):
            began = time.time()
            daemon.ask('POST', f'/v1/imports?cohort=meshes{k}', archived, 'application/zip')
            upload += time.time() - began
            before, began = daemon.look(), time.time()
            job, _ = daemon.run('encode', {'cohort': f'meshes{k}', 'lmax': asked.degree})
            encode, processor = encode + time.time() - began, processor + daemon.look() - before
            rows = daemon.json('GET', f"/v1/jobs/{job['id']}/results")['rows']
            # A hull may have a fold too many for one of them; that it is left out is told.
            members += [{'id': row['surface'], 'subject': name, 'label': label}
                        for row, (name, label, _) in zip(rows, part) if row.get('surface')]
        daemon.ask('POST', '/v1/cohorts', {'name': 'large', 'members': members})
        print(f'{len(files)} meshes ({len(packed)} archives, {sum(len(data) for _, data in packed) / MIB:.0f} MiB): upload {upload:.1f} s, encode {encode:.1f} s, '
              f'{1000 * processor / len(files):.1f} ms of processor time a member', flush=True)
        each = [run_process(daemon, process, options, len(members))
                for process, options in zip(asked.process, asked.options)]
        return each[0]
    finally:
        daemon.stop()


def main():
    if asked.meshes:
        with tempfile.TemporaryDirectory(dir=asked.folder) as folder:
            measure(read_files(asked.meshes), folder)
        return
    model, first = Model(), None
    for count in asked.members:
        with tempfile.TemporaryDirectory(dir=asked.folder) as folder:
            each = measure(samples(count, model), folder)
        first = first or each
        print(f'    processor time a member {each / first:.2f} of the first', flush=True)


main()
