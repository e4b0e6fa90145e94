"""Orchards and their truth."""

import math
import warnings

import numpy as np
import pytest

import rowscan


def test_truth_is_the_command_line_s_to_the_last_bit(command_line, orchard):
    assert orchard.truth == command_line.json("orchard", "truth", "spindle", "--seed", 7)


def test_cells_are_the_command_line_s_to_the_last_bit(command_line, orchard):
    rows = command_line.json("orchard", "truth", "spindle", "--seed", 7, "--cells")
    cells = orchard.cells()
    assert set(cells) == set(rows[0])
    for name, column in cells.items():
        assert column.tolist() == [row[name] for row in rows], name


def test_attributes_are_the_truth_s(orchard):
    truth = orchard.truth
    assert (orchard.leaf_area_m2, orchard.lai) == (truth["leaf_area_m2"], truth["lai"])
    assert orchard.trees == truth["trees"]
    assert len(orchard.trees) == orchard.trees_per_row == 12
    assert math.isclose(orchard.length_m, 18.0)


def test_leaves_add_up_to_the_truth(orchard):
    leaves = orchard.leaves()
    assert len(leaves) == sum(tree["leaves"] for tree in orchard.trees)
    assert math.isclose(leaves.area_m2.sum(), orchard.leaf_area_m2, rel_tol=1e-12)
    for tree in orchard.trees:
        own = leaves.area_m2[leaves.tree == tree["tree"]].sum()
        assert math.isclose(own, tree["leaf_area_m2"], rel_tol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(leaves.normal, axis=1), 1.0)
    assert leaves.first[0] == 0 and leaves.first[-1] == len(leaves.vertices_m)
    # A leaf's area follows from its outline: half the length of its vector area.
    outline = leaves.vertices_m[leaves.first[0] : leaves.first[1]]
    vector = np.cross(outline, np.roll(outline, -1, axis=0)).sum(axis=0) / 2
    assert math.isclose(np.linalg.norm(vector), leaves.area_m2[0], rel_tol=1e-9)


def test_arrays_own_the_memory_they_were_made_in(orchard):
    leaves = orchard.leaves()
    for array in (leaves.area_m2, leaves.vertices_m, orchard.cells()["leaf_area_m2"]):
        owner = array if array.base is None or not isinstance(array.base, np.ndarray) else array.base
        # What NumPy did not allocate it does not own: its base is the vector.
        assert type(owner.base).__name__ == "PySliceContainer"
        assert array.flags.writeable and array.flags.c_contiguous


@pytest.mark.parametrize("name", ["spindel", "no/such/scene.toml"])
def test_words_are_the_command_line_s(command_line, name):
    with pytest.raises(rowscan.Error) as error:
        rowscan.Orchard(name)
    assert str(error.value) == command_line.complaint("orchard", "truth", name)
    assert isinstance(error.value, ValueError)


def test_a_scene_file_is_read_and_its_nonsense_told(command_line, tmp_path):
    good = tmp_path / "one.toml"
    good.write_text("version = 1\n[orchard]\ntrees = 1\n")
    assert rowscan.Orchard(good).trees_per_row == 1
    bad = tmp_path / "bad.toml"
    bad.write_text("version = 1\n[orchard]\ntreess = 1\n")
    with pytest.raises(rowscan.Error, match="trees") as error:
        rowscan.Orchard(bad)
    assert str(error.value) == command_line.complaint("orchard", "truth", bad)


def test_an_old_roof_is_warned_of(tmp_path):
    old = tmp_path / "old.toml"
    old.write_text("version = 1\n[orchard]\ntrees = 1\n[[rig.scanner]]\nroof = 'forward'\n")
    with pytest.warns(UserWarning, match="old.toml: scanner 0: .* version 2 calls `roof = \"backward\"`"):
        rowscan.Orchard(old)
    with pytest.warns(UserWarning, match="version 2 calls"):
        rowscan.Scanner(scene=old)
    new = tmp_path / "new.toml"
    new.write_text(old.read_text().replace("version = 1", "version = 2").replace("forward", "backward"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rowscan.Orchard(new)


def test_cells_without_a_size_are_refused(orchard):
    with pytest.raises(rowscan.Error, match="positive number of metres, found `0`"):
        orchard.cells(cell_m=0.0)
