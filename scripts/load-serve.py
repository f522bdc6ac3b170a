#!/usr/bin/env python3
"""Puts load on `starpipe serve`: clients that upload, and clients that misbehave. Standard library alone.

    python3 scripts/load-serve.py PROGRAM [--clients 50] [--uploads 500] [--frame FILE] [--huge 2] [--options '--jobs 2']

50 clients upload frames, and ask until they are done; a client that is sent away with 503 asks again. Beside them
others send slowly, stop in the middle, claim or send bodies of 1 GB, and send what is no picture. In the middle the
server is killed and started again. It is an error if an upload that was accepted is lost, is not solved, or is solved
differently; if the server answers with 500; or if it does not end well. Prints the memory of the server over time.
"""

import argparse
import collections
import http.client
import json
import pathlib
import random
import re
import shlex
import socket
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent


class Server:
    def __init__(self, program, folder, options):
        self.command = [program, "serve", "--folder", str(folder), *options]
        self.port = 0
        self.start()

    def start(self):
        listen = ["--listen", f"127.0.0.1:{self.port}"]
        self.process = subprocess.Popen([*self.command, *listen], stderr=subprocess.PIPE, text=True)
        log = self.process.stderr
        line = next(line for line in log if "listening on" in line)
        self.port = int(re.search(r":(\d+)$", line.strip())[1])
        threading.Thread(target=log.read, daemon=True).start()

    def memory_mb(self):
        try:
            status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
            return int(re.search(r"VmRSS:\s+(\d+)", status)[1]) // 1000
        except (OSError, TypeError):
            return 0


