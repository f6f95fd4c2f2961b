"""GET /v1/openapi.json: a sound OpenAPI 3.1 document, of exactly the routes there are, that says what is answered."""

import json
import os
import pathlib
import re
import runpy
import subprocess
import tempfile
import unittest

import jsonschema
from jsonschema import Draft202012Validator

from daemon import Daemon
from make_store import Scene

N = 60
METHODS = "get put post delete options head patch trace".split()
SOURCE = pathlib.Path(__file__).resolve().parents[2]
ROUTES = SOURCE / "server" / "route" / "routes.c"


def obj(required=(), patterns=None, /, **properties):
    """A closed object, but for x-…"""
    return {"type": "object", "required": list(required), "properties": properties,
            "patternProperties": {"^x-": {}, **(patterns or {})}, "additionalProperties": False}


def d(name):
    return {"$ref": f"#/$defs/{name}"}


def either(name):
    return {"if": {"type": "object", "required": ["$ref"]}, "then": d("reference"), "else": d(name)}


TEXT, FLAG = {"type": "string"}, {"type": "boolean"}
ANY_OF = lambda what: {"type": "object", "additionalProperties": what}

# The parts of the specification (3.1.0, section 4.8) that a document without callbacks, links and webhooks can use.
DOCUMENT = {
    "$schema": "https://json-schema.org/draft/2020-12/schema",
    **obj(("openapi", "info", "paths"), openapi={"type": "string", "pattern": r"^3\.1\.\d+$"}, info=d("info"),
          jsonSchemaDialect=TEXT, servers={"type": "array", "items": obj(("url",), url=TEXT, description=TEXT)},
          paths=obj((), {"^/": d("path")}), components=d("components"),
          security={"type": "array", "items": d("security")},
          tags={"type": "array", "items": obj(("name",), name=TEXT, description=TEXT)}),
    "$defs": {
        "reference": obj(("$ref",), **{"$ref": TEXT, "summary": TEXT, "description": TEXT}),
        "info": obj(("title", "version"), title=TEXT, version=TEXT, summary=TEXT, description=TEXT,
                    termsOfService=TEXT, contact={"type": "object"},
                    license=obj(("name",), name=TEXT, identifier=TEXT, url=TEXT)),
        "security": ANY_OF({"type": "array", "items": TEXT}),
        "path": obj(summary=TEXT, description=TEXT, parameters=d("parameters"), **{m: d("operation") for m in METHODS}),
        "parameters": {"type": "array", "items": either("parameter")},
        "operation": obj(("responses",), tags={"type": "array", "items": TEXT}, summary=TEXT, description=TEXT,
                         operationId=TEXT, parameters=d("parameters"), requestBody=either("body"),
                         responses={**obj((), {r"^[1-5](\d\d|XX)$": either("response")}, default=either("response")), "minProperties": 1},
                         deprecated=FLAG, security={"type": "array", "items": d("security")}),
        "parameter": {**obj(("name", "in", "schema"), **{"name": TEXT, "in": {"enum": ["query", "header", "path", "cookie"]},
                                                        "description": TEXT, "required": FLAG, "deprecated": FLAG,
                                                        "schema": d("schema"), "example": {}, "style": TEXT,
                                                        "explode": FLAG}),
                      "if": {"properties": {"in": {"const": "path"}}},
                      "then": {"required": ["required"], "properties": {"required": {"const": True}}}},
        "body": obj(("content",), description=TEXT, required=FLAG, content=d("content")),
        "content": {"type": "object", "propertyNames": {"pattern": "^[a-z*]+/[a-z0-9.+*-]+$"}, "additionalProperties":
                    obj(schema=d("schema"), example={}, examples=ANY_OF(obj(summary=TEXT, description=TEXT, value={})))},
        "response": obj(("description",), description=TEXT, content=d("content"), headers=ANY_OF(either("header"))),
        "header": obj(("schema",), description=TEXT, required=FLAG, schema=d("schema"), example={}),
        "schema": {"type": ["object", "boolean"]},
        "components": obj(schemas=ANY_OF(d("schema")), responses=ANY_OF(either("response")),
                          parameters=ANY_OF(either("parameter")), headers=ANY_OF(either("header")),
                          securitySchemes=ANY_OF({"type": "object", "required": ["type"]})),
    },
}


def walk(value, where=()):
    yield where, value
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from walk(inner, (*where, key))


