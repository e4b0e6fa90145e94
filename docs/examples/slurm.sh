#!/bin/bash
# A study as a SLURM job array: one task a shard.
#   sbatch --array=1-8 docs/examples/slurm.sh docs/examples/sensor-study.toml out
#   rowscan study merge out/*.json --figure study.svg   # when all are done
# A task that was killed goes on where it was when it is submitted again; one that is finished does nothing.
#SBATCH --cpus-per-task=2
#SBATCH --time=01:00:00
set -eu
study=$1
folder=$2
index=$SLURM_ARRAY_TASK_ID
mkdir -p "$folder"
exec "${ROWSCAN:-rowscan}" study run "$study" --shard "$index/$SLURM_ARRAY_TASK_COUNT" --output "$folder/$index.json" --resume
