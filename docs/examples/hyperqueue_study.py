"""A study on HyperQueue: one task a shard, then the merge as a task that waits for them.

    python docs/examples/hyperqueue_study.py docs/examples/sensor-study.toml out --shards 8

Here the server and one worker run on this machine. On a cluster start `hq server` and `hq worker` there and leave out the
LocalCluster: `Client()` finds the server. With the `hq` program alone, the same is an array:

    hq submit --array 1-8 bash -c 'rowscan study run STUDY --shard $HQ_TASK_ID/8 --output out/$HQ_TASK_ID.json --resume'
"""

import argparse
import os
import pathlib
import sys

from hyperqueue import Job, LocalCluster
from hyperqueue.cluster import WorkerConfig


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("study")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--shards", type=int, default=4)
    arguments = parser.parse_args()
    rowscan = os.environ.get("ROWSCAN", "rowscan")
    folder = arguments.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    study = str(pathlib.Path(arguments.study).resolve())
    files = [str(folder / f"{index}.json") for index in range(1, arguments.shards + 1)]

    job = Job(default_workdir=folder / "hq")
    shards = [
        job.program(
            [rowscan, "study", "run", study, "--shard", f"{index}/{arguments.shards}", "--output", file, "--resume"]
        )
        for index, file in enumerate(files, start=1)
    ]
    merged = folder / "merged.csv"
    job.program([rowscan, "study", "merge", *files, "--format", "csv"], stdout=str(merged), deps=shards)

    with LocalCluster() as cluster:
        cluster.start_worker(WorkerConfig(cores=2))
        client = cluster.client()
        client.wait_for_jobs([client.submit(job)])
    print(merged)
    return 0


if __name__ == "__main__":
    sys.exit(main())
