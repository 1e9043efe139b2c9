"""The Python client against the real daemon: records as arrays, jobs, studies that are interrupted, a daemon that returns."""

import io
import json
import pathlib
import sys
import tempfile
import threading
import time
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from daemon import NUCLEI, Daemon, nuclei_table, scratch  # noqa: E402

import srnf  # noqa: E402
from srnf.labels import read_members, stem  # noqa: E402
from srnf.progress import Progress, announce  # noqa: E402


def setUpModule():
    global FOLDER, DAEMON, CLIENT
    FOLDER = scratch()
    DAEMON = Daemon(FOLDER.name)
    CLIENT = srnf.Client(DAEMON.url, progress=False, notice=lambda text: None)


def tearDownModule():
    CLIENT.close()
    DAEMON.stop()
    FOLDER.cleanup()


def made(process):
    """How many jobs of a process were computed, rather than answered by another one's results."""
    return sum(job.raw["cache"] == "miss" for job in CLIENT.jobs(process=process))


class Shown(unittest.TestCase):
    def test_values(self):
        """a printed document shows its values, and of what is nested as much as there is room for"""
        document = srnf.Document({"value": 1 / 3, "interval": [0.25, 0.75], "count": 12, "floor": True, "note": None, "kind": "it's"})
        self.assertEqual(
            repr(document),
            "Document(value=0.333333, interval=[0.25, 0.75], count=12, floor=True, note=None, kind=\"it's\")",
        )
        nested = srnf.Document({"accuracy": document.raw, "matrix": 40 * [40 * [0.5]], "text": 500 * "long", "surface": {
            "id": "surf-1", "name": "left", "area": 1.0}})
        self.assertRegex(repr(nested), "^Document\\(accuracy={value: 0.333333, interval: ")
        self.assertIn("matrix=[[0.5, 0.5, 0.5, 0.5, … 36 more], ", repr(nested))
        self.assertIn("surface=Surface('surf-1', name='left')", repr(nested))

    def test_bound(self):
        """however much there is, what is printed is bounded, and all members of a result are named"""
        deep = {"end": 1.0}
        for _ in range(100):
            deep = {f"inner{k}": deep for k in range(2)}
        many = {f"member{k}": [{"a": "x" * 90, "b": deep}] * 50 for k in range(40)}
        self.assertLess(len(repr(srnf.Document(many))), 2000)
        self.assertIn("member39", repr(srnf.Document(many)))
        self.assertLess(len(repr(srnf.Document({f"{k:0100}": k for k in range(10000)}))), 6000)
        rows = srnf.Rows(srnf.Document({"index": k, **many}) for k in range(1000))
        self.assertLess(len(repr(rows)), 3000)
        self.assertRegex(repr(rows), r"^\[Document\(index=0, .*\), Document\(index=1, .*, … 996 more\]$")
        self.assertEqual(repr(rows[:0]), "[]")
        self.assertEqual(repr(srnf.Rows([srnf.Document({"a": 1e-9})])), "[Document(a=1e-09)]")


