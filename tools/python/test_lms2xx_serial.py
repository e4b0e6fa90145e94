"""pyserial against the virtual LMS2xx: a pseudo-terminal and RFC 2217."""

import fcntl
import json
import os
import signal
import subprocess
import sys
import termios
import time

import pytest

serial = pytest.importorskip("serial")

import emulator as emulator_module  # noqa: E402 (pyserial first)
from lms2xx import RATES, Lms2xx, frame  # noqa: E402
from lms_client import Client  # noqa: E402

HERE = os.path.dirname(os.path.abspath(__file__))


class SerialEmulator:
    """`rowscan emulate`, or another command, on one serial line."""

    def __init__(self, rowscan, *arguments, command="emulate"):
        command = [rowscan.binary(), command, "--format", "jsonl", *arguments]
        self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE)
        event = json.loads(self.process.stdout.readline())
        assert event["event"] == "listening"
        self.endpoint = event["endpoint"]
        self.url = event.get("path") or "rfc2217://" + event["address"]

    def cpu_s(self):
        """Processor seconds used so far."""
        with open("/proc/%d/stat" % self.process.pid) as stat:
            fields = stat.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def close(self):
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(timeout=10)


@pytest.fixture
def line(rowscan, tmp_path):
    """Starts emulators on a pseudo-terminal, or as the arguments say."""
    started = []

    def start(*arguments, model="lms291", where=None):
        where = where or ("--pty", str(tmp_path / "scanner"))
        started.append(SerialEmulator(rowscan, "--model", model, *where, *arguments))
        return started[-1]

    yield start
    for emulator in started:
        emulator.close()


@pytest.fixture(scope="module")
def truth():
    """What an LMS111 at the same place sees before the tractor drives, from 0 to 180 degrees: mm, 0 for nothing within 20 m."""
    if not emulator_module.binary():
        pytest.skip("ROWSCAN_BIN is not set; `cargo xtask ci` sets it")
    emulator = emulator_module.Emulator("--model", "lms111")
    with Client(emulator.address, "B") as client:
        client.login()
        client.subscribe()
        distances = client.scans(1)[0].channel("DIST1").values
    emulator.close()
    return distances[90:451]


@pytest.mark.parametrize("rate", sorted(RATES))
def test_every_rate_gives_the_scenes_own_ranges(line, truth, rate):
    emulator = line("--time-scale", "max")
    with Lms2xx(emulator.url) as lms:
        assert lms.ask(b"\x3a")[1:-1] == b"LMS291;S05;X01.27 "
        lms.rate(rate)
        lms.millimetres()
        assert lms.ask(b"\x20\x24") == b"\xa0\x00\x10"
        scan = lms.scan()
    assert len(scan) == len(truth) == 361
    assert sum(value > 0 for value in truth) > 100
    for found, real in zip(scan, truth):
        assert found == real if real else found > 20000


def test_at_max_the_end_waits_until_the_client_has_read_all(rowscan, tmp_path):
    recording = str(tmp_path / "device.mcap")
    emulator = SerialEmulator(rowscan, "spindle", "--model", "lms291", "--pty", str(tmp_path / "scanner"), "--time-scale", "max",
                              "--seconds", "30", "--record", recording)
    with Lms2xx(emulator.url) as lms:
        assert lms.ask(b"\x20\x24") == b"\xa0\x00\x10"
        heard, quiet = bytearray(lms.received), 0
        lms.port.timeout = 0.5
        # A client that is slower than the scanner: when that is done, much is still to be read.
        while quiet < 4:
            try:
                # No more than there is: pyserial forgets what it has when the line ends under a read.
                piece = lms.port.read(min(700, lms.port.in_waiting) or 1)
            except (serial.SerialException, OSError):
                break
            heard += piece
            quiet = 0 if piece else quiet + 1
            time.sleep(0.02)
    assert emulator.process.wait(timeout=20) == 0
    code, told, said = rowscan.run("record", "--info", recording, "--format", "json")
    assert code == 0, said
    (stream,) = json.loads(told)["streams"]
    assert stream["scans"] > 30
    # The last one is still on the line when time ends.
    assert stream["scans"] - 1 <= heard.count(b"\x02\x80\xd6\x02\xb0") <= stream["scans"]


def test_a_client_at_the_wrong_rate_hears_and_is_heard_as_garbage(line):
    emulator = line("--rate", "38400")
    with Lms2xx(emulator.url, rate=9600) as lms:
        lms.port.timeout = 1
        assert lms.ask(b"\x31") is None
        lms.port.baudrate = 38400
        lms.port.reset_input_buffer()
        assert lms.ask(b"\x31")[0] == 0xB1
        assert lms.ask(b"\x20\x24") == b"\xa0\x00\x10"
        lms.port.baudrate = 9600
        heard = lms.port.read(200)
        assert heard and b"\x02\x80" not in heard


