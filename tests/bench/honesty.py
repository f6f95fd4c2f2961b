#!/usr/bin/python3
"""Suite honesty of lambert-bench: the errors that answers state beside the true ones.

    honesty.py PROGRAMS SCALE SEED [SCENE]

PROGRAMS is the folder of lambert, lambertd and lambert-bench; SCALE is quick, default, full, or mesh, which tells the
tables of the mesh alone, by 100 requests; SCENE is a scene file, or a folder of some, in place of the scenes of the
suite. Each scene is precomputed at defaults but for its faces, which are the elements, and as exact inverses of form
factors pair by pair at high quality, with other seeds, whose mean is the reference. All stores get the same random
requests: groups, elements, random emission, the scene's own light and skies, of which all elements, groups or single
elements are selected, or groups reduced. The same requests then go to a store of elements 16 times smaller, which has
the error of the mesh in it: the headline of each answer stands beside the distance of the light of the smaller elements
to that of those that they are parts of. There a lamp on a pole and two panels light the scene too, and sensors at random
places are asked: points that look up and anywhere, and cylinders. lambert-bench reads standard output: one JSON object a line, as of service.py.
"""

import csv
import json
import math
import os
import pathlib
import random
import sys
import tempfile

import h5py
import numpy as np

from service_programs import Client, Failure, Program, post, run_suite, tell

SECONDS = 3600
# share of the elements of each scene, requests of a scene
SIZES = {"quick": (.25, 30), "default": (1, 200), "full": (2, 400), "mesh": (1, 100)}
# Small factors are no more certain at high quality than at defaults, and a few of them may be all the light of a
# group: one reference would err as much as the store that is asked. The mean of several errs less.
REFERENCES = {"quick": 2, "default": 4, "full": 8, "mesh": 0}
# Elements of the reference of the mesh for each of the store that is asked; its operator is off by this share of its light.
FINER, FINE_EPSILON = 16, ".01"
# Below 1,025 elements the preset is an exact inverse, which has the error of the form factors alone.
SCENES = {"cornell": (1300, ["cornell"]), "closed cornell": (640, ["cornell", "--closed"]), "rooms": (1300, ["rooms"]),
          "patio": (1300, ["patio"]), "atrium": (1300, ["atrium"]), "maze": (1300, ["maze"]),
          "canopy": (1300, ["canopy"]), "anechoic": (640, ["anechoic"]), "city 1": (640, ["city", "--variant", "1"]),
          "city 3": (1300, ["city", "--variant", "3", "--terrain", "hill"])}
QUICK = "cornell", "closed cornell"
SUFFIXES = ".obj", ".gltf", ".glb", ".ply", ".stl", ".off"
EMISSIONS = "group", "groups", "element", "elements", "random", "own"
SKIES = "even sky", "cloudy sky", "sun"
LUMINAIRES = "luminaire", "luminaires"
TARGETS = "all", "group", "elements", "reduce"
SENSORS = "sensors", "sensors' means"
# Sensors of each of the three sets, and the panels and the lamp, whose candela fall with the angle.
PLACES = 40
PANEL = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 4 1 1 2 .3 .6 0\n1 1 30\n0 30 60 90\n0\n1000 850 450 0\n"
LAMP = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 30\n0 90 180\n0\n200 300 100\n"
DARK = 1e-6  # of all light: reflected light below this share is rounding of both stores
LIMITS = 2, .2  # of the true error over the stated one: hardly ever above, mostly above
WANTED = .95, .5


def table(name, title, columns, rows):
    clean = [[None if isinstance(x, float) and not math.isfinite(x) else x for x in row] for row in rows]
    tell(table={"name": name, "title": title, "columns": columns, "rows": clean})


COUNTS = (("requests", "", "with a stated and a true error"),
          ("below", "", "share whose true error is below twice the stated one; wanted: .95"),
          ("above", "", "share whose true error is above a fifth of the stated one; wanted: .5"),
          ("median", "", "true over stated error, median"), ("largest", "", "true over stated error, largest"),
          ("unstated", "", "answers that state no error"))


