# SPDX-License-Identifier: BSD-3-Clause
"""The DSI becomes clear with more events: one camera, two, fusion across time, by the length of the window.

Ghosh and Gallego 2022, Sec. 3.3.2 (Fig. 4) and 4.4.2 (Fig. 9).
"""

import tempfile

import numpy as np
from lab import ONE_CAMERA, PAPER, Page, between, compare, mvsec_room, pick, recorded
from matplotlib import pyplot
from pictures import bare, curves
from rigs import rig_of

import event_fusion as ef

DURATIONS = pick((0.05, 0.1, 0.2, 0.5, 1), (0.1,))  # seconds
ONE, H_T, ALG_1 = "one camera", "one camera, H_t", "H_c∘A_t (Alg. 1)"
FOUR, HALVES = "A_t∘H_c, N_s = 4", "A_t∘H_c, N_s = 2"
METHODS = {
    ONE: ONE_CAMERA,
    H_T: {**ONE_CAMERA, "fusion.subintervals": 4, "fusion.across_time": "harmonic"},
    ALG_1: {},
    FOUR: {"fusion.subintervals": 4},
    HALVES: {"fusion.subintervals": 2},
}


def methods(near, far):
    return {name: {**PAPER, **between(near, far), **options} for name, options in METHODS.items()}


# The paper's rig on a linear slider: the preset's camera, and another one to its right.
slider = recorded("slider", calibration=rig_of(ef.Simulation("slider").cameras[0], 0, 0.10), duration=pick(2.0, 0.1))
scenes = {"slider": (slider, methods(0.47, 2.4), pick(8, 1)), "room": (mvsec_room(), methods(1, 6.5), pick(10, 1))}
results = {scene: [compare(recording, recording.windows(seconds, count), options) for seconds in DURATIONS]
           for scene, (recording, options, count) in scenes.items()}  # fmt: skip

page = Page("convergence", "9. Convergence over time")
page.text(
    """The paper shows projections of the DSI for growing windows on a linear slider: two cameras show the structure
    earlier than one, and so does fusion across time. Here: the preset slider (240x180 pixels, 0.32 m/s sideways) with
    a second camera 0.10 m to the right, planes from 0.47 to 2.4 m; and the room of study 1. H_t: the harmonic mean of
    four sub-intervals. Mean [cm]/median [cm]/bad-pix [%]:"""
)


def short(values):
    return "/".join(f"{value:.1f}" for value in values)


rows, keys = [], ("mean_abs_m", "median_abs_m", "bad_pix_5px")
for scene, over in results.items():
    for seconds, of_duration in zip(DURATIONS, over):
        page.numbers(f"{scene}, windows of {seconds} s", of_duration)
    for name in METHODS:
        rows.append([f"{scene}: {name}", *(short(100 * errors[name].own[key] for key in keys) for errors in over)])
page.table(["", *(f"{seconds} s" for seconds in DURATIONS)], rows)


def mean(over, name, pixels="own"):
    return [100 * getattr(of_duration[name], pixels)["mean_abs_m"] for of_duration in over]


figure, axes = pyplot.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
for ax, (scene, over) in zip(axes, results.items()):
    curves(ax, DURATIONS, {name: mean(over, name) for name in METHODS}, "window [s]", "mean error [cm]", "log", "log")
    ax.set_xticks(DURATIONS, map(str, DURATIONS))
    ax.minorticks_off()
    ax.set_title(scene, fontsize="medium")
page.figure(figure, "Mean error of the own pixels by the length of the window")


def projections(dsi):
    """Return the largest values of a DSI from the front, from above (near below) and from the side (near left)."""
    front, top, side = dsi.values.max(0), dsi.values.max(1)[::-1], dsi.values.max(2).T
    gap, (planes, rows, columns) = 3, dsi.values.shape
    sheet = np.full((rows + gap + planes, columns + gap + planes), np.nan)
    sheet[:rows, :columns], sheet[rows + gap :, :columns], sheet[:rows, columns + gap :] = front, top, side
    return np.ceil(24 * sheet / dsi.values.max()) / 24  # few colours: a small file


shown, around = list(METHODS)[:4], pick((0.05, 0.2, 1), (0.05,))
middle = (slider.simulation.start + slider.simulation.end) // 2
figure, axes = pyplot.subplots(len(around), 4, figsize=(9, 2 * len(around)), layout="constrained", squeeze=False)
with tempfile.TemporaryDirectory() as folder:
    recording = slider.simulation.record(f"{folder}/slider", progress=False)
    for row, seconds in zip(axes, around):
        t0, t1, _ = slider.windows(seconds, 3)[1]
        for ax, name in zip(row, shown):
            dsi = ef.dsi(recording, t0, t1, methods(0.47, 2.4)[name], t_ref=middle)
            ax.imshow(projections(dsi), interpolation="nearest")
            bare(ax, f"{name}, {seconds} s")
            ax.axis("off")
page.figure(figure, "Slider: largest values of the DSI from the front, above (near below), and the side (near left)",
            "_dsi")  # fmt: skip

little = DURATIONS.index(pick(0.2, 0.1)) + 1
for scene, over in results.items():

    def claim(words, better, worse, pixels="own", departure=""):
        a, b = mean(over, better, pixels)[:little], mean(over, worse, pixels)[:little]
        smaller = all(x < y for x, y in zip(a, b))
        page.claim(f"{scene}, {words}", smaller, f"{short(a)} against {short(b)} cm", departure)

    common = " against ".join(short(mean(over, name, "common")[:little]) for name in (H_T, ONE))
    claim("up to 0.2 s: two cameras have a smaller mean error than one", ALG_1, ONE)
    claim("also on common pixels", ALG_1, ONE, "common")
    claim("one camera: H_t lowers it", H_T, ONE, departure=f"Other points remain; on common pixels {common}.")
    claim("two cameras: N_s = 4 lowers it", FOUR, ALG_1, departure="Sub-intervals of 12.5 ms have too few events.")
    claim("and N_s = 2", HALVES, ALG_1)
    claim("common pixels: a second camera does more than H_t", ALG_1, H_T, "common")
page.write()