def test_close_and_reopen_and_killed_clients(line):
    emulator = line()
    for exclusive in (None, True, None):
        with Lms2xx(emulator.url, exclusive=exclusive) as lms:
            assert lms.ask(b"\x31")[0] == 0xB1
            # Left streaming.
            assert lms.ask(b"\x20\x24") == b"\xa0\x00\x10"
    program = (
        "import sys; sys.path.insert(0, %r)\n"
        "from lms2xx import Lms2xx\n"
        "lms = Lms2xx(%r, exclusive=True); lms.ask(b'\\x31'); print('up', flush=True)\n"
        "import time; time.sleep(60)\n" % (HERE, emulator.url)
    )
    killed = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE)
    assert killed.stdout.readline().strip() == b"up"
    killed.kill()
    killed.wait()
    time.sleep(0.1)
    with Lms2xx(emulator.url, exclusive=True) as lms:
        assert lms.port.in_waiting == 0 or lms.ask(b"\x20\x25") == b"\xa0\x00\x10"
        assert lms.ask(b"\x20\x25") == b"\xa0\x00\x10"
        assert lms.ask(b"\x31")[0] == 0xB1


@pytest.mark.skipif(not hasattr(os, "setuid") or os.geteuid() != 0, reason="needs to become someone else")
def test_an_ordinary_user_reopens_what_a_killed_client_held_exclusively(rowscan, tmp_path):
    """Root opens exclusive ports anyway, so the whole test runs as nobody."""
    os.chmod(tmp_path, 0o777)
    for folder in list(tmp_path.parents)[:3]:
        os.chmod(folder, 0o755)
    can_run = subprocess.run([rowscan.binary(), "--version"], user=65534, group=65534, check=False,
                             stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd="/")
    if can_run.returncode != 0:
        pytest.skip("an ordinary user may not run the binary where it lies")
    child = os.fork()
    if child == 0:
        try:
            os.setgid(65534)
            os.setuid(65534)
            os.chdir("/")
            hold_kill_and_reopen(rowscan.binary(), str(tmp_path / "scanner"))
            os._exit(0)
        except BaseException as error:  # the child must not go on as a second test run
            print(repr(error), file=sys.stderr, flush=True)
            os._exit(1)
    assert os.waitpid(child, 0)[1] == 0


def hold_kill_and_reopen(binary, link):
    """A client takes the port for itself and is killed; the next one opens it."""
    emulator = subprocess.Popen([binary, "emulate", "--model", "lms291", "--pty", link, "--format", "jsonl"],
                                stdout=subprocess.PIPE)
    emulator.stdout.readline()
    client = os.fork()
    if client == 0:
        fcntl.ioctl(os.open(link, os.O_RDWR | os.O_NOCTTY), termios.TIOCEXCL)
        time.sleep(60)
        os._exit(0)
    try:
        for _ in range(100):
            time.sleep(0.05)
            try:
                os.close(os.open(link, os.O_RDWR | os.O_NOCTTY))
            except OSError:
                break
        else:
            raise AssertionError("the port never was exclusive")
    finally:
        os.kill(client, signal.SIGKILL)
        os.waitpid(client, 0)
    time.sleep(0.3)
    os.close(os.open(link, os.O_RDWR | os.O_NOCTTY))
    emulator.send_signal(signal.SIGINT)
    assert emulator.wait() == 0
    assert not os.path.lexists(link)


def test_idle_costs_next_to_nothing(line):
    emulator = line()
    with Lms2xx(emulator.url) as lms:
        assert lms.ask(b"\x31")[0] == 0xB1
        assert lms.ask(b"\x20\x24") == b"\xa0\x00\x10"
    time.sleep(0.5)
    before, began = emulator.cpu_s(), time.monotonic()
    time.sleep(3)
    share = (emulator.cpu_s() - before) / (time.monotonic() - began)
    print("idle: %.2f %% of a processor" % (100 * share))
    assert share < 0.01


def test_a_pause_inside_a_telegram_drops_it(line):
    emulator = line()
    with Lms2xx(emulator.url) as lms:
        status = frame(b"\x31")
        lms.port.timeout = 1
        lms.port.write(status[:4])
        # More than the half second and the slack that the bench profile allows a busy host.
        time.sleep(1.3)
        lms.port.write(status[4:])
        assert lms.port.read(1) == b""
        assert lms.ask(b"\x31")[0] == 0xB1


