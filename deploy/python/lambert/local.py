"""A scene in process: the questions that a daemon answers, by an operator of this process and the arrays of its store."""

from __future__ import annotations

from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from .answer import Answer, Figures, Jacobian
from .emissions import Emissions, Light, Operator, needs_daemon
from .errors import Refused, Unsupported
from .kinds import NumpyOperator
from .library import Library, LibraryOperator, find
from .light import QUANTITIES, About, AdjointQuery, LightQuery, word
from .mesh import Elements
from .remote import How
from .store import Store
from .units import Conversion
from .wire import Array

FIGURES = ("mean", "sum", "min", "max", "uniformity", "variance", "share", "ugr")
GRADIENTS = ("emission", "reflectance", "sky", "emitters", "groups", "luminaires")


class Local(Emissions):
    """A store in process. Any number of threads may share it."""

    def __init__(self, path: str, library: Union[None, bool, str] = None, *, store: Optional[Store] = None,
                 operator: Optional[Operator] = None, name: Optional[str] = None) -> None:
        self.store = Store(path) if store is None else store
        if operator is None:
            found = find(library)
            if found is None and library not in (None, False):
                raise Unsupported("liblambert was not found; set LAMBERT_LIBRARY to its path")
            operator = NumpyOperator(self.store) if found is None else LibraryOperator(self.store, Library(found))
        self.op = operator
        facts = self.store.facts()
        facts["emitters"] = operator.names or None
        self.about = About.of(facts, name)
        self.where = path

    def elements(self) -> Elements:
        return self.store.elements

    def groups(self) -> List[Mapping[str, Any]]:
        return self.store.group_lines()

    def document(self, name: str) -> Optional[Mapping[str, Any]]:
        return self.store.document(name)

    # Answers.

    def _solve(self, query: LightQuery, quantity: str) -> Tuple[Light, Array, Optional[List[int]], Dict[str, Any]]:
        """The light of all elements, [m, C, n], in the unit of the light."""
        light = self._light(query.emissions, query.photometric, query.tolerance is None)
        limited: Optional[List[int]] = None
        if self.op.emitters:
            if query.tolerance is not None:
                raise needs_daemon("tolerance with a store of few emitters")
            assert light.W is not None
            out = self.op.apply_emitters(quantity, light.W)
            if query.limit:
                limited = self.op.limit(quantity, None, None, light.W, out)
            return light, out, limited, {}
        H0 = self._direct(light)
        if query.tolerance is not None:
            if isinstance(self.op, NumpyOperator):
                raise Unsupported("tolerance needs liblambert, which was not found; set LAMBERT_LIBRARY, or ask a daemon")
            out, certificates, iterations = self.op.refine(quantity, light.E, H0, query.tolerance)
            if not query.batch:
                return light, out, None, {"certificate": certificates[0], "iterations": iterations[0]}
            return light, out, None, {"certificate": certificates, "iterations": iterations}
        out = self.op.apply(quantity, light.E, H0)
        if query.limit:
            limited = self.op.limit(quantity, light.E, H0, None, out)
        return light, out, limited, {}

    def light(self, query: LightQuery, how: How) -> Answer:
        select = query.select or {}
        if len(select) > 1:
            raise Refused(f"select has {', '.join(select)}; must have one of elements, groups, faces, sensors and probes")
        key = next(iter(select), None)
        if key in ("sensors", "probes"):
            light, values, limited, more = self._at_sensors(query, key, select[key])
        else:
            light, values, limited, more = self._solve(query, query.quantity)
        if query.stated and key is None and query.at in (None, "elements") and query.tolerance is None and isinstance(self.op, LibraryOperator):
            more["error"] = self._stated(light, values, query.quantity, ())
        convert = Conversion(light.kind, query.unit, query.quantity, self.about.channels)
        values = convert(values)
        if query.at == "faces" or key == "faces":
            values = self._at_faces(values, key, select.get(key) if key else None)
        elif key in ("elements", "groups"):
            values = values[:, :, self._selected(key, select[key])]
        if values.shape[1] == 1:
            values = values[:, 0]
        kind = np.float64 if query.tolerance is not None else np.float32
        unit = convert.unit
        if key == "probes":
            unit = "cd/m2" if convert.unit != "W/m2" else "W/(m2 sr)"
        count: Any = limited if query.batch or limited is None else limited[0]
        if more.get("certificate") is not None:
            more["certificate"] = np.multiply(more["certificate"], convert.factor).tolist()
        return Answer.of((values if query.batch else values[0]).astype(kind), unit=unit, limited=count, **more)

    def _selected(self, key: str, wanted: Sequence[Any]) -> Array:
        if key == "groups":
            return np.concatenate([np.flatnonzero(self.store.group == g) for name in wanted for g in self.store.groups.find(name)])
        indices = np.asarray(wanted)
        if indices.size and (indices.dtype.kind not in "iu" or indices.min() < 0 or indices.max() >= self.about.n):
            raise Refused(f"select/elements holds an index that is not from 0 to {self.about.n - 1}", kind="bad-index")
        return indices.astype(int)

    def _at_faces(self, values: Array, key: Optional[str], wanted: Any) -> Array:
        """Means over faces of the scene file by area, of fronts alone; NaN where a face has no element."""
        store = self.store
        if store.face_area is None:
            raise Refused("the store knows no faces; precompute the scene again", kind="not-in-store")
        face, faces, n = store.elements.face[:store.n_fronts], len(store.face_area), store.n_fronts
        of = face >= 0
        sums = np.zeros((*values.shape[:2], faces))
        groups_of = np.full(faces, -1)
        for element, f, area in [*zip(np.flatnonzero(of), face[of], store.area[:n][of]),
                                 *zip(store.face_part[:, 0], store.face_part[:, 1], store.face_part_area)]:
            sums[:, :, f] += area * values[:, :, element]
            groups_of[f] = store.group[element]
        with np.errstate(divide="ignore", invalid="ignore"):
            sums = np.where(store.face_area > 0, sums / store.face_area, np.nan)
        if key == "faces":
            chosen = np.asarray(wanted, int)
            if chosen.size and (chosen.min() < 0 or chosen.max() >= faces):
                raise Refused(f"select/faces holds an index that is not from 0 to {faces - 1}", kind="bad-index")
        elif key == "groups":
            found = [g for name in wanted for g in store.groups.find(name)]
            chosen = np.concatenate([np.flatnonzero(groups_of == g) for g in found])
        elif key is None:
            chosen = np.arange(faces)
        else:
            raise Refused("an answer at faces selects groups or faces", kind="wrong-members")
        return sums[:, :, chosen]

    def _at_sensors(self, query: LightQuery, key: str, names: Sequence[str]) -> Tuple[Light, Array, Optional[List[int]], Dict[str, Any]]:
        if self.op.emitters:
            raise needs_daemon("sensors of a store of few emitters")
        if key == "sensors" and query.quantity != "irradiance":
            raise Refused("the light at sensors is irradiance", kind="wrong-members")
        _, rows = self.store.sensor_rows(names, key == "probes")
        light, B, limited, more = self._solve(query, "radiosity")
        return light, self._gather(light, B.astype(float))[:, :, rows], limited, more

    def _gather(self, light: Light, B: Array) -> Array:
        """[m, C, receivers]: NaN where a receiver has no value."""
        read = self.store.sensors
        assert read is not None
        start, weights = read["indptr"].astype(int), read["weights"]
        rows = np.flatnonzero(np.diff(start))  # of a row without entries reduceat would give the next one's first
        made = np.zeros((*B.shape[:2], len(read["receiver"])))
        if rows.size:
            for m, c in np.ndindex(*B.shape[:2]):
                made[m, c, rows] = np.add.reduceat(weights * B[m, c][read["indices"]], start[rows])
        if light.L is not None and "sky" in read:
            made += light.L @ read["sky"].astype(float)
        if light.D is not None and "luminaires" in read and self.store.luminaires is not None:
            made += (light.D * self.store.luminaires["factors"]) @ read["luminaires"].astype(float)
        made[:, :, read["flags"] != 0] = np.nan
        return made

    def figures(self, query: LightQuery, how: How) -> Figures:
        reduce = query.reduce or {}
        words = [word(name, FIGURES, "figure") for name in reduce["with"]]
        if "ugr" in words:
            raise needs_daemon("ugr")
        over = "sensors" if "sensors" in reduce else "groups"
        if over == "groups" and set(words) <= {"mean", "sum"}:
            found = self._by_rows(query, words)
            if found is not None:
                return found
        if over == "sensors":
            if "sum" in words:
                raise Refused("sum is of groups alone", kind="wrong-members")
            light, values, limited, _ = self._at_sensors(query, over, reduce[over])
            values = Conversion(light.kind, query.unit, "irradiance", self.about.channels)(values)
            counts, _ = self.store.sensor_rows(reduce[over])
            at, parts = 0, {}
            for name, count in counts.items():
                x = values[:, :, at:at + count]
                good = ~np.isnan(x[0, 0])
                parts[name] = (x[:, :, good], np.ones(int(good.sum())))
                at += count
        else:
            light, values, limited, _ = self._solve(query, query.quantity)
            values = Conversion(light.kind, query.unit, query.quantity, self.about.channels)(values)
            parts = {}
            for name in reduce[over]:
                of = np.isin(self.store.group, self.store.groups.find(name)) & self.store.counts
                parts[name] = (values[:, :, of], self.store.area[of])
        unit = Conversion(light.kind, query.unit, "irradiance" if over == "sensors" else query.quantity, self.about.channels).unit
        figures = {name: {figure: self._figure(figure, x.astype(float), A, reduce.get("at_least"), query.batch) for figure in words}
                   for name, (x, A) in parts.items()}
        return Figures.of(figures, unit=unit, limited=limited if query.batch or limited is None else limited[0],
                          error=(lambda: self._stated_of(query)) if over == "groups" and query.tolerance is None else None)

    def _sources(self, given: Union[Array, Mapping[str, Any]]) -> Optional[Dict[str, Optional[Array]]]:
        """An emission as rows read it, whatever n is; None: it is to be expanded, or refused."""
        if isinstance(given, np.ndarray):
            return {"E": self.about.rows(given)} if np.isfinite(given).all() and not self.op.emitters else None
        if set(given) - {"groups", "luminaires", "sky", "emitters"}:
            return None
        groups: List[int] = []
        colours: List[Array] = []
        for name, value in given.get("groups", {}).items():
            found = self.store.groups.find(name)
            if isinstance(value, str) or not set(found).isdisjoint(groups):
                return None
            groups += found
            colours += [self._colour(value, f"emission/groups/{name}")] * len(found)
        made: Dict[str, Optional[Array]] = {"groups": np.array(groups, np.uint32), "exitances": np.array(colours, np.float32)} if groups else {}
        if "luminaires" in given:
            made["D"] = self._dimmers_of(given["luminaires"])
        if "sky" in given:
            made["L"] = self._sky_of(given["sky"])
        if "emitters" in given:
            made["W"] = self._weights_of(given["emitters"])
        return None if any(made[name].min(initial=0) < 0 for name in ("D", "L", "W") if name in made) else made  # type: ignore[union-attr]

    def _by_rows(self, query: LightQuery, words: Sequence[str]) -> Optional[Figures]:
        """Means and sums by the rows of the library, which cost nothing that grows with n; None: they do not answer this."""
        if not isinstance(self.op, LibraryOperator) or self.op.scene is None or query.tolerance is not None or query.photometric is not None:
            return None
        assert query.reduce is not None
        lights = []
        for emission in query.emissions:
            light = self._sources(emission)
            if light is None:
                return None
            lights.append(light)
        names = tuple(query.reduce["groups"])
        for name in names:
            self.store.groups.find(name)  # its words for one that is unknown
        rows = self.op.rows(query.quantity, names)
        assert rows is not None
        try:
            means = rows.means(lights).swapaxes(1, 2)  # [m, C, rows]
        except Refused:  # of few emitters, whose weights must be found
            return None
        if query.limit and (means < 0).any():
            signs = np.array([[any((light[key][..., c, :] if key == "E" else light[key][:, c]).min(initial=0) < 0  # type: ignore[index]
                                   for key in ("E", "exitances") if key in light) for c in range(means.shape[1])] for light in lights])
            means = np.where((means < 0) & ~signs[:, :, None], 0, means)
        convert = Conversion(self.store.lights, query.unit, query.quantity, self.about.channels)
        means = convert(means)
        means = means[:, 0] if means.shape[1] == 1 else means
        means = means if query.batch else means[0]
        figures = {}
        for k, name in enumerate(names):
            mean = means[..., k]
            figures[name] = {figure: None if mean.ndim == 0 and np.isnan(mean) else (mean if figure == "mean" else mean * rows.areas[k]).tolist()
                             for figure in words}
        return Figures.of(figures, unit=convert.unit, error=lambda: self._stated_of(query))

    def _stated_of(self, query: LightQuery) -> Optional[Dict[str, Any]]:
        """The stated errors of means of groups, of a batch the largest, as an answer to `reduce` has them."""
        if not isinstance(self.op, LibraryOperator) or query.reduce is None:
            return None
        light, out, _, _ = self._solve(query, query.quantity)
        groups: Dict[str, Dict[str, Any]] = {}
        for name in query.reduce["groups"]:
            found = self._stated(light, out, query.quantity, self.store.groups.find(name))
            if found is None:
                return None
            groups[name] = found
        worst = max(groups.values(), key=lambda error: error["stated"] or 0)
        return {**worst, "groups": groups}

    def _stated(self, light: Light, out: Array, quantity: str, groups: Sequence[int]) -> Optional[Dict[str, Any]]:
        """The largest of a batch; None: nothing is stated."""
        assert isinstance(self.op, LibraryOperator)
        found = []
        for v in range(len(out)):
            sources = {"W": light.W[v]} if self.op.emitters and light.W is not None else {
                "E": light.E[v], "L": None if light.L is None else light.L[v], "D": None if light.D is None else light.D[v]}
            one = self.op.stated(quantity, sources, out[v], groups)
            if one is None:
                return None
            found.append(one)
        return max(found, key=lambda error: error["stated"] or 0)

    @staticmethod
    def _figure(name: str, x: Array, A: Array, limits: Optional[Sequence[float]], batch: bool) -> Any:
        """A figure of x [m, C, values] by area, as JSON has it."""
        def plain(values: Array) -> Any:
            values = values[:, 0] if values.shape[1] == 1 else values
            values = values if batch else values[0]
            return None if values.ndim == 0 and np.isnan(values) else values.tolist()

        if name == "share":
            return {str(limit): plain((x >= limit) @ A / A.sum()) for limit in limits or ()}
        if x.shape[2] == 0:
            return plain(np.full(x.shape[:2], np.nan))
        mean = x @ A / A.sum()
        if name == "uniformity":
            with np.errstate(divide="ignore", invalid="ignore"):
                return plain(np.where(mean > 0, x.min(2) / mean, np.nan))
        if name in ("min", "max"):
            return plain(x.min(2) if name == "min" else x.max(2))
        return plain(mean if name == "mean" else x @ A if name == "sum" else (x - mean[:, :, None]) ** 2 @ A / A.sum())

    # Gradients.

    def adjoint(self, query: AdjointQuery, how: How) -> List[Dict[str, Array]]:
        """All cotangents of elements together, by one pass over the operator or a few."""
        for name in query.gradient:
            word(name, GRADIENTS, "gradient")
        read = [self._cotangent(given, query.quantity) for given in query.cotangents]
        g, quantity = np.stack([one[0] for one in read]), read[0][2]
        if self.op.emitters:
            found = [self._adjoint_emitters(query, W) for W in self.op.adjoint_emitters(quantity, g)]
        else:
            w = self.op.adjoint(quantity, g)
            found = [self._adjoint(query, quantity, one[0], row.astype(float), one[1]) for one, row in zip(read, w)]
        return [{name: np.stack([made[name] for made in found]) for name in found[0]} if query.batch else found[0]]

    def _cotangent(self, given: Union[Array, Dict[str, Any]], quantity: str) -> Tuple[Array, Optional[Array], str]:
        """A cotangent of elements [C, n]; that of the sensors which it is of, or None; and the quantity that it is of."""
        if isinstance(given, np.ndarray) or "sensors" not in given:
            return self._spread(given, "cotangent")[0], None, quantity
        at_sensors, read = self._sensor_cotangent(given["sensors"])[0], self.store.sensors
        assert read is not None
        i = np.repeat(np.arange(len(read["receiver"])), np.diff(read["indptr"].astype(int)))
        g = np.stack([np.bincount(read["indices"].astype(int), read["weights"] * row[i], self.about.n) for row in at_sensors])
        return g, at_sensors, "radiosity"

    def _adjoint(self, query: AdjointQuery, quantity: str, g: Array, w: Array, at_sensors: Optional[Array]) -> Dict[str, Array]:
        store, C, read = self.store, self.about.channels, self.store.sensors
        # By H0: what E' = E + rho H0 makes of it, and irradiance has it directly.
        by_direct = self.op.rho * w + (g if quantity == "irradiance" else 0)
        made: Dict[str, Array] = {}
        for name in query.gradient:
            if name == "emission":
                made[name] = w
            elif name == "groups":
                made[name] = np.stack([np.bincount(store.group, row, len(store.group_names)) for row in w])
            elif name == "reflectance":
                made[name] = self._by_reflectance(query, quantity, w, g)
            elif name == "sky":
                if store.sky is None:
                    raise Refused("the store has no sky; precompute it with --sky", kind="not-in-store")
                made[name] = by_direct @ store.sky["first_bounce"].T.astype(float)
                if at_sensors is not None and read is not None and "sky" in read:
                    made[name] = made[name] + at_sensors @ read["sky"].T.astype(float)
            elif name == "luminaires":
                if store.luminaires is None:
                    raise Refused("the store has no luminaires; precompute it with --luminaires", kind="not-in-store")
                found = by_direct @ store.luminaires["irradiance"].T.astype(float)
                if at_sensors is not None and read is not None and "luminaires" in read:
                    found = found + at_sensors @ read["luminaires"].T.astype(float)
                made[name] = found * store.luminaires["factors"]
            else:
                raise Refused("the store answers any emission and has no emitters", kind="not-in-store")
        kind = np.float64 if query.doubles else np.float32
        return {name: (array[0] if C == 1 else array).astype(kind) for name, array in made.items()}

    def _sensor_cotangent(self, given: Mapping[str, Any]) -> Tuple[Array, Array]:
        counts, rows = self.store.sensor_rows(list(given))
        read = self.store.sensors
        assert read is not None
        made, at = np.zeros((self.about.channels, len(read["receiver"]))), 0
        for name, count in counts.items():
            value = given[name]
            of = rows[at:at + count]
            if isinstance(value, Mapping):
                array = np.asarray(value["values"], float)
                if array.shape not in ((count,), (self.about.channels, count)):
                    raise Refused(f"cotangent/sensors/{name} has the shape {list(array.shape)}, must have [{count}]", kind="wrong-length")
                made[:, of] += array
            else:
                made[:, of] += self._colour(value, f"cotangent/sensors/{name}")[:, None]
            at += count
        made[:, read["flags"] != 0] = 0
        return made, rows

    def _by_reflectance(self, query: AdjointQuery, quantity: str, w: Array, g: Array) -> Array:
        if query.emission is None:
            raise Refused("a gradient by reflectance needs an emission", kind="wrong-members")
        light = self._light([query.emission], None, True)
        H0 = self._direct(light)
        H = self.op.apply("irradiance", light.E, H0)[0].astype(float)
        if quantity == "indirect":  # of rho (H - H0) itself
            return np.asarray(w * H + g * (H - (0 if H0 is None else H0[0])))
        return np.asarray(w * H)

    def _adjoint_emitters(self, query: AdjointQuery, W: Array) -> Dict[str, Array]:
        made: Dict[str, Array] = {}
        for name in query.gradient:
            count = 0 if self.store.luminaires is None else len(self.store.luminaires["names"])
            if name == "emitters":
                made[name] = W
            elif name == "luminaires" and count:
                made[name] = W[:, self.op.emitters - count:]
            else:
                raise Refused(f"a store of few emitters has gradients by emitters and luminaires, not by {name}", kind="not-in-store")
        return {name: array[0] if self.about.channels == 1 else array for name, array in made.items()}

    def jacobian(self, of: Mapping[str, Any], by: Any, quantity: Optional[str], how: How) -> Jacobian:
        """Of sensors by the light of each column alone, of groups and elements by adjoints."""
        if set(of) not in ({"sensors"}, {"groups"}, {"elements"}):
            raise Refused(f"a jacobian is of sensors, groups or elements, one of them; it is of {', '.join(of) or 'none'}", kind="wrong-members")
        if "sensors" not in of:
            return self._jacobian(of, by, word(quantity or "radiosity", QUANTITIES, "quantity"))
        if quantity not in (None, "irradiance"):
            raise Refused("the light at sensors is irradiance", kind="wrong-members")
        names = [of["sensors"]] if isinstance(of["sensors"], str) else list(of["sensors"])
        store, about = self.store, self.about
        counts, _ = store.sensor_rows(names)
        kinds = [by] if isinstance(by, str) else list(by) if by is not None else \
            [name for name in ("luminaires", "groups", "sky") if name == "groups" or getattr(store, name) is not None]
        made: Dict[str, Array] = {}
        columns: Dict[str, Any] = {}
        for kind in kinds:
            word(kind, ("luminaires", "groups", "sky", "emitters"), "by")
            emissions: List[Mapping[str, Any]]
            if kind == "luminaires":
                columns[kind] = list(store.luminaires["names"]) if store.luminaires else []
                emissions = [{"luminaires": {name: 1}} for name in columns[kind]]
            elif kind == "groups":
                columns[kind] = store.group_names
                emissions = [{"elements": np.flatnonzero(store.group == g), "values": np.ones(int((store.group == g).sum()))}
                             for g in range(len(store.group_names))]
            elif kind == "sky" and store.sky is not None:
                columns[kind] = len(store.sky["tiles"])
                emissions = [{"sky": row} for row in np.eye(columns[kind])]
            else:
                emissions = []
            if not emissions:
                raise Refused(f"the store has no {kind}", kind="not-in-store")
            found = self.light(LightQuery.of(about, emissions, quantity="irradiance", select={"sensors": names}, limit=False), how)
            made[kind] = np.moveaxis(found.values, 0, -1)  # [rows, columns], or [C, rows, columns]
        return Jacobian.of(made, counts, columns)

    def _columns_of(self, by: Any) -> Dict[str, Any]:
        """The names of the columns of each kind, or their number."""
        store = self.store
        there = {"luminaires": list(store.luminaires["names"]) if store.luminaires else [],
                 "groups": [] if self.op.emitters else store.group_names,
                 "sky": len(store.sky["tiles"]) if store.sky is not None and not self.op.emitters else 0, "emitters": self.op.names}
        kinds = [by] if isinstance(by, str) else list(by) if by is not None else [name for name, columns in there.items() if columns]
        for kind in kinds:
            if not there[word(kind, tuple(there), "by")]:
                raise Refused(f"the store has no {kind} to derive by", kind="not-in-store")
        return {kind: there[kind] for kind in kinds}

    def _jacobian(self, of: Mapping[str, Any], by: Any, quantity: str) -> Jacobian:
        """Of means of groups, or of values of elements."""
        (key, wanted), = of.items()
        columns = self._columns_of(by)
        names = [wanted] if isinstance(wanted, str) else list(np.atleast_1d(wanted).tolist())
        found: Dict[str, Array] = {}
        if key == "elements":
            chosen = self._selected("elements", names)
        else:
            groups = [self.store.groups.find(name) for name in names]
        if isinstance(self.op, LibraryOperator) and self.op.scene is not None:
            rows = self.op.rows(quantity, tuple(names)) if key == "groups" else None
            for kind in columns:
                matrix = rows.jacobian(kind) if rows is not None else self.op.jacobian(quantity, chosen, kind)
                assert matrix is not None
                found[kind] = matrix
        else:
            g = np.zeros((len(names), self.about.channels, self.about.n))
            for k in range(len(names)):
                if key == "elements":
                    g[k, :, chosen[k]] = 1
                else:
                    inside = np.isin(self.store.group, groups[k]) & self.store.counts
                    g[k, :, inside] = (self.store.area[inside] / self.store.area[inside].sum())[:, None]
            query = AdjointQuery(self.about, list(g), True, tuple(columns), quantity)
            for kind, array in self.adjoint(query, How())[0].items():  # [rows, C, columns]
                found[kind] = np.moveaxis(array.reshape(len(names), self.about.channels, -1), 0, 1)
        return Jacobian.of({kind: matrix[0] if self.about.channels == 1 else matrix for kind, matrix in found.items()},
                           {name: 1 for name in names} if key == "groups" else {}, columns)

    # Questions that need a daemon, and materials.

    def skies(self, skies: Sequence[Any], how: How) -> List[Dict[str, Any]]:
        raise needs_daemon("a sky by name or weather")

    def weather(self, gaps: Optional[str], how: How) -> Dict[str, Any]:
        raise needs_daemon("the weather beside a store")

    def variant(self, name: str, reflectances: Mapping[str, Any], how: How) -> Local:
        rho = self.store.rho.astype(float)
        for group, value in reflectances.items():
            colour = self._colour(value, f"groups/{group}")
            if (colour < 0).any() or (colour >= 1).any():
                raise Refused(f"groups/{group} = {value!r}, must be at least 0 and below 1", kind="bad-value")
            rho[:, np.isin(self.store.group, self.store.groups.find(group))] = colour[:, None]
        operator = NumpyOperator(self.store, rho.astype(np.float32).astype(float))
        made = Local(self.where, store=_with_rho(self.store, rho), operator=operator, name=f"{self.about.name}@{name}")
        return made

    def delete(self, how: How) -> None:
        if "@" not in self.about.name:
            raise Refused(f"{self.where}: a store stays; a variant can be deleted")

    def close(self) -> None:
        """Nothing is held open."""


def _with_rho(store: Store, rho: Array) -> Store:
    made: Store = Store.__new__(Store)
    made.__dict__.update(store.__dict__)
    made.rho = rho.astype(np.float32)
    arrays = {name: getattr(store.elements, name) for name in ("area", "normal", "centre", "group", "face")}
    made.elements = Elements.of({**arrays, "reflectance": made.rho})
    return made
