# SPDX-License-Identifier: BSD-3-Clause
"""Run all studies, or those that are named: ``python3 studies/run.py [--quick] [--build FOLDER] [NAME ...]``.

Each writes its page, its numbers and its figures into docs/studies. --quick: tiny, into a temporary folder; shows that
every study runs. Exit status 77: the folder of real calibrations and trajectories (EFM_SHARED_DATA) is missing.
"""

import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
from time import monotonic

HERE = pathlib.Path(__file__).resolve().parent
STUDIES = (
    "fusion_functions",
    "algorithms",
    "subintervals",
    "driving",
    "resolution",
    "contrast_threshold",
    "three_cameras",
    "runtime",
    "convergence",
    "pose_accuracy",
    "slider",
    "better_depth",
    "motion_correction",
    "refinement",
    "automatic",
)

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--quick", action="store_true")
parser.add_argument("--build", type=pathlib.Path, default=HERE.parent / "build/release")
parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(STUDIES))
arguments = parser.parse_args()
if unknown := set(arguments.names) - set(STUDIES):
    parser.error(f"{', '.join(sorted(unknown))}: expected names of {', '.join(STUDIES)}")
if not pathlib.Path(os.environ.get("EFM_SHARED_DATA", HERE.parent.parent / "shared/data")).is_dir():
    sys.exit(77)

build = arguments.build.resolve()
environment = {**os.environ, "PYTHONPATH": f"{build / 'python'}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"}
with tempfile.TemporaryDirectory() as scratch:
    quick = ["--quick", "--out", scratch, "--cache", f"{scratch}/cache"] if arguments.quick else []
    for name in STUDIES:
        if arguments.names and name not in arguments.names:
            continue
        began = monotonic()
        subprocess.run([sys.executable, HERE / f"{name}.py", "--build", build, *quick], env=environment, check=True)
        print(f"  took {monotonic() - began:.0f} s", flush=True)
