"""Black box: `lambert view` starts a daemon, opens a browser and leaves nothing running."""

import base64
import http.client
import json
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time
import unittest
import urllib.parse

from command import ENVIRONMENT, LAMBERT, lambert, must
from patience import PATIENCE


def wait_until(condition):
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(.05)


def status_of(address, path):
    where = urllib.parse.urlsplit(address)
    connection = http.client.HTTPConnection(where.hostname, where.port, timeout=PATIENCE)
    connection.request("GET", path)
    status = connection.getresponse().status
    connection.close()
    return status


def is_gone(pid):
    """True once a process has ended, also where nobody has asked for its status."""
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split()[0] == "Z"
    except (FileNotFoundError, ProcessLookupError):
        return True


class View(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lambert-view-")
        must("generate", "cornell", "--elements", 200, "-o", cls.path("box.obj"))
        must("precompute", cls.path("box.obj"), "-o", cls.path("box.h5"), "--rays", 64, "--probes", 0, "--quiet")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder.name, name)

    def script(self, name, text):
        path = self.path(name)
        with open(path, "w", encoding="utf-8") as file:
            file.write("#!/bin/sh\n" + text)
        os.chmod(path, 0o755)
        return path

    @staticmethod
    def name_of(pid):
        """None of a browser that has ended meanwhile."""
        try:
            return pathlib.Path(f"/proc/{pid}/comm").read_text(encoding="utf-8").strip()
        except (FileNotFoundError, ProcessLookupError):
            return None

    def start(self, *options, **environment):
        process = subprocess.Popen([LAMBERT, "view", *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                   env=dict(ENVIRONMENT, **environment))

        def stop():
            if process.poll() is None:
                process.kill()
            process.communicate()
        self.addCleanup(stop)
        address = process.stdout.readline().strip()
        self.assertRegex(address, r"^http://127\.0\.0\.1:\d+/(#1\.[-_A-Za-z0-9]+)?$")
        children = pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text(encoding="utf-8").split()
        daemons = [int(pid) for pid in children if self.name_of(pid) == "lambertd"]
        self.assertEqual(len(daemons), 1, children)
        return process, address, daemons[0]

    def test_browser_and_interrupt(self):
        opened = self.path("opened")
        browser = self.script("browser", f'echo "$#" "$@" >"{opened}.new" && mv "{opened}.new" "{opened}"\n')
        process, address, daemon = self.start(self.path("box.h5") + ":room", BROWSER=browser)
        wait_until(lambda: os.path.exists(opened))
        with open(opened, encoding="utf-8") as file:
            self.assertEqual(file.read(), f"1 {address}\n")
        # The stores are there before anybody is told the address.
        self.assertEqual(status_of(address, "/readyz"), 200)
        self.assertEqual(status_of(address, "/v1/scenes/room"), 200)
        self.assertEqual(os.getpgid(daemon), daemon)  # Ctrl-C comes to `lambert view` alone
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=PATIENCE)
        self.assertEqual((process.returncode, output), (0, ""), errors)
        self.assertIn("serving room", errors)
        self.assertTrue(is_gone(daemon))

    def test_no_browser(self):
        opened = self.path("never")
        browser = self.script("browser-2", f'touch "{opened}"\n')
        process, address, daemon = self.start(self.path("box.h5"), "--no-browser", BROWSER=browser)
        self.assertEqual(status_of(address, "/healthz"), 200)
        # The end of `lambert view` by any signal ends the daemon.
        process.kill()
        process.wait()
        wait_until(lambda: is_gone(daemon))
        self.assertFalse(os.path.exists(opened))

    def test_lights(self):
        for argument, scene in (":room", "room"), ("", "box"):
            process, address, _ = self.start(self.path("box.h5") + argument, self.path("box.h5") + ":other", "--no-browser",
                                             "--emit", "lamp=10,20,30", "--emit", "floor=.5")
            code = address.split("#1.")[1]
            state = json.loads(base64.urlsafe_b64decode(code + "=" * (-len(code) % 4)))
            self.assertEqual((sorted(state), state["scene"]), (["lighting", "scene"], scene))
            groups = state["lighting"]["groups"]
            self.assertEqual(sorted(groups), ["floor", "lamp"])
            lamp = groups["lamp"]
            luminance = .2126 * 10 + .7152 * 20 + .0722 * 30
            self.assertAlmostEqual(lamp["power"], luminance, 9)
            for part, value in zip(lamp["colour"], (10, 20, 30)):
                self.assertAlmostEqual(part * luminance, value, 9)
            self.assertEqual(groups["floor"], {"on": True, "power": .5, "colour": [1, 1, 1], "kelvin": None})
            process.terminate()
            process.communicate(timeout=PATIENCE)
        for status, words, item in ((1, "no group 'sun'", "sun=1"), (2, "--emit", "lamp"), (2, "--emit", "lamp=bright"),
                                    (2, "--emit", "lamp=-1"), (1, "2 values", "lamp=1,2")):
            done = lambert("view", self.path("box.h5"), "--no-browser", "--emit", item)
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (status, "", 1), done.stderr)
            self.assertIn(words, done.stderr)

    def link_of(self, *options):
        process, address, _ = self.start(*options, "--no-browser")
        process.terminate()
        process.communicate(timeout=PATIENCE)
        code = address.split("#1.")[1]
        return json.loads(base64.urlsafe_b64decode(code + "=" * (-len(code) % 4)))["lighting"]

    def test_lamps_without_a_name_are_dark(self):
        groups = self.link_of(self.path("box.h5"), "--emit", "floor=.5")["groups"]
        self.assertEqual(({name: light["on"] for name, light in groups.items()}, groups["floor"]["power"]),
                         ({"floor": True, "lamp": False}, .5))
        self.assertGreater(groups["lamp"]["power"], 1)

    def test_luminaires(self):
        with open(self.path("spot.ies"), "w", encoding="ascii") as file:
            file.write("IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 9\n0 90\n0\n10 0\n")
        spot = {"file": "spot.ies", "at": [.3, .3, .4]}
        spots = [dict(spot, name="desk", dim=.25), dict(spot, name="a", group="row"), dict(spot, name="b", group="row")]
        with open(self.path("spots.json"), "w", encoding="ascii") as file:
            json.dump({"luminaires": spots}, file)
        store = self.path("spots.h5")
        must("precompute", self.path("box.obj"), "-o", store, "--rays", 64, "--probes", 0, "--quiet", "--lights", "lm",
             "--luminaires", self.path("spots.json"))
        dark = {"on": False, "dim": .25, "tint": [1, 1, 1], "kelvin": None}
        lighting = self.link_of(store, "--dim", "row=1,.5,0")
        # Luminaires of a group that are alike stand in the link as their group; lamps are dark beside them.
        self.assertEqual((sorted(lighting["luminaires"]), lighting["luminaires"]["desk"]), (["desk", "row"], dark))
        self.assertFalse(lighting["groups"]["lamp"]["on"])
        row, luminance = lighting["luminaires"]["row"], .2126 + .7152 * .5
        self.assertTrue(row["on"])
        self.assertAlmostEqual(row["dim"], luminance, 9)
        for part, value in zip(row["tint"], (1, .5, 0)):
            self.assertAlmostEqual(part * luminance, value, 9)
        lighting = self.link_of(store, "--emit", "lamp=3", "--dim", "a=.5")
        self.assertEqual({name: (light["on"], light["dim"]) for name, light in lighting["luminaires"].items()},
                         {"desk": (False, .25), "a": (True, .5), "b": (False, 1)})
        self.assertEqual((lighting["groups"]["lamp"]["on"], lighting["groups"]["lamp"]["power"]), (True, 3))
        # Lamps alone: luminaires are dark.
        self.assertEqual({light["on"] for light in self.link_of(store, "--emit", "lamp=3")["luminaires"].values()}, {False})
        for status, words, path, item in ((1, 'no luminaire "gone"', store, "gone=1"), (2, "--dim", store, "desk"),
                                          (2, "--dim", store, "desk=-1"), (1, "2 values", store, "desk=1,2"),
                                          (1, "has no luminaires", self.path("box.h5"), "desk=1")):
            done = lambert("view", path, "--no-browser", "--dim", item)
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (status, "", 1), done.stderr)
            self.assertIn(words, done.stderr)

    def test_terminated(self):
        process, _, daemon = self.start(self.path("box.h5"), "--no-browser")
        process.terminate()
        process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 0)
        self.assertTrue(is_gone(daemon))

    def test_browser_that_fails(self):
        for browser, words in ((self.path("missing"), f"{self.path('missing')} cannot be run"),
                               (self.script("browser-3", "exit 3\n"), "the browser did not open the address")):
            process, address, _ = self.start(self.path("box.h5"), BROWSER=browser)
            self.assertIn("serving box", process.stderr.readline())
            self.assertIn(words, process.stderr.readline())
            self.assertEqual(status_of(address, "/healthz"), 200)
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=PATIENCE)
            self.assertEqual(process.returncode, 0)

    def test_daemon_that_is_ended(self):
        process, _, daemon = self.start(self.path("box.h5"), "--no-browser")
        os.kill(daemon, signal.SIGKILL)
        _, errors = process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 1)
        self.assertIn("lambertd was ended by signal 9", errors)

    def test_nothing_to_view(self):
        done = lambert("view", self.path("box.obj"))
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertIn("box.obj", done.stderr)
        self.assertIn("no store can be served", done.stderr)
        done = lambert("view")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1))
        # A copy without a daemon beside it or in PATH.
        alone = self.path("alone")
        os.mkdir(alone)
        shutil.copy(LAMBERT, alone)
        done = subprocess.run([os.path.join(alone, "lambert"), "view", self.path("box.h5")], capture_output=True, text=True,
                              env=dict(ENVIRONMENT, PATH=alone), timeout=PATIENCE, check=False)
        self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (1, "", 1), done.stderr)
        self.assertIn("lambertd cannot be run", done.stderr)


if __name__ == "__main__":
    unittest.main()
