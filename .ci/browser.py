"""Chromium without a window, by its debugging protocol, with nothing but the standard library."""

import base64
import json
import os
import socket
import struct
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit
from urllib.request import Request, urlopen

CHROMIUM = os.environ.get("CHROMIUM", "chromium")
_FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--remote-debugging-port=0")
_PATIENCE = 300.0  # s, of a machine that has much else to do


class _Socket:
    """A WebSocket, RFC 6455, as far as the protocol needs it: whole text messages."""

    def __init__(self, address: str) -> None:
        url = urlsplit(address)
        self._socket = socket.create_connection((url.hostname, url.port), _PATIENCE)
        self._file = self._socket.makefile("rb")
        key = base64.b64encode(os.urandom(16)).decode()
        lines = (
            *(f"GET {url.path} HTTP/1.1", f"Host: {url.netloc}", "Upgrade: websocket", "Connection: Upgrade"),
            *(f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13", "", ""),
        )
        self._socket.sendall("\r\n".join(lines).encode())
        while self._file.readline().strip():
            pass

    def send(self, text: str) -> None:
        """One message."""
        data, mask = text.encode(), os.urandom(4)
        head = (
            struct.pack("!BBH", 0x81, 0xFE, len(data))
            if len(data) < 65536
            else struct.pack("!BBQ", 0x81, 0xFF, len(data))
        )
        self._socket.sendall(head + mask + bytes(byte ^ mask[i % 4] for i, byte in enumerate(data)))

    def close(self) -> None:
        """Give it back."""
        self._file.close()
        self._socket.close()

    def receive(self) -> str:
        """The next message."""
        parts, last = b"", False
        while not last:
            first, size = self._file.read(2)
            last, size = bool(first & 0x80), size & 0x7F
            if size >= 126:
                size = int.from_bytes(self._file.read(2 if size == 126 else 8), "big")
            parts += self._file.read(size)
        return parts.decode()


class Tab:
    """A page: methods of the protocol by name, JavaScript, the mouse, pictures. `process` is the browser's."""

    def __init__(self, address: str, process: int) -> None:
        self._socket, self._count, self.process = _Socket(address), 0, process

    def close(self) -> None:
        """End the talk with it."""
        self._socket.close()

    def call(self, method: str, **parameters: Any) -> Mapping[str, Any]:
        """What a method returns; events that come in between are let go."""
        self._count += 1
        self._socket.send(json.dumps({"id": self._count, "method": method, "params": parameters}))
        while (answer := json.loads(self._socket.receive())).get("id") != self._count:
            pass
        if "error" in answer:
            raise RuntimeError(f"{method}: {answer['error']['message']}")
        return answer["result"]

    def run(self, script: str) -> Any:
        """The value of an expression, awaited where it is a promise."""
        answer = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(f"{script}: {answer['exceptionDetails']['exception'].get('description')}")
        return answer["result"].get("value")

    def until(self, script: str) -> None:
        """Wait until an expression is true."""
        end = time.monotonic() + _PATIENCE
        while not self.run(script):
            if time.monotonic() > end:
                raise RuntimeError(f"never true: {script}")
            time.sleep(0.05)

    def open(self, address: str, width: int, height: int) -> None:
        """Load a page in a window of a size; a narrow one is a phone's."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
        self.call("Emulation.setDeviceMetricsOverride", **size)
        self.call("Page.navigate", url=address)
        self.until(f"location.href === {json.dumps(address)} && document.readyState === 'complete'")

    def mouse(self, kind: str, x: float, y: float) -> None:
        """mousePressed, mouseMoved or mouseReleased at a place."""
        held = {"mousePressed": 1, "mouseMoved": 1, "mouseReleased": 0}[kind]
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=held, clickCount=1)

    def picture(self, path: Path, whole: bool = False, scale: float = 1.0) -> None:
        """A picture of the window or of the whole page, .png, `scale` pixels of it for one of the page's."""
        sizes = "document.documentElement.scrollHeight" if whole else "innerHeight"
        width, height = self.run(f"[innerWidth, {sizes}]")
        clip = {"x": 0, "y": 0, "width": width, "height": height, "scale": scale}
        data = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole, clip=clip)["data"]
        path.write_bytes(base64.b64decode(data))


@contextmanager
def browser() -> Iterator[Tab]:
    """A tab of a browser of its own."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        words = [CHROMIUM, *_FLAGS, f"--user-data-dir={folder}", "about:blank"]
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            tab = Tab(_new_tab(Path(folder) / "DevToolsActivePort"), process.pid)
            yield tab
            tab.close()
        finally:
            process.terminate()
            process.wait(10)


def _new_tab(port_file: Path) -> str:
    end = time.monotonic() + _PATIENCE
    while not (port_file.exists() and port_file.read_text().count("\n")):
        if time.monotonic() > end:
            raise RuntimeError(f"{CHROMIUM} does not start")
        time.sleep(0.05)
    port = int(port_file.read_text().split()[0])
    with urlopen(Request(f"http://127.0.0.1:{port}/json/new", method="PUT"), timeout=_PATIENCE) as answer:
        return json.load(answer)["webSocketDebuggerUrl"]
