# SPDX-License-Identifier: BSD-3-Clause
"""The table of README.md: the default options beside the paper's, on the same windows; written between its two marks."""

import subprocess
from time import process_time

import numpy as np
from depth_quality import known_depths
from lab import ARGUMENTS, ONE_CAMERA, PAPER, ROOT, between, pick, recorded
from slider import slider, slider_truth

import event_fusion as ef


def simulated(preset, near, far):
    """Return arrays, windows of 0.2 s and the truth of a preset with a seed that no option was chosen on."""
    recording = recorded(preset, seed=7, duration=pick(0.75, 0.2))
    arrays = recording.cameras, recording.events, recording.poses
    return arrays, recording.windows(0.2, pick(3, 1)), recording.truth, between(near, far)


def real_slider():
    truth = slider_truth()["depth"]
    *arrays, windows = slider()
    return arrays, windows, lambda _: truth, {**between(0.47, 2.4), **ONE_CAMERA}


def measured(arrays, windows, truth, options):
    """Return the number of points with a truth, of right ones (error up to 10 %), the median error, and CPU seconds."""
    error = []
    for keyframe in ef.keyframes(*arrays, windows, options):
        _, depth, true = known_depths(keyframe.depth, truth(keyframe))
        error.append(np.abs(depth - true) / true)
    error = np.concatenate(error)

    def seconds(times):
        began = process_time()
        ef.keyframes(*arrays, windows * times, {**options, "performance.threads": 1})
        return process_time() - began

    cost = min(seconds(3) - seconds(1) for _ in range(pick(3, 1))) / 2 / len(windows)  # without reading the arrays
    return len(error), np.count_nonzero(error <= 0.1), np.median(error), cost


SCENES = {
    "`slider_depth`, real, 1 camera": real_slider,
    "desk, simulated, 2 cameras": lambda: simulated("desk_stereo", 0.5, 5),
    "drive, simulated, 2 cameras": lambda: simulated("drive_stereo", 4, 50),
}
rows = ["| the paper's options → ours, same windows | points | right points | median error | wrong points | time |",
        "|---|---:|---:|---:|---:|---:|"]  # fmt: skip
for name, make in SCENES.items():
    arrays, windows, truth, planes = make()
    paper = measured(arrays, windows, truth, {**PAPER, **planes, "depth.max_confidence": "keyframe"})
    ours = measured(arrays, windows, truth, {**planes, "dsi.num_planes": 100, "refinement.correct_motion": False})
    points, right, median, cost = zip(paper, ours)
    rows.append(
        f"| {name} | {points[0]:,} → {points[1]:,} | {right[0]:,} → {right[1]:,} | {median[0]:.2%} → {median[1]:.2%} | "
        f"{1 - right[0] / points[0]:.1%} → {1 - right[1] / points[1]:.1%} | {cost[1] / cost[0]:.1f} times |"
    )
commit = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout.strip()
rows.append(f"\nWrong: an error over 10 % ([how](docs/studies.md); `studies/summary.py`, commit {commit}).")
print(*rows, sep="\n")
if not ARGUMENTS.quick:
    readme, begin, end = ROOT / "README.md", "<!-- table -->\n", "\n<!-- end of table -->"
    before, rest = readme.read_text().split(begin)
    readme.write_text(before + begin + "\n".join(rows) + end + rest.split(end)[1])
