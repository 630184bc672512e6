# SPDX-License-Identifier: BSD-3-Clause
"""The functions that fuse the DSIs of two cameras (Ghosh and Gallego 2022, Sec. 4.2, Table 2, Fig. 7)."""

import numpy as np
from lab import PAPER, RULES, Page, between, compare, grows, listed, mvsec_room, of, pick
from matplotlib import pyplot
from pictures import curves, depth_and_confidence

# Table 2 of the paper, flying1: mean and median error in cm, bad-pix in %, million points.
PUBLISHED = dict(zip(RULES, ("58/24/17.4/6.13", "60/25/18.6/6.61", "64/28/20.3/6.90",
                             "79/38/27.2/5.97", "99/62/36.8/7.65", "109/75/41.3/9.25")))  # fmt: skip

recording = mvsec_room()  # 10 s
windows = recording.windows(seconds=0.1, count=pick(40, 2))
methods = {rule: {**PAPER, **between(1, 6.5), "fusion.across_cameras": rule} for rule in RULES}
results = compare(recording, windows, methods)

page = Page("fusion_functions", "1. Fusion functions across cameras")
page.text(f"""The paper fuses two cameras' DSIs with six functions on MVSEC's indoor flights, in windows of 0.1 s: the
    differences are largest with little data. Here: MVSEC's calibration on the smoothed trajectory of flying1 through a simulated
    room, 10 s, {len(windows)} windows of 0.1 s, planes from 1 to 6.5 m. Paper: its flying1, mean/median/bad-pix/million points.""")
page.errors("windows of 0.1 s", results, paper=PUBLISHED)
shown = {rule: result.maps[len(windows) // 2] for rule, result in results.items()}
page.figure(depth_and_confidence(shown, limits=(1, 6.5)), "The middle window: depth (near bright, far dark; points drawn 3 pixels wide) and confidence (dark high)")

for title, key, pixels in (
    ("mean error [cm]", "mean_abs_m", "own"),
    ("median error [cm]", "median_abs_m", "own"),
    ("bad-pix [%]", "bad_pix_5px", "own"),
    ("bad-pix on common pixels [%]", "bad_pix_5px", "common"),
    ("bad-pix at equal numbers [%]", "bad_pix_5px", "equal"),
):
    values = of(results, key, pixels, 100)
    page.claim(f"{title} grows from min to max", grows(values), listed(values))
points, mean = (dict(zip(RULES, of(results, key))) for key in ("points", "mean_abs_m"))
page.claim("max keeps more points than min, but arithmetic fewer than geometric",
           points["max"] > points["min"] and points["arithmetic"] < points["geometric"],
           listed(of(results, "points", scale=1e-3)) + " thousand")  # fmt: skip
more, cost = points["harmonic"] / points["min"] - 1, mean["harmonic"] / mean["min"] - 1
page.claim("harmonic has more points than min (paper: +7.9 %), its mean error is at most 10 % larger (paper: +3.5 %)",
           more > 0 and cost <= 0.1, f"{more:+.1%}, {cost:+.1%}")  # fmt: skip
spread = [100 * np.mean([confidence > 0.1 * confidence.max() for _, confidence in result.maps])
          for result in results.values()]  # fmt: skip
page.claim("maps are sharper towards min: fewer pixels have a tenth of the window's largest confidence", grows(spread),
           listed(spread) + " %")  # fmt: skip

seconds = pick((0.05, 0.1, 0.2, 0.5, 1), (0.05, 0.1))
bad = {rule: [] for rule in RULES}
for s in seconds:
    of_length = compare(recording, recording.windows(s, pick(10, 2)), methods)
    page.numbers(f"windows of {s} s", of_length)
    for rule, result in of_length.items():
        bad[rule].append(100 * result.own["bad_pix_5px"])
gaps = [arithmetic - harmonic for arithmetic, harmonic in zip(bad["arithmetic"], bad["harmonic"])]
page.claim(f"the shorter the window, the more arithmetic and harmonic differ (10 windows of {listed(seconds, 2)} s)",
           grows(gaps[::-1]), "bad-pix differs by " + listed(gaps) + " percentage points")  # fmt: skip
figure, ax = pyplot.subplots(figsize=(7, 3.6), layout="constrained")
curves(ax, seconds, bad, "window [s]", "bad-pix [%]", xscale="log")
page.figure(figure, "Bad pixels of each function by the length of the window", "_windows")
page.write()
