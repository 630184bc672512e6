# SPDX-License-Identifier: BSD-3-Clause
"""Sub-intervals that are fused across time, with two cameras and with one (Ghosh and Gallego 2022, Sec. 4.4).

Table 4: A_t∘H_c with 2, 4 and 8 sub-intervals; Fig. 10: sub-intervals alone and fused; Fig. 9: one camera, H_t.
"""

import numpy as np
from lab import ONE_CAMERA, PAPER, Page, best_truth, between, compare, grows, keyframes, listed, mvsec_room, of, pick
from pictures import bold
from recording_errors import with_sway
from side_by_side import depth_grid, events_in, richest, table

PARTS = 4
TWO_CAMERAS = {**PAPER, **between(1, 6.5)}  # A_t∘H_c
ONE = {**TWO_CAMERAS, **ONE_CAMERA, "fusion.across_time": "harmonic"}
METHODS = {"one camera": ONE, **{f"N_s = {n}": {**TWO_CAMERAS, "fusion.subintervals": n} for n in (1, 2, 4, 8)}}
# Table 4 of the paper: mean and median error in cm, bad-pix in %, million points.
PUBLISHED = {"N_s = 2": "20.9/9.8/1.66/1.14", "N_s = 4": "20.5/9.6/1.63/1.19", "N_s = 8": "19.8/9.3/1.56/1.20"}

page = Page("subintervals", "3. Temporal fusion")
recording = mvsec_room()
seconds, short = recording.windows(pick(1, 0.1), pick(10, 1)), recording.windows(pick(0.2, 0.05), pick(25, 1))
exact = compare(recording, seconds, METHODS)
sway = compare(with_sway(recording, metres=0.01, degrees=0.1), seconds, METHODS)
brief = compare(recording, short, METHODS)

page.text(
    f"""The paper fuses N_s sub-intervals of a window across time (A_t∘H_c): more of them make the map more accurate.
    Here: the recording of study 1, {len(seconds)} windows of 1 s and {len(short)} of 0.2 s. N_s = 1 is Alg. 1. Sway:
    poses are wrong by sines of 1 cm and 0.1° on each axis, about 1 Hz. H_t: the harmonic mean of four sub-intervals
    of one camera. Paper: its mean of flying1 to 3, mean/median/bad-pix/million points."""
)
table(page, {"1 s": exact, "sway": sway, "0.2 s": brief}, [(0, 1, 2, 9)] * 3, PUBLISHED)

views = keyframes(recording, seconds, METHODS["N_s = 2"])
best = np.concatenate([(t := best_truth(view.depth, recording.truth(view)))[t > 0] for view in views])
step = (1 / 1 - 1 / 6.5) / (PAPER["dsi.num_planes"] - 1)  # of the inverse depths of planes
floor = 100 * np.median(step / 4 * best**2)  # errors are uniform in half a step to both sides
number = 1e-3 * events_in(recording, short) / 8
for condition, results, reason in (
    ("1 s", exact, f"There is little to gain: with the best planes the median would be {floor:.2f} cm."),
    ("1 s, sway", sway, ""),
    ("0.2 s", brief, f"Eight are too many: each has {number:.1f} thousand events (paper: about 70). Where a "
     "camera has none, the harmonic mean is zero."),
):  # fmt: skip
    chosen = {name: results[name] for name in PUBLISHED}
    keys = {"mean": "mean_abs_m", "median": "median_abs_m", "bad-pix": "bad_pix_5px", "points": "points"}
    true = [name for name, key in keys.items() if grows(of(chosen, key, scale=1 if name == "points" else -1))]
    page.claim(f"{condition}: with N_s from 2 to 8 mean, median and bad-pix fall, points rise", len(true) == 4,
               "all" if len(true) == 4 else f"true of {', '.join(true) or 'none'}", reason)  # fmt: skip
ends = "one camera", "N_s = 2", "N_s = 8"
median = np.array([[results[name].own["median_abs_m"] for name in ends] for results in (exact, sway, brief)])
gain = 100 * (1 - median[:, 1:] / median[:, :-1])
page.claim("the second camera lowers the median more than N_s = 8 does (paper: 32 and 5 %)",
           all(gain[:, 0] > gain[:, 1]), "; ".join("%.0f and %.0f %%" % tuple(row) for row in gain))  # fmt: skip


def of_part(recording, windows, method):
    """Map a sub-interval of each window, in the view of the whole window."""
    options, i = method
    if i is not None:
        windows = [(t0 + (t1 - t0) * i // PARTS, t0 + (t1 - t0) * (i + 1) // PARTS, t) for t0, t1, t in windows]
    return keyframes(recording, windows, options)


windows, bad, rows = recording.windows(pick(0.4, 0.1), pick(12, 1)), {}, []
for name, options in (("one camera", ONE), ("two cameras", TWO_CAMERAS)):
    methods = {f"sub-interval {i + 1}": (options, i) for i in range(PARTS)}
    methods["fused"] = {**options, "fusion.subintervals": PARTS}, None
    results = compare(recording, windows, methods, of_part)
    page.numbers(f"sub-intervals of 0.4 s, {name}", results)
    bad[name] = of(results, "bad_pix_5px", scale=100)
    w = richest(results["fused"])
    rows.append({f"{name}, {part}": bold(result.maps[w][0]) for part, result in results.items()})
    page.claim(f"{name}, 0.4 s fused: fewer bad pixels than in any sub-interval",
               bad[name][-1] < min(bad[name][:-1]), f"{bad[name][-1]:.1f}; {listed(bad[name][:-1])} %")  # fmt: skip
fused = [of_cameras[-1] for of_cameras in bad.values()]
page.claim("fused, two cameras have fewer than one", fused[1] < fused[0], listed(fused) + " %")

for duration in pick((0.1, 0.2, 1), (0.1,)):
    windows = recording.windows(duration, pick(25 if duration < 1 else 10, 1))
    results = compare(recording, windows, {"EMVS": ONE, "H_t": {**ONE, "fusion.subintervals": PARTS}})
    page.numbers(f"one camera, windows of {duration} s", results)
    mean, equal = of(results, "mean_abs_m", scale=100), of(results, "mean_abs_m", "equal", 100)
    page.claim(f"one camera, {duration} s: H_t lowers the mean error", mean[1] < mean[0],
               f"{mean[0]:.1f} to {mean[1]:.1f} cm",
               f"It keeps more points; at equal numbers: {equal[0]:.1f} to {equal[1]:.1f} cm.")  # fmt: skip
page.figure(depth_grid(rows, (1, 6.5), 1.75), "Four sub-intervals of 0.1 s alone, and fused")
page.write()
