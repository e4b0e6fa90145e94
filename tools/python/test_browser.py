"""The live page as a person uses it: a headless Chromium opens it, looks, presses and waits.

`cargo xtask foreign browser` runs it; elsewhere it is skipped.
"""

import json
import os
import socket
import time
import urllib.request

import pytest

import browser as browser_module
from lms_client import Client

pytestmark = pytest.mark.skipif(not os.environ.get("ROWSCAN_BROWSER"), reason="`cargo xtask foreign browser` runs it")

#: What each number on the page says of a state.
WORDS = {
    "rate_hz": lambda of: "%.2f" % of["rate_hz"],
    "nearest_m": lambda of: "%.2f" % of["nearest_m"],
    "returns": lambda of: "%d of %d" % (of["returns"], of["beams"]),
}


def start(rowscan, *arguments, web="127.0.0.1:0"):
    return rowscan.Emulator("spindle", "--seed", "7", "--start-when", "now", "--web", web, *arguments)


def get(address, path):
    with urllib.request.urlopen("http://%s%s" % (address, path), timeout=10) as answer:
        return json.load(answer)


@pytest.fixture
def bench(rowscan):
    started = start(rowscan)
    started.web = started.endpoint("web")["address"]
    yield started
    started.close()


@pytest.fixture
def window():
    assert browser_module.program(), "there is no chromium"
    with browser_module.Browser() as opened:
        yield opened


def look(window, address, rest=""):
    """Opens the page and waits for its first picture."""
    window.open("http://%s/%s" % (address, rest))
    window.wait("rowscan.firstMs && rowscan.world.orchard && rowscan.state")


def test_it_draws_everything_and_complains_of_nothing(bench, window):
    look(window, bench.web)
    print("first picture after %.0f ms" % window.ask("rowscan.firstMs"))
    window.wait("rowscan.strip.strip && rowscan.world.cloudCount > 2000")
    colours = window.ask("(() => { const p = rowscan; p.world.draw(p.picture.tractor, 'dark', p.picture.at); return p.world.colours(); })()")
    assert colours > 100, colours
    for canvas in (".fan canvas", "#strip"):
        painted = window.ask("""(() => { const c = document.querySelector(%s);
            const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; let n = 0;
            for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return n / (d.length / 4); })()""" % json.dumps(canvas))
        assert painted > 0.02, (canvas, painted)
    told = window.ask("({stats: rowscan.world.stats, fps: rowscan.fps, drawMs: rowscan.drawMs, budget: rowscan.world.budget})")
    print("drawing: %s" % told)
    assert told["stats"]["draws"] < 200 and told["stats"]["leaves"] > 1000
    # Fetched from here alone.
    sources = window.ask("performance.getEntriesByType('resource').map((of) => new URL(of.name).host)")
    assert set(sources) == {bench.web}
    weight = window.ask("performance.getEntriesByType('resource').filter((of) => of.name.includes('/page/')).reduce((n, of) => n + of.encodedBodySize, 0)")
    print("page weight without its index: %d bytes" % weight)
    assert 10_000 < weight < 500_000
    # Nobody has asked the scanner for remissions.
    assert window.ask("document.getElementById('by-remission').hidden")
    for colour in ("class", "range"):
        window.ask("document.querySelector('input[value=%s]').click()" % colour)
        window.wait("rowscan.colouring.by === %s && !rowscan.wanted" % json.dumps(colour))
    assert window.errors == []


def test_the_numbers_are_those_of_the_json(bench, window):
    look(window, bench.web)
    window.ask("document.getElementById('pause').click()")
    window.wait("rowscan.state.clock.paused")
    state = get(bench.web, "/watch/state")
    assert state["clock"]["paused"] is True
    window.wait("rowscan.state.scanners[0].counter === %d" % state["scanners"][0]["counter"])
    # The state that the page has shown last is at most one behind.
    window.wait("document.querySelector('[data-number=\"0.counter\"]').textContent === '%d'" % state["scanners"][0]["counter"])
    of = state["scanners"][0]
    shown = window.ask("Object.fromEntries([...document.querySelectorAll('[data-number]')].map((e) => [e.dataset.number, e.textContent]))")
    for key, text in shown.items():
        name = key.split(".")[-1]
        if key.startswith("0."):
            value = of.get(name)
            expected = "–" if value is None else WORDS.get(name, lambda of, name=name: str(of[name]))(of)
        else:
            value = state["tractor"]["speeds"][name]
            expected = "–" if value is None else "%.2f m/s" % value
        assert text == expected, key
    assert shown["0.counter"] != "–" and shown["ground_m_s"] == "1.00 m/s"
    # Nobody knows, and 0 would be a lie.
    assert shown["0.repeated"] == "–"
    assert window.ask("document.getElementById('time').textContent") == "%.2f s" % state["clock"]["now_s"]


