#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Prints how large the project is: C++ lines and files, files under 40 lines, and headers that one file alone includes
# (beside their own source file), for each folder and in sum; Python beside them, and words of docs/. With BIN, also what the built program loads and how long
# it takes to start.
#   figures.sh [ROOT [BIN]]      default: this project; BIN is a folder such as build/release/bin
set -euo pipefail
root=$(realpath "${1:-$(dirname "$0")/..}")
bin=${2:+$(realpath "$2")}
cd "$root"

python3 - <<'PYTHON'
import collections
import pathlib
import re

LIBRARIES = [f for f in ("mapping", "maps", "tracking_stub", "plugin", "include", "examples", "python") if pathlib.Path(f).is_dir()]
sources = {str(f): f.read_text() for top in LIBRARIES + ["test"] for f in sorted(pathlib.Path(top).rglob("*"))
           if f.suffix in (".h", ".cpp")}
includers = collections.defaultdict(set)
for path, text in sources.items():
    for name in re.findall(r'^\s*#\s*include\s+"([^"]+)"', text, re.M):
        if name != path.rsplit(".", 1)[0] + ".h":
            includers[name].add(path)


def row(name, paths):
    lines = [sources[p].count("\n") for p in paths]
    single = sum(p.endswith(".h") and len(includers[p]) == 1 for p in paths)
    print(f"{name:28} {sum(lines):7} {len(paths):6} {sum(n < 40 for n in lines):9} {single:13}")


print(f"{'folder':28} {'lines':>7} {'files':>6} {'under 40':>9} {'one includer':>13}")
folders = collections.defaultdict(list)
for path in sources:
    folders[str(pathlib.Path(path).parent) if not path.startswith("test/") else "test"].append(path)
for folder in [f for f in folders if f != "test"]:
    row(folder, folders[folder])
row("source", [p for p in sources if not p.startswith("test/")])
row("tests", folders["test"])
for name, tops in (("Python module", ["python"]), ("Python tests", ["test/python", "test/formats"]), ("studies", ["studies"]),
                   ("studies/public", ["studies/public"])):
    files = [f for top in tops for f in pathlib.Path(top).glob("**/*.py" if top != "studies" else "*.py")]
    lines = [f.read_text().count("\n") for f in files]
    print(f"{name:28} {sum(lines):7} {len(files):6} {sum(n < 40 for n in lines):9}")
words = {name: sum(len(f.read_text().split()) for f in pathlib.Path(".").glob(name)) for name in ("docs/*.md", "docs/studies/*.md")}
print(*(f"words of {name}: {count}" for name, count in words.items()), sep="\n")
PYTHON

if [ -n "$bin" ]; then
  export LD_LIBRARY_PATH="$bin/../lib"
  echo "libraries that event-fusion loads   $(ldd "$bin/event-fusion" | wc -l)"
  "$bin/event-fusion" --version > /dev/null
  python3 - "$bin/event-fusion" <<'PYTHON'
import subprocess
import sys
import time

seconds = []
for _ in range(11):
    start = time.monotonic()
    subprocess.run([sys.argv[1], "--version"], check=True, stdout=subprocess.DEVNULL)
    seconds.append(time.monotonic() - start)
print(f"event-fusion --version              {sorted(seconds)[5]:.3f} s, median of 11")
PYTHON
fi