class OpenApi(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        path = pathlib.Path(folder.name)
        Scene(N).write(path / "grey.h5", "grey", sky=4)
        Scene(N, channels=3).write(path / "colour.h5", "colour")
        cls.daemon = Daemon("--stores", path, "--max-body", 100_000)
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)
        cls.answer = cls.daemon.get("/v1/openapi.json")
        cls.document = cls.answer.json()

    def resolve(self, pointer):
        self.assertTrue(pointer.startswith("#/"), pointer)
        found = self.document
        for step in pointer[2:].split("/"):
            found = found[step.replace("~1", "/").replace("~0", "~")]
        return found

    def at(self, what):
        return self.resolve(what["$ref"]) if "$ref" in what else what

    def operations(self):
        for path, item in self.document["paths"].items():
            for method in METHODS:
                if method in item:
                    yield path, method.upper(), item[method]

    def validator(self, schema):
        return Draft202012Validator({**schema, "components": self.document["components"]})

    def fits(self, value, schema):
        errors = [f"{'/'.join(map(str, e.absolute_path))}: {e.message[:300]}" for e in self.validator(schema).iter_errors(value)]
        self.assertEqual(errors, [])

    def named(self, name):
        return {"$ref": f"#/components/schemas/{name}"}

    def test_it_is_the_file(self):
        self.assertEqual((self.answer.status, self.answer.headers["Content-Type"]), (200, "application/json"))
        self.assertEqual(self.answer.body, (ROUTES.parent / "openapi.json").read_bytes())

    def test_its_version_is_that_of_the_programs(self):
        for program in os.environ["LAMBERT"], os.environ["LAMBERTD"]:
            printed = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
            self.assertEqual(printed.split()[1], self.document["info"]["version"])

    def test_its_layout(self):
        layout = runpy.run_path(SOURCE / "tests" / "openapi.py")
        self.assertEqual(self.answer.body.decode(), layout["text"](), "run tests/openapi.py")

    def test_it_is_openapi(self):
        Draft202012Validator.check_schema(DOCUMENT)
        errors = [f"{'/'.join(map(str, e.absolute_path))}: {e.message[:200]}"
                  for e in Draft202012Validator(DOCUMENT).iter_errors(self.document)]
        self.assertEqual(errors, [])

    def test_the_check_can_fail(self):
        for spoil in (lambda x: x.pop("info"), lambda x: x.update(openapi="3.0.3"), lambda x: x.update(path={}),
                      lambda x: x["paths"].update(relative={}),
                      lambda x: x["paths"]["/healthz"]["get"].pop("responses"),
                      lambda x: x["paths"]["/healthz"]["get"]["responses"].update({"20": {"description": ""}}),
                      lambda x: x["paths"]["/healthz"]["get"]["responses"]["200"].pop("description"),
                      lambda x: x["components"]["parameters"]["Name"].pop("required")):
            copy = json.loads(self.answer.body)
            spoil(copy)
            self.assertFalse(Draft202012Validator(DOCUMENT).is_valid(copy))

    def test_references_and_schemas(self):
        schemas = 0
        used = set()
        for where, value in walk(self.document):
            if isinstance(value, dict) and "$ref" in value and where[-1] != "properties":
                self.resolve(value["$ref"])
                used.add(value["$ref"])
            if where and where[-1] == "schema" or where[:2] == ("components", "schemas") and len(where) == 3:
                Draft202012Validator.check_schema(value)
                schemas += 1
        self.assertGreater(schemas, 20)
        for kind, members in self.document["components"].items():
            for name in members:
                if kind != "securitySchemes":
                    self.assertIn(f"#/components/{kind}/{name}", used)
        for _, _, operation in self.operations():
            for body in (operation.get("requestBody", {}), *map(self.at, operation["responses"].values())):
                for content in body.get("content", {}).values():
                    for example in content.get("examples", {}).values():
                        self.fits(example["value"], content["schema"])

    def test_operations(self):
        names = []
        for path, method, operation in self.operations():
            names.append(operation["operationId"])
            holes = re.findall(r"\{(\w+)\}", path)
            parameters = [self.at(p) for p in operation.get("parameters", [])]
            self.assertEqual([p["name"] for p in parameters if p["in"] == "path"], holes, path)
            self.assertEqual(len({(p["name"], p["in"]) for p in parameters}), len(parameters))
            self.assertTrue(operation["summary"])
            token = operation.get("security", self.document["security"])
            self.assertEqual({"token": []} in token, path.startswith("/v1/") or path == "/metrics")
            self.assertEqual("401" in operation["responses"], {"token": []} in token)
            self.assertEqual("404" in operation["responses"], bool(holes) or path.startswith("/viewer."))
        self.assertEqual(len(set(names)), len(names))

    def test_it_has_the_routes_that_there_are(self):
        table = re.findall(r'\.method = "([A-Z]+)",\s+\.pattern = "([^"]+)"', ROUTES.read_text())
        self.assertGreater(len(table), 10)
        self.assertEqual(sorted(table), sorted((method, path) for path, method, _ in self.operations()))

    def statuses_of(self, *files):
        """The statuses of the classes of problems that these files name."""
        classes = dict(re.findall(r"\[(PROBLEM_\w+)\] = \{(\d+),", (SOURCE / "solver" / "codec" / "problem.c").read_text()))
        self.assertGreater(len(classes), 20)
        found = set()
        for file in files:
            named = re.findall(r"\bPROBLEM_\w+", (SOURCE / file).read_text())
            found |= {classes[name] for name in named if name not in ("PROBLEM_NONE", "PROBLEM_COUNT")}
        return found

    def test_every_status_that_the_code_can_give(self):
        """A problem that the sources of a route name is described there, and no other one is."""
        names = ("answer group_figures json json_adjoint json_emission json_jacobian json_parser json_reduce json_select json_sensors "
                 "json_skies npy request")
        body = [f"solver/codec/{name}.c" for name in names.split()]
        own = {"get_healthz": ["get_health.c"], "get_readyz": ["get_health.c"], "get_metrics": ["get_metrics.c"],
               **{f"keeps_{name}": ["kept_answer.c", file] for name, file in (
                   ("scenes", "get_scenes.c"), ("scene", "get_scenes.c"), ("mesh", "get_mesh.c"), ("elements", "get_elements.c"), ("groups", "get_sky.c"),
                   ("openapi", "get_documents.c"), ("manual", "get_documents.c"),
                   ("sky", "get_sky.c"), ("luminaires", "get_sky.c"), ("sensors", "get_sky.c"), ("weather", "get_sky.c"))},
               "post_radiosity": ["post_radiosity.c", "array_members.c", "refined_answer.c", "radiosity_figures.c", "sensor_figures.c"],
               "post_adjoint": ["post_adjoint.c", "array_members.c"], "post_jacobian": ["post_jacobian.c"],
               "post_skies": ["post_skies.c", "weather_source.c"], "post_weather": ["post_weather.c", "weather_source.c"], "post_sun": ["post_sun.c"],
               "put_reflectance": ["reflectance_variants.c"], "delete_reflectance": ["reflectance_variants.c"],
               "delete_scene": ["reflectance_variants.c"],
               **{f"get_viewer_{part}": ["get_viewer.c"] for part in ("page", "script", "style", "icon", "licences")}}
        table = re.findall(r"\{\.method = .*?\}(?=,\s)", ROUTES.read_text(), re.S)
        self.assertGreater(len(table), 10)
        framing, pages = self.statuses_of("server/http/framing.c"), self.statuses_of("server/http/browser.c")
        self.assertEqual((framing, pages), ({"400", "501"}, {"403"}))
        for row in table:
            method, path = re.search(r'\.method = "(\w+)",\s+\.pattern = "([^"]+)"', row).groups()
            handler = re.search(r"(?:\.(?:handle|steps) = &?|KEPT\()(\w+)", row)[1]
            wanted = framing | self.statuses_of("server/route/call.c")  # 503: memory is short for any answer
            if ".any_host" not in row:
                wanted |= pages
            if ".open" not in row or "TOKEN_METRICS" in row:
                wanted |= {"401"}
            if "{name}" in path:  # no such scene; a variant that could not be built answers by its problem
                wanted |= {"404"}
                if method != "DELETE":
                    wanted |= self.statuses_of("server/scene/variants.c") - ({"429"} if method != "PUT" else set())
            if "with_body" in row:
                wanted |= {"413", "415"}
            for file in own[handler]:
                wanted |= self.statuses_of(f"server/route/{file}")
            if handler.startswith("post_"):
                wanted |= self.statuses_of(*body)
            if method in ("PUT", "DELETE") and "with_body" in row:
                wanted |= self.statuses_of("solver/codec/reflectance.c", "solver/codec/json.c")
            # One file holds the handlers of variants: not all of its problems are of each.
            # The page itself is also there where its files are not.
            wanted -= {"get_viewer_page": {"404"}, "put_reflectance": {"405"}, "delete_reflectance": {"405", "409", "429"},
                       "delete_scene": {"409", "413", "415", "422", "429"}}.get(handler, set())
            said = set(self.document["paths"][path][method.lower()]["responses"])
            with self.subTest(method=method, path=path):
                self.assertEqual(sorted(wanted - said), [])
                self.assertEqual(sorted(s for s in said - wanted if s >= "400"), [])

    def test_every_method_of_every_path(self):
        connection = self.daemon.connect()
        for path, item in self.document["paths"].items():
            here = path.replace("{name}", "grey")
            known = {m.upper() for m in METHODS if m in item}
            for method in "GET", "PUT", "POST", "DELETE", "PATCH":
                body = "{}" if method in ("PUT", "POST", "PATCH") else None
                answer = self.daemon.ask(method, here, body, {"Content-Type": "application/json"}, connection=connection)
                with self.subTest(method=method, path=path):
                    if method not in known:
                        self.assertEqual(answer.status, 405)
                        self.assertEqual({m.strip() for m in answer.headers["Allow"].split(",")} - {"HEAD"}, known)
                        continue
                    said = item[method.lower()]["responses"]
                    self.assertIn(str(answer.status), said)
                    self.check(answer, self.at(said[str(answer.status)]))
        connection.close()

    def check(self, answer, response):
        """Type, body and headers as described."""
        kind = answer.headers["Content-Type"].split(";")[0]
        self.assertIn(kind, response["content"])
        if kind.endswith("json"):
            self.fits(answer.json(), response["content"][kind]["schema"])
        for name, header in response["headers"].items():
            header = self.at(header)
            given = answer.headers[name]
            # A short answer is never coded, whatever is asked for.
            if given is None:
                self.assertIn(name, ("Content-Encoding", "Vary"))
                continue
            self.fits(int(given) if header["schema"].get("type") == "integer" else given, header["schema"])

    def test_scenes_are_as_described(self):
        schema = self.document["components"]["schemas"]["Scene"]
        for name in "grey", "colour":
            told = self.daemon.get(f"/v1/scenes/{name}").json()
            self.fits(told, self.named("Scene"))
            self.assertEqual(set(told) - set(schema["properties"]), set())

    def solve(self, scene, body, accept=None):
        answer = self.daemon.radiosity(scene, body, accept=accept)
        said = self.document["paths"]["/v1/scenes/{name}/radiosity"]["post"]["responses"]
        self.assertIn(str(answer.status), said)
        self.check(answer, self.at(said[str(answer.status)]))
        return answer.status

    def test_requests_that_fit_are_answered(self):
        one = [1] * N
        for scene, body in (("grey", {"emission": one}), ("colour", {"emission": [one] * 3}), ("colour", {"emission": one}),
                            ("grey", {"emissions": [one, {"groups": {"lamp": 2}}], "quantity": "irradiance"}),
                            ("colour", {"emission": {"elements": [3], "values": [[1, 2, 3]]}, "quantity": "indirect"}),
                            ("colour", {"emission": {"groups": {"lamp": [1, 2, 3]}}, "select": {"groups": ["floor"]}}),
                            ("grey", {"emission": {"sky": [1, 2, 3, 4]}, "select": {"elements": [5, 0]}}),
                            ("grey", {"emission": {"sky": [1, 2, 3, 4], "groups": {"lamp": 1}}})):
            self.fits(body, self.named("RadiosityRequest"))
            self.assertEqual(self.solve(scene, body), 200, body)
        self.assertEqual(self.solve("grey", {"emission": one}, accept="application/x-npy"), 200)

    def test_requests_that_do_not_fit_are_refused(self):
        one = [1] * N
        for body in ({}, [], {"emission": one, "emissions": [one]}, {"emissions": []}, {"emission": "1"},
                     {"emission": one, "quantity": "heat"}, {"emission": one, "select": {"elements": ["0"]}},
                     {"emission": {"elements": [1]}}, {"emission": {"groups": {"lamp": "1"}}}, {"emission": None},
                     {"emission": {"elements": [-1], "values": [1]}}, {"emission": one, "select": []}):
            self.assertFalse(self.validator(self.named("RadiosityRequest")).is_valid(body), body)
            self.assertEqual(self.solve("grey", body), 422, body)
        self.assertEqual(self.daemon.radiosity("grey", "{").status, 400)

    def test_problems(self):
        for answer in (self.daemon.get("/none"), self.daemon.get("/v1/scenes/none"), self.daemon.ask("PATCH", "/healthz"),
                       self.daemon.radiosity("grey", "{"), self.daemon.radiosity("grey", " " * 200_000)):
            self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
            self.fits(answer.json(), self.named("Problem"))

    def test_problem_types(self):
        """The document lists the classes of problems that the daemon has; each has a section in the manual."""
        classes = re.findall(r'MANUAL "([a-z-]+)"', (SOURCE / "solver" / "codec" / "problem.c").read_text())
        self.assertGreater(len(classes), 20)
        types = self.at(self.named("Problem"))["properties"]["type"]["enum"]
        self.assertEqual(types, [f"deploy/docs/api.md#{name}" for name in classes])
        manual = SOURCE / "deploy" / "docs" / "api.md"
        if manual.exists():
            headings = re.findall(r"^#+ (.*)$", manual.read_text(), re.M)
            anchors = [re.sub(r"[^a-z0-9 -]", "", heading.lower()).replace(" ", "-") for heading in headings]
            self.assertEqual([name for name in classes if name not in anchors], [])


if __name__ == "__main__":
    unittest.main()
