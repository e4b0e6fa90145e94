"""Pictures of the live page for the documents: `cargo xtask screenshots` runs it. Look at each before it is committed."""

import os
import sys
import time

from browser import Browser
from emulator import Emulator, run
from lms_client import Client

#: Where a picture is told how the page got there.
FOLDER = sys.argv[1]
WANTED = sys.argv[2:]


def look(window, started, scheme_wait_s):
    """Opens the page and lets it run for a while."""
    window.open("http://%s/" % started.endpoint("web")["address"])
    window.wait("rowscan.firstMs && rowscan.state && (!rowscan.about.has_orchard || rowscan.world.orchard)")
    time.sleep(scheme_wait_s)


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
            look(window, started, wait_s)
            window.ask(script)
            time.sleep(after_s)
            keep(window, name)
    finally:
        started.close()


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
    "lost": lambda: drive("lost", "dark", fault("power", off_ms="30000"), ["--scanner", "0"], after_s=5.0),
    "dirty": lambda: drive("dirty", "light", fault("contamination", level="2", sector="[60, 100]"), after_s=3.0),
    "small": lambda: drive("small", "dark", size=(420, 900)),
}


def main():
    for name in WANTED or PICTURES:
        PICTURES[name]()


if __name__ == "__main__":
    main()