def test_bad_frames_are_refused_as_the_device_does(line):
    emulator = line()
    with Lms2xx(emulator.url) as lms:
        broken = bytearray(frame(b"\x31"))
        broken[-1] ^= 1
        lms.port.write(broken)
        assert lms.port.read(1) == b"\x15"
        assert lms.ask(b"\x20\x00WRONGPWD") == b"\xa0\x01\x10"
        assert lms.ask(b"\x45\x00", reply=0x92) == b"\x92\x10"
        assert lms.ask(b"\x3b\xb4\x00\x19\x00")[1] == 0


def test_the_configuration_survives_in_its_file(line, tmp_path):
    state = str(tmp_path / "state.txt")
    emulator = line("--state", state)
    with Lms2xx(emulator.url) as lms:
        lms.millimetres()
    assert emulator.close() == 0
    emulator = line("--state", state)
    with Lms2xx(emulator.url) as lms:
        assert lms.ask(b"\x74")[6:8] == b"\x06\x01"


def test_rfc2217_with_a_change_of_rate(line):
    emulator = line("--time-scale", "max", where=("--rfc2217", "127.0.0.1:0"))
    assert emulator.endpoint == "rfc2217"
    for rate in (38400, 500000):
        with Lms2xx(emulator.url) as lms:
            lms.port.dtr = True
            lms.port.rts = False
            lms.rate(rate)
            lms.millimetres()
            assert lms.ask(b"\x20\x24") == b"\xa0\x00\x10"
            assert len(lms.scan()) == 361
            assert lms.ask(b"\x20\x25") == b"\xa0\x00\x10"
            lms.port.baudrate = 9600
            lms.port.timeout = 1
            assert lms.ask(b"\x31") is None, "another rate is garbage here too"
            lms.port.baudrate = rate
            lms.port.timeout = 5
            lms.rate(9600)


def test_lines_that_do_not_go_together_are_refused(rowscan, tmp_path):
    taken = tmp_path / "file"
    taken.write_text("mine")
    for arguments, complaint in [
        (["--model", "lms291"], "one serial line"),
        (["--model", "lms291", "--pty", str(tmp_path / "a"), "--rfc2217", "127.0.0.1:0"], "one serial line"),
        (["--model", "lms291", "--pty", str(taken)], "choose another name"),
        (["--model", "lms291", "--serial", "/dev/no-such-port"], "/dev/no-such-port"),
        (["--model", "lms291", "--rfc2217", "nowhere"], "expected HOST:PORT"),
        (["--model", "lms291", "--pty", str(tmp_path / "a"), "--rate", "12345"], "9600, 19200, 38400 and 500000"),
        (["--model", "lms291", "--pty", str(tmp_path / "a"), "--start", "standby"], "no such state"),
    ]:
        code, out, err = rowscan.run("emulate", *arguments)
        assert (code, out) == (2, ""), (arguments, out, err)
        assert complaint in err, (arguments, err)
    assert taken.read_text() == "mine"


def test_a_recorded_scanner_is_one_again(rowscan, line, tmp_path):
    recording = tmp_path / "run.mcap"

    def session(url, count):
        """Sets the scanner up and takes its first scans, as any client would."""
        with Lms2xx(url) as lms:
            ident = lms.ask(b"\x3a")
            lms.rate(38400)
            lms.millimetres()
            status = lms.ask(b"\x31")
            assert lms.ask(b"\x20\x24") == b"\xa0\x00\x10"
            scans = [lms.scan() for _ in range(count)]
            assert lms.ask(b"\x20\x25") == b"\xa0\x00\x10"
        return ident, status, scans[:10]

    emulator = line("--time-scale", "max", "--record", str(recording))
    # More than the replay's client takes: a replay that has sent everything ends.
    recorded = session(emulator.url, 60)
    assert emulator.close() == 0
    replayed = SerialEmulator(rowscan, str(recording), "--pty", str(tmp_path / "again"), "--time-scale", "max", command="replay")
    try:
        assert session(replayed.url, 10) == recorded
        with Lms2xx(replayed.url, rate=38400) as lms:
            # Other beams than the recorded 361, and another way of output: not done.
            assert lms.ask(b"\x3b\x64\x00\x19\x00")[:6] == b"\xbb\x00\xb4\x00\x32\x00"
            assert lms.ask(b"\x20\x2a", reply=0x92) == b"\x92\x10"
    finally:
        replayed.close()
