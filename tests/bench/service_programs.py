"""Programs that suite service of lambert-bench drives, their configurations, and a client of HTTP."""

import ctypes
import json
import math
import os
import signal
import socket
import subprocess
import time

ANSWER_S, END_S = 120, 10  # limits for an answer, and for a program that was asked to end
PR_SET_PDEATHSIG = 1

# Times are in microseconds. Arguments: method, or method, file of the body and its type.
WRK_SCRIPT = """
function init(args)
  wrk.method = args[1]
  if args[2] then
    local file = assert(io.open(args[2], 'rb'))
    wrk.body = file:read('*a')
    file:close()
    wrk.headers['Content-Type'] = args[3]
    wrk.headers['Accept'] = args[3]
  end
end
function done(summary, latency, requests)
  local e = summary.errors
  io.write(string.format('\\nmeasured %.0f %.0f %.0f %.0f %.0f\\n', latency:percentile(50), latency:percentile(99),
    summary.requests, summary.duration, e.connect + e.read + e.write + e.timeout + e.status))
end
"""

# One process, as the other servers have one thread that talks.
NGINX_CONFIGURATION = """
daemon off; master_process off; pid nginx.pid; error_log stderr;
events { worker_connections 512; }
http {
  access_log off; keepalive_requests 100000000;
  client_body_temp_path nginx-body; proxy_temp_path nginx-proxy; fastcgi_temp_path nginx-fastcgi;
  uwsgi_temp_path nginx-uwsgi; scgi_temp_path nginx-scgi;
  server { listen 127.0.0.1:%d backlog=512; root answers; }
}
"""


class Failure(Exception):
    """The suite cannot go on, for the reason given."""


def die_with_parent():
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


class Program:
    """A process that works in a folder, whose standard error is kept there in a file."""

    def __init__(self, name, folder, *arguments):
        self.name, self.errors = name, folder / f"{name}.errors"
        with open(self.errors, "wb") as errors:
            self.process = subprocess.Popen([*map(str, arguments)], cwd=folder, stdin=subprocess.PIPE, text=True,
                                            stdout=subprocess.PIPE, stderr=errors, preexec_fn=die_with_parent)

    def fail(self, what):
        said = [line for line in self.errors.read_text(errors="replace").splitlines() if line]
        raise Failure(f"{self.name} {what}" + (f": {said[-1]}" if said else ""))

    def line(self):
        """The next line of its standard output."""
        line = self.process.stdout.readline()
        if not line:
            self.fail("ended before it was ready")
        return line

    def port(self):
        """The port of a server, from the line in which it says where it listens."""
        while True:
            line = self.line()
            if "listening on http://127.0.0.1:" in line:
                return int(line.rsplit(":", 1)[1])

    def finish(self, seconds):
        """All of its standard output, once it has ended well."""
        try:
            said, _ = self.process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            self.fail("takes too long")
        if self.process.returncode != 0:
            self.fail("failed")
        return said

    def stop(self):
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(END_S)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()


class Solver(Program):
    """lambert-bench itself, which makes the operator and times solves of it in process."""

    def __init__(self, folder, programs):
        super().__init__("solver", folder, programs / "lambert-bench", "service-solver")

    def ask(self, *command):
        try:
            self.process.stdin.write(" ".join(map(str, command)) + "\n")
            self.process.stdin.flush()
            return [float(x) for x in self.line().split()]
        except BrokenPipeError:
            return self.fail("failed")

    def solves(self, how, threads, seconds):
        p50, p99, per_second, count = self.ask(how, threads, seconds)
        return {"p50": p50, "p99": p99, "per_second": per_second, "count": count, "threads": threads}


def post(path, kind, body):
    """A request as bytes."""
    return (f"POST {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: {kind}\r\nAccept: {kind}\r\n"
            f"Content-Length: {len(body)}\r\n\r\n").encode() + body


GET_FILE = b"GET /npy HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"


class Client:
    """One keep-alive connection; connects anew where the server has hung up."""

    def __init__(self, port):
        self.port, self.socket, self.buffer = port, None, bytearray(1 << 16)

    def close(self):
        if self.socket is not None:
            self.socket.close()
        self.socket = None

    def receive(self, begin, end):
        more = self.socket.recv_into(memoryview(self.buffer)[begin:end])
        if more == 0:
            raise ConnectionError
        return more

    def ask(self, request):
        """Status, body (valid until the next request) and seconds; status 0: the server hung up instead."""
        begin = time.perf_counter()
        if self.socket is None:
            self.socket = socket.create_connection(("127.0.0.1", self.port), ANSWER_S)
            self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        try:
            self.socket.sendall(request)
            got, end = 0, -1
            while end < 0:
                got += self.receive(got, len(self.buffer))
                end = self.buffer.find(b"\r\n\r\n", 0, got)
            head = bytes(self.buffer[:end + 2]).lower()
            begin_of_body, length = end + 4, int(head.split(b"\r\ncontent-length:", 1)[1].split(b"\r\n", 1)[0])
            whole = begin_of_body + length
            if len(self.buffer) < whole:
                self.buffer = self.buffer[:got] + bytes(whole - got)
            while got < whole:
                got += self.receive(got, whole)
            seconds = time.perf_counter() - begin
            status = int(head.split(b" ", 2)[1])
            if b"\r\nconnection: close" in head:
                self.close()
            return status, memoryview(self.buffer)[begin_of_body:whole], seconds
        except (ConnectionError, socket.timeout):
            self.close()
            return 0, b"", math.nan

    def must(self, request, what):
        status, body, seconds = self.ask(request)
        if status != 200:
            raise Failure(f"{what} answered {status}: " + bytes(body[:200]).decode(errors="replace"))
        return body, seconds

    def repeat(self, request, seconds, what):
        """At least once, and again for that long."""
        end = time.perf_counter() + seconds
        self.must(request, what)
        while time.perf_counter() < end:
            self.must(request, what)


def tell(**record):
    print(json.dumps(record), flush=True)


def cancel(_number, _frame):
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise Failure("cancelled")


def run_suite(run):
    """Calls run; what fails becomes a record of lambert-bench and the status 1."""
    signal.signal(signal.SIGTERM, cancel)
    try:
        run()
    except (Failure, OSError) as failure:
        try:
            tell(error=str(failure))
        except BrokenPipeError:
            pass
        os._exit(1)
