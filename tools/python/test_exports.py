"""Every format that `rowscan export` writes, from a real run, opened by the programs its users have."""

import csv
import json

import pytest

from emulator import Emulator, run

numpy = pytest.importorskip("numpy")
reader = pytest.importorskip("mcap.reader")

#: Columns of points.
COLUMNS = ["x_m", "y_m", "z_m", "range_m", "remission", "time_s", "scan", "beam", "echo", "layer_deg", "echoes"]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A recording of an LMS111 passing the built-in row."""
    if not __import__("emulator").binary():
        pytest.skip("ROWSCAN_BIN is not set; `cargo xtask ci` sets it")
    path = tmp_path_factory.mktemp("export") / "run.mcap"
    emulator = Emulator("--model", "lms111", "--time-scale", "10")
    try:
        code, _, said = run("record", "tcp://%s:%d" % emulator.address, "-o", str(path), "--scans", "20")
        assert code == 0, said
    finally:
        emulator.close()
    return path


@pytest.fixture(scope="module")
def sent(recorded):
    """The ranges that were sent, scan by scan, beam by beam; 0 for a miss."""
    with open(recorded, "rb") as stream:
        messages = reader.make_reader(stream).iter_messages(log_time_order=False)
        return [json.loads(message.data)["ranges"] for schema, _, message in messages if schema and schema.name == "foxglove.LaserScan"]


@pytest.fixture(scope="module")
def export(recorded, tmp_path_factory):
    """Exports to a format; gives the file."""
    folder = tmp_path_factory.mktemp("exported")

    def to(name, *flags):
        path = folder / ("%s.%s" % ("-".join(flag.strip("-") for flag in flags) or "points", name))
        code, _, said = run("export", str(recorded), "--to", name, "-o", str(path), *flags)
        assert code == 0, said
        return path

    return to


@pytest.fixture(scope="module")
def points(export, sent):
    """All points as the CSV has them, which must be the returns that were sent."""
    with open(export("csv", "--rig", "spindle"), newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0]) == COLUMNS
    found = [(int(row["scan"]), int(row["beam"]), float(row["range_m"])) for row in rows]
    assert found == [(scan, beam, metres) for scan, ranges in enumerate(sent) for beam, metres in enumerate(ranges) if metres > 0]
    return {name: numpy.array([float(row[name]) for row in rows]) for name in COLUMNS}


def test_numpy_reads_points_and_scans(export, points, sent):
    array = numpy.load(export("npy", "--rig", "spindle"), allow_pickle=False)
    assert list(array.dtype.names) == COLUMNS
    for name in COLUMNS:
        numpy.testing.assert_array_equal(array[name], points[name])
    scans = numpy.load(export("npy", "--what", "scans"), allow_pickle=False)
    assert scans["range"].shape == (len(sent), 541)
    numpy.testing.assert_allclose(scans["range"], 1000 * numpy.array(sent), atol=1e-6)


def test_laspy_reads_las(export, points):
    laspy = pytest.importorskip("laspy")
    las = laspy.read(export("las", "--rig", "spindle"))
    assert str(las.header.version) == "1.4" and len(las.points) == len(points["x_m"])
    for found, name in ((las.x, "x_m"), (las.y, "y_m"), (las.z, "z_m")):
        numpy.testing.assert_allclose(found, points[name], atol=1e-4)


def test_plyfile_reads_ply(export, points):
    plyfile = pytest.importorskip("plyfile")
    vertices = plyfile.PlyData.read(str(export("ply", "--rig", "spindle")))["vertex"]
    for found, name in (("x", "x_m"), ("y", "y_m"), ("z", "z_m"), ("beam", "beam"), ("scan", "scan")):
        numpy.testing.assert_array_equal(vertices[found], points[name])


def test_pyarrow_reads_parquet(export, points):
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not pinned: it is larger than all else here")
    table = parquet.read_table(export("parquet", "--rig", "spindle"))
    assert table.column_names == COLUMNS
    for name in COLUMNS:
        numpy.testing.assert_array_equal(table.column(name).to_numpy(), points[name])


def test_a_csv_of_scans_is_a_recording_again(export, sent):
    path = export("csv", "--what", "scans")
    code, told, said = run("estimate", str(path), "--format", "json")
    assert code == 0, said
    assert json.loads(told)["scans"] == len(sent)


def test_pandas_reads_the_matrix_as_it_is(rowscan, tmp_path):
    pandas = pytest.importorskip("pandas")
    prefix = tmp_path / "row"
    code, out, said = rowscan.run("scan", "wall", "--dy", "0.5", "--dtheta", "5", "--output", str(prefix), "--write", "matrix,npy", "--format", "json")
    assert code == 0, said
    scan = json.loads(out)[0]
    frame = pandas.read_csv(str(prefix) + "_L.csv")
    assert frame.shape == (scan["beams"], scan["lines"] + 1) and frame.columns[0] == "theta_deg"
    assert all(kind == "float64" for kind in frame.dtypes.iloc[1:].astype(str))
    numpy.testing.assert_allclose(frame.columns[1:].astype(float), 0.5 * numpy.arange(scan["lines"]))
    numpy.testing.assert_allclose(frame.iloc[:, 1:], numpy.load(str(prefix) + "_L.npy"), rtol=1e-6)


def test_pandas_reads_the_cells_of_the_truth(rowscan, tmp_path):
    pandas = pytest.importorskip("pandas")
    path = tmp_path / "cells.csv"
    code, _, said = rowscan.run("orchard", "truth", "wall", "--cells", "--output", str(path))
    assert code == 0, said
    cells = pandas.read_csv(path)
    code, out, said = rowscan.run("orchard", "truth", "wall", "--format", "json")
    assert code == 0, said
    assert abs(cells["leaf_area_m2"].sum() / json.loads(out)["leaf_area_m2"] - 1) < 1e-9
