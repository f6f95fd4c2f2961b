"""A folder of stores for tests of a lambertd, and what they wait for."""

import pathlib
import subprocess
import tempfile
import time
import unittest


from daemon import LAMBERTD, PATIENCE
from make_store import Scene


class Case(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def store(self, file="box.h5", name="box", n=60, **more):
        path = self.folder / file
        kind = more.pop("kind", "low_rank")
        scene = Scene(n, **more)
        scene.write(path, name, kind=kind)
        return path, scene

    def run_once(self, *arguments):
        return subprocess.run([LAMBERTD, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE)

    def names(self, daemon):
        return [s["name"] for s in daemon.get("/v1/scenes").json()["scenes"]]

    def wait_in_flight(self, daemon, count, connection):
        """Until so many requests are open, the one that asks among them."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            text = daemon.get("/metrics", connection=connection).body.decode()
            if f"\nlambertd_in_flight {count}\n" in text:
                return
            time.sleep(0.001)
        self.fail(f"never {count} requests in flight")

    def wait_draining(self, daemon, connection):
        """Until the daemon says that it goes: by 503 or, where the signal came between the answer and its header,
        by closing the connection; asking again would then open another, which nobody accepts any more."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            answer = daemon.get("/readyz", connection=connection)
            if answer.status == 503 or answer.headers["Connection"] == "close":
                return
            time.sleep(0.001)
        self.fail("still ready after the signal")

    def read_all(self, s):
        parts = []
        try:
            while part := s.recv(65536):
                parts.append(part)
        except ConnectionResetError:
            pass
        return b"".join(parts)
