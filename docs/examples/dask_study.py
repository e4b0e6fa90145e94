"""A study on Dask: one task a shard, then the merge.

    python docs/examples/dask_study.py docs/examples/sensor-study.toml out --shards 8
    python docs/examples/dask_study.py STUDY out --shards 64 --scheduler tcp://scheduler:8786

Without a scheduler two workers of one thread each run on this machine. Workers need the program, and a folder they share.
"""

import argparse
import os
import pathlib
import subprocess
import sys

from distributed import Client, LocalCluster


def run_shard(rowscan: str, study: str, index: int, shards: int, file: str) -> str:
    command = [rowscan, "study", "run", study, "--shard", f"{index}/{shards}", "--output", file, "--resume"]
    subprocess.run(command, check=True, env={**os.environ, "RAYON_NUM_THREADS": "1"})
    return file


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("study")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--shards", type=int, default=4)
    parser.add_argument("--scheduler", help="address of a scheduler that runs already")
    arguments = parser.parse_args()
    rowscan = os.environ.get("ROWSCAN", "rowscan")
    folder = arguments.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    study = str(pathlib.Path(arguments.study).resolve())

    cluster = arguments.scheduler or LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    )
    with Client(cluster) as client:
        shards = [
            client.submit(run_shard, rowscan, study, index, arguments.shards, str(folder / f"{index}.json"), pure=False)
            for index in range(1, arguments.shards + 1)
        ]
        files = client.gather(shards)
    merged = folder / "merged.csv"
    with merged.open("w") as out:
        subprocess.run([rowscan, "study", "merge", *files, "--format", "csv"], check=True, stdout=out)
    print(merged)
    return 0


if __name__ == "__main__":
    sys.exit(main())
