"""A bench for judges of the web page and the API: a service with a simulated scanner."""

import contextlib
import json
import os
import pathlib
import socket
import subprocess
import time
import urllib.request


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Bench:
    """Programs in a folder of their own; `programs` is where cargo has put them."""

    def __init__(self, programs, folder, scanner=(), config=""):
        self.programs = pathlib.Path(programs)
        self.folder = pathlib.Path(folder)
        self.scanner = list(scanner)
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self.config = self.folder / "relief.toml"
        self.config.write_text(
            f"""
[service]
socket = "reliefd.sock"
listen = "127.0.0.1:{self.port}"
state_dir = "state"
spool_dir = "spool"
[scanner]
port = "{self.folder / 'scanner'}"
[log]
format = "text"
{config}
"""
        )
        self.children = {}

    def start(self, name, *words):
        log = open(self.folder / f"{name}.log", "ab")
        program = str(self.programs / name)
        child = subprocess.Popen([program, *words], cwd=self.folder, stdout=log, stderr=log)
        self.children[name] = child

    def stop(self, name):
        child = self.children.pop(name)
        child.terminate()
        child.wait(timeout=30)

    def __enter__(self):
        with contextlib.ExitStack() as undo:
            undo.callback(self.__exit__)
            self.start("sim-scanner", "--pty", "scanner", *self.scanner)
            self.wait(lambda: (self.folder / "scanner").exists())
            self.start("reliefd", "--config", str(self.config))
            self.wait(lambda: (self.folder / "reliefd.sock").exists())
            self.token = self.relief("token", "create", "judge")["token"]
            self.wait(lambda: self.get("/v1/status")["scanner"]["link"] == "ready")
            undo.pop_all()
        return self

    def __exit__(self, *_):
        for name in list(self.children):
            self.stop(name)

    def wait(self, condition, longest=60):
        until = time.monotonic() + longest
        while not condition():
            for name, child in self.children.items():
                if child.poll() is not None:
                    log = (self.folder / f"{name}.log").read_text()
                    raise RuntimeError(f"{name} has ended:\n{log}")
            if time.monotonic() > until:
                raise TimeoutError(f"not within {longest} s")
            time.sleep(0.05)

    def relief(self, *words):
        command = [str(self.programs / "relief"), *words, "--json"]
        environment = {**os.environ, "RELIEF_SOCKET": str(self.folder / "reliefd.sock")}
        done = subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE)
        return json.loads(done.stdout)

    def request(self, method, path, body=None, fields=None):
        """The reply; an error status raises."""
        request = urllib.request.Request(self.url + path, method=method)
        request.add_header("Authorization", f"Bearer {self.token}")
        for name, value in (fields or {}).items():
            request.add_header(name, value)
        if body is not None:
            request.add_header("Content-Type", "application/json")
            request.data = json.dumps(body).encode()
        return urllib.request.urlopen(request, timeout=60)

    def get(self, path):
        with self.request("GET", path) as reply:
            return json.load(reply)

    def post(self, path, body=None, fields=None):
        with self.request("POST", path, body, fields) as reply:
            return json.load(reply)

    def scan(self, name, longest=60):
        """Takes a scan, and waits for its result so long at most. Gives the scan's id."""
        scan = self.post("/v1/scans", {"name": name})
        path = f"/v1/scans/{scan['id']}"
        self.wait(lambda: self.get(path)["state"] == "complete")
        job = self.get(path)["jobs"][0]
        self.wait(lambda: self.get(f"/v1/jobs/{job}")["state"] == "done", longest)
        return scan["id"]
