#!/bin/bash
# Runs a render or gradient in shards and merges them when all are done, to the bits of the run in one piece:
#
#     bash submit.sh 8 grad job.toml out.exr [options of drt]
#
# $DRT names the program, where it is not `drt` in the path; further options of sbatch go into $SBATCH_EXTRA. Prints the
# number of the last job.
set -euo pipefail
if [ $# -lt 4 ]; then
    echo "usage: bash submit.sh SHARDS render|grad INPUT OUTPUT [options of drt]" >&2
    exit 2
fi
here=$(cd "$(dirname "$0")" && pwd)
count=$1 output=$4
shift
read -ra extra <<<"${SBATCH_EXTRA:-}"
shards=$(sbatch --parsable "${extra[@]}" --array="1-$count" "$here/render.sbatch" "$@")
sbatch --parsable "${extra[@]}" --dependency="afterok:$shards" "$here/merge.sbatch" "$output" "$count"