class Records(unittest.TestCase):
    def test_mesh(self):
        """a mesh has its report, its bytes come back, and its triangles have its volume"""
        file = NUCLEI / "L_amygdala.ply"
        mesh = CLIENT.upload(file)
        self.assertEqual((mesh.name, mesh.analysable, mesh.content()), ("L_amygdala", True, file.read_bytes()))
        shape = mesh.triangles()
        self.assertEqual(shape.faces.shape, (mesh.faces, 3))
        a, b, c = (shape.vertices[shape.faces[:, k]] for k in range(3))
        volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
        self.assertAlmostEqual(volume / mesh.report.volume, 1, 9)

    def test_surface(self):
        """coefficients, grid and field have their shapes, and the squared norm of the field is the area"""
        surface = CLIENT.encode(CLIENT.upload(NUCLEI / "L_amygdala.ply"), lmax=6).surface
        self.assertEqual(surface.coefficients().shape, (3, 49))
        document = CLIENT.get(f"{surface.path}/srnf")
        q, weights = surface.srnf(), np.array(document["weights"])
        self.assertEqual((q.shape, surface.grid(9, 16).shape), ((document["nTheta"], document["nPhi"], 3), (9, 16, 3)))
        self.assertAlmostEqual(float(np.einsum("ijk,ijk,i->", q, q, weights)), surface.area, 9)
        original, stored = surface.triangles(12, "original").vertices, surface.triangles(12).vertices
        sides = np.ptp(original, axis=0) / np.ptp(stored * surface.scale, axis=0)
        self.assertLess(np.abs(sides - 1).max(), 1e-6)
        again = CLIENT.add_surface(surface.coefficients())
        self.assertLess(np.abs(again.coefficients() - surface.coefficients()).max(), 1e-15)

    def test_names(self):
        """inputs go by snake_case too; a wrong one is told with the one that was meant"""
        mesh = CLIENT.upload(NUCLEI / "L_amygdala.ply")
        other = CLIENT.upload(NUCLEI / "R_amygdala.ply")
        path = CLIENT.run("geodesic", from_=mesh, to=other, steps=3, register=False)
        self.assertEqual((len(path.surfaces), path.times.tolist()), (3, [0.0, 0.5, 1.0]))
        self.assertEqual(path.relative_energies.geodesic.shape, (3,))
        with self.assertRaisesRegex(srnf.InputError, "did you mean 'lmax'"):
            CLIENT.encode(mesh, l_max_=3)
        with self.assertRaisesRegex(srnf.InputError, "did you mean 'encode'"):
            CLIENT.run("encod")
        with self.assertRaisesRegex(srnf.InputError, "register needs moving"):
            CLIENT.run("register", template=mesh)
        with self.assertRaises(srnf.Problem) as caught:
            CLIENT.encode(mesh, lmax=1000)
        self.assertEqual((caught.exception.status, caught.exception.errors[0]["pointer"]), (422, "/inputs/lmax"))

    def test_renamed(self):
        """a file that is uploaded again leaves the name that its mesh was given; a name that is asked for is set"""
        file = NUCLEI / "L_caudate.ply"
        mesh = CLIENT.upload(file)
        mesh.rename("left caudate")
        self.assertEqual(CLIENT.upload(file).name, "left caudate")
        self.assertEqual(CLIENT.upload_all([file])[0].name, "left caudate")
        self.assertEqual(CLIENT.upload(file, "again").name, "again")

    def test_tables(self):
        """cohorts and models come as columns of one length"""
        shapes = [CLIENT.encode(CLIENT.upload(f), lmax=4).surface for f in sorted(NUCLEI.glob("L_*.ply"))[:4]]
        rows = [{"id": s, "label": "AB"[k % 2], "covariates": {"age": 40 + k}} for k, s in enumerate(shapes)]
        cohort = CLIENT.cohort("tables", rows)
        table = cohort.table()
        self.assertEqual((table["label"], table["covariates.age"]), (["A", "B", "A", "B"], [40, 41, 42, 43]))
        model = CLIENT.pca(cohort, register=False).model
        scores = model.scores()
        columns = model.scores_table()
        self.assertEqual({len(column) for column in columns.values()}, {4})
        self.assertEqual(columns["component 1"], scores[:, 0].tolist())
        self.assertEqual(model.mean, CLIENT.surface(model.mean.id))
        mean = model.shape([0, 0])
        self.assertEqual((mean.coefficients.shape, mean.lmax), ((3, (mean.lmax + 1) ** 2), mean.lmax))
        stored = model.mean.coefficients()
        self.assertLess(np.abs(mean.coefficients[:, 1:] - stored[:, 1:]).max(), 1e-3)  # another start
        ahead = model.shape(np.array([1.5]))  # the same as the process makes
        made = CLIENT.modes(model, 1, coefficients=[1.5]).surfaces[0].coefficients()
        self.assertLess(np.abs(ahead.coefficients[:, 1:] - made[:, 1:]).max(), 1e-3)
        self.assertGreater(np.abs(ahead.coefficients[:, 1:] - mean.coefficients[:, 1:]).max(), 0.01)
        with tempfile.TemporaryDirectory() as folder:
            file = model.save_shape(pathlib.Path(folder, "shape.glb"), [1.5], resolution=4)
            self.assertEqual(file.read_bytes()[:4], b"glTF")
        matrix = CLIENT.distances(shapes, register=False).matrix
        self.assertEqual(matrix.shape, (4, 4))
        self.assertLess(np.abs(matrix - matrix.T).max(), 1e-15)
        job = CLIENT.submit("distances", surfaces=shapes, register=False).wait()
        self.assertEqual(np.abs(job.matrix() - matrix).max(), 0)
        self.assertEqual(job.matrix(condensed=True).tolist(), matrix[np.triu_indices(len(matrix), 1)].tolist())
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(np.load(job.save(pathlib.Path(folder, "d.npy"))).shape, (4, 4))
            half = np.load(job.save(pathlib.Path(folder, "c.npy"), condensed=True))
            self.assertEqual(half.tolist(), job.matrix(condensed=True).tolist())
            with self.assertRaises(srnf.Problem) as refused:
                job.save(pathlib.Path(folder, "c.json"), condensed=True)
            self.assertIn("only symmetric matrices as .npy", str(refused.exception))
        with self.assertRaises(srnf.Problem) as caught:
            CLIENT.cohort("tables", rows[:2])
        self.assertEqual(caught.exception.code, "cohort-exists")

    def test_jobs(self):
        """a job is followed by events, canceled, and says why it has no results"""
        meshes = [CLIENT.upload(file) for file in sorted(NUCLEI.glob("*.ply"))]
        job = CLIENT.submit("distances", surfaces=meshes)
        self.assertIn(job.status, ("accepted", "running"))
        threading.Timer(0.2, job.cancel).start()
        seen = [event.status for event in job.events()]
        self.assertEqual(seen[-1], "dismissed")
        with self.assertRaises(srnf.JobFailed) as caught:
            CLIENT.job(job.id).result()
        self.assertEqual(caught.exception.job, job.id)
        late = CLIENT.submit("distances", surfaces=meshes, metric="srm")
        with self.assertRaises(TimeoutError):
            late.wait(0)
        late.cancel()

    def test_events(self):
        """all jobs are followed as one stream, which goes on from an event; a ticket opens one"""
        mesh = CLIENT.upload(NUCLEI / "L_putamen.ply")
        events = CLIENT.events()
        first = next(events)
        self.assertEqual((first.kind, dict(first.job)), ("start", {}))
        job = CLIENT.submit("encode", mesh=mesh, lmax=7)
        ended = next(e for e in events if e.job.raw.get("id") == job.id and e.job.raw.get("status") == "successful")
        events.close()
        self.assertEqual(ended.kind, "status")
        self.assertEqual(next(CLIENT.events(after=first.id)).job.id, job.id)
        job.delete()
        gone = next(CLIENT.events(after=ended.id))
        self.assertEqual((gone.kind, dict(gone.job)), ("deleted", {"id": job.id}))
        ticket = CLIENT.ticket()
        self.assertGreater(ticket.expiresInSeconds, 0)
        with CLIENT.http.lines(f"/v1/events?ticket={ticket.ticket}", {}) as stream:
            self.assertEqual(stream.status, 200)
        self.assertEqual((dict(CLIENT.caller()), CLIENT.users()), ({"role": "admin", "tokens": False}, []))

    def test_pandas(self):
        """a table is what pandas takes"""
        try:
            import pandas
        except ImportError:
            self.skipTest("no pandas")
        mesh = CLIENT.upload(NUCLEI / "L_amygdala.ply")
        self.assertEqual(pandas.DataFrame(srnf.columns([mesh.raw])).shape[0], 1)


