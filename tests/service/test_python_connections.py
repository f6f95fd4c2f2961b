"""The Python package beside daemons that are busy, gone, replaced or closed, and in threads and processes that give up."""

import http.server
import os
import shutil
import signal
import tempfile
import threading
import unittest
import unittest.mock

import numpy as np

from command import must
from daemon import Daemon
from lambert_python import lambert
from patience import PATIENCE


class Fake(http.server.BaseHTTPRequestHandler):
    """Answers by `server.script`, a list of functions of this handler; the last one stays."""

    protocol_version = "HTTP/1.1"

    def log_message(self, *words):
        pass

    def do_GET(self):
        self.rfile.read(int(self.headers.get("Content-Length", 0)))
        self.server.asked.append(self)
        script = self.server.script
        (script.pop(0) if len(script) > 1 else script[0])(self)

    do_POST = do_PUT = do_GET

    def say(self, status, body=b"{}", **headers):
        self.send_response_only(status)
        for name, value in headers.items():
            self.send_header(name.replace("_", "-"), value)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)


class Connections(unittest.TestCase):
    """A server that closes, waits and refuses as it is told."""

    def serve(self, *script):
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Fake)
        server.daemon_threads = True
        server.script, server.asked = list(script), []
        threading.Thread(target=server.serve_forever, args=(.01,), daemon=True).start()
        self.addCleanup(server.server_close)
        self.addCleanup(server.shutdown)
        return server, lambert.connect(f"http://127.0.0.1:{server.server_port}", timeout=PATIENCE)

    def test_busy_is_asked_again(self):
        for status in (429, 503):
            busy = lambda h, status=status: h.say(status, b'{"title":"Full","detail":"later"}', Retry_After="0.05")
            server, daemon = self.serve(busy, busy, lambda h: h.say(200, b'{"scenes":[]}'))
            self.assertEqual(daemon.scenes(), [])
            self.assertEqual(len(server.asked), 3)
        server, daemon = self.serve(busy)
        with self.assertRaisesRegex(lambert.Unavailable, "later"):
            daemon.scenes()
        self.assertEqual(len(server.asked), 5)  # once and four times again
        server, daemon = self.serve(lambda h: h.say(503, Retry_After="3600"))
        with self.assertRaises(lambert.Unavailable):  # longer than its time limit
            daemon.scenes()
        self.assertEqual(len(server.asked), 1)
        server, daemon = self.serve(lambda h: h.say(429))
        with self.assertRaises(lambert.Busy):
            lambert.client.Client.ask(daemon._client, lambert.wire.Request("PUT", "/"))
        self.assertEqual(len(server.asked), 1)

    def test_connection_that_was_closed_while_idle(self):
        def last(h):
            h.say(200, b'{"scenes":[]}')
            h.close_connection = True  # without a word of it

        server, daemon = self.serve(last)
        for _ in range(3):
            self.assertEqual(daemon.scenes(), [])
        self.assertEqual(len(server.asked), 3)

        def cut(h):
            h.close_connection = True

        server, daemon = self.serve(cut)
        with self.assertRaises(lambert.Disconnected):
            daemon.scenes()
        self.assertEqual(len(server.asked), 1)  # a new connection that breaks is a daemon that fails

    def test_one_connection_is_kept(self):
        server, daemon = self.serve(lambda h: h.say(200, b'{"scenes":[]}'))
        for _ in range(4):
            daemon.scenes()
        self.assertEqual(len({h.client_address for h in server.asked}), 1)

    def test_giving_up(self):
        entered, leave = threading.Event(), threading.Event()
        self.addCleanup(leave.set)

        def slow(h):
            entered.set()
            leave.wait(PATIENCE)

        server, daemon = self.serve(slow)
        request = lambert.wire.Request("GET", "/v1/scenes")
        with self.assertRaisesRegex(lambert.TimedOut, "no answer within 0.1 s"):
            daemon._client.ask(request, timeout=.1)
        for give_up in ("cancel", "close"):
            entered.clear()
            cancel, ended = threading.Event(), []

            def ask():
                try:
                    daemon._client.ask(request, cancel=cancel if give_up == "cancel" else None)
                except lambert.LambertError as error:
                    ended.append(error)

            thread = threading.Thread(target=ask)
            thread.start()
            self.assertTrue(entered.wait(PATIENCE))
            cancel.set() if give_up == "cancel" else daemon.close()
            thread.join(PATIENCE)
            self.assertIsInstance(ended[0], lambert.Cancelled, give_up)
        leave.set()

    def test_answers_that_are_none(self):
        server, daemon = self.serve(lambda h: h.say(502, b"<html>Bad gateway</html>", Content_Type="text/html"))
        with self.assertRaisesRegex(lambert.LambertError, "502 <html>Bad gateway"):
            daemon.scenes()

    def test_request_says_its_time_limit(self):
        server, daemon = self.serve(lambda h: h.say(200))
        daemon._client.ask(lambert.wire.to_json("/x", {}), timeout=7)
        self.assertAlmostEqual(float(server.asked[0].headers["Lambert-Timeout"]), 7, delta=1)


