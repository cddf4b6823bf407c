"""`cordillera serve` of a bench, on a folder of its own and a free port."""
import os
import subprocess
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import processes  # noqa: E402


class OwnServer:
    """Listens when it is made; it ends with the bench. port: None where the program ended before."""

    def __init__(self, program, folder):
        self.data = os.path.join(folder, "data")
        self.log = open(os.path.join(folder, "log"), "w+")
        self.process = processes.start([program, "serve", "--listen", "127.0.0.1:0", "--data", self.data], stderr=self.log, stdin=subprocess.DEVNULL)
        self.port = None
        while self.port is None and self.process.poll() is None:
            time.sleep(0.02)
            said = open(self.log.name).read()
            mark = said.find("http://127.0.0.1:")
            if mark >= 0 and said.find("/", mark + 7) > 0:
                self.port = int(said[mark + 17:said.index("/", mark + 17)])
