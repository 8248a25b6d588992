"""MAVProxy as users install it, at the command of a test."""

import os
import re
import subprocess
import sys
import threading
import time
from pathlib import Path

PATIENCE = 30.0


class MAVProxy:
    """The console of a MAVProxy process."""

    def __init__(self, port, folder, scheme="udpin"):
        script = Path(sys.executable).with_name("mavproxy.py")
        command = [
            sys.executable,
            "-u",
            str(script),
            f"--master={scheme}:127.0.0.1:{port}",
            f"--state-basedir={folder}",
        ]
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            cwd=folder,
            env={**os.environ, "HOME": str(folder)},
        )
        self.output = ""
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.process.stdout:
            self.output += line

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()

    def expect(self, pattern, command=""):
        """The match of `pattern` in the output after `command`, which is repeated until it matches."""
        start, end, again = len(self.output) if command else 0, time.monotonic() + PATIENCE, 0.0
        while time.monotonic() < end:
            if command and time.monotonic() > again:
                self.process.stdin.write(command + "\n")
                self.process.stdin.flush()
                again = time.monotonic() + 2.0
            match = re.search(pattern, self.output[start:])
            if match:
                return match
            time.sleep(0.02)
        raise AssertionError(f"no {pattern!r} in:\n{self.output}")

    def status(self, name):
        """The numbers in the message of this name that MAVProxy got last, without lists."""
        text = self.expect(rf"{name} {{([^}}]*)}}", f"status {name}").group(1)
        return {key: float(value) for key, value in re.findall(r"(\w+) : ([^\[,]+)", text)}
