"""Both programs read the same files: `lambert solve --emission FILE` and `POST .../radiosity` accept the same ones,
refuse the same ones for the same reason, and answer the same numbers. A thousand starts of `lambert` are quicker by a
build without a sanitizer, where there is one: the daemon, by the same functions, reads all that it reads."""

import io
import json
import os
import pathlib
import re
import struct
import tempfile
import unittest

import h5py
import numpy as np

from command import REFERENCE, lambert
from daemon import Daemon
from make_store import Scene, set_attributes

CORPUS = pathlib.Path(os.environ["FIXTURES"]) / "json"
N = 12


def npy_bytes(array, version=(1, 0)):
    out = io.BytesIO()
    np.lib.format.write_array(out, np.asarray(array), version=version)
    return out.getvalue()


def npy_by_hand(header, values, version=b"\x01\x00"):
    text = header.encode() + b"\n"
    length = struct.pack("<H" if version[0] == 1 else "<I", len(text))
    return b"\x93NUMPY" + version + length + text + np.asarray(values, "<f4").tobytes()


# EMISSIONs and whether they can be read for 12 elements, channels, tiles of a sky, emitters.
def emissions(channels, tiles):
    dense = [0.5 + i for i in range(N)]
    rows = [[c + i for i in range(N)] for c in range(channels)]
    sky = [0.25 * t for t in range(tiles)]
    return [
        dense, rows, [dense], [dense, dense], rows + [dense], [rows], [rows, rows], dense[:-1], dense + [1], [], [[]],
        [*dense[:-1], -1], [*dense[:-1], 1e39], [*dense[:-1], 3.4e38], [*dense[:-1], "1"], [*dense[:-1], None],
        [*dense[:-1], [1]], [*dense[:-1], 5e-324], 7, "lamp", None, True, {},
        {"elements": [3, 0], "values": [5, 6]}, {"elements": [3], "values": [[5] * channels]},
        {"elements": [3], "values": [[5] * (channels + 1)]}, {"elements": [3, 3], "values": [5, 5]},
        {"elements": [3], "values": []}, {"elements": [], "values": []}, {"elements": [N], "values": [1]},
        {"elements": [-1], "values": [1]}, {"elements": [1.5], "values": [1]}, {"elements": [1.0], "values": [1]},
        {"elements": ["1"], "values": [1]}, {"elements": [1]}, {"values": [1]}, {"elements": 1, "values": 1},
        {"groups": {}}, {"groups": {"lamp": 2}}, {"groups": {"lamp": [2] * channels, "wall": 0}},
        {"groups": {"box": 1}}, {"groups": {"box.red": 1, "box.blue": 2}}, {"groups": {"box": 1, "box.red": 2}},
        {"groups": {"lmap": 1}}, {"groups": {"bux": 1}}, {"groups": {"xyzzy": 1}}, {"groups": {"lamp": -1}},
        {"groups": {"lamp": None}}, {"groups": [1]}, {"groups": {"lamp": 1}, "elements": [1], "values": [1]},
        {"sky": sky}, {"sky": [[s] * channels for s in sky]}, {"sky": sky, "groups": {"lamp": 1}}, {"sky": sky[:-1]},
        {"sky": [*sky, 1]}, {"sky": [-1] * tiles}, {"sky": 1}, {"emitters": [1]}, {"emitters": []},
        {"sky": sky, "other": 1}, {"groups": {"lamp": 1}, "quantity": "radiosity"},
    ]


# Texts that are no json.dumps of a value, each an EMISSION or none.
TEXTS = [
    '{"groups":{"lamp":1,"lamp":2}}', '{"groups":{"lamp":1},"groups":{"lamp":2}}', '{"groups":{"l\\u0061mp":1}}',
    '{"groups":{"lamp\\u0000":1}}', '{"elements":[1],"elements":[1],"values":[1]}', '[1,2,3,NaN]', '[Infinity]', '[1e999]',
    '{"elements":[1],"values":[1e999]}', '{"elements":[1e999],"values":[1]}', '{"elements":[1],"values":[-0.0]}',
    '{"elements":[0],"values":[0.1000000000000000055511151231257827021181583404541015625]}', '[1,]', '{"groups":{"lamp":1}}x',
    '{"groups":{"lamp":01}}', "{'groups':{}}", '\ufeff{"groups":{}}', '{"groups":{"\ud800":1}}', "[" * 80 + "]" * 80,
    ' \n\t{"groups" : {"lamp" : 1.5e0} } \r\n',
]


