"""Orchards by keys, results as objects, studies, pictures, pickles, old names."""

import json
import multiprocessing
import pickle

import numpy as np
import pytest

import rowscan


@pytest.fixture(scope="module")
def small():
    return rowscan.Orchard("spindle", seed=3, trees=3)


@pytest.fixture(scope="module")
def driven(small):
    return rowscan.drive(small, "lms111")


def test_keys_are_those_of_a_scene_file(small, command_line, tmp_path):
    assert small.trees_per_row == 3
    scene = tmp_path / "scene.toml"
    scene.write_text('version = 2\nseed = 3\n[orchard]\npreset = "spindle"\ntrees = 3\ntarget_lai = 1.2\n[orchard.tree]\niterations = 5\n')
    by_file = rowscan.Orchard(scene)
    by_keys = rowscan.Orchard("spindle", seed=3, trees=3, target_lai=1.2, **{"orchard.tree.iterations": 5})
    assert by_keys.lai == by_file.lai == pytest.approx(1.2, rel=0.01)
    by_rig = rowscan.Orchard("spindle", trees=3, **{"rig.speed_m_s": 0.5})
    assert len(rowscan.drive(by_rig)) == 2 * len(rowscan.drive(rowscan.Orchard("spindle", trees=3)))


@pytest.mark.parametrize(
    "keys, words",
    [
        ({"treez": 3}, "unknown key `treez`; did you mean `trees`?"),
        ({"trees": -3}, "1 or more"),
        ({"trees": "many"}, "key `orchard.trees`"),
        ({"rig.speed": 1.0}, "did you mean `speed_m_s`?"),
        ({"trees": None}, "key `orchard.trees`"),
    ],
)
def test_keys_are_checked_as_toml_is(keys, words):
    with pytest.raises(rowscan.Error) as error:
        rowscan.Orchard("spindle", **keys)
    assert words in str(error.value)


@pytest.mark.parametrize("seed", [-1, 2**64, 1.5, "seven"])
def test_a_seed_that_is_none_is_a_value_error(seed):
    for call in [
        lambda: rowscan.Orchard("spindle", seed=seed),
        lambda: rowscan.Scanner("lms111", seed=seed),
        lambda: rowscan.drive("spindle", seed=seed),
        lambda: rowscan.check("row.toml", seed=seed),
    ]:
        with pytest.raises(ValueError, match="seed: expected a whole number of 0 to"):
            call()


def test_an_estimate_of_a_drive_is_that_of_a_client(small, driven):
    with rowscan.Scanner("lms111", small, time_scale="max") as scanner:
        live = rowscan.estimate(scanner.source, small, scans=len(driven))
    assert rowscan.estimate(driven) == rowscan.estimate(driven, small) == live
    assert rowscan.estimate(driven, scans=50).scans == 50


def test_an_estimate_of_a_drive_has_the_truth_beside_it(driven):
    found = rowscan.estimate(driven, estimators="all", trees="trunk")
    assert any(beside.truth is not None for beside in found.side_by_side)


def test_an_estimate_of_what_was_read_is_that_of_the_file(command_line, small, tmp_path):
    path = tmp_path / "run.mcap"
    with rowscan.Scanner("lms111", small, time_scale="max") as scanner:
        assert command_line.run("record", scanner.source, "-o", path, "--scans", 150).returncode == 0
    of_arrays, of_file = rowscan.estimate(rowscan.read(path), small), rowscan.estimate(path, small)
    # A file says which bytes were no telegram; arrays do not.
    assert of_arrays == of_file and of_file.scans >= 150
    with pytest.raises(rowscan.Error, match="first echoes: expected scans read with echo=0, found echo=1"):
        rowscan.estimate(rowscan.read(path, echo=1), small)


def test_changed_arrays_are_estimated_as_they_are(small, driven):
    changed = pickle.loads(pickle.dumps(driven))
    changed.ranges_m[:] = np.nan
    assert rowscan.estimate(changed, small).impacted_total_area_m2 == 0.0
    assert rowscan.estimate(driven, small).impacted_total_area_m2 > 0.0


def test_scans_say_where_the_tractor_was(driven):
    np.testing.assert_allclose(driven.row_m, driven.time_s * 1.0, atol=1e-6)
    np.testing.assert_allclose(driven.speed_m_s, 1.0)
    frame_of = pytest.importorskip("pandas") and driven.to_pandas()
    assert frame_of.row_m.iloc[-1] == driven.row_m[-1] and set(frame_of.speed_m_s) == {1.0}


def test_a_tractor_that_stops_stands_where_it_is():
    keys = {"trees": 3, "drive.stop_and_go": {"go_s": 2.0, "stop_s": 1.0, "ramp_s": 0.5}}
    scans = rowscan.drive(rowscan.Orchard("spindle", **keys))
    assert scans.speed_m_s.min() == 0.0 and scans.speed_m_s.max() == pytest.approx(1.0)
    stands = scans.speed_m_s == 0.0
    both = stands[1:] & stands[:-1]
    assert both.any() and (np.diff(scans.row_m)[both] == 0.0).all()
    np.testing.assert_allclose(np.gradient(scans.row_m, scans.time_s)[2:-2], scans.speed_m_s[2:-2], atol=0.03)