class Studies(unittest.TestCase):
    def setUp(self):
        self.place = scratch()
        self.addCleanup(self.place.cleanup)
        self.folder = pathlib.Path(self.place.name, "nuclei")
        self.folder.mkdir()
        for file in NUCLEI.glob("*.ply"):
            (self.folder / file.name).symlink_to(file)
        self.labels = pathlib.Path(self.place.name, "labels.csv")
        self.labels.write_text(nuclei_table())

    def study(self, client=None, **options):
        options = {"lmax": 4, "register": "none", "mirror_right": True, **options}
        return srnf.Study.from_folder(self.folder, self.labels, client=client or CLIENT, **options)

    def test_return(self):
        """a study goes on where the daemon was killed and came back, and nothing is computed twice"""
        self.labels.write_text("".join(line for line in nuclei_table().splitlines(True) if not line.startswith("R")))
        for file in self.folder.glob("R*"):
            file.unlink()
        before = {name: made(name) for name in ("encode", "register", "pca")}
        study = self.study(register="template", degree=3, lmax=7)
        gone = threading.Timer(0.4, lambda: (DAEMON.kill(), time.sleep(0.7), DAEMON.start()))
        gone.start()
        model = study.model()
        gone.join()
        self.assertEqual(len(model.raw["scores"]), 6)
        again = self.study(register="template", degree=3, lmax=7)
        self.assertEqual(again.model().id, model.id)
        after = {name: made(name) - before[name] for name in before}
        self.assertEqual(after, {"encode": 1, "register": 5, "pca": 1})

    def test_interrupted(self):
        """a study whose process died between its steps goes on without uploads or jobs"""
        first = self.study()
        ids = [surface.id for surface in first.encode()]
        jobs = len(CLIENT.jobs())
        second = self.study()
        self.assertEqual(([s.id for s in second.encode()], len(CLIENT.jobs())), (ids, jobs))
        p = second.compare_groups(permutations=99).p_value
        third = self.study()
        self.assertEqual((third.compare_groups(permutations=99).p_value, len(CLIENT.jobs())), (p, jobs + 1))

    def test_relabelled(self):
        """distances are not computed again where labels alone have changed, unless they may name sides"""
        matrix = self.study().distances().matrix
        jobs = made("distances")
        self.labels.write_text(nuclei_table().replace(",A,", ",case,"))
        again = self.study().distances()
        self.assertEqual((again.matrix.tolist(), made("distances")), (matrix.tolist(), jobs))
        self.assertEqual(set(again.raw["groups"]), set(self.study().labels()))
        kept = json.loads((self.study().out / "results/distances.json").read_text())
        self.assertEqual(kept["groups"], again.raw["groups"])
        self.assertIn("case", again.raw["groups"])
        self.labels.write_text(nuclei_table().replace(",A,", ",lh,"))
        self.study().distances()
        self.assertEqual(made("distances"), jobs + 1)

    def test_refused(self):
        """files that cannot be used are named all at once, or left out"""
        (self.folder / "broken.ply").write_text("ply\nnonsense\n")
        (self.folder / "open.off").write_text("OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n")
        self.labels.write_text(nuclei_table() + "broken.ply,A,x,L,1\nopen.off,A,y,L,1\n")
        with self.assertRaises(srnf.FilesRefused) as caught:
            self.study().encode()
        self.assertEqual([one["code"] for one in caught.exception.refused], ["unparsable-mesh", "mesh-not-closed"])
        study = self.study(skip_refused=True)
        self.assertEqual((len(study.encode()), len(study.members), len(study.refused)), (12, 12, 2))

    def test_run(self):
        """all steps end well, or say why they were left out; tables, figures and the report are written"""
        study = self.study()
        steps = study.run(permutations=99, steps=("encode", "register", "pca", "groups"))
        self.assertEqual([s.status for s in steps], ["done", "left out", "done", "done"])
        self.assertEqual([surface.mirrored for surface in study.encode()], 6 * [False] + 6 * [True])
        study.modes(1)
        tables = {path.stem: path.read_text().splitlines() for path in study.tables()}
        self.assertEqual((len(tables["members"]), len(tables["scores"]), len(tables["groups"])), (13, 13, 2))
        self.assertTrue(tables["members"][1].startswith("L_amygdala.ply,A,amygdala,,left,False,61.0,mesh-"))
        adjusted = study.compare_groups(permutations=99, covariates=["age"])
        self.assertEqual((adjusted.raw["regressedOut"], study.results["groups"].raw["regressedOut"]), (["age"], []))
        self.assertEqual([name for name in study.results if "groups" in name], ["groups", "groups-2"])
        self.assertIs(study.compare_groups(permutations=99, covariates=["age"]), adjusted)
        rows = [line.split(",") for line in (study.tables(), (study.out / "tables" / "groups.csv"))[1].read_text().splitlines()]
        self.assertEqual([row[1] for row in rows], ["covariates taken out", "none", "age"])
        report = study.report().read_text()
        self.assertIn("covariates taken out", report)
        self.assertIn("95 %", report)
        self.assertNotIn("<script", report)
        self.assertNotIn('src="http', report)
        for figure in ("mean", "scores", "mode-1", "groups-significance"):
            content = (study.out / "figures" / f"{figure}.png").read_bytes()
            self.assertEqual(content[:8], b"\x89PNG\r\n\x1a\n")
            self.assertIn(f'alt="{figure}"', report)

    def test_volumes(self):
        """a study of label volumes takes one label of each as its mesh"""
        folder = pathlib.Path(self.place.name, "volumes")
        folder.mkdir()
        for name in ("subcortex.nii.gz", "subcortex.seg.nrrd"):
            (folder / name).symlink_to(NUCLEI.parent / "aal_volume" / name)
        with self.assertRaisesRegex(srnf.InputError, "--extract"):
            srnf.Study.from_folder(folder, client=CLIENT)
        study = srnf.Study.from_folder(folder, client=CLIENT, extract=77, lmax=4)
        self.assertEqual([surface.lmax for surface in study.encode()], [4, 4])
        self.assertEqual(CLIENT.mesh(study.members[0].mesh).source.process, "extract")
        jobs = len(CLIENT.jobs())
        again = srnf.Study.from_folder(folder, client=CLIENT, extract=77, lmax=4)
        self.assertEqual((again.encode(), len(CLIENT.jobs())), (study.encode(), jobs))
        with self.assertRaises(srnf.FilesRefused) as caught:
            srnf.Study.from_folder(folder, client=CLIENT, extract=5).encode()
        self.assertEqual([one["file"] for one in caught.exception.refused], ["subcortex.nii.gz", "subcortex.seg.nrrd"])

    def test_level(self):
        """the line of a level lies where the values cross it"""
        from srnf.figures import level_lines, share_below

        vertices = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
        faces = np.array([[i, (i + 1) % 4, 4] for i in range(4)] + [[(i + 1) % 4, i, 5] for i in range(4)])
        shape = srnf.Triangles(vertices, faces, {})
        segments, crossed = level_lines(shape, vertices[:, 2], 0.25)
        self.assertEqual((segments.shape, sorted(crossed)), ((4, 2, 3), [0, 1, 2, 3]))
        self.assertLess(np.abs(segments[:, :, 2] - 0.25).max(), 1e-12)
        self.assertAlmostEqual(share_below(shape, vertices[:, 2], 0.25), 0.5)

    def test_one_label(self):
        """a study of one label leaves out what needs two"""
        self.labels.write_text(nuclei_table().replace(",B,", ",A,"))
        steps = {s.name: s for s in self.study().run(steps=("encode", "groups", "classify"))}
        self.assertEqual(steps["groups"].status, "left out")
        self.assertIn("'A'", steps["classify"].detail)

    def test_label_column(self):
        """another column can be the label; one that looks like it is named where there is none"""
        self.labels.write_text(nuclei_table().replace("label", "Group", 1))
        steps = {s.name: s for s in self.study().run(steps=("groups",))}
        self.assertIn("--label-column Group", steps["groups"].detail)
        self.assertEqual(self.study(label_column="group").labels(), ["A", "B"])
        with self.assertRaisesRegex(srnf.InputError, "no column 'nosuch'; its first line has: file, Group"):
            self.study(label_column="nosuch")