def test_pause_pauses_and_step_steps(bench, window):
    look(window, bench.web)
    with Client(bench.address, "B") as client:
        client.subscribe()
        client.receive()
        window.ask("document.getElementById('pause').click()")
        window.wait("rowscan.state.clock.paused")
        before = get(bench.web, "/clock")
        with pytest.raises(socket.timeout):
            while True:
                client.receive(patience_s=0.7)
        assert get(bench.web, "/clock") == before
        window.ask("document.getElementById('step').click()")
        window.wait("rowscan.state.clock.steps > %d" % before["steps"])
        assert client.receive().startswith(b"sSN LMDscandata")
        with pytest.raises(socket.timeout):
            client.receive(patience_s=0.7)
        # The space bar is the same button.
        window.ask("document.activeElement.blur(); document.dispatchEvent(new KeyboardEvent('keydown', {key: ' '}))")
        window.wait("document.getElementById('pause').textContent === 'Pause'")
        assert client.receive().startswith(b"sSN LMDscandata")


def test_a_fault_pressed_is_a_fault_in_the_stream(bench, window):
    look(window, bench.web)
    with Client(bench.address, "B") as client:
        client.subscribe()
        client.receive()
        window.ask("""(() => { const name = document.getElementById('fault-name'); name.value = 'contamination'; name.dispatchEvent(new Event('change'));
            document.querySelector('[data-key=level]').value = '1'; document.getElementById('fault-for').value = '';
            document.querySelector('#fault-form button.main').click(); })()""")
        window.wait("!!document.querySelector('#fault-list [data-name=contamination][data-state=active]')")
        assert [fault["name"] for fault in get(bench.web, "/faults")] == ["contamination"]
        window.wait("document.querySelector('.fan .state').dataset.status === 'contamination_warning'")
        # Contents of LCMstate: 1 is a warning.
        assert client.exchange(b"sRN LCMstate").endswith(b"\x01")
        window.ask("document.querySelector('#fault-list button').click()")
        window.wait("!document.querySelector('#fault-list li')")
        window.wait("document.querySelector('.fan .state').dataset.status === 'ok'")
        assert client.exchange(b"sRN LCMstate").endswith(b"\x00")
        # What the server refuses is told in its own words.
        window.ask("""(() => { document.getElementById('fault-for').value = '-3'; document.getElementById('fault-form').noValidate = true;
            document.querySelector('#fault-form button.main').click(); })()""")
        assert "expected a number" in window.wait("document.getElementById('fault-error').textContent")
    # The refusal above is an answer of 400, which a browser logs.
    assert all("400" in error for error in window.errors), window.errors


def test_it_comes_back_when_the_program_does(rowscan, window):
    first = start(rowscan)
    address = first.endpoint("web")["address"]
    try:
        look(window, address)
        assert window.ask("document.getElementById('link').dataset.state") in ("live", "connecting")
        window.wait("document.getElementById('link').dataset.state === 'live'")
    finally:
        first.close()
    window.wait("document.getElementById('link').dataset.state === 'lost'")
    again = start(rowscan, web=address)
    try:
        window.wait("document.getElementById('link').dataset.state === 'live'")
        began = window.ask("rowscan.picture.at")
        window.wait("rowscan.picture.at > %r && rowscan.picture.at < 60" % min(began, 0.1))
        count = window.ask("rowscan.picture.number")
        window.wait("rowscan.picture.number > %d" % (count + 5))
    finally:
        again.close()


def test_a_token_is_asked_for_and_taken(rowscan, window):
    started = start(rowscan, "--web-token", "secret-77")
    try:
        address = started.endpoint("web")["address"]
        window.open("http://%s/" % address)
        window.wait("!document.getElementById('token').hidden")
        window.open("about:blank")
        look(window, address, "#token=secret-77")
        window.wait("document.getElementById('link').dataset.state === 'live'")
    finally:
        started.close()


def scans_within(client, seconds):
    end = time.monotonic() + seconds
    scans = 0
    while time.monotonic() < end:
        scans += client.receive().startswith(b"sSN")
    return scans


def test_a_page_in_the_background_holds_nothing_up(bench, window):
    look(window, bench.web)
    # It draws nothing, and so never says that it has.
    window.ask("rowscan.frame = () => {}; true")
    with Client(bench.address, "B") as client:
        client.subscribe()
        client.receive()
        # What the page had said before may bring one picture more.
        scans_within(client, 1)
        before = window.ask("rowscan.picture.number")
        assert scans_within(client, 3) > 50
    assert window.ask("rowscan.picture.number") == before
    assert get(bench.web, "/watch/state")["scanners"][0]["lost"] == 0
