"""What `tools/beside` works out by itself, without a peer: rays, triangles, agreement, ratios, when it refuses."""

import sys
from pathlib import Path

import pytest

numpy = pytest.importorskip("numpy")
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "beside"))
import beside  # noqa: E402
import drive  # noqa: E402


def test_rays_are_unit_vectors_every_half_degree_from_below_behind_to_above_behind():
    origins, directions = drive.rays()
    assert origins.shape == directions.shape == (900 * 541, 3)
    assert numpy.allclose(numpy.linalg.norm(directions, axis=1), 1.0, atol=1e-12)
    degrees = numpy.degrees(numpy.arctan2(directions[:541, 2], directions[:541, 0]))
    assert numpy.allclose(degrees, numpy.arange(541) / 2 - 135)
    # Beam 270 looks level at the row, from 1.9 m before its axis and 1.6 m up.
    assert numpy.allclose(directions[270], [1, 0, 0]) and not directions[:, 1].any()
    assert numpy.allclose(origins[541 * 899 + 270], [-1.9, 17.98, 1.6])


def test_a_slow_peer_casts_lines_of_the_whole_drive():
    origins, directions = drive.rays(2)
    assert origins.shape == (2 * 541, 3)
    assert numpy.allclose(origins[541], [-1.9, 9.0, 1.6])
    assert list(drive.line_numbers(2)) == [0, 450]


def test_triangles_keep_a_face_s_area_and_come_back_from_a_ply(tmp_path):
    square = numpy.float32([[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 0]])
    mesh = drive.triangles([square, square + 1])
    drive.write_ply(mesh, tmp_path / "two.ply")
    vertices, faces = drive.read_ply(tmp_path / "two.ply")
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    areas = numpy.linalg.norm(numpy.cross(b - a, c - a), axis=1) / 2
    assert len(faces) == 4 and areas.sum() == pytest.approx(12.0)


def test_the_row_goes_on_at_its_ends():
    leaf = numpy.float32([[0, 17.9, 1], [0, 18.1, 1], [0, 18.0, 2]])
    middle = leaf - numpy.float32([0, 9, 0])
    with_copies = drive.with_neighbours([leaf, middle])
    assert [round(float(face[:, 1].min()), 3) for face in with_copies] == [17.9, 8.9, -0.1]


def test_ranges_agree_within_a_millimetre_or_where_both_miss():
    ours = numpy.array([1.0, 2.0, numpy.inf, numpy.inf])
    assert drive.agreement(ours, numpy.array([1.0009, 2.002, numpy.inf, 5.0])) == 0.5


def test_ratios_above_one_say_that_rowscan_is_ahead():
    ours = [beside.Round(rays_per_s=30.0, first_s=2.0, memory_mb=100.0)] * 3
    theirs = [beside.Round(rays_per_s=rate, first_s=1.0, memory_mb=300.0) for rate in (10.0, 15.0, 5.0)]
    found = beside.ratios(ours, theirs)
    assert found["rays_per_s"] == {"median": 3.0, "least": 2.0, "greatest": 6.0}
    assert found["first_s"]["median"] == 0.5 and found["memory_mb"]["median"] == 3.0
    with pytest.raises(ValueError):
        drive.median_and_spread([])


def row(name, agree=None, **more):
    return {"name": name, "version": "", "agree": {beside.MESH: agree}, **more}


@pytest.mark.parametrize(
    "agree, refused", [((0.971, 1.0), None), ((0.969, 1.0), "embree disagrees with rowscan for 3.1 % of the rays")]
)
def test_more_than_three_percent_of_disagreement_is_refused(agree, refused):
    # Ours with round branches is another row, of which more may differ.
    rows = [row(beside.MESH, agree=1.0), row(beside.GROWN, agree=0.5)]
    rows += [row("embree", agree=agree[0]), row("open3d", agree=agree[1])]
    assert beside.refusal(rows) == refused


def test_one_peer_is_too_few_and_a_missing_one_is_named():
    rows = [row(beside.MESH, agree=1.0), row("embree", agree=1.0), row("helios++", missing="No module named 'pyhelios'")]
    ratio = {"median": 2.0, "least": 0.5, "greatest": 33.3}
    rows[1]["ratios"] = {beside.MESH: dict.fromkeys(("rays_per_s", "first_s", "memory_mb"), ratio)}
    assert beside.refusal(rows) == "peers measured: 1; at least 2 must be"
    lines = beside.table(rows, beside.MESH).splitlines()
    assert lines[2] == "| embree | 100.00 % | 2.0 (0.50 to 33) | 2.0 (0.50 to 33) | 2.0 (0.50 to 33) |"
    assert lines[3].startswith("| helios++ | not there: No module named 'pyhelios'")
