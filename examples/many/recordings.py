#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Maps the recordings of a list. docs/many-recordings.md describes the list and the results.

  recordings.py jobs  LIST OUT [OPTION...]    writes OUT/jobs, a command per recording
  recordings.py run   OUT NAME ARGUMENT...    maps one recording to OUT/NAME
  recordings.py table LIST OUT                prints the table, and writes it as OUT/index.html with pictures;
                                              exit status 1 if a recording is not mapped
"""
import html
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import urllib.parse
from pathlib import Path

PROGRAM = os.environ.get("EVENT_FUSION") or "event-fusion"
FINAL = (0, 1, 2)  # done, cannot be done, wrong options: another try would end in the same way
TRY_AGAIN = 75  # exit status of `run` for all other statuses of the program
COLUMNS = ("recording", "status", "quality", "keyframes", "points", "seconds", "events/s", "reason")
NUMBERS = COLUMNS[3:7]


def fail(text):
    print(f"error: {text}", file=sys.stderr)
    sys.exit(2)


def read_json(path):
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return None


def write(path, text):
    """A killed script leaves either the old file or the new file."""
    unfinished = path.with_name(f"{path.name}.unfinished-{os.getpid()}")
    unfinished.write_text(text, errors="surrogateescape")
    unfinished.replace(path)


def read_status(path):
    """Returns the status of a finished run; None if there is none, or if its file is damaged."""
    status = read_json(path)
    keys = {"status": int, "tries": int, "has_report": bool, "arguments": list}
    if isinstance(status, dict) and all(isinstance(status.get(key), kind) for key, kind in keys.items()):
        return status
    return None


def plain_quotes(line):
    r"""Replaces $'\303\244 b', as Bash's `printf %q` writes names in a C locale, by quotes that shlex reads."""
    named = {"n": 10, "t": 9, "r": 13, "a": 7, "b": 8, "e": 27, "E": 27, "f": 12, "v": 11}

    def byte(match):
        code = match[1].decode("latin-1")
        if code[0] in "01234567":
            return bytes([int(code, 8) & 255])
        return bytes([int(code[1:], 16) if code[0] == "x" and len(code) > 1 else named.get(code, ord(code[0]))])

    def quoted(match):
        escaped = os.fsencode(match[1])
        return shlex.quote(os.fsdecode(re.sub(rb"\\([0-7]{1,3}|x[0-9a-fA-F]{1,2}|.)", byte, escaped)))

    return re.sub(r"\$'((?:[^'\\]|\\.)*)'", quoted, line)


def read_list(path):
    """Returns {name: arguments of `event-fusion map`} in the order of the list."""
    found = {}
    used = dict.fromkeys(("index.html", "jobs", "joblog", "lock", "log", "slurm", "table.txt"), "these scripts")
    try:
        lines = Path(path).read_text("utf-8-sig", "surrogateescape").split("\n")
    except OSError as error:
        fail(f"{path}: {error.strerror}")
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        where = f"{path}:{number}"
        try:
            words = shlex.split(plain_quotes(line))
        except ValueError as error:
            fail(f"{where}: {error}")
        name = words.pop(0)[:-1] if words[0].endswith(":") else None
        if not words or not words[0] or words[0].startswith("-"):
            fail(f"{where}: expected [NAME:] RECORDING [OPTION...]")
        if name is None:
            name = re.sub(r"\.[A-Za-z]\w*$", "", os.path.basename(os.path.abspath(words[0])))
        if "/" in name or name in ("", ".", ".."):
            fail(f"{where}: '{name}' cannot be the name of a folder: write NAME: before the recording")
        if name in used:
            fail(f"{where}: the name '{name}' is used by {used[name]}: write NAME: before the recording")
        used[name] = f"line {number}"
        found[name] = words
    return found or fail(f"{path}: no recording")


def jobs(list_file, out, *options):
    recordings = read_list(list_file)
    if not shutil.which(PROGRAM):
        fail(f"{PROGRAM}: no such program: set EVENT_FUSION to its path")
    (out / "log").mkdir(parents=True, exist_ok=True)
    script = os.path.abspath(__file__)
    text = "".join(shlex.join([script, "run", str(out), name, *arguments, *options]) + "\n"
                   for name, arguments in recordings.items())
    # OUT/log tells what is finished, not the joblog of an earlier call.
    (out / "joblog").unlink(missing_ok=True)
    write(out / "jobs", text)


