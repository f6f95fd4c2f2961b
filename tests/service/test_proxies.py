"""lambertd behind nginx and HAProxy, where they are installed, as operating.md sets them up: the page and the routes below a path,
refusals of long bodies, and the checks of a balancer."""

import pathlib
import re
import shutil
import socket
import subprocess
import time
import unittest
import urllib.error
import urllib.parse
import urllib.request

from daemon import PATIENCE, Daemon
from daemon_case import Case

MANUAL = pathlib.Path(__file__).resolve().parents[2] / "deploy" / "docs" / "operating.md"
TRIES = 20


def program(name):
    return shutil.which(name, path="/usr/sbin:/usr/local/sbin:/usr/bin:/bin")


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as s:
        return s.getsockname()[1]


class Proxies(Case):
    def setUp(self):
        super().setUp()
        self.path, _ = self.store()
        self.port = free_port()

    def snippet(self, language, daemon):
        """The configuration in the manual, for these ports."""
        text = re.search(rf"```{language}\n(.*?)```", MANUAL.read_text(), re.S)[1]
        self.assertEqual((text.count("127.0.0.1:8400"), text.count("127.0.0.1:8317")), (1, 1))
        return text.replace("127.0.0.1:8400", f"127.0.0.1:{self.port}").replace("127.0.0.1:8317", f"127.0.0.1:{daemon.port}")

    def start(self, *command):
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(process.wait)
        self.addCleanup(process.terminate)

    def nginx(self, server):
        folder = self.folder / "nginx"
        folder.mkdir(mode=0o777)
        temporary = "".join(f"{kind}_temp_path {folder}/{kind};\n" for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi"))
        conf = folder / "nginx.conf"
        conf.write_text(f"daemon off; master_process off; error_log {folder}/errors; pid {folder}/pid;\nevents {{}}\n"
                        f"http {{ access_log off;\n{temporary}{server}}}\n")
        self.start(program("nginx"), "-p", folder, "-c", conf, "-e", folder / "errors")

    def haproxy(self, text):
        conf = self.folder / "haproxy.cfg"
        conf.write_text(text)
        self.start(program("haproxy"), "-db", "-f", conf)

    def ask(self, path, body=None, headers=None):
        url = f"http://127.0.0.1:{self.port}{path}"
        try:
            with urllib.request.urlopen(urllib.request.Request(url, body, headers or {}), timeout=PATIENCE) as answer:
                return answer.status, answer.headers, answer.read()
        except urllib.error.HTTPError as refused:
            return refused.code, refused.headers, refused.read()

    def wait(self, path):
        """Until the proxy passes requests on."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            try:
                if self.ask(path)[0] == 200:
                    return
            except OSError:
                pass
            time.sleep(.02)
        self.fail("the proxy does not pass requests on")

    def check(self, folder):
        """The page and the routes below a path, with their links, and refusals of long bodies."""
        self.wait(f"{folder}readyz")
        page = self.ask(folder)[2].decode()
        links = re.findall(r'(?:src|href)="([^"]*)"', page)
        self.assertGreater(len(links), 1)
        for link in links:
            self.assertEqual(self.ask(urllib.parse.urljoin(folder, link))[0], 200, link)
        route, kind = f"{folder}v1/scenes/box/radiosity", {"Content-Type": "application/json"}
        self.assertEqual(self.ask(route, b'{"emission":{"groups":{"lamp":1}}}', kind)[0], 200)
        for _ in range(TRIES):
            status, _, body = self.ask(route, b" " * 8_000_000, {"Content-Type": "text/plain"})
            self.assertEqual(status, 415)
        manual = urllib.parse.urljoin(route, re.search(rb'"type":"([^"]*)"', body)[1].decode())
        self.assertIn(b"\n### media-type\n", self.ask(manual)[2])

    @unittest.skipUnless(program("nginx"), "no nginx")
    def test_nginx(self):
        with Daemon(self.path, "--trusted-proxy", "127.0.0.1") as daemon:
            self.nginx(self.snippet("nginx", daemon))
            self.check("/light/")

    @unittest.skipUnless(program("nginx"), "no nginx")
    def test_nginx_as_it_is(self):
        """A Host and an upstream of its own, over a Unix socket."""
        where = self.folder / "socket"
        with Daemon(self.path, "--unix", where, listen=None):
            where.chmod(0o777)
            self.folder.chmod(0o755)
            self.nginx(f"upstream light {{ server unix:{where}; }}\nserver {{ listen 127.0.0.1:{self.port}; client_max_body_size 0;\n"
                       "location /a/b/ { proxy_pass http://light/; } }\n")
            self.check("/a/b/")

    @unittest.skipUnless(program("haproxy"), "no HAProxy")
    def test_haproxy(self):
        with Daemon(self.path, "--trusted-proxy", "127.0.0.1") as daemon:
            self.haproxy(self.snippet("haproxy", daemon))
            self.check("/light/")

    @unittest.skipUnless(program("haproxy"), "no HAProxy")
    def test_the_check_of_haproxy_as_it_is(self):
        with Daemon(self.path) as daemon:
            self.haproxy("defaults\n mode http\n timeout connect 10s\n timeout client 60s\n timeout server 60s\n"
                         f"listen l\n bind 127.0.0.1:{self.port}\n option httpchk\n"
                         f" server s 127.0.0.1:{daemon.port} check inter 50 rise 1 fall 1\n")
            self.wait("/v1/scenes")
            before = self.options_asked(daemon)
            while self.options_asked(daemon) < before + 3:  # the check was asked, and found the daemon well
                self.assertEqual(self.ask("/v1/scenes")[0], 200)

    def options_asked(self, daemon):
        found = re.search(r'lambertd_requests_total\{route="/",status="204"\} (\d+)', daemon.get("/metrics").body.decode())
        return int(found[1]) if found else 0


if __name__ == "__main__":
    unittest.main()
