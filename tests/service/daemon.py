"""A lambertd for a test: on a free port of the loopback, stopped whatever happens."""

import io
import http.client
import json
import os
import re
import signal
import socket
import subprocess
import tempfile
import time

import numpy as np

from patience import PATIENCE

LAMBERTD = os.environ["LAMBERTD"]

# The text of /metrics is kept for so long (METRICS_PAGE_S of server/route/metrics_page.h).
METRICS_S = .1


class Answer:
    def __init__(self, status, headers, body):
        self.status, self.headers, self.body = status, headers, body

    def json(self):
        return json.loads(self.body)

    def __repr__(self):
        return f"{self.status} {self.body[:300]!r}"


class Daemon:
    def __init__(self, *arguments, listen="127.0.0.1:0", ready=True, launcher=()):
        """launcher: a command that becomes lambertd."""
        self.out = tempfile.TemporaryFile("w+")
        self.err = tempfile.TemporaryFile("w+")
        self.port = None
        self.measured = 0  # when /metrics was asked for last
        where = ["--listen", listen] if listen is not None else []
        self.process = subprocess.Popen([*launcher, LAMBERTD, *where, *map(str, arguments)], stdout=self.out, stderr=self.err)
        try:
            if ready:
                self.wait_for("listening on")
                found = re.search(r"listening on http://127\.0\.0\.1:(\d+)", self.output())
                self.port = int(found.group(1)) if found else None
        except BaseException:
            self.kill()
            self.out.close()
            self.err.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, kind, value, trace):
        try:
            if kind is not None:
                self.kill()
                print(self.output(), self.errors())
            elif self.process.poll() is None:
                self.stop()
        finally:
            self.kill()
            self.out.close()
            self.err.close()

    def output(self):
        return self._read(self.out)

    def errors(self):
        return self._read(self.err)

    @staticmethod
    def _read(file):
        # The daemon shares the file's offset: pread does not move it.
        return os.pread(file.fileno(), 1 << 20, 0).decode()

    def wait_for(self, words, times=1):
        """Until standard output holds the words so often."""
        self.wait_until(lambda: self.output().count(words) >= times, words)

    def wait_for_error(self, words):
        self.wait_until(lambda: words in self.errors(), words)

    def wait_until(self, said, words):
        deadline = time.monotonic() + PATIENCE
        while not said():
            if self.process.poll() is not None:
                raise RuntimeError(f"lambertd ended with {self.process.returncode}: {self.errors()}")
            if time.monotonic() > deadline:
                raise TimeoutError(f"lambertd did not say {words!r}: {self.output()} {self.errors()}")
            time.sleep(0.005)

    def signal(self, number):
        self.process.send_signal(number)

    def wait(self):
        return self.process.wait(PATIENCE)

    def stop(self):
        """By SIGTERM; a sanitizer's complaint is another exit status than 0."""
        self.signal(signal.SIGTERM)
        code = self.wait()
        if code != 0:
            raise RuntimeError(f"lambertd ended with {code}: {self.errors()}")

    def kill(self):
        self.process.kill()
        self.process.wait()

    def connect(self, source="127.0.0.1"):
        """source: the address that is the client's, any of 127.0.0.0/8."""
        return http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE, source_address=(source, 0))

    def raw(self):
        return socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE)

    def ask(self, method, path, body=None, headers=None, connection=None):
        own = connection is None
        connection = connection or self.connect()
        if path == "/metrics":  # the figures of now, not those that were answered before
            time.sleep(max(0, self.measured + METRICS_S - time.monotonic()))
        try:
            connection.request(method, path, body, headers or {})
            response = connection.getresponse()
            return Answer(response.status, response.headers, response.read())
        finally:
            self.measured = time.monotonic() if path == "/metrics" else self.measured
            if own:
                connection.close()

    def get(self, path, **more):
        return self.ask("GET", path, **more)

    def post(self, path, body, kind="application/json", accept=None, connection=None, headers=None):
        if not isinstance(body, (bytes, str)):
            body = json.dumps(body)
        headers = dict(headers or {})
        if kind is not None:
            headers["Content-Type"] = kind
        if accept is not None:
            headers["Accept"] = accept
        return self.ask("POST", path, body, headers, connection)

    def radiosity(self, name, body, **more):
        return self.post(f"/v1/scenes/{name}/radiosity", body, **more)


def npy(array, version=None):
    """The bytes of a NumPy array as a file holds them."""
    out = io.BytesIO()
    np.lib.format.write_array(out, np.asarray(array), version)
    return out.getvalue()
