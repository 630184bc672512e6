#!/bin/bash
# SPDX-License-Identifier: BSD-3-Clause
# Maps many recordings with GNU parallel: map_many_parallel.sh LIST OUT [OPTION of event-fusion map]...
# JOBS=N: recordings at the same time. docs/many-recordings.md explains LIST, OUT and the exit status.
set -o pipefail
[ $# -ge 2 ] || { sed -n 3,4p "$0" >&2; exit 2; }
parallel --version 2>&1 | grep -q '^GNU parallel' || { echo "error: GNU parallel is not installed" >&2; exit 2; }
here=$(cd "$(dirname "$0")" && pwd)
list=$1 out=$2
mkdir -p "$out" && exec 9>"$out/lock" || exit 2
flock -n 9 || { echo "error: $out: another run uses this folder" >&2; exit 2; }
"$here/recordings.py" jobs "$@" || exit 2

recordings=$(wc -l <"$out/jobs")
cores=${SLURM_CPUS_ON_NODE:-$(nproc)}
jobs=${JOBS:-$((recordings < cores ? recordings : cores))}
export MAP_THREADS=$((jobs < cores ? cores / jobs : 1))
export PARALLEL_SHELL=/bin/bash

# A job's exit status is 0 if another try would end in the same way, also after an error.
# Only the other jobs are tried again: three times now, and by the next call.
trap 'stopped=1' INT TERM HUP
parallel --jobs "$jobs" --joblog "$out/joblog" --resume-failed --retries 3 \
    --termseq TERM,20000,TERM,2000,KILL,25 :::: "$out/jobs"
"$here/recordings.py" table "$list" "$out" | tee "$out/table.txt"
status=$?
exit $((status && ${stopped:-0} ? 130 : status))
