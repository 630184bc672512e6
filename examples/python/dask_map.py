#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Maps one recording with Dask (docs/cluster.md): dask_map.py SHARDS OUT RECORDING [OPTION of event-fusion map]...
DASK_SCHEDULER=tcp://HOST:8786 uses the workers of a cluster, which see the same files. Else, they are started here."""

import importlib
import os
import subprocess
import sys
import time
from typing import Any

dask: Any = importlib.import_module("dask.distributed")
PROGRAM = os.environ.get("EVENT_FUSION") or "event-fusion"


def make_shard(plan: str, number: int, folder: str) -> None:
    command = [PROGRAM, "map", "--plan", plan, "--shard", str(number), "--out", folder, "--quiet"]
    # The program of a worker that was killed goes on: then this one waits for it.
    while "is writing its result there" in (result := subprocess.run(command, stderr=subprocess.PIPE, text=True)).stderr:
        time.sleep(5)
    if result.returncode:
        raise RuntimeError(f"shard {number}: status {result.returncode}: {result.stderr}")


def main(shards: str, out: str, *recording: str) -> None:
    folders = [os.path.abspath(f"{out}.shards/{number}") for number in range(int(shards))]
    plan = os.path.abspath(f"{out}.shards/plan.json")
    os.makedirs(os.path.dirname(plan), exist_ok=True)
    subprocess.run([PROGRAM, "plan", *recording, "--shards", shards, "--out", plan], check=True)
    with dask.Client(os.environ.get("DASK_SCHEDULER")) as client:
        made = [client.submit(make_shard, plan, number, folder, retries=2) for number, folder in enumerate(folders)]
        dask.progress(made)
        client.gather(made)
    subprocess.run([PROGRAM, "join", plan, *folders, "--out", out], check=True)


if __name__ == "__main__":
    main(*sys.argv[1:]) if len(sys.argv) > 3 else sys.exit(__doc__)