class Replaced(unittest.TestCase):
    """A daemon that is killed, or reads another store, in the middle of a loop."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        for name, size, reflectance in (("a", "1,1,1", .5), ("b", "1,1,2", .5), ("c", "1,1,1", .2)):
            must("generate", "box", "--divisions", 3, "--size", size, "-o", self.path(name + ".obj"))
            must("precompute", self.path(name + ".obj"), "--reflectance", reflectance, "--probes", 0, "-o", self.path(name + ".h5"), "--quiet")
        shutil.copy(self.path("a.h5"), self.path("room.h5"))

    def path(self, name):
        return os.path.join(self.folder, name)

    def replace(self, daemon, name, times):
        shutil.copy(self.path(name), self.path("new"))
        os.replace(self.path("new"), self.path("room.h5"))
        daemon.signal(signal.SIGHUP)
        daemon.wait_for("serving room", times)

    def test_replaced(self):
        with Daemon(self.path("room.h5")) as daemon:
            scene = lambert.Scene(f"http://127.0.0.1:{daemon.port}")
            E = np.ones(scene.n)
            first = scene.radiosity(E).values
            self.replace(daemon, "c.h5", 2)  # other materials, the same places
            self.assertLess(scene.radiosity(E).max(), first.max())
            self.replace(daemon, "b.h5", 3)  # as many elements elsewhere
            for ask in (lambda: scene.radiosity(E), lambda: scene.adjoint(E), lambda: scene.as_operator() @ E,
                        lambda: scene.reduce(E, groups=scene.names[0])):
                with self.assertRaisesRegex(lambert.SceneChanged, "another geometry"):
                    ask()
            with self.assertRaisesRegex(lambert.SceneChanged, "another geometry"):  # no index is in it, and areas known before are another store's
                scene.reduce({scene.names[0]: 1}, groups=scene.names[0])
            self.assertEqual(lambert.Scene(f"http://127.0.0.1:{daemon.port}").radiosity(E).shape, (54,))
            must("generate", "box", "--divisions", 4, "-o", self.path("d.obj"))
            must("precompute", self.path("d.obj"), "--probes", 0, "-o", self.path("d.h5"), "--quiet")
            blind, seeing = (lambert.Scene(f"http://127.0.0.1:{daemon.port}", check=check) for check in (-1, 0))
            self.replace(daemon, "d.h5", 4)
            for ask in (lambda: seeing.radiosity(E), lambda: seeing.jacobian({"elements": [53]}), lambda: seeing.areas):  # a refusal is of another scene, too
                with self.assertRaisesRegex(lambert.SceneChanged, "96 elements"):
                    ask()
            with self.assertRaises(lambert.SceneChanged):  # its shape alone says so
                blind.radiosity({blind.names[0]: 1})

    def test_daemon_without_tags(self):
        """One before 0.3 is asked after an answer, and gets its members in JSON, as it leaves a query unread."""
        plain = lambert.client.Client.ask

        def without(client, request, **more):
            reply = plain(client, request, **more)
            return lambert.wire.Reply(reply.status, {name: value for name, value in reply.headers.items() if name != "lambert-scene"}, reply.body)

        with Daemon(self.path("room.h5")) as daemon, unittest.mock.patch.object(lambert.client.Client, "ask", without):
            scene = lambert.Scene(f"http://127.0.0.1:{daemon.port}")
            E = np.ones(scene.n)
            query = lambert.light.LightQuery.of(scene._source.about, E, limit=False)
            self.assertIsNone(query.array_request())
            np.testing.assert_allclose(scene @ -E, -(scene @ E), rtol=1e-6)
            self.replace(daemon, "b.h5", 2)
            for ask in (lambda: scene.radiosity(E), lambda: scene.adjoint([E, E])):
                with self.assertRaisesRegex(lambert.SceneChanged, "another geometry"):
                    ask()

    def test_killed_and_started_again(self):
        with Daemon(self.path("room.h5")) as daemon:
            port = daemon.port
            scene = lambert.Scene(f"http://127.0.0.1:{port}/room")
            first = scene.radiosity(np.ones(scene.n)).values
            daemon.kill()
            with self.assertRaises(lambert.Disconnected):
                scene.radiosity(np.ones(scene.n))
        with Daemon(self.path("room.h5"), listen=f"127.0.0.1:{port}"):
            np.testing.assert_array_equal(scene.radiosity(np.ones(scene.n)), first)

    def test_full(self):
        """More clients than may wait: each gets its answer, as all ask again."""
        with Daemon(self.path("room.h5"), "--max-inflight", 1, "--threads", 1) as daemon:
            scene = lambert.Scene(f"http://127.0.0.1:{daemon.port}", retries=100)
            wrong = []

            def loop():
                try:
                    for _ in range(5):
                        scene.radiosity(np.ones((8, 1, scene.n)))
                except lambert.LambertError as error:
                    wrong.append(error)

            threads = [threading.Thread(target=loop) for _ in range(4)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            self.assertEqual(wrong, [])

    def test_longer_than_the_daemon_takes(self):
        """The refusal is read, although the daemon closes before the body is sent."""
        with Daemon(self.path("room.h5"), "--max-body", 1000) as daemon:
            scene = lambert.Scene(f"http://127.0.0.1:{daemon.port}")
            for _ in range(3):
                with self.assertRaisesRegex(lambert.Refused, "longer than 1000 bytes") as caught:
                    scene._source.client.ask(lambert.wire.Request("POST", "/v1/scenes/room/radiosity", bytes(1 << 26), lambert.wire.NPY))
                self.assertEqual(caught.exception.kind, "too-long")
            self.assertEqual(scene.radiosity({scene.names[0]: 1}).shape, (54,))

    def test_forked_process_has_connections_of_its_own(self):
        with Daemon(self.path("room.h5")) as daemon:
            scene = lambert.Scene(f"http://127.0.0.1:{daemon.port}")
            first = scene.radiosity(np.ones(scene.n)).values
            child = os.fork()
            if child == 0:
                good = all(np.array_equal(scene.radiosity(np.ones(scene.n)), first) for _ in range(20))
                os._exit(0 if good else 1)
            for _ in range(20):
                np.testing.assert_array_equal(scene.radiosity(np.ones(scene.n)), first)
            self.assertEqual(os.waitpid(child, 0)[1], 0)

    def test_unix_socket(self):
        with Daemon(self.path("room.h5"), "--unix", self.path("socket"), listen=None) as daemon:
            scene = lambert.Scene(f"unix:{self.path('socket')}")
            self.assertEqual(scene.radiosity(np.ones(scene.n)).shape, (54,))
            self.assertEqual(lambert.Scene(f"unix:{self.path('socket')}:room").name, "room")
            with self.assertRaisesRegex(lambert.NotFound, "HTTP"):
                scene.show()
            self.assertIsNone(daemon.process.poll())
        with self.assertRaises(lambert.Disconnected):
            scene.radiosity(np.ones(scene.n))

    def test_served(self):
        with lambert.serve(self.path("a.h5"), self.path("b.h5")) as daemon:
            self.assertEqual({scene["name"] for scene in daemon.scenes()}, {"a", "b"})
            self.assertTrue(daemon.health())
            process = daemon.process
        self.assertEqual(process.poll(), 0)
        self.assertFalse(daemon.health())
        with self.assertRaisesRegex(lambert.LambertError, "gone.h5"):
            lambert.serve(self.path("gone.h5"))
        with self.assertRaises(lambert.NotFound):
            lambert.serve(self.path("a.h5"), program=self.path("lambertd"))


if __name__ == "__main__":
    unittest.main()
