# SPDX-License-Identifier: BSD-3-Clause
"""Sensors of different contrast thresholds θ (Ghosh and Gallego 2022, Sec. 4.10)."""

import numpy as np
from flying_room import FAR, METHODS, NEAR, TWO, draw_errors, flying_room
from lab import COLUMNS, Page, around, errors, keyframes, listed, of, pick, score, strongest
from pictures import bold
from precision import percent_at, precision
from side_by_side import depth_grid, events_in

THRESHOLDS = pick((0.05, 0.1, 0.2, 0.4, 0.8), (0.2, 0.4))
STRONGEST = 2500  # points of a window
WHITE = "two cameras, one white level"  # the confidence that counts as 255: the largest at the lowest threshold

maps, events, methods = {}, [], METHODS
for threshold in THRESHOLDS:
    recording = flying_room(pick(640, 80), threshold)
    windows = recording.windows(pick(0.2, 0.05), pick(2, 1))
    events.append(1e-6 * events_in(recording, windows))
    if WHITE not in methods:
        largest = keyframes(recording, windows, TWO)[0].confidence.max()
        methods = {**METHODS, WHITE: {**TWO, "depth.max_confidence": largest}}
    for method, options in methods.items():
        made = keyframes(recording, windows, options)
        maps.setdefault(method, {})[f"θ = {threshold}"] = [(k.depth, k.confidence) for k in made]
truths = [recording.truth(keyframe) for keyframe in made]  # the same at each threshold
results = {method: score(recording, maps[method], truths) for method in METHODS}
two = results["two cameras"]
precisions = {name: precision(result, truths) for name, result in two.items()}

page = Page("contrast_threshold", "6. Contrast threshold")
page.text(
    f"""The paper simulates flying_room at five contrast thresholds: a high one gives fewer points and a larger mean
    error, while the median stays. Here: the room, the rig and the windows of study 5 at 640x480 pixels; the
    thresholds give {listed(events, 2)} million events in a window of 0.2 s."""
)
for method, over in results.items():
    page.numbers(method, over)
columns = [COLUMNS[i] for i in (0, 1, 2, 9)]
page.table(["", *(f"{cameras}: {title}" for cameras in ("one", "two") for title, *_ in columns)],
           [[name, *(f"{scale * results[method][name].own[key]:.{decimals}f}"
                     for method in METHODS for _, key, scale, decimals in columns)] for name in two])  # fmt: skip
page.figure(draw_errors(THRESHOLDS, {method: results[method] for method in METHODS}, precisions,
                        "contrast threshold θ", "log"),
            "Errors of the own pixels by threshold; precision and recall of two cameras", "_errors")  # fmt: skip
page.figure(depth_grid([{name: bold(one.maps[0][0]) for name, one in two.items()}], (NEAR, FAR), 1.7),
            "Two cameras: depths of a window at each threshold; points are drawn 3 pixels wide")  # fmt: skip


def falls(values, tolerance=0):
    return all(b <= a + tolerance for a, b in zip(values, values[1:]))


def recall(depth, truth, limit):
    """Return the percentage of the truth that has a depth within a pixel and a limit; depths may be none."""
    near = around(np.where(depth > 0, depth, np.nan), np.nan)
    return 100 * np.mean(np.any(np.abs(near - truth) <= limit, axis=0)[truth > 0])


points = of(two, "points", scale=1e-3)
one_white = [[depth for depth, _ in of_window] for of_window in maps[WHITE].values()]
of_one_white = [1e-3 * np.count_nonzero(depths) for depths in one_white]
found_white = [np.mean([recall(*pair, 0.12) for pair in zip(depths, truths)]) for depths in one_white]
mean, median = of(two, "mean_abs_m", scale=100), of(two, "median_abs_m", scale=100)
common = of(two, "median_abs_m", "common", 100)
page.claim("fewer points at high thresholds", falls(points), listed(points) + " thousand",
           "The extraction is relative to the largest confidence, and all confidences fall with the number of events."
           )  # fmt: skip
page.claim("with the white level of the lowest threshold they are fewer", falls(of_one_white),
           listed(of_one_white) + " thousand")  # fmt: skip
page.claim("the mean error at the highest threshold is above that at the lowest", mean[-1] > mean[0],
           listed(mean) + " cm")  # fmt: skip
best = [100 * errors([strongest(*one, STRONGEST) for one in result.maps], truths)["median_abs_m"]
        for result in two.values()]  # fmt: skip
page.claim("the median error is fairly constant: within a factor of 1.5", max(median) <= 1.5 * min(median),
           listed(median, 2) + " cm",
           f"More so on common pixels ({listed(common, 2)} cm), and for the {STRONGEST} points of a window with the "
           f"highest local contrast ({listed(best, 2)} cm): at high thresholds the largest confidence is a few "
           "votes, and single crossings of rays pass.")  # fmt: skip
spread = max(mean) / min(mean), max(median) / min(median)
page.claim("the mean varies more than the median", spread[0] > spread[1],
           f"largest over smallest {listed(spread, 2)}", "Single crossings change the median, too.")  # fmt: skip
precise, found = (percent_at(precisions, key, 0.12) for key in ("precision", "recall"))
page.claim("precision within 12 cm falls with the threshold, or rises by half a percent at most",
           falls(precise, 0.5), listed(precise) + " %")  # fmt: skip
page.claim("recall falls, too", falls(found), listed(found) + " %", "The number of points does not fall.")
page.claim("with one white level recall falls", falls(found_white), listed(found_white) + " %")
page.write()