class Load:
    def __init__(self, server, frame, uploads):
        self.server = server
        self.frame = frame
        self.left = uploads
        self.lock = threading.Lock()
        self.statuses = collections.Counter()
        self.results = collections.Counter()
        self.errors = []
        self.waits = []
        self.is_over = False

    def ask(self, method, path, body=None, kind="application/x-www-form-urlencoded"):
        """Status and body; asks again as long as the server is away or has no room."""
        while True:
            connection = http.client.HTTPConnection("127.0.0.1", self.server.port, timeout=120)
            try:
                connection.request(method, path, body, {"Content-Type": kind} if body else {})
                reply = connection.getresponse()
                content = reply.read()
            except (OSError, http.client.HTTPException):
                self.statuses["no answer"] += 1
                time.sleep(0.2)
                continue
            finally:
                connection.close()
            with self.lock:
                self.statuses[reply.status] += 1
                if reply.status == 500:
                    self.errors.append(content)
            if reply.status != 503:
                return reply.status, content
            time.sleep(random.uniform(0.1, 1))

    def upload(self, content):
        form = (
            b'--7\r\nContent-Disposition: form-data; name="request-json"\r\n\r\n{"session": "a"}\r\n'
            b'--7\r\nContent-Disposition: form-data; name="file"; filename="a.png"\r\n\r\n' + content + b"\r\n--7--\r\n"
        )
        status, reply = self.ask("POST", "/api/upload", form, "multipart/form-data; boundary=7")
        return json.loads(reply)["subid"] if status == 200 else None

    def client(self):
        while True:
            with self.lock:
                if self.left == 0:
                    return
                self.left -= 1
            begun = time.time()
            number = self.upload(self.frame)
            while json.loads(self.ask("GET", f"/api/jobs/{number}")[1])["status"] == "solving":
                time.sleep(0.2)
            _, calibration = self.ask("GET", f"/api/jobs/{number}/calibration")
            with self.lock:
                self.results[calibration] += 1
                self.waits.append(time.time() - begun)

    def until_over(self, misbehave):
        while not self.is_over:
            try:
                misbehave()
            except OSError:
                time.sleep(0.1)

    def connect(self):
        return socket.create_connection(("127.0.0.1", self.server.port), timeout=60)

    def head(self, length):
        return f"POST /api/upload HTTP/1.1\r\nHost: localhost\r\nContent-Length: {length}\r\n\r\n".encode()

    def slow(self):
        with self.connect() as stream:
            stream.sendall(self.head(100_000))
            while not self.is_over:
                stream.sendall(b"a")
                time.sleep(0.5)

    def slow_head(self):
        with self.connect() as stream:
            for letter in self.head(1):
                stream.sendall(bytes([letter]))
                time.sleep(0.5)

    def half(self):
        with self.connect() as stream:
            stream.sendall(self.head(len(self.frame)) + self.frame[: len(self.frame) // 2])
        time.sleep(0.1)

    def huge(self):
        """A body of 1 GB without a length, sent as long as the server takes it."""
        with self.connect() as stream:
            stream.sendall(b"POST /solve HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n")
            chunk = b"100000\r\n" + bytes(0x100000) + b"\r\n"
            for _ in range(1000):
                stream.sendall(chunk)
        time.sleep(1)

    def claimed(self):
        with self.connect() as stream:
            stream.sendall(self.head(1_000_000_000))
            reply = stream.recv(100)
            # Nothing from a server that was killed, and 503 where the queue is full.
            if reply and b" 413 " not in reply and b" 503 " not in reply:
                self.errors.append(reply)
        time.sleep(0.1)

    def noise(self):
        self.ask("POST", "/solve", random.randbytes(10_000))
        self.upload(b"\x89PNG\r\n\x1a\n" + random.randbytes(1000))
        time.sleep(0.2)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--clients", type=int, default=50)
    parser.add_argument("--uploads", type=int, default=500)
    parser.add_argument("--frame", type=pathlib.Path, default=ROOT / "fixtures/orion/orion.png")
    parser.add_argument("--huge", type=int, default=2, help="clients that send 1 GB")
    parser.add_argument("--options", default="", help="of starpipe serve")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        options = ["--send-time", "10", *shlex.split(arguments.options)]
        server = Server(arguments.program, pathlib.Path(folder) / "jobs", options)
        load = Load(server, arguments.frame.read_bytes(), arguments.uploads)
        return run(server, load, arguments)


def run(server, load, arguments):
    clients = [threading.Thread(target=load.client) for _ in range(arguments.clients)]
    bad = [load.slow, load.slow_head, load.half, load.claimed, load.noise] * 2 + [load.huge] * arguments.huge
    for misbehave in bad:
        threading.Thread(target=load.until_over, args=(misbehave,), daemon=True).start()
    begun = time.time()
    for client in clients:
        client.start()
    is_killed, most_mb, told = False, 0, 0
    while any(client.is_alive() for client in clients):
        time.sleep(0.25)
        most_mb = max(most_mb, server.memory_mb())
        spent = time.time() - begun
        if spent >= told:
            print(f"{spent:6.1f} s: {len(load.waits):5} done, {server.memory_mb():5} MB", flush=True)
            told += 5
        if not is_killed and len(load.waits) >= arguments.uploads // 2:
            is_killed = True
            server.process.kill()
            server.process.wait()
            print(f"{spent:6.1f} s: killed", flush=True)
            server.start()
    load.is_over = True
    spent = time.time() - begun
    server.process.terminate()
    status = server.process.wait(120)
    waits = sorted(load.waits)
    print(f"{len(waits)} uploads in {spent:.1f} s, {len(waits) / spent:.1f} a second; at most {most_mb} MB")
    print(f"from upload to answer: median {waits[len(waits) // 2]:.1f} s, longest {waits[-1]:.1f} s")
    print("replies:", dict(load.statuses))
    print("different results:", len(load.results), "exit status:", status)
    is_solved = all(b'"ra"' in result for result in load.results)
    good = len(load.results) == 1 and is_solved and not load.errors and status == 0 and len(waits) == arguments.uploads
    for error in load.errors[:5]:
        print("error:", error)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
