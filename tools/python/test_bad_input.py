"""Bad input: exit code 2, a message that names the remedy, nothing on stdout."""

import socket


def refused(rowscan, *arguments):
    """Runs the command, checks that it was refused as usage, returns the message."""
    code, out, err = rowscan.run(*arguments)
    assert code == 2, "exit %d: %s" % (code, err)
    assert out == ""
    assert "panicked" not in err
    return err


def test_an_unknown_model_lists_the_models(rowscan):
    message = refused(rowscan, "emulate", "--model", "lms9000", "--tcp", "127.0.0.1:0")
    assert "lms9000" in message and "lms111" in message and "lms511" in message


def test_a_busy_port_is_named(rowscan):
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = "127.0.0.1:%d" % server.getsockname()[1]
        assert address in refused(rowscan, "emulate", "--tcp", address)


def test_a_missing_scene_is_named(rowscan):
    assert "no-such-scene.toml" in refused(rowscan, "emulate", "no-such-scene.toml", "--tcp", "127.0.0.1:0")


def test_an_unknown_key_in_a_scene_is_named_with_its_line(rowscan, tmp_path):
    scene = tmp_path / "typo.toml"
    scene.write_text("version = 1\nsede = 7\n")
    message = refused(rowscan, "emulate", str(scene), "--tcp", "127.0.0.1:0")
    assert "sede" in message and "seed" in message and "2" in message


def test_an_unknown_subcommand(rowscan):
    assert "emulat" in refused(rowscan, "emulat")


def test_a_source_nobody_serves(rowscan):
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    assert str(port) in refused(rowscan, "estimate", "tcp://127.0.0.1:%d" % port)