class Labels(unittest.TestCase):
    def setUp(self):
        self.place = scratch()
        self.addCleanup(self.place.cleanup)
        self.folder = pathlib.Path(self.place.name, "f")
        self.folder.mkdir()
        for name in ("a.ply", "b.obj.gz", "lh.pial", "notes.txt", ".hidden.ply"):
            (self.folder / name).touch()
        self.table = pathlib.Path(self.place.name, "t.csv")

    def read(self, text):
        self.table.write_text(text)
        return read_members(self.folder, self.table)

    def test_read(self):
        """semicolons, decimal commas, names without their end, truths and empty cells are read"""
        found = self.read("File;Label;time;side;age;treated\na.ply;x;0,5;L;41,5;true\nb;y;NA;rh;;false\nlh.pial;;;;40;\n")
        self.assertEqual([m.path.name for m in found], ["a.ply", "b.obj.gz", "lh.pial"])
        self.assertEqual((found[0].time, found[0].side, found[1].side, found[2].label), (0.5, "left", "right", None))
        self.assertEqual(found[0].covariates, {"age": 41.5, "treated": True})
        self.assertEqual([stem(m.path) for m in found], ["a", "b", "lh.pial"])
        found = self.read("file\tparticipant_id\na.ply\tsub-1\nb\tsub-1\nlh.pial\tsub-2\n")
        self.assertEqual([m.subject for m in found], ["sub-1", "sub-1", "sub-2"])
        found = self.read("file;age;share\na.ply;41,5;0.125\nb;42;1.5\nlh.pial;40;0.250\n")
        self.assertEqual([m.covariates["share"] for m in found], [0.125, 1.5, 0.25])

    def test_wrong(self):
        """what is wrong in a table is said with its line and what to do"""
        good = "file,label\na.ply,x\nb.obj.gz,y\nlh.pial,z\n"
        for text, message in (
            (good + "c.ply,x\n", r"line 5: there is no mesh 'c.ply'.*did you mean a.ply"),
            (good + "B,x\n", r"line 5: there is no mesh 'B' .*did you mean b.obj.gz"),
            (good + "a.ply,y\n", r"line 5: a.ply was named before, in .*line 2"),
            (good.replace("b.obj.gz,y\n", ""), "has no row for 1 of 3 meshes .*: b.obj.gz"),
            (good.replace("file", "name"), "has no column 'file'; its first line has: name, label"),
            (good + "notes.txt,x\n", "its name is not that of a mesh"),
            (good.replace(",x", ",x,3"), "line 2: 3 cells, but 2 columns"),
            ("file,side\na.ply,up\nb,L\nlh.pial,L\n", "the side 'up' is neither left nor right"),
            ("file,side,time\na.ply,up,x\nb,L,1\nc.ply,L,1\n",
             r"(?s)line 2: the time 'x' is no number.*line 2: the side 'up'.*line 4: there is no mesh 'c.ply'.*no row for 1 of 3"),
            ("file,label\na.ply,x,3\nb,y\nlh.pial\n", r"(?s)line 2: 3 cells.*line 4: 1 cell"),
            ("", "is empty"),
            ("file\n", "no rows"),
            ('file,age\na.ply,"1,5"\nb,"2,5"\nlh.pial,3\n', "column age has commas in its numbers.*separated by commas"),
            ("file;age\na.ply;1,5\nb;2.5\nlh.pial;3\n", "column age has numbers with points and with commas"),
            ("file;age;mass\na.ply;41,5;950\nb;42;1.200\nlh.pial;40;1.100\n",
             "'1.200' of column mass can be two numbers, since column age has '41,5'"),
            ("file\tage\tmass\na.ply\t41.5\t950\nb\t42\t1,200\nlh.pial\t40\t\n", "'1,200' of column mass can be two numbers"),
        ):
            with self.assertRaisesRegex(srnf.InputError, message):
                self.read(text)
        with self.assertRaisesRegex(srnf.InputError, "There is no folder"):
            read_members(self.folder / "x", None)


