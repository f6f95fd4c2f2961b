"""The routes /elements and /groups in front of a daemon that has none, from its stores, for tests of clients that need them."""

import http.client
import http.server
import io
import json
import threading
import urllib.parse

import h5py
import numpy as np


def elements_of(store):
    """The arrays of GET …/elements, and the groups of GET …/groups."""
    with h5py.File(store, "r") as f:
        mesh = f["mesh"]
        corners, vertices = mesh["elements"][()], mesh["vertices"][()]
        n = len(corners)
        triangle = corners[:, 3] == 0xFFFFFFFF
        p = vertices[np.where(corners == 0xFFFFFFFF, corners[:, :1], corners)]
        halves = [(np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1), p[:, :3].mean(1)),
                  (np.linalg.norm(np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 0]), axis=1) * ~triangle, p[:, [0, 2, 3]].mean(1))]
        weight = halves[0][0] + halves[1][0]
        centre = sum(w[:, None] * c for w, c in halves) / weight[:, None]
        group, area = mesh["group"][()], mesh["area"][()]
        face = mesh["face"][()].astype(np.int32) if "face" in mesh else np.full(n, -1, np.int32)
        arrays = {"area": area, "normal": mesh["normal"][()], "centre": centre.astype("f4"), "group": group, "face": face,
                  "reflectance": np.atleast_2d(mesh["reflectance"][()])}
        emission = np.atleast_2d(mesh["emission"][()])
        groups = []
        for g, name in enumerate(mesh["group_names"][()]):
            of = group == g
            mean = [[float(row[of] @ area[of] / area[of].sum()) if of.any() else 0 for row in x] for x in (arrays["reflectance"], emission)]
            groups.append({"name": name.decode(), "area": float(area[of].sum()), "elements": int(of.sum()),
                           "reflectance": mean[0], "emission": mean[1]})
    return arrays, groups


class Front(http.server.ThreadingHTTPServer):
    """A proxy of one daemon; its port is `server_port`."""

    daemon_threads = True

    def __init__(self, port, stores):
        super().__init__(("127.0.0.1", 0), Handler)
        self.port, self.stores = port, stores
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.shutdown()
        self.server_close()


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True

    def log_message(self, *words):
        pass

    def answer(self, status, body, headers):
        self.send_response_only(status)
        for name, value in headers:
            if name.lower() not in ("content-length", "connection", "transfer-encoding"):
                self.send_header(name, value)
        if status not in (204, 304):
            self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def do_GET(self):
        parts = urllib.parse.urlsplit(self.path).path.split("/")
        if parts[-1] in ("elements", "groups") and parts[-2] in self.server.stores:
            arrays, groups = elements_of(self.server.stores[parts[-2]])
            if parts[-1] == "groups":
                self.answer(200, json.dumps({"groups": groups}).encode(), [("Content-Type", "application/json")])
            else:
                out = io.BytesIO()
                np.savez(out, **arrays)
                self.answer(200, out.getvalue(), [("Content-Type", "application/zip")])
            return
        length = int(self.headers.get("Content-Length", 0))
        body = self.rfile.read(length) if length else None
        connection = http.client.HTTPConnection("127.0.0.1", self.server.port, timeout=60)
        connection.request(self.command, self.path, body, dict(self.headers))
        answer = connection.getresponse()
        self.answer(answer.status, answer.read(), answer.getheaders())
        connection.close()

    do_POST = do_PUT = do_DELETE = do_GET
