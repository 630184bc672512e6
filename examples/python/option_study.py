#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What an option does to accuracy and number of points: option_study.py RECORDING KEY VALUE VALUE…, for example
`option_study.py desk fusion.across_cameras min harmonic arithmetic`. The recording has its truth. Draws study.pdf."""

import sys

import matplotlib.pyplot as plt

import event_fusion as ef

if len(sys.argv) < 4:
    sys.exit(__doc__)
recording = ef.open(sys.argv[1])
key, values = sys.argv[2], sys.argv[3:]
wrong, points = [], []
for value in values:
    made = ef.map(recording, {key: value})
    errors = ef.evaluate.depth(made, recording, tolerance_px=1)["all"]
    wrong.append(100 * errors["beyond_tenth"])
    points.append(errors["points"])
    print(f"{key} = {value}: {points[-1]} depths, {wrong[-1]:.2f} % of them wrong by more than a tenth")

figure, left = plt.subplots(figsize=(4, 3), layout="constrained")
right = left.twinx()
left.plot(values, wrong, "o-", color="#d95f02")
right.plot(values, points, "s--", color="#1b9e77")
left.set_xlabel(key)
left.set_ylabel("depths wrong by over 10 % [%]", color="#d95f02")
right.set_ylabel("depths", color="#1b9e77")
left.set_ylim(bottom=0)
right.set_ylim(bottom=0)
figure.savefig("study.pdf")
