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


def look(window, started, wait_s):
    """Opens the page and lets it run for a while."""
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


def motion(name, scheme, frames=40, size=(1000, 640)):
    """A drive past a row that moves: simulated time runs slowly, so that a machine without a graphics card gets every frame."""
    slow = 0.125
    started = Emulator("spindle", "--seed", "7", "--web", "127.0.0.1:0", "--time-scale", str(slow))
    try:
        with Browser(*size, scheme=scheme) as window, Client(started.address, "B") as client:
            client.subscribe()
            threading.Thread(target=drain, args=(client,), daemon=True).start()
            look(window, started, 2.0)
            window.ask(by_class())
            request = urllib.request.Request("http://%s/clock" % started.endpoint("web")["address"], method="POST")
            request.add_header("Content-Type", "application/json")
            urllib.request.urlopen(request, json.dumps({"scale": 4}).encode()).close()
            time.sleep(1.0)
            urllib.request.urlopen(request, json.dumps({"scale": slow}).encode()).close()
            stills, at_s = [], []
            for _ in range(frames):
                stills.append(window.still(quality=55))
                at_s.append(window.ask("rowscan.state.tractor.at_s"))
        between_ms = round((at_s[-1] - at_s[0]) / (frames - 1) * 1000)
        path = os.path.join(FOLDER, "watch-%s.webp" % name)
        with open(path, "wb") as file:
            file.write(animated.webp(stills, *size, between_ms))
        print("%s: %d kB, a frame every %d ms" % (path, os.path.getsize(path) / 1000, between_ms))
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
