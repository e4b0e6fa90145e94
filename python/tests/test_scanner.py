"""Scanners in this process, as their clients and their owners see them."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time

import pytest

import children
import rowscan
from cola import LOGIN, SUBSCRIBE, Client


@pytest.fixture
def scanner(orchard):
    """One that runs as fast as its client."""
    with rowscan.Scanner("lms111", orchard, time_scale="max") as scanner:
        yield scanner


def test_a_client_finds_it(scanner):
    assert scanner.addresses == {"scanner0": scanner.address}
    assert scanner.source == "tcp://" + scanner.address
    with Client(scanner.address) as client:
        assert b"LMS10x_FieldEval" in client.ask(b"sRN DeviceIdent")
        assert client.ask(LOGIN) == b"sAN SetAccessMode 1"
        assert scanner.state["scanner0"]["clients"] == 1


def test_start_and_stop_do_what_the_block_does(orchard):
    scanner = rowscan.Scanner("lms111", orchard)
    assert not scanner.running
    with pytest.raises(rowscan.Error, match="not running; call start"):
        scanner.address
    assert scanner.start() is scanner and scanner.start() is scanner
    host, port = scanner.address.split(":")
    scanner.stop()
    scanner.stop()
    # Its port is free when stop returns.
    with socket.socket() as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        other.bind((host, int(port)))
    with pytest.raises(OSError):
        socket.create_connection((host, int(port)), timeout=1)
    scanner.start()
    with Client(scanner.address) as client:
        assert client.ask(b"sRN DeviceIdent")
    scanner.stop()


def test_connections_end_with_it(orchard):
    scanner = rowscan.Scanner("lms111", orchard).start()
    with Client(scanner.address) as client:
        client.ask(b"sRN DeviceIdent")
        scanner.stop()
        with pytest.raises(ConnectionError):
            client.receive()


def test_every_start_begins_at_the_row_s_start(orchard):
    def first_scans():
        with rowscan.Scanner("lms111", orchard, time_scale="max") as scanner, Client(scanner.address) as client:
            client.ask(SUBSCRIBE)
            return [client.receive() for _ in range(5)]

    assert first_scans() == first_scans()


def test_a_serial_scanner_is_a_port_that_goes_with_it(orchard, tmp_path):
    serial = pytest.importorskip("serial")
    link = tmp_path / "lms"
    with rowscan.Scanner("lms291", orchard, pty=link) as scanner:
        assert scanner.address == str(link) and scanner.source == "serial:%s" % link
        with serial.Serial(scanner.address, 9600, timeout=5) as port:
            port.write(bytes.fromhex("0200010031 1512".replace(" ", "")))
            assert port.read(1) == b"\x06"
    assert not os.path.lexists(link)


def test_the_tractor_has_can_and_gnss(tractor):
    assert set(tractor.addresses) == {"scanner0", "can0", "nmea0"}
    host, port = tractor.addresses["nmea0"].split(":")
    with socket.create_connection((host, int(port)), timeout=5) as gnss:
        assert gnss.recv(4096).startswith(b"$G")
    assert os.path.exists(tractor.addresses["can0"])


def test_time_stops_steps_and_goes_on(orchard):
    with rowscan.Scanner("lms111", orchard, time_scale=100) as scanner, Client(scanner.address) as client:
        scanner.pause()
        before = scanner.time_s
        client.ask(SUBSCRIBE)
        assert scanner.state["paused"] and scanner.time_s == before
        scanner.step(5)
        first = client.scan()
        assert [client.scan() for _ in range(3)] == [first + 1, first + 2, first + 3]
        stood = scanner.time_s
        client.ask(b"sRN DeviceIdent")
        assert scanner.time_s == stood
        scanner.resume()
        while scanner.time_s <= stood + 1.0:
            client.scan()
        scanner.time_scale = 1000
        assert scanner.time_scale == 1000


def test_until_stops_at_a_tree(orchard):
    with rowscan.Scanner("lms111", orchard, time_scale="max") as scanner, Client(scanner.address) as client:
        scanner.pause()
        client.ask(SUBSCRIBE)
        reader = threading.Thread(target=_drain, args=(client,), daemon=True)
        reader.start()
        scanner.until(tree=4)
        state = scanner.state
        assert state["tree"] == 4
        # The fourth trunk stands in the middle of the fourth metre and a half of row.
        assert abs(state["row_m"] - 3.5 * orchard.tree_spacing_m) < 0.1
        assert scanner.row_m == state["row_m"]
        scanner.until(row_m=6.0)
        assert 6.0 <= scanner.row_m < 6.1
        scanner.until(driven_s=7.0)
        assert 7.0 <= scanner.state["time_s"] - scanner.state["began_s"] < 7.1
        with pytest.raises(rowscan.Error, match="past tree 4 already, at 7.0"):
            scanner.until(tree=4)


def _drain(client):
    try:
        while True:
            client.scan()
    except (OSError, ValueError):
        pass


def test_time_that_never_comes_is_told(scanner):
    with pytest.raises(rowscan.Error, match="did not come to tree 4 within 200ms: it runs while a client takes scans"):
        scanner.until(tree=4, timeout=0.2)
    with pytest.raises(rowscan.Error, match="from 1 to 12, found 40"):
        scanner.until(tree=40)
    with pytest.raises(rowscan.Error, match="one of tree, row_m and driven_s"):
        scanner.until()


def test_a_fault_acts_and_is_cleared(scanner):
    with Client(scanner.address) as client:
        assert scanner.fault("drop", at={"scan": 3}, count=1) == "drop"
        assert [(fault["id"], fault["state"]) for fault in scanner.faults] == [("drop", "waiting")]
        client.ask(SUBSCRIBE)
        counters = [client.scan() for _ in range(4)]
        assert [after - before for before, after in zip(counters, counters[1:])] == [1, 2, 1]
        assert any("fault drop on scanner0: Begin" in line for line in scanner.log)
        scanner.clear("drop")
        assert scanner.faults == []
        with pytest.raises(rowscan.Error, match="there is no fault `drop`"):
            scanner.clear("drop")
        scanner.fault("stall", for_={"s": 1000.0})
        scanner.clear()
        assert client.scan() > counters[-1]


def test_faults_are_given_at_the_start(orchard, tmp_path):
    fault = {"name": "drop", "at": {"scan": 2}}
    file = tmp_path / "faults.toml"
    file.write_text('[[fault]]\nname = "drop"\nat = { scan = 2 }\n')
    for faults in ([fault], file):
        with rowscan.Scanner("lms111", orchard, time_scale="max", faults=faults) as scanner:
            with Client(scanner.address) as client:
                client.ask(SUBSCRIBE)
                first = client.scan()
                assert client.scan() == first + 2


def test_what_cannot_be_is_told_before_anything_grows(command_line, tmp_path):
    def words(**keywords):
        with pytest.raises(rowscan.Error) as error:
            rowscan.Scanner(**keywords)
        return str(error.value)

    assert words(model="lms112") == command_line.complaint("emulate", "--model", "lms112")
    assert words(scene="spindel") == command_line.complaint("emulate", "spindel")
    missing = tmp_path / "none.toml"
    assert words(faults=missing) == command_line.complaint("emulate", "--tcp", "127.0.0.1:0", "--faults", missing)
    assert "did you mean `drop`" in words(faults=[{"name": "dorp"}])
    assert "1e-6" in words(time_scale="fast") or "max" in words(time_scale="fast")
    assert "can" in words(can="smoke:1")
    assert "one LMS2xx" in words(model=["lms291", "lms291"])


def test_a_port_that_is_taken_is_told(command_line, orchard):
    with rowscan.Scanner("lms111", orchard) as scanner:
        other = rowscan.Scanner("lms111", orchard, tcp=scanner.address)
        with pytest.raises(rowscan.Error, match="the port is in use") as error:
            other.start()
        assert str(error.value) == command_line.complaint("emulate", "--tcp", scanner.address)
        assert not other.running


def test_other_threads_run_while_it_waits(scanner):
    """The interpreter's lock is released in a long call."""
    seen = []
    thread = threading.Thread(target=lambda: seen.append(time.monotonic()))
    began = time.monotonic()
    timer = threading.Timer(0.05, thread.start)
    timer.start()
    with pytest.raises(rowscan.Error):
        scanner.step(10, timeout=1.0)
    thread.join()
    assert seen and seen[0] - began < 0.9


