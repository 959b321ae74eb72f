"""A headless Chromium, driven through the W3C WebDriver protocol that chromedriver speaks."""

import json
import shutil
import subprocess
import time
from contextlib import contextmanager, suppress
from socket import create_server
from urllib.request import Request, urlopen

DRIVER = shutil.which("chromedriver")
BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
PRESENT = bool(DRIVER and BROWSER)
OPTIONS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage")


class Browser:
    """One window."""

    def __init__(self, address):
        self._address = address
        chosen = {"binary": BROWSER, "args": [*OPTIONS]}
        options = {"goog:chromeOptions": chosen, "goog:loggingPrefs": {"browser": "ALL"}}
        wanted = {"capabilities": {"alwaysMatch": options}}
        self._session = f"{address}/session/{self._call('POST', '/session', wanted)['sessionId']}"

    def _call(self, method, path, body=None):
        base = self._address if path == "/session" else self._session
        data = None if body is None else json.dumps(body).encode()
        where = f"{self._address}{path}" if path == "/session" else f"{base}{path}"
        with urlopen(Request(where, data, {"Content-Type": "application/json"}, method=method), timeout=60) as reply:
            return json.load(reply)["value"]

    def open(self, address, width=1280, height=900):
        """Load a page in a window of this size."""
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
        self._call("POST", "/goog/cdp/execute", {"cmd": "Emulation.setDeviceMetricsOverride", "params": metrics})
        self._call("POST", "/url", {"url": address})

    def run(self, script, *arguments):
        """Run a script in the page and return its value."""
        return self._call("POST", "/execute/sync", {"script": script, "args": arguments})

    def set(self, selector, value, event):
        """Give an input a value, and tell it so by an event."""
        told = "const e = document.querySelector(arguments[0]); e.value = arguments[1]; "
        self.run(f"{told} e.dispatchEvent(new Event(arguments[2]))", selector, value, event)

    def wait(self, condition, seconds=60):
        """Wait until an expression of the page is true, and return its value."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if found := self.run(f"return {condition}"):
                return found
            time.sleep(0.05)
        raise TimeoutError(f"not within {seconds} s: {condition}; the page says {self.complaints()}")

    def drag(self, start, end, steps=8):
        """Press the mouse at ``start``, move to ``end`` and let go; both in pixels of the window."""
        places = [[a + (b - a) * k / steps for a, b in zip(start, end, strict=True)] for k in range(1, steps + 1)]
        moves = [{"type": "pointerMove", "duration": 30, "x": round(x), "y": round(y)} for x, y in (start, *places)]
        moves.insert(1, {"type": "pointerDown", "button": 0})
        mouse = {"type": "pointer", "id": "mouse", "actions": [*moves, {"type": "pointerUp", "button": 0}]}
        self._call("POST", "/actions", {"actions": [mouse]})

    def complaints(self):
        """Return what the page's console holds of errors."""
        return [entry["message"] for entry in self._call("POST", "/se/log", {"type": "browser"})
                if entry["level"] == "SEVERE"]

    def close(self):
        """Close the window."""
        with suppress(OSError):
            self._call("DELETE", "")


@contextmanager
def browser():
    """Yield a ``Browser`` and end it afterwards."""
    with create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    driver = subprocess.Popen([DRIVER, f"--port={port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        window = _opened(f"http://127.0.0.1:{port}")
        yield window
        window.close()
    finally:
        driver.terminate()
        driver.wait()


def _opened(address, seconds=60):
    end = time.monotonic() + seconds
    while True:
        try:
            return Browser(address)
        except OSError:
            if time.monotonic() > end:
                raise
            time.sleep(0.1)
