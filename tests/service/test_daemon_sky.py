"""GET /v1/scenes/NAME/sky and /weather: the tiles of a store, and the weather file beside it, of which pages make skies."""

import os
import pathlib
import signal
import tempfile
import time
import unittest

import h5py
import numpy as np

from command import must
from daemon import PATIENCE, Daemon
from make_store import Scene, add_checksums
from weather import a_year, epw, wea

N = 60
EAST_NORTH_UP = {"x": ((0, 1, 0), (0, 0, 1)), "y": ((1, 0, 0), (0, 0, -1)), "z": ((1, 0, 0), (0, 1, 0))}


class SkyAndWeather(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def serve(self, *arguments):
        daemon = Daemon(*arguments)
        self.addCleanup(daemon.__exit__, None, None, None)
        return daemon

    def test_the_tiles_are_those_of_the_store(self):
        """Of real stores, by every way up; the columns of /sky/tiles are the reference."""
        scene = self.folder / "box.obj"
        must("generate", "box", "--divisions", "1", "-o", scene)
        for up, tiling in (("z", "tregenza"), ("y", "reinhart:2"), ("x", "grid:12x5")):
            must("precompute", scene, "-o", self.folder / f"{up}.h5", "--up", up, "--sky", tiling, "--ground-albedo", ".25",
                 "--rays", "64", "--probes", "0", "--quiet")
        daemon = self.serve(*(f"{self.folder / up}.h5:{up}" for up in EAST_NORTH_UP))
        for up, (east, north) in EAST_NORTH_UP.items():
            told = daemon.get(f"/v1/scenes/{up}/sky").json()
            with h5py.File(self.folder / f"{up}.h5") as f:
                tiles, tiling = f["sky/tiles"][:], f["sky"].attrs["tiling"].decode()
            self.assertEqual((told["tiling"], told["tiles"], told["up"], told["ground_albedo"], told["weather"]),
                             (tiling, len(tiles), up, .25, None))
            self.assertEqual((tuple(told["east"]), tuple(told["north"])), (east, north))
            zenith = np.cross(east, north)
            azimuth, altitude = np.radians(np.array(told["centre"])).T
            directions = (np.outer(np.cos(altitude) * np.sin(azimuth), east) + np.outer(np.cos(altitude) * np.cos(azimuth), north)
                          + np.outer(np.sin(altitude), zenith))
            np.testing.assert_allclose(directions, tiles[:, :3], atol=1e-12)
            np.testing.assert_allclose(np.radians(told["altitude"]), tiles[:, 3:5], atol=1e-12)
            np.testing.assert_allclose(np.radians(told["azimuth"]), tiles[:, 5:7], atol=1e-12)
            np.testing.assert_array_equal(told["solid_angle"], tiles[:, 7])
            np.testing.assert_array_equal(told["cosine"], tiles[:, 8])
            self.assertTrue(((np.array(told["centre"])[:, 0] >= 0) & (np.array(told["centre"])[:, 0] < 360)).all())
            # The light of one tile, by the daemon's own answer, is of the tile at that place.
            self.assertEqual(daemon.radiosity(up, {"emission": {"sky": [1] * len(tiles)}}).status, 200)

    def test_a_store_without_a_sky(self):
        Scene(N).write(self.folder / "plain.h5", "plain")
        daemon = self.serve(self.folder / "plain.h5")
        answer = daemon.get("/v1/scenes/plain/sky")
        self.assertEqual((answer.status, answer.json()["detail"]), (404, "plain: the store has no sky"))
        answer = daemon.get("/v1/scenes/plain/weather")
        self.assertEqual((answer.status, answer.json()["detail"]), (404, "plain: no .epw or .wea file of its name is beside the store"))

    def test_broken_tiles_are_refused(self):
        path = self.folder / "broken.h5"
        Scene(N).write(self.folder / "plain.h5", "plain")
        for place, value, words in (((2, 4), np.nan, "/sky/tiles[2][4] is no finite number"),
                                    ((1, 7), 0, "/sky/tiles[1][7] = 0, a solid angle must be above 0")):
            Scene(N).write(path, "broken", sky=4)
            with h5py.File(path, "r+") as f:
                f["sky/tiles"][place] = value
                add_checksums(f)
            daemon = self.serve(path, self.folder / "plain.h5")
            self.assertIn(words, daemon.errors())
            self.assertEqual([s["name"] for s in daemon.get("/v1/scenes").json()["scenes"]], ["plain"])

    def test_weather(self):
        hours = list(a_year())
        Scene(N).write(self.folder / "box.h5", "made from another", sky=4)
        (self.folder / "box.wea").write_text(wea(hours))
        daemon = self.serve("--stores", self.folder)
        path = "/v1/scenes/box"
        answer = daemon.get(f"{path}/weather")
        self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, "text/plain; charset=utf-8"))
        self.assertEqual(answer.body.decode(), wea(hours))
        self.assertEqual(daemon.get(f"{path}/sky").json()["weather"], "wea")
        again = daemon.get(f"{path}/weather", headers={"If-None-Match": answer.headers["ETag"]})
        self.assertEqual((again.status, again.body), (304, b""))
        # An EPW goes before a WEA, once the stores are read again; the weather is no change of the operator.
        (self.folder / "box.epw").write_bytes(b"\xef\xbb\xbf" + epw(hours).encode())
        self.assertEqual(daemon.get(f"{path}/weather").body, answer.body)
        daemon.signal(signal.SIGHUP)
        deadline = time.monotonic() + PATIENCE
        while daemon.get(f"{path}/sky").json()["weather"] != "epw" and time.monotonic() < deadline:
            time.sleep(.01)
        self.assertEqual(daemon.get(f"{path}/weather").body[3:].decode(), epw(hours))

    def test_nothing_else_is_ever_served(self):
        beside = {"text": b"root:x:0:0\n", "nul": b"LOCATION,\0", "empty": b"", "long": b"LOCATION," + b"," * (8 << 20)}
        for name, content in beside.items():
            Scene(N).write(self.folder / f"{name}.h5", name, sky=4)
            (self.folder / f"{name}.epw").write_bytes(content)
        Scene(N).write(self.folder / "pipe.h5", "pipe", sky=4)
        os.mkfifo(self.folder / "pipe.epw")
        Scene(N).write(self.folder / "folder.h5", "folder", sky=4)
        (self.folder / "folder.epw").mkdir()
        daemon = self.serve("--stores", self.folder)
        words = {"text": "begin with", "nul": "no text", "empty": "begin with", "long": "at most 8388608 are served", "pipe": "is not a file",
                 "folder": "is not a file"}
        for name, said in words.items():
            answer = daemon.get(f"/v1/scenes/{name}/weather")
            self.assertEqual(answer.status, 404, name)
            self.assertIn(said, answer.json()["detail"], name)
            self.assertNotIn(str(self.folder), answer.json()["detail"])
            self.assertIsNone(daemon.get(f"/v1/scenes/{name}/sky").json()["weather"])
        for name in "..%2Ftext", "text.epw", "%2e%2e", "text%00":
            self.assertEqual(daemon.get(f"/v1/scenes/{name}/weather").status, 404)

    def test_weather_counts_as_memory(self):
        Scene(N).write(self.folder / "box.h5", "box", sky=4)
        (self.folder / "box.epw").write_bytes(b"LOCATION," + b"," * (4 << 20))
        daemon = self.serve(self.folder / "box.h5", "--max-memory", "2M", "--threads", "1")
        answer = daemon.get("/v1/scenes/box/weather")
        self.assertEqual(answer.status, 404)
        self.assertIn("--max-memory has no room for it", answer.json()["detail"])


if __name__ == "__main__":
    unittest.main()
