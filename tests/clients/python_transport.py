"""The client beside servers that are busy, broken, gone or strange: requests are repeated as they may be, and no more."""

import pathlib
import sys
import threading
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from daemon import Scripted, answer, drop, scratch  # noqa: E402

import srnf  # noqa: E402
from srnf import envelope  # noqa: E402

JOB = {"jobID": "job-1", "processID": "encode", "status": "successful", "progress": 100}
ENCODE = {"id": "encode", "inputs": {"mesh": {"title": "Mesh", "schema": {"type": "string"}, "minOccurs": 1}}}
BUSY = answer(503, {"code": "queue-full", "status": 503, "detail": "The queue is full."}, Retry_After=1)


class Transport(unittest.TestCase):
    def client(self, *answers, **options):
        self.server = Scripted(answers)
        self.addCleanup(self.server.close)
        self.told = []
        client = srnf.Client(self.server.url, notice=self.told.append, progress=False, **options)
        self.addCleanup(client.close)
        return client

    def test_retry_after(self):
        """a busy server is asked again after Retry-After, and not before"""
        client = self.client(BUSY, answer(200, {"version": "1"}))
        self.assertEqual(client.get("/v1/version"), {"version": "1"})
        self.assertGreaterEqual(self.server.seen[1][4] - self.server.seen[0][4], 0.9)
        self.assertIn("The queue is full", self.told[0])

    def test_patience(self):
        """it gives up when patience ends, with the problem"""
        client = self.client(*[BUSY] * 4, patience=0)
        with self.assertRaises(srnf.Problem) as caught:
            client.get("/v1/version")
        self.assertEqual((caught.exception.code, len(self.server.seen)), ("queue-full", 1))

    def test_key(self):
        """an execution carries one Idempotency-Key through all its tries, another execution another"""
        flight = answer(409, {"code": "idempotency-key-in-flight", "status": 409, "detail": "wait"})
        client = self.client(answer(200, ENCODE), drop, flight, answer(201, JOB), answer(201, JOB))
        self.assertEqual(client.submit("encode", mesh="mesh-1").id, "job-1")
        client.submit("encode", mesh="mesh-1")
        posts = [headers["Idempotency-Key"] for method, _, headers, _, _ in self.server.seen if method == "POST"]
        self.assertEqual([posts[0] == key for key in posts], [True, True, True, False])

    def test_final(self):
        """what is final is not repeated: 404, 422, a conflict, a full disk"""
        for status, kind in ((404, srnf.NotFound), (422, srnf.Problem), (409, srnf.Problem), (507, srnf.QuotaExceeded)):
            client = self.client(answer(status, {"code": "x", "status": status, "detail": "no"}))
            with self.assertRaises(kind):
                client.get("/v1/meshes/mesh-1")
            self.assertEqual(len(self.server.seen), 1)

    def test_deleted(self):
        """a deletion whose answer was lost counts as done"""
        client = self.client(answer(200, {"id": "mesh-1"}), drop, drop, answer(404, {"code": "no-such-mesh", "status": 404}))
        client.mesh("mesh-1").delete()
        self.assertEqual([one[0] for one in self.server.seen], ["GET", "DELETE", "DELETE", "DELETE"])

    def test_nothing_there(self):
        """a server that never answered is not waited for, and the message says what to do"""
        started = time.monotonic()
        with self.assertRaises(srnf.Unreachable) as caught:
            srnf.Client("http://127.0.0.1:1").get("/v1/version")
        self.assertLess(time.monotonic() - started, 5)
        self.assertRegex(str(caught.exception), "127.0.0.1:1: connection refused. Is srnfd running there")

    def test_closed(self):
        """closing the client ends a wait in another thread"""
        client = self.client(*[answer(503, {"code": "server-busy", "status": 503}, Retry_After=60)] * 2)
        threading.Timer(0.3, client.close).start()
        started = time.monotonic()
        with self.assertRaises(srnf.SrnfError):
            client.get("/v1/version")
        self.assertLess(time.monotonic() - started, 20)

    def test_strange(self):
        """an answer that is no JSON is a problem all the same"""
        client = self.client(lambda h: (h.send_response(418), h.send_header("Content-Length", "5"), h.end_headers(), h.wfile.write(b"<html")))
        with self.assertRaises(srnf.Problem) as caught:
            client.get("/v1/version")
        self.assertEqual((caught.exception.status, caught.exception.code), (418, "http-418"))

    def test_token(self):
        """a token goes into the header, and a file without one is refused before any request"""
        with scratch() as folder:
            file = pathlib.Path(folder, "token")
            file.write_text("abc123\nsecond line\n")
            client = self.client(answer(200, {}), token_file=file)
            client.get("/v1/version")
            self.assertEqual(self.server.seen[0][2]["Authorization"], "Bearer abc123")
            file.write_text("\n")
            with self.assertRaisesRegex(srnf.InputError, "does not have a token"):
                srnf.Client(token_file=file)

    def test_half_file(self):
        """a file appears only when it is whole"""
        with scratch() as folder:
            half = lambda h: (h.send_response(200), h.send_header("Content-Length", "9"), h.end_headers(), h.wfile.write(b"1234"), drop(h))  # noqa: E731
            client = self.client(answer(200, {"id": "mesh-1", "format": "ply"}), half, half, half, patience=0)
            with self.assertRaises(srnf.Unreachable):
                client.mesh("mesh-1").save(pathlib.Path(folder, "a.ply"))
            self.assertEqual(list(pathlib.Path(folder).iterdir()), [])


class Envelopes(unittest.TestCase):
    def test_lists(self):
        """pages are read by any of the names that their members have"""
        for name in ("items", "jobs", "processes"):
            self.assertEqual(envelope.items({name: [{"id": "a"}]}), [{"id": "a"}])
        self.assertEqual(envelope.cursor({"next": "c1"}), "c1")
        self.assertEqual(envelope.cursor({"links": [{"rel": "next", "href": "/v1/jobs?limit=2&cursor=c2"}]}), "c2")
        self.assertIsNone(envelope.cursor({"next": None, "links": []}))
        self.assertEqual((envelope.total({"total": 3}), envelope.total({})), (3, None))

    def test_links(self):
        """links are read from arrays and objects"""
        self.assertEqual(envelope.link({"links": [{"rel": "self", "href": "/a"}]}, "self"), "/a")
        self.assertEqual(envelope.link({"links": {"self": "/a"}}, "self"), "/a")
        self.assertIsNone(envelope.link({"links": []}, "self"))

    def test_inputs(self):
        """inputs are read from the map of a description"""
        schema = {"type": "integer", "minimum": 4, "maximum": 127, "default": 31}
        lmax = {"title": "Lmax", "description": "Degree.", "schema": schema, "minOccurs": 0, "maxOccurs": 1}
        found = envelope.inputs({"inputs": {"lmax": lmax, "mesh": {"title": "Mesh", "schema": {"type": "string"}}}})
        self.assertEqual([(n, one.required) for n, one in found.items()], [("lmax", False), ("mesh", True)])
        self.assertEqual((found["lmax"].takes(), found["lmax"].default), ("integer, 4..127", 31))
        self.assertEqual((found["lmax"].description, found["mesh"].description), ("Degree.", "Mesh"))
