"""Scans as arrays: of drives in memory, and of recordings."""

import csv
import math

import numpy as np
import pytest

import rowscan


@pytest.fixture(scope="module")
def driven(orchard):
    return rowscan.drive(orchard, "lms111")


@pytest.fixture(scope="module")
def recording(command_line, orchard, tmp_path_factory):
    """The command line records what a scanner of ours sends."""
    path = tmp_path_factory.mktemp("recording") / "run.mcap"
    with rowscan.Scanner("lms111", orchard, time_scale="max") as scanner:
        done = command_line.run("record", scanner.source, "-o", path, "--scans", 200)
    assert done.returncode == 0, done.stderr
    return path


def test_shapes_and_misses(driven):
    assert len(driven) == 900 and driven.ranges_m.shape == driven.remission.shape == (900, 541)
    assert driven.ranges_m.dtype == np.float64 and driven.remission.dtype == np.uint16
    misses = np.isnan(driven.ranges_m)
    assert 0.1 < misses.mean() < 0.9
    assert np.nanmin(driven.ranges_m) > 0.0 and np.isfinite(driven.ranges_m[~misses]).all()
    np.testing.assert_allclose(driven.angles_deg, np.arange(541) * 0.5 - 45.0)
    np.testing.assert_allclose(np.diff(driven.time_s), 0.02, atol=2e-6)
    assert driven.received_s is None
    assert driven.encoder_ticks[-1] > driven.encoder_ticks[0]


def test_ranges_are_the_vector_s_own_memory(driven):
    assert type(driven.ranges_m.base.base).__name__ == "PySliceContainer"
    # The same array each time: nothing is made anew.
    assert driven.ranges_m.ctypes.data == driven.ranges_m.ctypes.data == driven.ranges_m.base.ctypes.data


def test_points_lie_where_ranges_and_angles_say(driven):
    points = driven.points()
    assert points["points_m"].shape == (np.isfinite(driven.ranges_m).sum(), 3)
    # The tractor drives at 1 m/s, 50 scans a second; each beam starts where it then is, 720 half degrees a turn.
    turns = points["scan"] + points["beam"] / 720
    # Where that is, the encoder says, in ticks of a millimetre.
    np.testing.assert_allclose(points["points_m"][:, 1], turns * 0.02, atol=0.002)
    # The scanner looks from 1.6 m down to level ground, and nothing lies below that.
    assert abs(points["points_m"][:, 2].min()) < 0.01


def test_a_drive_is_what_a_client_receives(driven, recording):
    read = rowscan.read(recording)
    # What was on its way when the recorder had its 200 is recorded too.
    assert len(read) >= 200
    np.testing.assert_array_equal(read.ranges_m, driven.ranges_m[: len(read)])
    np.testing.assert_array_equal(read.telegram_counter, driven.telegram_counter[: len(read)])
    assert (np.diff(read.received_s) >= 0).all()


