"""A headless Chromium, driven by its DevTools protocol over a pair of pipes: no driver program, no package."""

import base64
import json
import os
import shutil
import subprocess
import tempfile
import time

#: How long Chromium may take to start, and to answer.
LIMIT_S = 40.0
#: Flags that make it draw the same everywhere: by SwiftShader, in a window of a known size.
FLAGS = ["--headless=new", "--no-first-run", "--no-default-browser-check", "--disable-extensions", "--disable-background-networking",
         "--disable-component-update", "--disable-sync", "--mute-audio", "--hide-scrollbars", "--force-color-profile=srgb",
         "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
         "--remote-debugging-pipe", "--no-sandbox"]


def program():
    """Path of Chromium, or None."""
    return os.environ.get("ROWSCAN_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")


class Browser:
    """One window with one page."""

    def __init__(self, width=1400, height=900, scheme="dark"):
        self.folder = tempfile.mkdtemp(prefix="rowscan-browser-")
        (their_in, self.out), (self.into, their_out) = os.pipe(), os.pipe()
        command = [program(), *FLAGS, "--user-data-dir=" + self.folder, "--window-size=%d,%d" % (width, height), "about:blank"]
        # Chromium reads from descriptor 3 and writes to 4; bash alone takes descriptors of two digits.
        shell = ["bash", "-c", 'exec "$@" 3<&%d 4>&%d' % (their_in, their_out), "bash"]
        self.process = subprocess.Popen(shell + command, pass_fds=(their_in, their_out), stdin=subprocess.DEVNULL,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(their_in)
        os.close(their_out)
        self.bytes = b""
        self.number = 0
        #: What the page wrote to its console as an error, and what it threw.
        self.errors = []
        target = self.call("Target.createTarget", url="about:blank", session=None)["targetId"]
        self.session = None
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True, session=None)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(domain + ".enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def _message(self, limit_s):
        end = time.monotonic() + limit_s
        while b"\0" not in self.bytes:
            assert time.monotonic() < end, "Chromium said nothing for %.0f s" % limit_s
            piece = os.read(self.into, 1 << 20)
            assert piece, "Chromium ended with %s" % self.process.wait()
            self.bytes += piece
        message, self.bytes = self.bytes.split(b"\0", 1)
        return json.loads(message)

    def call(self, method, session="own", **parameters):
        """One call of the protocol; its result."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if session == "own":
            message["sessionId"] = self.session
        os.write(self.out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._message(LIMIT_S)
            if answer.get("id") == self.number:
                assert "error" not in answer, "%s: %s" % (method, answer["error"])
                return answer["result"]
            self._note(answer)

    def _note(self, event):
        name, told = event.get("method"), event.get("params", {})
        if name == "Runtime.exceptionThrown":
            self.errors.append(told["exceptionDetails"].get("exception", {}).get("description") or told["exceptionDetails"]["text"])
        elif name == "Log.entryAdded" and told["entry"]["level"] == "error":
            self.errors.append("%s %s" % (told["entry"]["text"], told["entry"].get("url", "")))
        elif name == "Runtime.consoleAPICalled" and told["type"] in ("error", "assert"):
            self.errors.append(" ".join(str(arg.get("value", arg.get("description"))) for arg in told["args"]))

    def open(self, url):
        """Goes there, and does not wait for it to load."""
        self.call("Page.navigate", url=url)

    def ask(self, script):
        """What a script, or its promise, comes to."""
        told = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in told, told["exceptionDetails"]
        return told["result"].get("value")

    def wait(self, script, limit_s=30.0):
        """Waits until a script is true; what it came to."""
        end = time.monotonic() + limit_s
        while True:
            value = self.ask("(() => { try { return (%s); } catch { return false; } })()" % script)
            if value:
                return value
            assert time.monotonic() < end, "not true within %.0f s: %s; errors: %s" % (limit_s, script, self.errors)
            time.sleep(0.05)

    def picture(self, path):
        """A picture of the window, as PNG or WebP by its name."""
        kind = {"format": "webp", "quality": 80} if path.endswith(".webp") else {"format": "png"}
        data = self.call("Page.captureScreenshot", **kind)["data"]
        with open(path, "wb") as out:
            out.write(base64.b64decode(data))

    def still(self, quality):
        """The window as lossy WebP."""
        return base64.b64decode(self.call("Page.captureScreenshot", format="webp", quality=quality)["data"])

    def close(self):
        """Ends it."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        os.close(self.out)
        os.close(self.into)
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
