"""Answers for some elements, and figures of them, have the bits that these elements have among all."""

import io
import pathlib
import tempfile
import unittest

import h5py
import numpy as np

from command import must
from daemon import Daemon


class SomeElements(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-some-")
        cls.addClassCleanup(folder.cleanup)
        cls.stores = {}
        # Three channels and several pieces of the tree; a sky that lights all elements.
        for name, more in (("cornell", ["--closed", "--elements", 9000]), ("patio", ["--elements", 1500])):
            scene, store = (pathlib.Path(folder.name) / f"{name}.{kind}" for kind in ("obj", "h5"))
            must("generate", name, *more, "-o", scene)
            must("precompute", scene, "-o", store, "--method", "hierarchical", "--epsilon", .05, "--rays", 64, "--probes", 0,
                 "--quiet", *(["--sky", "tregenza"] if name == "patio" else []))
            with h5py.File(store) as file:
                cls.stores[name] = ([g.decode() for g in file["mesh/group_names"]], file["mesh/group"][:],
                                    file["mesh/reflectance"][:].shape)
        cls.daemon = Daemon(*(pathlib.Path(folder.name) / f"{name}.h5" for name in cls.stores), "--threads", 2)
        cls.addClassCleanup(cls.daemon.stop)

    def ask(self, name, body, accept="application/x-npy"):
        answer = self.daemon.post(f"/v1/scenes/{name}/radiosity", body, accept=accept)
        self.assertEqual(answer.status, 200, answer)
        return np.load(io.BytesIO(answer.body)) if accept.endswith("npy") else answer.json()

    def lights(self, name):
        """Each group, one element, nothing, light of either sign, all elements, and a sky of one tile or of all."""
        names, group, (channels, n) = self.stores[name]
        draw = np.random.default_rng(7)
        yield from ({"emission": {"groups": {g: 2.5}}} for g in names)
        yield {"emission": {"groups": {names[0]: 1, names[-1]: 3}}}
        yield {"emission": {"elements": [n // 3], "values": [4]}}
        yield {"emission": {"elements": [], "values": []}}
        yield {"emission": {"elements": list(range(0, n, 97)), "values": [(-1.0) ** k for k in range(0, n, 97)]}}
        yield {"emission": draw.random((channels, n) if channels > 1 else n).round(3).tolist()}
        if name == "patio":
            yield {"emission": {"sky": [0] * 30 + [100.0] + [0] * 114}}
            yield {"emission": {"sky": [10.0] * 145, "groups": {names[0]: 1}}}

    def test_values_and_figures(self):
        for name, (names, group, (channels, n)) in self.stores.items():
            for light in self.lights(name):
                whole = self.ask(name, light).reshape(channels, n)
                self.assertTrue(np.isfinite(whole).all())
                for k, g in enumerate(names):
                    own = np.nonzero(group == k)[0]
                    some = self.ask(name, light | {"select": {"groups": [g]}}).reshape(channels, -1)
                    self.assertEqual(some.tobytes(), whole[:, own].tobytes(), (name, g, str(light)[:80]))
                    figures = self.ask(name, light | {"reduce": {"groups": [g], "with": ["max", "min"]}}, "application/json")
                    for word, of in ("max", np.max), ("min", np.min):
                        self.assertEqual(np.ravel(figures["groups"][g][word]).tolist(), of(whole[:, own], axis=1).tolist())
                own = np.arange(n)[::n // 7]
                some = self.ask(name, light | {"select": {"elements": own.tolist()}}).reshape(channels, -1)
                self.assertEqual(some.tobytes(), whole[:, own].tobytes())

    def test_in_company(self):
        for name, (names, group, (channels, n)) in self.stores.items():
            for count in 3, 12:  # one by one, and side by side
                batch = {"emissions": [{"groups": {names[v % len(names)]: 1 + v}} for v in range(count)]}
                whole = self.ask(name, batch).reshape(count, channels, n)
                for asked in names[:1], names[:2], names:
                    figures = self.ask(name, batch | {"reduce": {"groups": asked, "with": ["max", "uniformity"]}},
                                       "application/json")["groups"]
                    for g in asked:
                        own = whole[:, :, group == names.index(g)]
                        self.assertEqual(np.ravel(figures[g]["max"]).tolist(), own.max(axis=2).ravel().tolist())
                        for v, word in enumerate(np.reshape(figures[g]["uniformity"], (count, channels)).tolist()):
                            self.assertTrue(all(u is None or 0 <= u <= 1 for u in word), (v, word))


if __name__ == "__main__":
    unittest.main()
