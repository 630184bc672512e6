#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Two maps against one truth: compare_maps.py MAP MAP TRUTH (PCD or PLY files, folders of `map`, a recording with
gt_cloud.ply). Draws compared.pdf."""

import sys

import matplotlib.pyplot as plt

import event_fusion as ef
from event_fusion import plot

if len(sys.argv) < 3:
    sys.exit(__doc__)
*maps, truth = sys.argv[1:]
figure, axes = plt.subplots(1, len(maps), sharey=True, squeeze=False, figsize=(4 * len(maps), 3), layout="constrained")
for path, ax in zip(maps, axes[0]):
    errors = ef.evaluate.map(path, truth, align=True)
    accuracy = errors["accuracy"]
    print(f"{path}: {accuracy['points']} points, median error {100 * accuracy['median_m']:.2f} cm, "
          f"90 % within {100 * accuracy['p90_m']:.2f} cm")
    plot.precision_recall(errors, ax).set_title(path)
figure.savefig("compared.pdf")