def test_ctrl_c_ends_a_long_call():
    program = (
        "import rowscan\n"
        "with rowscan.Scanner('lms111', time_scale='max') as scanner:\n"
        "    print('waits', flush=True)\n"
        "    scanner.step(1000, timeout=None)\n"
    )
    child = children.start(program)
    assert child.stdout.readline() == "waits\n"
    child.send_signal(signal.SIGINT)
    _, complaint = child.communicate(timeout=10)
    assert "KeyboardInterrupt" in complaint and child.returncode != 0


def test_the_interpreter_s_end_ends_it():
    program = (
        "import rowscan\n"
        "scanner = rowscan.Scanner('lms291').start()\n"
        "print(scanner.address)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=30)
    assert done.returncode == 0, done.stderr
    assert not os.path.lexists(done.stdout.strip())


def test_several_scanners_of_one_tractor(tmp_path):
    scene = tmp_path / "two.toml"
    scene.write_text(
        "version = 1\n[orchard]\ntrees = 2\n[rig]\nspeed_m_s = 1.0\n"
        + "[[rig.scanner]]\nmodel = \"lms111\"\ndistance_m = 1.9\nheight_m = 1.6\n" * 2
    )
    with rowscan.Scanner([], scene, nmea="tcp:127.0.0.1:0") as tractor:
        assert list(tractor.addresses) == ["nmea0"]
    with rowscan.Scanner(["lms111", "lms151"], scene) as scanner:
        assert list(scanner.addresses) == ["scanner0", "scanner1"]
        for name, model in [("scanner0", b"LMS111"), ("scanner1", b"LMS151")]:
            with Client(scanner.addresses[name]) as client:
                assert model in client.ask(b"sRN DItype")


def test_datagrams_go_where_they_are_directed(orchard):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.bind(("127.0.0.1", 0))
        ear.settimeout(10)
        here = "127.0.0.1:%d" % ear.getsockname()[1]
        with rowscan.Scanner("picoscan150", orchard, udp=here, rest="127.0.0.1:0") as scanner:
            assert here in scanner.addresses.values()
            with Client(scanner.address) as client:
                assert client.ask(b"sMN SetAccessMode 04 81BE23AA") == b"sAN SetAccessMode 1"
                assert client.ask(b"sWN ScanDataEnable 1") == b"sWA ScanDataEnable"
            datagram, _ = ear.recvfrom(65536)
            assert datagram[:4] == b"\x02\x02\x02\x02"


@pytest.mark.parametrize(
    "model, keys, why",
    [
        ("picoscan150", {"udp": "here"}, "expected an IPv4 address with a port"),
        ("picoscan150", {"allow_destination": "there"}, "expected an IPv4 address"),
        ("picoscan150", {"udp": ["127.0.0.1:0", "127.0.0.1:0"]}, "1 addresses for no such scanner"),
        ("lms111", {"udp": "127.0.0.1:0"}, "such as picoscan150"),
        ("lms111", {"allow_destination": "192.0.2.7"}, "such as picoscan150"),
        ("lms111", {"rest": "127.0.0.1:0"}, "such as picoscan150"),
    ],
)
def test_destinations_that_are_none_are_refused(orchard, model, keys, why):
    with pytest.raises(ValueError, match=why):
        rowscan.Scanner(model, orchard, **keys).start()


def test_one_scanner_listens_at_several_addresses(orchard):
    with rowscan.Scanner("lms111", orchard, tcp=["127.0.0.1:0", "127.0.0.1:0"]) as scanner:
        assert list(scanner.addresses) == ["scanner0", "scanner0:1"]
        for address in scanner.addresses.values():
            with Client(address) as client:
                assert b"LMS10x_FieldEval" in client.ask(b"sRN DeviceIdent")