def counts_of(ratios, unstated):
    if not ratios:
        return [0., math.nan, math.nan, math.nan, math.nan, float(unstated)]
    found = np.array(ratios)
    return [float(len(found)), float((found < LIMITS[0]).mean()), float((found > LIMITS[1]).mean()),
            float(np.median(found)), float(found.max()), float(unstated)]


class Store:
    """A store behind a daemon."""

    def __init__(self, folder, programs, path, name):
        self.daemon = Program(name, folder, programs / "lambertd", f"{path}:bench", "--listen", "127.0.0.1:0")
        self.client = Client(self.daemon.port())

    def ask(self, request):
        body = json.dumps(request).encode()
        answer, _ = self.client.must(post("/v1/scenes/bench/radiosity", "application/json", body), "lambertd")
        return json.loads(bytes(answer))

    def about(self):
        answer, _ = self.client.must(b"GET /v1/scenes/bench HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", "lambertd")
        return json.loads(bytes(answer))

    def stop(self):
        self.client.close()
        self.daemon.stop()


def mean_of(answers):
    """The mean of JSON values of one form: of numbers, in lists and objects of these."""
    first = answers[0]
    if isinstance(first, dict):
        return {key: mean_of([answer[key] for answer in answers]) for key in first}
    if isinstance(first, list):
        return np.mean(np.array(answers, dtype=float), axis=0)
    return float(np.mean(answers))


class Reference:
    """The mean of the answers of several stores, of the members that are lighting."""

    def __init__(self, stores):
        self.stores = stores

    def ask(self, request):
        answers = [store.ask(request) for store in self.stores]
        return {key: mean_of([answer[key] for answer in answers])
                for key in ("radiosity", "indirect", "groups") if key in answers[0]}


class Finer:
    """A store of smaller elements, which is asked what another one is asked, and tells the light inside the elements of that."""

    def __init__(self, store, path, asked):
        self.store = store
        with h5py.File(asked) as coarse, h5py.File(path) as fine:
            places = {key: k for k, key in enumerate(self.keys(coarse))}
            self.parent = np.array([places[key] for key in self.keys(fine)])
            self.area, self.group = fine["mesh/area"][:], fine["mesh/group"][:]
            self.names = [name.decode() for name in fine["mesh/group_names"]]
        self.n = len(places)

    @staticmethod
    def keys(store):
        """The face of each element, and whether it is the back of it."""
        face, attributes = store["mesh/face"][:], store["mesh"].attrs
        backs = len(face) // 2 if attributes["two_sided"] else int(attributes.get("backs", 0))
        return [(int(f), k >= len(face) - backs) for k, f in enumerate(face)]

    def emission(self, given):
        """Every part of an element emits what the element does."""
        if isinstance(given, list):
            return np.array(given)[self.parent].tolist()
        if "elements" not in given:
            return given
        values = np.zeros(self.n)
        values[given["elements"]] = given["values"]
        return values[self.parent].tolist()

    def emitted(self, given):
        if isinstance(given, dict):
            values = given.get("groups", {})
            return np.array([values.get(self.names[g], 0) for g in self.group], dtype=float)
        return np.array(given, dtype=float)

    def light(self, request):
        """The radiosity of all parts, [C][n], and the light that they reflect, which is that of a sky as well."""
        emission = self.emission(request["emission"])
        answer = self.store.ask({"emission": emission})
        radiosity = np.atleast_2d(np.array(answer["radiosity"], dtype=float))
        return radiosity, radiosity - (0 if isinstance(emission, dict) and "sky" in emission else self.emitted(emission))


