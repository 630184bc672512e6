#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs the benchmarks and writes DIR/performance.json and DIR/performance.md. Builds nothing.

Cases whose names have the same first two parts are compared: a process runs them in turns, so other
load of the machine affects all of them equally.
"""
import argparse
import json
import math
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
GROUPS = ("voting", "keyframe", "motion", "fusion", "extraction", "global_cloud", "reading", "live", "growth")
LARGE = re.compile("10000000|growth/.*/(4|8|16)/")  # cases that --quick leaves out


def read_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="Other arguments (--benchmark_...) go to Google Benchmark.")
    parser.add_argument("--quick", action="store_true",
                        help="small cases, each once: tests that everything runs")
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "build/bench")
    parser.add_argument("groups", nargs="*", metavar="GROUP", help=" ".join(GROUPS))
    arguments, others = parser.parse_known_args()
    unknown = [word for word in arguments.groups if word not in GROUPS]
    unknown += [word for word in others if not word.startswith("--benchmark_")]
    if unknown:
        parser.error(f"{unknown[0]} is not known")
    return arguments, others


def output(*command):
    done = subprocess.run(command, text=True, capture_output=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{done.stderr}{command[0]}: exit status {done.returncode}")
    return done.stdout


def run(arguments, others):
    """@return the results of all batches, in the format of Google Benchmark."""
    program = arguments.build / "bin/event_fusion_bench"
    if not program.exists():
        sys.exit(f"{program} is not there: build it with cmake --preset release "
                 "-DEFM_BUILD_LONG=ON && cmake --build --preset release")
    options = ["--benchmark_min_time=0.2", "--benchmark_repetitions=5",
               "--benchmark_enable_random_interleaving=true",
               "--benchmark_display_aggregates_only=true"]
    if arguments.quick:
        options += ["--small", "--benchmark_min_time=0", "--benchmark_repetitions=1"]
    options += others
    listed = output(program, *options, "--benchmark_list_tests").splitlines()
    batches = {}
    for name in listed:
        group, case = name.split("/")[:2]
        if group in (arguments.groups or GROUPS) and not (arguments.quick and LARGE.search(name)):
            batches.setdefault((group, case), []).append(name)
    results = {}
    with tempfile.TemporaryDirectory() as scratch:
        file = pathlib.Path(scratch) / "results.json"
        for names in batches.values():
            print(output(program, *options, f"--benchmark_out={file}",
                         f"--benchmark_filter=^({'|'.join(names)})$"), flush=True)
            batch = json.loads(file.read_text())
            results.setdefault("context", batch["context"])
            results.setdefault("benchmarks", []).extend(batch["benchmarks"])
    if not results:
        sys.exit("no benchmark has such a name")
    results["benchmarks"].sort(key=lambda result: listed.index(result["run_name"])
                               if result["run_name"] in listed else len(listed))
    commit = subprocess.run(["git", "-C", ROOT, "describe", "--always", "--dirty"], text=True,
                            capture_output=True, check=False).stdout.strip()
    results["context"]["commit"] = commit or "unknown"
    results["context"]["load_after"] = os.getloadavg()[0]
    return results


def medians(results):
    """@return the quantities of each case, by the parts of its name. One run is its own median."""
    cases = {}
    for result in results["benchmarks"]:
        if "error_message" in result:
            sys.exit(f"{result['name']}: {result['error_message']}")
        if result.get("aggregate_name", "median") == "median":
            name = tuple(result["run_name"].removesuffix("/process_time").split("/"))
            cases[name] = {**result, "cpu_ms": result["cpu_time"], "real_ms": result["real_time"]}
    return cases


def tables(cases):
    """@return per table its title, the columns and the rows. Ratios are speeds to a reference."""
    def ratio(reference, own, time="cpu_ms"):
        return cases[reference][time] / cases[own][time] if {reference, own} <= cases.keys() else ""

    motion = []
    for name, case in cases.items():
        if name[0] == "motion" and name[2] == "as shipped":
            paper, plain, paper_plain = ((*name[:2], options, kernel) for options, kernel in (
                ("paper", name[3]), ("as shipped", "plain"), ("paper", "plain")))
            motion.append([name[1], name[3], case["cpu_ms"], ratio(plain, name),
                           cases.get(paper, {}).get("cpu_ms", ""), ratio(paper_plain, paper),
                           ratio(paper_plain, name)])
    yield ("Keyframes as shipped, beside the paper's options",
           ["case", "kernel", "as shipped, ms", "times plain", "the paper's options, ms",
            "times plain", "as shipped, times plain with the paper's options"], motion)
    for title, what in (("Voting", "densities"), ("One camera's sweep", "sweep")):
        yield (title, ["case", "kernel", "cpu_ms", "votes/s", "times_yardstick"],
               [[n[1], n[3], c["cpu_ms"], c["votes/s"],
                 ratio((*n[:2], "densities", "yardstick"), n) if n[3] != "yardstick" else ""]
                for n, c in cases.items() if n[0] == "voting" and n[2] == what])
    quantities = ["cpu_ms", "real_ms", "warp_ms", "sweep_ms", "depth_ms", "peak_mb"]
    yield ("A stereo keyframe",
           ["case", "kernel", "threads", *quantities, "times_unfused", "times_one_thread"],
           [[n[1], n[2], n[3].removeprefix("threads:"), *(c[q] for q in quantities),
             ratio((*n[:2], "unfused", n[3]), n) if n[2] != "unfused" else "",
             ratio((*n[:3], "threads:1"), n, "real_ms") if n[3] != "threads:1" else ""]
            for n, c in cases.items() if n[0] == "keyframe"])
    yield ("Live", ["case", "real_ms", "slowest_ms", "delay_ms", "keyframes", "lost"],
           [[n[1], *(c[q] for q in ("real_ms", "slowest_ms", "delay_ms", "keyframes", "lost"))]
            for n, c in cases.items() if n[0] == "live"])
    growths = {}
    for n, c in cases.items():
        if n[0] == "growth":
            growths.setdefault(n[1:3], []).append((math.log(float(n[3])), math.log(c["cpu_ms"])))
    yield ("Growth", ["case", "kernel", "exponent"],
           [[*growth, statistics.linear_regression(*zip(*logs)).slope]
            for growth, logs in growths.items() if len(logs) > 1])
    for title, group, parts, rate in (
            ("Fusion and peaks", "fusion", ["size", "case", "kernel"], "voxels/s"),
            ("Extraction", "extraction", ["case"], "pixels/s"),
            ("Global cloud", "global_cloud", ["group", "case"], "points/s"),
            ("Reading", "reading", ["group", "case"], "events/s")):
        yield (title, [*parts, "cpu_ms", rate],
               [[*n[1:], c["cpu_ms"], c[rate]] for n, c in cases.items() if n[0] == group])


def readable(value):
    """Four digits, with M for millions and G for billions."""
    if isinstance(value, str):
        return value
    for unit, name in ((1e9, " G"), (1e6, " M")):
        if value >= unit:
            return f"{value / unit:.4g}{name}"
    return f"{value:.0f}" if value >= 1000 else f"{value:.4g}"


def markdown(results):
    context = results["context"]
    caches = [f"L{cache['level']} {cache['type']} {cache['size'] // 1024} KiB"
              for cache in context["caches"]]
    lines = ["# Performance", "", f"- cores: {context['num_cpus']}", f"- caches: {', '.join(caches)}"]
    lines += [f"- {key}: {context[key]}" for key in ("processor", "compiler", "flags", "commit")]
    lines += [f"- load before: {context['load_avg'][0]:.1f}", f"- load after: {context['load_after']:.1f}"]
    for title, columns, rows in tables(medians(results)):
        if rows:
            lines += ["", f"## {title}", f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
            lines += [f"| {' | '.join(map(readable, row))} |" for row in rows]
    return "\n".join(lines) + "\n"


def main():
    arguments, others = read_arguments()
    results = run(arguments, others)
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "performance.json").write_text(json.dumps(results, indent=1))
    (arguments.out / "performance.md").write_text(markdown(results))
    print(f"written to {arguments.out}/performance.md and performance.json")


if __name__ == "__main__":
    main()
