"""Pictures of the live page for the documents: `cargo xtask screenshots` runs it. Look at each before it is committed."""

import contextlib
import json
import os
import sys
import tempfile
import threading
import time
import urllib.request

import animated
from browser import Browser
from emulator import Emulator, run
from lms_client import Client

#: Where a picture is told how the page got there.
FOLDER = sys.argv[1]
WANTED = sys.argv[2:]


#: Smooth edges and every return, although there is no graphics card.
AS_ON_A_CARD = "const made = WebGL2RenderingContext.prototype.getParameter; WebGL2RenderingContext.prototype.getParameter = " \
    "function (what) { const told = made.call(this, what); return typeof told === 'string' ? told.replace(/swiftshader/gi, 'card') : told; };"


def look(window, started, wait_s):
    """Opens the page and lets it run for a while."""
    window.call("Page.addScriptToEvaluateOnNewDocument", source=AS_ON_A_CARD)
    window.open("http://%s/" % started.endpoint("web")["address"])
    window.wait("rowscan.firstMs && rowscan.state && (!rowscan.about.has_orchard || rowscan.world.orchard)")
    # As detailed as on a graphics card, however slow this machine draws.
    window.ask("if (rowscan.world) { rowscan.world.adapt = () => {}; rowscan.world.budget = 60000; }")
    time.sleep(wait_s)


def keep(window, name):
    path = os.path.join(FOLDER, "watch-%s.webp" % name)
    window.picture(path)
    print("%s: %d kB" % (path, os.path.getsize(path) / 1000))
    assert os.path.getsize(path) < 300_000, "%s is too heavy" % path


def drive(name, scheme, script="true", arguments=(), wait_s=7.0, after_s=2.0, size=(1440, 1000)):
    """A drive past a row, with a client; `script` is what is pressed."""
    started = Emulator("spindle", "--seed", "7", "--web", "127.0.0.1:0", *arguments)
    try:
        with Browser(*size, scheme=scheme) as window, Client(started.address, "B") as client:
            client.exchange(b"sRN DeviceIdent")
            client.login()
            client.exchange(b"sMN Run")
            client.subscribe()
            threading.Thread(target=drain, args=(client,), daemon=True).start()
            look(window, started, wait_s)
            window.ask(script)
            time.sleep(after_s)
            keep(window, name)
    finally:
        started.close()


def motion(name, scheme, frames=32, steps=6, size=(1280, 800)):
    """A drive past a row that moves: step by step, so that a machine without a graphics card gets every frame."""
    started = Emulator("spindle", "--seed", "7", "--web", "127.0.0.1:0")

    def order(path, **keys):
        request = urllib.request.Request("http://%s%s" % (started.endpoint("web")["address"], path), method="POST",
                                         data=json.dumps(keys).encode(), headers={"Content-Type": "application/json"})
        urllib.request.urlopen(request).close()

    try:
        with Browser(*size, scheme=scheme) as window, Client(started.address, "B") as client:
            client.subscribe()
            threading.Thread(target=drain, args=(client,), daemon=True).start()
            look(window, started, 2.0)
            window.ask(by_class("rowscan.world.budget = 12000"))
            order("/clock", paused=True)
            stills = []
            for _ in range(frames):
                at_s = window.ask("rowscan.state.tractor.at_s")
                order("/step", n=steps)
                window.wait("rowscan.state.tractor.at_s > %r" % at_s)
                stills.append(window.still(quality=55))
        path = os.path.join(FOLDER, "watch-%s.webp" % name)
        with open(path, "wb") as file:
            file.write(animated.webp(stills, *size, steps * 20))
        print("%s: %d kB" % (path, os.path.getsize(path) / 1000))
        assert os.path.getsize(path) < 2_000_000, "%s is too heavy" % path
    finally:
        started.close()


def replay(name, scheme):
    """A recording of a drive, replayed to a client."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "run.mcap")
        started = Emulator("spindle", "--seed", "7", "--start-when", "first")
        try:
            code, _, said = run("record", "tcp://%s:%d" % started.address, "-o", path, "--scans", "400", limit_s=60)
            assert code == 0, said
        finally:
            started.close()
        started = Emulator(path, "--web", "127.0.0.1:0", "--loop", command="replay")
        try:
            with Browser(1440, 900, scheme=scheme) as window, Client(started.address, "B") as client:
                client.exchange(b"sRN DeviceIdent")
                client.subscribe()
                threading.Thread(target=drain, args=(client,), daemon=True).start()
                look(window, started, 6.0)
                window.ask("document.getElementById('pause').click()")
                time.sleep(1.0)
                keep(window, name)
        finally:
            started.close()


def drain(client):
    """Takes what comes, until nothing does."""
    with contextlib.suppress(OSError):
        while client.socket.recv(65536):
            pass


def fault(name, **keys):
    """A script that starts a fault as a person would."""
    sets = "".join("document.querySelector('[data-key=%s]').value = %r;" % item for item in keys.items())
    return ("(() => { const name = document.getElementById('fault-name'); name.value = %r; name.dispatchEvent(new Event('change')); %s"
            "document.getElementById('fault-for').value = ''; document.querySelector('#fault-form button.main').click(); })()" % (name, sets))


def by_class(rest="true"):
    return "document.querySelector('input[value=class]').click(); %s" % rest


PICTURES = {
    "drive": lambda: drive("drive", "light", by_class(), ["--optics", "device"]),
    "dark": lambda: drive("dark", "dark"),
    "lost": lambda: drive("lost", "dark", fault("power"), after_s=6.0),
    "dirty": lambda: drive("dirty", "light", fault("contamination", level="2", sector="[60, 100]"), after_s=3.0),
    "replay": lambda: replay("replay", "light"),
    "motion": lambda: motion("motion", "dark"),
    "small": lambda: drive("small", "dark", size=(420, 900)),
}


def main():
    for name in WANTED or PICTURES:
        PICTURES[name]()


if __name__ == "__main__":
    main()