class Requests:
    """Random requests to a scene."""

    def __init__(self, about, groups, own, tiles, seed):
        self.random = random.Random(seed)
        self.n, self.names, self.own, self.tiles = about["elements"], sorted(set(groups)), own, tiles

    def elements(self, most):
        return sorted(self.random.sample(range(self.n), min(self.n, self.random.randint(1, most))))

    def emission(self, kind):
        r = self.random
        if kind == "group":
            return {"groups": {r.choice(self.names): 1}}
        if kind == "groups":
            return {"groups": {name: r.uniform(.1, 1)
                               for name in r.sample(self.names, min(len(self.names), r.randint(2, 5)))}}
        if kind == "element":
            return {"elements": [r.randrange(self.n)], "values": [1]}
        if kind == "elements":
            chosen = self.elements(50)
            return {"elements": chosen, "values": [r.uniform(.1, 1) for _ in chosen]}
        if kind == "random":
            return [r.random() for _ in range(self.n)]
        if kind == "own":
            return self.own
        if kind == "even sky":
            return {"sky": [1] * self.tiles}
        if kind == "cloudy sky":
            return {"sky": [r.uniform(.2, 1) for _ in range(self.tiles)]}
        if kind in LUMINAIRES:
            names = [f"panel.{k}" for k in range(2)] + ["lamp"]
            chosen = r.sample(names, 1 if kind == "luminaire" else r.randint(2, len(names)))
            return {"luminaires": {name: r.uniform(.1, 1) for name in chosen}}
        sun = [.05] * self.tiles
        sun[r.randrange(self.tiles)] = 50
        return {"sky": sun}

    def draw(self, placed=False):
        """placed: luminaires and sensors are among them."""
        kinds = [kind for kind in EMISSIONS if kind != "own" or self.own is not None]
        kind = self.random.choice(kinds + list(SKIES) * (self.tiles > 0) + list(LUMINAIRES) * placed)
        target = self.random.choice(TARGETS + SENSORS * placed)
        request = {"emission": self.emission(kind)}
        if target == "group":
            request["select"] = {"groups": [self.random.choice(self.names)]}
        elif target == "elements":
            request["select"] = {"elements": self.elements(50)}
        elif target == "reduce":
            chosen = self.random.sample(self.names, min(len(self.names), self.random.randint(1, 3)))
            request["reduce"] = {"groups": chosen, "with": self.random.choice([["mean"], ["mean", "min", "max"]])}
        elif target in SENSORS:
            request["select" if target == "sensors" else "reduce"] = {"sensors": [self.random.choice(["up", "any", "faces"])]}
            if target != "sensors":
                request["reduce"]["with"] = ["mean"]
        return kind, target, request