class SameVerdicts(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.stores, cls.tiles = {}, {}
        for name, channels, sky in (("grey", 1, 4), ("colour", 3, 0), ("bands", 20, 4)):
            path = cls.folder / f"{name}.h5"
            Scene(N, channels=channels, seed=channels).write(path, name, sky=sky)
            # The tool checks the hash of the geometry, and says what it should be.
            with h5py.File(path, "r+") as file:
                set_attributes(file["mesh"], {"source_hash": "0" * 32})
            found = re.search(r"the geometry has ([0-9a-f]{32})", lambert("solve", path).stderr).group(1)
            with h5py.File(path, "r+") as file:
                del file["mesh"].attrs["geometry_hash"]
                set_attributes(file["mesh"], {"geometry_hash": found})
            cls.stores[name], cls.tiles[name] = channels, sky
        cls.daemon = Daemon("--stores", cls.folder)
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def solve(self, store, file, *more, out="out.npy"):
        """The tool's answer, or the reason in its line."""
        path = self.folder / out
        path.unlink(missing_ok=True)
        done = lambert("solve", self.folder / f"{store}.h5", "--emission", file, *more, "-o", path, program=REFERENCE)
        if done.returncode == 0:
            return np.load(path) if out.endswith(".npy") else json.loads(path.read_text()), None
        self.assertEqual((done.returncode, done.stderr.count("\n"), path.exists()), (1, 1, False), done.stderr)
        named = re.fullmatch(f"lambert solve: ({re.escape(str(file))}|{re.escape(str(path))}): (.*)\n", done.stderr)
        self.assertIsNotNone(named, done.stderr)
        return None, named.group(2)

    def ask(self, store, body, kind="application/json"):
        """The daemon's answer, or its reason and status."""
        answer = self.daemon.radiosity(store, body, kind=kind, accept="application/x-npy")
        if answer.status == 200:
            return np.load(io.BytesIO(answer.body)), None, 200
        self.assertIn(answer.status, (400, 422), answer)
        return None, answer.json()["detail"], answer.status

    @staticmethod
    def plain(reason):
        """A reason without the words for the whole text and its place in it, which differ as the bodies do."""
        reason = re.sub(r"\bthe (?:body|file)\b|\bemission(?= must| holds)", "IT", reason)
        return re.sub(r"^emission/|(?<=a key of )emission/", "", reason)

    def compare(self, store, file, body, kind="application/json"):
        """Compares the verdicts on a file and on a request that asks the same; returns whether it is accepted."""
        with self.subTest(store=store, file=file.name, body=body[:200]):
            values, reason = self.solve(store, file)
            wanted, detail, status = self.ask(store, body, kind)
            self.assertEqual(reason is None, detail is None, (reason, detail))
            if reason is None:
                self.assertEqual((values.dtype, values.shape), (wanted.dtype, wanted.shape))
                np.testing.assert_array_equal(values, wanted)
            else:
                self.assertEqual("is not JSON" in reason or "is not NPY" in reason or "is NPY version" in reason,
                                 status == 400, (reason, detail))
                # A text that is cut short ends elsewhere in a request around it.
                if "is not JSON" not in reason:
                    self.assertEqual(self.plain(reason), self.plain(detail))
            return reason is None
        return False

    def write(self, name, data):
        path = self.folder / name
        path.write_bytes(data)
        return path

    def test_emissions(self):
        for store, channels in self.stores.items():
            accepted = []
            for emission in emissions(channels, self.tiles[store]):
                one, both = json.dumps(emission).encode(), json.dumps({"emissions": [emission, {"groups": {"wall": 2}}]}).encode()
                wrapped = b'{"emission":' + one + b"}"
                accepted.append(self.compare(store, self.write("bare.json", one), wrapped))
                if store == "grey":
                    accepted.append(self.compare(store, self.write("one.json", wrapped), wrapped))
                if store != "bands":
                    accepted.append(self.compare(store, self.write("many.json", both), both))
            self.assertGreater(sum(accepted), 12)
            self.assertGreater(len(accepted) - sum(accepted), 30)

    def test_texts(self):
        for text in TEXTS:
            bare = text.encode("utf-8", "surrogatepass")
            inner = bare.removeprefix(b"\xef\xbb\xbf") # a mark stands before all of a text
            wrapped = bare[: len(bare) - len(inner)] + b'{"emission":' + inner + b"}"
            self.compare("grey", self.write("bare.json", bare), wrapped)
            self.compare("grey", self.write("one.json", wrapped), wrapped)

    def test_objects(self):
        dense = [1.0] * N
        for body in ({"emission": dense, "emissions": [dense]}, {"emissions": []}, {"emissions": {}}, {"emissions": [7]},
                     {"emissions": [dense, dense[:-1]]}, {"emissions": [{"sky": [1, 2, 3, 4]}, dense]}):
            text = json.dumps(body).encode()
            self.compare("grey", self.write("body.json", text), text)
        # Options of a request belong on the command line.
        for body in ({"emission": dense, "quantity": "indirect"}, {"quantity": "indirect", "emission": dense},
                     {"emission": dense, "select": {"elements": [1]}}, {"emission": dense, "tolerance": 1e-3}):
            _, reason = self.solve("grey", self.write("options.json", json.dumps(body).encode()))
            self.assertIn("is not a member that can stand here", reason)

    def test_published_cases(self):
        names = sorted(path for path in CORPUS.glob("[yn]_*.json"))
        self.assertEqual(len(names), 121)
        for path in names:
            text = path.read_bytes()
            self.assertFalse(self.compare("grey", path, b'{"emission":' + text + b"}"), path.name)
            _, detail, status = self.ask("grey", text)
            self.assertEqual((status, "is not JSON" in detail), (422, False) if path.name[0] == "y" else (400, True), path.name)

    def test_arrays(self):
        good = np.linspace(0, 3, N)
        with_value = lambda value: np.where(np.arange(N) == 5, value, good)
        header = "{'descr': '<f4', 'fortran_order': False, 'shape': %s}"
        for store, channels in self.stores.items():
            arrays = [npy_bytes(np.resize(good, shape).astype(kind)) for kind in ("<f4", "<f8", "<f2", ">f4", "<i4", "|u1", "<c8")
                      for shape in ((N,), (1, N), (2, N), (channels, N), (1, channels, N), (3, channels, N), (3, 2, N), (0, N),
                                    (0, channels, N), (N - 1,), (), (N, 1), (1, 1, 1, N), (0,))]
            arrays += [npy_bytes(with_value(value)) for value in (np.nan, np.inf, -np.inf, -1, -0.0, 1e39, 3.5e38, 5e-324)]
            arrays += [npy_bytes(good, version) for version in ((1, 0), (2, 0), (3, 0))]
            arrays += [npy_bytes(np.asfortranarray(array)) for array in (np.ones((N, N)), np.outer([1, 2], good), -np.ones((2, N)))]
            arrays += [npy_by_hand(header % shape, good) for shape in ("(12,)", "(12)", "12", "[12]", "(12, )", "(012,)", "(+12,)",
                                                                      "(1e1,)", "(12,),", "(18446744073709551616,)",
                                                                      "(4294967296, 4294967296, 12)", "(-12,)", "(6, 2)")]
            arrays += [npy_by_hand(text, good) for text in (
                "{'shape': (12,), 'descr': '<f4', 'fortran_order': False, }", "{'descr': '<f4', 'shape': (12,)}", "{}", "",
                "{'descr': '<f4', 'fortran_order': False, 'shape': (12,), 'shape': (12,)}", "{'descr': '<f4', 'x': 1}",
                "{'descr': '<f4', 'fortran_order': 0, 'shape': (12,)}", '{"descr": "<f4", "fortran_order": False, "shape": (12,)}',
                "x'descr': '<f4', 'fortran_order': False, 'shape': (12,)")]
            arrays += [npy_by_hand(header % "(12,)", good, version) for version in (b"\x00\x00", b"\x01\x01", b"\x04\x00")]
            arrays += [npy_by_hand(header % "(12,)", good[:-1]), npy_by_hand(header % "(12,)", np.ones(N + 1)), b"", b"\x93NUMPY"]
            if store != "grey":  # the header is read by the same function whatever the scene
                arrays = arrays[:28]
            accepted = [self.compare(store, self.write("array.npy", data), data, "application/x-npy") for data in arrays]
            self.assertGreater(sum(accepted), 6)
            self.assertGreater(len(accepted) - sum(accepted), 6)

    def test_suggestions(self):
        for store in self.stores:
            _, reason = self.solve(store, self.write("a.json", b'{"groups":{"lmap":1}}'))
            self.assertEqual(reason, 'groups/lmap: the scene has no group "lmap"; did you mean "lamp"?')
            _, detail, _ = self.ask(store, {"emission": {"groups": {"lamp": 1}}, "select": {"groups": ["flor"]}})
            self.assertIn('no group "flor"; did you mean "floor"?', detail)

    def test_answers_in_json(self):
        figures = ["mean", "sum", "min", "max", "uniformity", "variance"]
        batch = {"emissions": [{"groups": {"lamp": 1}}, {"groups": {"box": 2, "wall": .5}}]}
        for store in self.stores:
            for body in ({"emission": {"groups": {"lamp": 1}}}, batch):
                file = self.write("light.json", json.dumps(body).encode())
                for quantity in ("radiosity", "irradiance", "indirect"):
                    told, _ = self.solve(store, file, "--quantity", quantity, out="out.json")
                    asked = self.daemon.radiosity(store, {**body, "quantity": quantity}).json()
                    asked.pop("time_ms")
                    self.assertEqual(told, asked)
                reduce = [part for group in ("box", "floor") for part in ("--reduce", f"{group}={','.join(figures)}")]
                told, _ = self.solve(store, file, *reduce, out="out.json")
                asked = self.daemon.radiosity(store, {**body, "reduce": {"groups": ["box", "floor"], "with": figures}}).json()
                asked.pop("time_ms")
                self.assertEqual(told, asked)


if __name__ == "__main__":
    unittest.main()