def test_a_recording_is_read_as_it_is_exported(command_line, recording, tmp_path):
    out = tmp_path / "scans.csv"
    done = command_line.run("export", recording, "--what", "points", "--to", "csv", "-o", out, "--rig", "spindle")
    assert done.returncode == 0, done.stderr
    with open(out, newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    read = rowscan.read(recording)
    points = read.points("spindle")
    assert len(rows) == len(points["points_m"])
    assert [float(row["range_m"]) for row in rows] == read.ranges_m[np.isfinite(read.ranges_m)].tolist()
    for axis, name in enumerate(["x_m", "y_m", "z_m"]):
        assert [float(row[name]) for row in rows] == points["points_m"][:, axis].tolist()


def test_at_most_so_many_scans(recording):
    assert len(rowscan.read(recording, scans=20)) == 20


def test_a_beam_has_no_tenth_echo(recording):
    assert np.isnan(rowscan.read(recording, echo=9, scans=2).ranges_m).all()


def test_a_data_frame_has_a_row_a_beam(driven):
    pandas = pytest.importorskip("pandas")
    frame = driven.to_pandas()
    assert isinstance(frame, pandas.DataFrame) and len(frame) == 900 * 541
    line = frame[frame.scan == 17]
    np.testing.assert_array_equal(line.range_m.to_numpy(), driven.ranges_m[17])
    np.testing.assert_array_equal(line.angle_deg.to_numpy(), driven.angles_deg)
    assert (line.time_s == driven.time_s[17]).all()
    assert math.isclose(frame.range_m.isna().mean(), np.isnan(driven.ranges_m).mean())


def test_a_serial_scanner_drives_too(orchard):
    scans = rowscan.drive(orchard, "lms291")
    assert scans.remission is None and len(scans) > 100


def test_words_are_the_command_line_s(command_line, tmp_path):
    for name in ["nowhere.mcap", "tcp://127.0.0.1:1"]:
        with pytest.raises(rowscan.Error) as error:
            rowscan.read(tmp_path / name if "nowhere" in name else name)
        place = tmp_path / name if "nowhere" in name else name
        assert str(error.value) == command_line.complaint("export", place, "--to", "csv", "-o", tmp_path / "x.csv")
    with pytest.raises(rowscan.Error) as error:
        rowscan.drive("spindle", "lms112")
    assert str(error.value) == command_line.complaint("emulate", "--model", "lms112")


def test_an_estimate_is_the_command_line_s_to_the_last_bit(command_line, recording, orchard):
    expected = command_line.json("estimate", recording, "--rig", "spindle")
    assert rowscan.estimate(recording, "spindle") == expected
    assert expected["scans"] >= 200 and expected["leaf_area_m2"] > 0.0
    expected = command_line.json("estimate", recording, "--rig", "spindle", "--scans", 100, "--model", "lms511", "--echo", "first")
    assert rowscan.estimate(recording, orchard, scans=100, model="lms511", echo="first") == expected


def test_without_a_rig_areas_are_unknown(recording):
    found = rowscan.estimate(recording)
    assert found["scans"] >= 200 and found["leaf_area_m2"] is None


def test_the_rig_that_a_recording_keeps_measures_as_on_the_command_line(command_line, tmp_path):
    path = tmp_path / "kept.mcap"
    with rowscan.Scanner("lms111", "spindle", time_scale="max") as scanner:
        assert command_line.run("record", scanner.source, "-o", path, "--rig", "spindle", "--scans", 200).returncode == 0
    expected = command_line.json("estimate", path)
    assert expected["leaf_area_contact_raw_m2"] > 0.0
    assert rowscan.estimate(path) == expected


def test_estimators_and_trees_are_the_command_line_s_to_the_last_bit(command_line, recording, orchard):
    flags = ("--estimators", "all", "--trees", "trunk", "--trees", "valley")
    expected = command_line.json("estimate", recording, "--rig", "spindle", *flags)
    found = rowscan.estimate(recording, "spindle", estimators="all", trees=["trunk", "valley"])
    assert found == expected
    assert len(found["side_by_side"]) > 10 and [cut["method"] for cut in found["trees_found"]] == ["trunk", "valley"]
    assert any(beside["truth"] is not None for beside in found["side_by_side"])
    # An orchard that is grown already brings its truth along.
    of_orchard = rowscan.estimate(recording, orchard, estimators=["tai"])["side_by_side"]
    assert {beside["estimator"] for beside in of_orchard} < {beside["estimator"] for beside in found["side_by_side"]}
    assert any(beside["truth"] is not None for beside in of_orchard)


def test_names_of_estimators_and_cuts_are_checked(recording):
    with pytest.raises(rowscan.Error, match="there is no estimator `mtaa`.*there are all, "):
        rowscan.estimate(recording, "spindle", estimators="mtaa")
    with pytest.raises(rowscan.Error, match="trees: expected `trunk` or `valley`, found `roots`"):
        rowscan.estimate(recording, "spindle", trees=["roots"])


def test_what_the_command_line_withholds_is_none(command_line, tmp_path):
    path = tmp_path / "wall.mcap"
    with rowscan.Scanner("lms111", "wall", time_scale="max") as scanner:
        assert command_line.run("record", scanner.source, "-o", path, "--scans", 150).returncode == 0
    found = rowscan.estimate(path, "wall")
    assert found["leaf_area_withheld"] == "no_foliage" and found["impacted_total_area_m2"] > 0
    areas = [key for key in found if key.startswith("leaf_area_") and key.endswith("_m2")]
    assert len(areas) > 5 and all(found[key] is None for key in [*areas, "lai"])
    for part in found["trees"] + found["slices"]:
        assert all(part[key] is None for key in part if key.startswith("leaf_area_") or key == "lai"), part
    done = command_line.run("estimate", path, "--rig", "wall", "--format", "json")
    assert done.returncode == 1


def test_a_scanner_is_estimated_live(orchard):
    with rowscan.Scanner("lms111", orchard, time_scale="max") as scanner:
        found = rowscan.estimate(scanner.source, orchard, scans=900)
    assert found["scans"] == 900 and found["scans_lost"] == 0
    assert abs(found["leaf_area_m2"] / orchard.leaf_area_m2 - 1.0) < 0.25