class Scene:
    def __init__(self, bench, name, path):
        self.bench, self.name, self.path = bench, name, path
        self.n_requests = bench.n_requests

    def precompute(self, store, *options, mesh=("--mesh", "faces")):
        if "--seed" not in options:
            options = *options, "--seed", str(self.bench.seed)
        Program("lambert", self.bench.folder, self.bench.programs / "lambert", "precompute", self.path, "-o", store,
                "--quiet", *mesh, "--sky", "tregenza", *options).finish(SECONDS)

    def place(self):
        """Options for luminaires and sensors at random places of the box about the scene."""
        with open(self.path, "rb") as file:  # an OBJ, as `lambert generate` writes it; of other files they would need a reader
            corners = np.array([line.split()[1:4] for line in file if line.startswith(b"v ")], dtype=float)
        if not len(corners):
            return ()
        r, folder = random.Random(self.bench.seed + 3), self.bench.folder
        low, high = corners.min(axis=0), corners.max(axis=0)

        def anywhere(margin):
            return [float(a + (b - a) * r.uniform(margin, 1 - margin)) for a, b in zip(low, high)]

        def direction():
            way = np.array([r.gauss(0, 1) for _ in range(3)])
            return (way / np.linalg.norm(way)).tolist()

        (folder / "panel.ies").write_text(PANEL, encoding="utf-8")
        (folder / "lamp.ies").write_text(LAMP, encoding="utf-8")
        lights = [{"name": f"panel.{k}", "file": "panel.ies", "at": anywhere(.2)} for k in range(2)]
        lights.append({"name": "lamp", "file": "lamp.ies", "at": anywhere(.2)})
        (folder / "lights.json").write_text(json.dumps({"luminaires": lights}), encoding="utf-8")
        (folder / "sensors.json").write_text(json.dumps({
            "points": [{"name": "up", "at": [anywhere(.05) for _ in range(PLACES)], "normal": [0, 0, 1]},
                       *({"name": f"any.{k}", "at": [anywhere(.05)], "normal": direction()} for k in range(PLACES))],
            "cylinders": [{"name": "faces", "at": [anywhere(.05) for _ in range(PLACES)]}]}), encoding="utf-8")
        return "--lights", "lm", "--luminaires", folder / "lights.json", "--sensors", folder / "sensors.json"

    def measure_mesh(self):
        """Pairs of the true error and the headline of answers, with the mesh in them."""
        stores = [self.bench.folder / name for name in ("asked.h5", "finer.h5")]
        served, placed = [], self.place()
        try:
            self.precompute(stores[0], *placed)
            self.read_elements(stores[0])
            words = ("--epsilon", FINE_EPSILON, "--method", "hierarchical", "--probes", "0")
            self.precompute(stores[1], "--seed", str(self.bench.seed + 2000), *words, *placed,
                            mesh=("--elements", str(FINER * len(self.groups))))
            for store in stores:
                served.append(Store(self.bench.folder, self.bench.programs, store, "lambertd"))
            asked, finer = served[0], Finer(served[1], stores[1], stores[0])
            tiles = self.lit_tiles(asked)
            requests, found = Requests(asked.about(), self.groups, self.own_emission(), tiles, self.bench.seed + 1), []
            for _ in range(self.n_requests):
                kind, target, request = requests.draw(bool(placed))
                found += [(kind, target, true, stated) for true, stated in self.mesh_error(target, request, asked, finer)]
            return found
        finally:
            for store in served:
                store.stop()
            for store in stores:
                store.unlink(missing_ok=True)

    def mesh_error(self, target, request, asked, finer):
        """Pairs as of error, of the headline of what is asked."""
        answer = asked.ask(request)
        if target in SENSORS:
            return self.sensor_error(request, asked, finer)
        radiosity, reflected = finer.light(request)
        stated = self.infinite(answer.get("error", {}))
        names = np.array(self.groups)[finer.parent]
        if target == "reduce":
            pairs = []
            for name in request["reduce"]["groups"]:
                weight = finer.area * (names == name) / finer.area[names == name].sum()
                right, there = radiosity @ weight, np.linalg.norm(reflected @ weight)
                off = np.atleast_1d(np.array(answer["groups"][name]["mean"], dtype=float)) - right
                if there > DARK * np.linalg.norm(right):
                    pairs.append((float(np.linalg.norm(off) / there), stated.get("groups", {}).get(name, {}).get("stated")))
            return pairs
        values = np.atleast_2d(np.array(answer["radiosity"], dtype=float))
        chosen = np.arange(self.area.size)
        if "select" in request:
            chosen = (np.array(request["select"]["elements"]) if "elements" in request["select"] else
                      np.flatnonzero(np.array(self.groups) == request["select"]["groups"][0]))
        place = np.full(self.area.size, -1)
        place[chosen] = np.arange(chosen.size)
        part = np.flatnonzero(place[finer.parent] >= 0)
        off = values[:, place[finer.parent[part]]] - radiosity[:, part]
        light = self.norm(reflected[:, part], finer.area[part])
        dark = DARK * self.norm(radiosity[:, part], finer.area[part])
        return [(self.norm(off, finer.area[part]) / light, stated.get("stated"))] if light > dark else []

    def sensor_error(self, request, asked, finer):
        """The root of the mean square error of a set over that of its values, and the stated one. A reduction states
        that of its set, too, so that its set is selected for the truth."""
        answer, name = asked.ask(request), (request.get("select") or request["reduce"])["sensors"][0]
        select = {"sensors": [name]}
        found, right = (np.array(store.ask({"emission": emission, "select": select})["irradiance"], dtype=float)
                        for store, emission in ((asked, request["emission"]), (finer.store, finer.emission(request["emission"]))))
        known = np.isfinite(found) & np.isfinite(right)
        light = np.linalg.norm(right[known])
        stated = self.infinite(answer.get("error", {})).get("sensors", {}).get(name, {}).get("stated")
        return [(float(np.linalg.norm(found[known] - right[known]) / light), stated)] if light > 0 else []

    def measure(self):
        folder = self.bench.folder
        stores = [folder / "asked.h5"] + [folder / f"reference-{k}.h5" for k in range(self.bench.references)]
        served = []
        try:
            self.precompute(stores[0])
            for k, store in enumerate(stores[1:]):
                self.precompute(store, "--seed", str(self.bench.seed + 1000 + k), "--quality", "high", "--method", "exact",
                                "--probes", "0")
            self.read_elements(stores[0])
            for store in stores:
                served.append(Store(folder, self.bench.programs, store, "lambertd"))
            return self.compare(served[0], Reference(served[1:]))
        finally:
            for store in served:
                store.stop()
            for store in stores:
                store.unlink(missing_ok=True)

    def read_elements(self, store):
        """Areas and groups, as a file of values has them."""
        values = self.bench.folder / "values.csv"
        Program("lambert", self.bench.folder, self.bench.programs / "lambert", "solve", store, "--emission",
                self.dark(store), "-o", values).finish(SECONDS)
        with open(values, newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.area = np.array([float(row["area"]) for row in rows])
        self.groups = [row["group"] for row in rows]

    def dark(self, store):
        about = json.loads(Program("lambert", self.bench.folder, self.bench.programs / "lambert", "info", store,
                                   "--json").finish(SECONDS))
        path = self.bench.folder / "dark.npy"
        np.save(path, np.zeros(about["elements"], dtype=np.float32))
        return path

    def compare(self, asked, reference):
        about, tiles = asked.about(), self.lit_tiles(asked)
        requests = Requests(about, self.groups, self.own_emission(), tiles, self.bench.seed)
        found = []
        for _ in range(self.n_requests):
            kind, target, request = requests.draw()
            truth = self.error(target, request, asked, reference)
            found += [(kind, target, true, stated) for true, stated in truth]
        return about, found

    @staticmethod
    def lit_tiles(store):
        """The tiles of its sky; 0: it has none, or the scene is closed."""
        about = store.about()
        tiles = about["sky"]["tiles"] if about["sky"] else 0
        if not tiles:
            return 0
        answer = store.ask({"emission": {"sky": [1] * tiles}, "quantity": "irradiance"})
        return tiles if np.max(answer["irradiance"]) > 0 else 0

    def own_emission(self):
        """Groups whose names say that they are lamps shine in scenes of `lambert generate`."""
        lamps = sorted({name for name in self.groups if "lamp" in name or "light" in name})
        return {"groups": {name: 1 for name in lamps}} if lamps else None

    def weights(self, request):
        if "select" not in request:
            return self.area
        if "elements" in request["select"]:
            return self.area[request["select"]["elements"]]
        return self.area[[k for k, group in enumerate(self.groups) if group == request["select"]["groups"][0]]]

    def error(self, target, request, asked, reference):
        """Pairs of the true and the stated indirect error, one of each name of a reduction; None: not stated."""
        answer, truth = asked.ask(request), reference.ask(request)
        light = reference.ask({**request, "quantity": "indirect"})
        stated = answer.get("error", {})
        if stated.get("light") == "own":  # null says that any error is possible
            stated = self.infinite(stated)
        if target != "reduce":
            area = self.weights(request)
            off = np.array(answer["radiosity"], dtype=float) - np.array(truth["radiosity"], dtype=float)
            true = self.norm(off, area) / max(self.norm(np.array(light["indirect"], dtype=float), area), 1e-300)
            return [(true, stated.get("indirect_mean"))] if true < 1e100 else []
        pairs = []
        for name in request["reduce"]["groups"]:
            means = [np.atleast_1d(np.array(of["groups"][name]["mean"], dtype=float)) for of in (answer, truth, light)]
            there = np.linalg.norm(means[2])
            one = stated.get("groups", {}).get(name, {}).get("mean", stated.get("indirect_mean"))
            if there > 0:
                pairs.append((float(np.linalg.norm(means[0] - means[1]) / there), one))
        return pairs

    @classmethod
    def infinite(cls, x):
        if isinstance(x, dict):
            return {key: cls.infinite(value) for key, value in x.items()}
        return math.inf if x is None else x

    @staticmethod
    def norm(x, area):
        return float(np.sqrt((area * np.atleast_2d(x) ** 2).sum()))


class Bench:
    def __init__(self, programs, scale, seed, given=None):
        self.programs, self.quick, self.seed = pathlib.Path(programs).resolve(), scale == "quick", int(seed)
        self.share, self.n_requests = SIZES[scale]
        self.references = REFERENCES[scale]
        self.given = pathlib.Path(given).resolve() if given else None

    def scenes(self):
        if self.given is not None:
            files = sorted(self.given.iterdir()) if self.given.is_dir() else [self.given]
            for file in files:
                if file.suffix.lower() in SUFFIXES:
                    yield file.stem, file
            return
        for name, (elements, words) in SCENES.items():
            if self.quick and name not in QUICK:
                continue
            path = self.folder / "scene.obj"
            Program("lambert", self.folder, self.programs / "lambert", "generate", *words, "--elements",
                    str(round(self.share * elements)), "-o", path).finish(SECONDS)
            yield name, path

    def run(self):
        with tempfile.TemporaryDirectory(prefix="lambert-bench-", dir=os.environ.get("TMPDIR") or "/tmp") as path:
            self.folder = pathlib.Path(path).resolve()
            pairs, meshes = {}, {}
            for name, file in self.scenes():
                scene = Scene(self, name, file)
                text = ""
                if self.references:
                    about, found = scene.measure()
                    pairs[name] = about["elements"], found
                    text = f", {about['kind']}: {self.told(found)}"
                found = scene.measure_mesh()
                meshes[name] = len(scene.groups), found
                tell(log=f"{name}, {len(scene.groups)} elements{text}; with the mesh: {self.told(found)}")
            if not meshes:
                raise Failure(f"{self.given}: no scene file ({', '.join(SUFFIXES)})")
            if pairs:
                self.tell_tables(pairs, ("scenes", "Stated errors of answers to random requests beside the true ones"),
                                 ("kinds", "The same by emission and by what was asked for"))
            self.tell_tables(meshes, ("mesh", "Headlines of such answers beside the true errors with the mesh in them, "
                                      f"by elements {FINER} times smaller"),
                             ("mesh-kinds", "Headlines by emission and by what was asked for"))

    def told(self, found):
        requests, below, above = self.summary(found)[:3]
        return f"of {requests:.0f} errors {below:.3f} are below twice the stated one, {above:.3f} above a fifth"

    def tell_tables(self, of_scenes, by_scene, by_kind):
        """of_scenes: elements and pairs by name."""
        everything = [pair for _, found in of_scenes.values() for pair in found]
        rows = [[name, float(n), *self.summary(found)] for name, (n, found) in of_scenes.items()]
        table(*by_scene, (("scene", None, "name, or all"), ("elements", "", "n"), *COUNTS),
              [*rows, ["all", None, *self.summary(everything)]])
        kinds = [("emission", kind, 0) for kind in EMISSIONS + SKIES + LUMINAIRES]
        kinds += [("target", kind, 1) for kind in TARGETS + SENSORS]
        table(*by_kind, (("by", None, "emission or target"), ("kind", None, "of it"), *COUNTS),
              [[by, kind, *self.summary([pair for pair in everything if pair[place] == kind])] for by, kind, place in kinds])

    @staticmethod
    def summary(pairs):
        """true over stated error: 0 of an answer that is exact, and stated so."""
        known = [(true, stated) for _, _, true, stated in pairs if stated is not None]
        ratios = [true / stated if stated > 0 else 1. if true == 0 else math.inf for true, stated in known]
        return counts_of(ratios, len(pairs) - len(known))


run_suite(lambda: Bench(*sys.argv[1:]).run())