def test_results_are_dicts_and_objects(driven):
    found = rowscan.estimate(driven)
    assert isinstance(found, dict) and found.leaf_area_m2 == found["leaf_area_m2"] > 0
    assert found.trees[0].height_m == found["trees"][0]["height_m"]
    plain = found.to_dict()
    assert type(plain) is dict and type(plain["trees"][0]) is dict and json.loads(json.dumps(plain)) == found
    with pytest.raises(AttributeError, match="no 'leaf_area'; it has .*leaf_area_m2"):
        found.leaf_area
    pandas = pytest.importorskip("pandas")
    trees = found.to_frame()
    assert isinstance(trees, pandas.DataFrame) and list(trees.tree) == [tree.tree for tree in found.trees]
    assert len(found.to_frame("slices")) == len(found.slices)
    with pytest.raises(ValueError, match="found `leaves`"):
        found.to_frame("leaves")


def test_a_profile_is_lists_by_key(driven):
    found = rowscan.estimate(driven, profile=0.25)
    row = found.bands()
    assert len(set(map(len, row.values()))) == 1 and len(row["from_m"]) == len(found.profile.row)
    leaf = np.array(row["leaf_area_m2"], dtype=float)
    assert np.nansum(leaf) == pytest.approx(found.leaf_area_m2)
    assert np.array(row["leaf_area_interval_m2"], dtype=float).shape == (len(leaf), 2)
    for tree in found.trees:
        assert np.nansum(found.bands(tree.tree)["leaf_area_m2"]) == pytest.approx(tree.leaf_area_m2)
    with pytest.raises(KeyError):
        found.bands(99)
    assert rowscan.estimate(driven).bands() == {}
    with pytest.raises(ValueError, match="0.1..=0.5"):
        rowscan.estimate(driven, profile=0.05)


def test_pickles_come_back(small, driven):
    again = pickle.loads(pickle.dumps(small))
    assert again.truth == small.truth and repr(again) == repr(small)
    scans = pickle.loads(pickle.dumps(driven))
    for name in ["ranges_m", "remission", "time_s", "row_m", "encoder_ticks"]:
        np.testing.assert_array_equal(getattr(scans, name), getattr(driven, name))
    assert rowscan.estimate(scans) == rowscan.estimate(driven)
    np.testing.assert_array_equal(scans.points()["points_m"], driven.points()["points_m"])
    leaves = small.leaves()
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(leaves)).vertices_m, leaves.vertices_m)
    scan = rowscan.scan_row(small, dy_m=0.2, points=True)
    back = pickle.loads(pickle.dumps(scan))
    assert back.areas == scan.areas and set(back.points) == set(scan.points)
    found = rowscan.estimate(driven)
    assert pickle.loads(pickle.dumps(found)) == found
    with pytest.raises(TypeError):
        pickle.dumps(rowscan.Scanner("lms111", small))


def test_orchards_go_to_other_processes(small):
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.map(_lai, [small]) == [small.lai]


def _lai(orchard):
    return orchard.lai


STUDY = """version = 1
name = "speeds"
scene = "spindle"
keep = ["contact.leaf_area_m2"]
[[sweep]]
key = "rig.speed_m_s"
values = [1.0, 2.0]
[[sweep]]
key = "orchard.trees"
values = [2, 3]
"""


def test_a_study_is_the_command_line_s(command_line, tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    found = rowscan.study(path, seed=5, repeats=1)
    expected = command_line.json("study", "run", path, "--seed", 5, "--repeats", 1)
    assert found.rows == expected["rows"] and found.effects == expected["effects"]
    assert found.svg.startswith("<svg") and found._repr_svg_() == found.svg
    assert pickle.loads(pickle.dumps(found)).svg == found.svg
    pytest.importorskip("pandas")
    assert len(found.to_frame()) == 4 and set(found.to_frame("effects").axis) == {"speed_m_s", "trees"}


def test_pictures_are_the_command_line_s(command_line, tmp_path, small):
    scene = tmp_path / "scene.toml"
    scene.write_text('version = 2\nseed = 3\n[orchard]\npreset = "spindle"\ntrees = 2\n')
    orchard = rowscan.Orchard(scene)
    assert command_line.run("orchard", "export", scene, "--svg", tmp_path / "row.svg").returncode == 0
    assert orchard.svg() == orchard._repr_svg_() == (tmp_path / "row.svg").read_text()
    size = ("--size", "160x90", "--figure", "none", "--view", "side")
    assert command_line.run("orchard", "render", scene, "-o", tmp_path / "row.png", *size).returncode == 0
    assert orchard.png("side", size=(160, 90)) == (tmp_path / "row.png").read_bytes()
    with pytest.raises(ValueError, match="view: expected one of three-quarter, side, alley, top, found `below`"):
        orchard.png("below")


def test_old_names_last_one_release(small):
    for old, new in [("scan", "scan_row"), ("Scan", "RowScan"), ("Scans", "ScanArrays")]:
        with pytest.warns(DeprecationWarning, match="rowscan.%s is now rowscan.%s" % (old, new)):
            assert getattr(rowscan, old) is getattr(rowscan, new)
    with pytest.raises(AttributeError, match="no attribute 'scanner'"):
        rowscan.scanner
