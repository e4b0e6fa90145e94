"""The paper's scans."""

import csv

import numpy as np
import pytest

import rowscan

KINDS = ["lateral", "opposite", "zenith", "lateral-orthogonal", "opposite-orthogonal", "zenith-orthogonal"]


@pytest.mark.parametrize("kind", KINDS)
def test_areas_are_the_command_line_s_to_the_last_bit(command_line, orchard, kind):
    expected = command_line.json("scan", "spindle", "--seed", 7, "--type", kind, "--dy", 0.1)
    scan = rowscan.scan_row(orchard, kind, dy_m=0.1)
    assert [scan.areas] == expected
    assert scan.ranges_m.shape == (scan.areas["lines"], scan.areas["beams"]) == (len(scan.y_m), len(scan.swept))
    assert np.isnan(scan.ranges_m).sum() == scan.areas["escapes"]
    assert (scan.swept[0], scan.swept[-1]) == (scan.areas["range_from"], scan.areas["range_to"])
    assert scan.points is None


def test_points_are_the_command_line_s_to_the_last_bit(command_line, orchard, tmp_path):
    flags = ["--seed", 7, "--dy", 0.2, "-o", tmp_path / "row", "--write", "csv,npy"]
    done = command_line.run("scan", "spindle", *flags)
    assert done.returncode == 0, done.stderr
    scan = rowscan.scan_row(orchard, dy_m=0.2, points=True)
    with open(tmp_path / "row_points.csv", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    points = scan.points
    assert len(rows) == len(points["points_m"])
    for axis, name in enumerate(["x_m", "y_m", "z_m"]):
        assert [float(row[name]) for row in rows] == points["points_m"][:, axis].tolist()
    names = ["ground", "leaf", "wood", "fruit", "post", "wire", "grass"]
    assert [row["class"] for row in rows] == [names[number] for number in points["class"]]
    assert [int(row["tree"] or -1) for row in rows] == points["tree"].tolist()
    assert [int(row["organ"] or -1) for row in rows] == points["organ"].tolist()
    assert [int(row["step"]) for row in rows] == points["line"].tolist()
    # Matrix L stands the other way round: a row a beam.
    matrix = np.load(tmp_path / "row_L.npy")
    np.testing.assert_array_equal(matrix, np.nan_to_num(scan.ranges_m, nan=1000.0).T.astype(np.float32))


def test_words_are_the_command_line_s(command_line, orchard):
    with pytest.raises(rowscan.Error) as error:
        rowscan.scan_row(orchard, distance_m=0.1)
    assert str(error.value) == command_line.complaint("scan", "spindle", "--distance", 0.1, "--seed", 7)
    with pytest.raises(rowscan.Error, match="expected one of lateral, .* found `sideways`"):
        rowscan.scan_row(orchard, "sideways")