class Asked(unittest.TestCase):
    def test_predict(self):
        """predict tells meshes and cohorts, which are mappings too, from subjects of several structures"""
        mesh, other = (CLIENT.upload(NUCLEI / f"L_{name}.ply") for name in ("thalamus", "putamen"))
        cohort = CLIENT.cohort("asked", [{"id": mesh}])
        client = srnf.Client(DAEMON.url, progress=False)
        client.run = lambda process, inputs, **options: inputs
        subject = {"thalamus": mesh, "putamen": other}
        for group, told in (
            ([mesh, other], {"surfaces": [mesh, other]}),
            (mesh, {"surfaces": [mesh]}),
            ([mesh.id], {"surfaces": [mesh.id]}),
            ("nuclei", {"cohort": "nuclei"}),
            (cohort, {"cohort": cohort}),
            (subject, {"parts": subject}),
            ([subject], {"parts": [subject]}),
        ):
            self.assertEqual(client.predict("model-x", group), {"model": "model-x", **told})


    def test_mirror(self):
        """mirror takes meshes and surfaces, as such or by their ids"""
        mesh = CLIENT.upload(NUCLEI / "L_thalamus.ply")
        surface = CLIENT.encode(mesh, lmax=4).surface
        image = CLIENT.mirror(surface).surface
        self.assertTrue(image.mirrored)
        self.assertEqual(CLIENT.mirror(surface.id).surface.id, image.id)
        self.assertEqual(CLIENT.mirror(mesh.id).mesh.id, CLIENT.mirror(mesh).mesh.id)


