"""The examples that run a study on a cluster, each on this machine: the result is the one of a single run."""

import csv
import os
import pathlib
import subprocess
import sys

import pytest

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "docs" / "examples"
STUDY = EXAMPLES / "quick-study.toml"


@pytest.fixture
def program(rowscan):
    return rowscan.binary()


def straight(program):
    """The study in one go, as CSV."""
    command = [program, "study", "run", str(STUDY), "--format", "csv"]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def example(program, *arguments, **environment):
    subprocess.run(arguments, check=True, timeout=80, env={**os.environ, "ROWSCAN": program, **environment})


@pytest.mark.parametrize(
    "package, script",
    [("hyperqueue", "hyperqueue_study.py"), ("distributed", "dask_study.py")],
)
def test_a_python_cluster_gives_the_rows_of_a_single_run(program, tmp_path, package, script):
    pytest.importorskip(package)
    example(program, sys.executable, str(EXAMPLES / script), str(STUDY), str(tmp_path), "--shards", "3")
    assert (tmp_path / "merged.csv").read_text() == straight(program)


def test_an_array_of_jobs_gives_the_rows_of_a_single_run(program, tmp_path):
    script = str(EXAMPLES / "slurm.sh")
    for index in ("2", "1", "3", "2"):  # in any order; the one submitted twice is finished already
        example(program, script, str(STUDY), str(tmp_path), SLURM_ARRAY_TASK_ID=index, SLURM_ARRAY_TASK_COUNT="3")
    files = sorted(str(path) for path in tmp_path.glob("*.json"))
    merge = subprocess.run(
        [program, "study", "merge", *files, "--format", "csv"], check=True, capture_output=True, text=True
    )
    assert merge.stdout == straight(program)
    rows = list(csv.DictReader(merge.stdout.splitlines()))
    assert len(rows) == 8
    for row in rows:
        assert row["rowscan"] and row["study_seed"] == "1" and len(row["scene_hash"]) == 16