def run(out, name, *arguments):
    status_file = out / "log" / f"{name}.status"
    earlier = read_status(status_file)
    report = out / name / "report.json"
    tries = 1
    if earlier and earlier["arguments"] == list(arguments):
        if earlier["status"] in FINAL and (report.exists() or not earlier["has_report"]):
            return 0
        tries = earlier["tries"] + 1
    status_file.unlink(missing_ok=True)
    earlier_report = report.stat().st_mtime_ns if report.exists() else 0
    # The engines send their signals to the program, too. This script stays and writes the status.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: None)
    threads = os.environ.get("MAP_THREADS")
    command = [PROGRAM, "map", *(["--set", f"performance.threads={threads}"] if threads else []),
               "--out", str(out / name), *arguments]
    with open(out / "log" / f"{name}.log", "a", errors="surrogateescape") as log:
        print(f"=== try {tries}:", shlex.join(command), file=log, flush=True)
        try:
            status = subprocess.call(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        except OSError as error:
            print(error, file=log)
            status = 127
    if status < 0:
        status = 128 - status  # killed by a signal: as in a shell
    has_report = report.exists() and report.stat().st_mtime_ns != earlier_report
    write(status_file, json.dumps({"status": status, "tries": tries, "has_report": has_report,
                                   "arguments": arguments}))
    print(*(value for value in row(out, name).values() if value != "-"), flush=True)
    return 0 if status in FINAL else TRY_AGAIN


def reason(log):
    """Returns the first error of the last try, or else its last line."""
    last_try = re.split(r"(?m)^=== try .*$", log.read_text(errors="replace"))[-1].strip()
    error = re.search(r"(?m)^event-fusion: error: (.*)", last_try)
    return error[1] if error else last_try.split("\n")[-1] or "-"


def row(out, name):
    cells = dict.fromkeys(COLUMNS, "-")
    cells["recording"] = name
    log = out / "log" / f"{name}.log"
    done = read_status(log.with_name(f"{name}.status"))
    if done and done["has_report"] and not (out / name / "report.json").exists():
        cells.update(status="not run", reason="its result was removed")
        return cells
    if not done:
        cells["status"] = "unfinished" if log.exists() else "not run"
        return cells
    status = done["status"]
    report = done["has_report"] and read_json(out / name / "report.json")
    if report:
        seconds = report["seconds"]["total"]
        cells.update(keyframes=report["keyframes"], points=report["points"], seconds=f"{seconds:.1f}",
                     quality=report.get("quality", {}).get("word", "-"))
        cells["events/s"] = f"{round(report['events']['read'] / max(seconds, 1e-3), -3):.0f}"
    if status == 0:
        cells["status"] = "mapped"
        warnings = {warning["name"] for warning in report["warnings"]} if report else set()
        reasons = ["warnings: " + ", ".join(sorted(warnings))] if warnings else []
        quality = report and report.get("quality")
        if quality and quality["word"] in ("doubtful", "wrong"):
            reasons.insert(0, ", ".join(quality["reasons"]))
        cells["reason"] = "; ".join(reasons) or "-"
    elif status == 130:
        cells.update(status="stopped", reason="stopped as requested")
    elif status > 128:
        cells.update(status="killed", reason=f"signal {status - 128}, try {done['tries']}")
    else:
        cells.update(status="partial" if report else "failed", reason=reason(log))
    return cells


def page(out, rows):
    """Returns the table as a page: each recording with pictures of its map and depths, which open the map."""
    lines = ["<!DOCTYPE html><meta charset=utf-8><title>Recordings</title>",
             "<style>body{font:14px sans-serif} td,th{padding:4px 10px; text-align:left; vertical-align:top}",
             "tr{border-top:1px solid #ccc} table{border-collapse:collapse} img{height:120px} td{max-width:30em} .failed,.wrong{color:#b00}",
             ".doubtful,.partial{color:#a60} td.n{text-align:right}</style>",
             f"<p>{sum(row['status'] == 'mapped' for row in rows)} of {len(rows)} recordings are mapped.</p><table><tr>",
             *(f"<th>{column}</th>" for column in COLUMNS), "<th>map</th><th>depths</th></tr>"]
    for cells in rows:
        name = cells["recording"]
        words = {"status": cells["status"], "quality": cells["quality"], **dict.fromkeys(NUMBERS, "n")}
        lines.append("<tr>" + "".join(f'<td class="{words.get(column, "")}">{html.escape(str(cell))}</td>'
                                      for column, cell in cells.items()))
        for picture in ("map.png", "overview.png"):
            links = [urllib.parse.quote(os.fsencode(f"{name}/{file}")) for file in ("map.html", picture)]
            shown = f'<a href="{links[0]}"><img src="{links[1]}" loading=lazy></a>' if (out / name / picture).exists() else ""
            lines.append(f"<td>{shown}</td>")
    return "\n".join(lines) + "</table>\n"


def table(list_file, out):
    rows = [row(out, name) for name in read_list(list_file)]
    texts = [COLUMNS] + [[str(value) for value in cells.values()] for cells in rows]
    widths = [max(map(len, column)) for column in zip(*texts)]
    for text in texts:
        cells = [cell.rjust(width) if column in NUMBERS else cell.ljust(width)
                 for column, cell, width in zip(COLUMNS, text, widths)]
        print("  ".join(cells).rstrip())
    try:
        write(out / "index.html", page(out, rows))
    except OSError as error:
        print(f"error: {out}/index.html: {error.strerror}", file=sys.stderr)
    return 0 if all(cells["status"] == "mapped" for cells in rows) else 1


if __name__ == "__main__":
    sys.stdout.reconfigure(errors="replace")
    steps = {"jobs": jobs, "run": run, "table": table}
    step, *arguments = sys.argv[1:] or [""]
    if step not in steps or len(arguments) < 2 or (step == "table" and len(arguments) > 2):
        fail(__doc__)
    folder = 0 if step == "run" else 1
    arguments[folder] = Path(arguments[folder])
    sys.exit(steps[step](*arguments))