class Terminal(io.StringIO):
    def isatty(self):
        return True


class Bars(unittest.TestCase):
    def test_terminal(self):
        """on a terminal a bar is drawn in place, and what is announced stands above it"""
        out = Terminal()
        with Progress("encode", 4, None, out) as bar:
            bar.update(2)
            with Progress("hidden", 1, False, out):
                announce("The server is away.")
        lines = out.getvalue().split("\n")
        self.assertIn("[############............] 2/4", lines[0])
        self.assertTrue(lines[0].endswith("\rThe server is away."), lines)
        self.assertEqual(lines[1].split("\r")[-1], "encode: 4 done in 0 s")
        self.assertNotIn("hidden", out.getvalue())

    def test_lines(self):
        """without a terminal a bar is one line at its end, and nothing where it is not wanted"""
        out = io.StringIO()
        with Progress("encode", 3, None, out) as bar:
            bar.update(2)
        self.assertEqual(out.getvalue(), "encode: 3 done in 0 s\n")
        with Progress("encode", 3, False, out) as bar:
            bar.update(2)
        self.assertEqual(out.getvalue().count("\n"), 1)

    def test_single(self):
        """one job is told in per cent, as 0/1 says nothing"""
        out = Terminal()
        with Progress("regress", 1, None, out) as bar:
            bar.update(0.41)
        self.assertIn(" 41 %", out.getvalue())
        self.assertTrue(out.getvalue().endswith("regress: done in 0 s\n"), out.getvalue())
