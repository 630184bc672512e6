# SPDX-License-Identifier: BSD-3-Clause
"""Three cameras against two and one: the harmonic mean of all (Ghosh and Gallego 2022, Sec. 4.8)."""

import numpy as np
from lab import ARGUMENTS, PAPER, Page, between, keyframes, listed, pick, recorded, score
from matplotlib import pyplot
from pictures import depth_and_confidence
from precision import draw_precision, precision
from rigs import rig_of

import event_fusion as ef

CAMERAS = {"camera 0": "0", "camera 1": "1", "camera 2": "2", "0 and 1": "0,1", "0 and 2": "0,2", "1 and 2": "1,2",
           "three": "0,1,2"}  # fmt: skip
ONES, PAIRS = list(CAMERAS)[:3], list(CAMERAS)[3:6]
METHODS = {name: {**PAPER, **between(0.8, 4.5), "rig.cameras": cameras} for name, cameras in CAMERAS.items()}

if ARGUMENTS.quick:  # a scene that is made faster
    recording = recorded("slider", calibration=rig_of(ef.Simulation("slider").cameras[0], 0, 0.1, 0.2), duration=0.05)
else:
    recording = recorded("trinocular", duration=1.0)
windows = recording.windows(pick(0.2, 0.05), pick(4, 1))
made = {name: keyframes(recording, windows, options) for name, options in METHODS.items()}
maps = {name: [(k.depth, k.confidence) for k in of_method] for name, of_method in made.items()}
truths = [recording.truth(view) for view in made["three"]]
results = score(recording, maps, truths)

# The pixels where every combination of cameras has confidence: outside of these, all three together have none.
seen = [np.all([confidence > 0 for _, confidence in window], axis=0) for window in zip(*maps.values())]
where_seen = {name: [(np.where(mask, depth, 0), confidence) for mask, (depth, confidence) in zip(seen, of_method)]
              for name, of_method in maps.items()}  # fmt: skip
within = score(recording, where_seen, truths)

page = Page("three_cameras", "7. Three cameras")
page.text(
    f"""The paper fuses the three cameras of EVIMO2's rig and shows that the map has fewer outliers, within the common
    field of view. Here, with exact truth: the preset trinocular, three fisheyes of 640x480 pixels in a furnished
    room, one of them upright; {len(windows)} windows of 0.2 s, planes from 0.8 to 4.5 m, the view of camera 0."""
)
page.numbers("where all cameras see", within)
wrong = {name: 100 * result.own["beyond_tenth"] for name, result in results.items()}
page.errors("all pixels", results)
shown = {name: results[name].maps[0] for name in ("camera 0", "camera 1", "camera 2", "0 and 1", "three")}
page.figure(depth_and_confidence(shown, 1.75), "One window: depth (near bright, far dark) and confidence")
figure, axes = pyplot.subplots(1, 3, figsize=(9, 3), layout="constrained")
draw_precision(axes, {name: precision(result, truths) for name, result in results.items()})
page.figure(figure, "Precision, recall and F1 over the allowed error", "_precision")

one, two = ([wrong[name] for name in names] for names in (ONES, PAIRS))
page.claim("three cameras have less than half of any camera's points with errors beyond 10 %",
           wrong["three"] < 0.5 * min(one), f"{wrong['three']:.2f} against {listed(one, 2)} %")  # fmt: skip
page.claim("and less than any two cameras", wrong["three"] < min(two),
           f"{wrong['three']:.2f} against {listed(two, 2)} %")  # fmt: skip
median = [100 * within[name].common["median_abs_m"] for name in (*PAIRS, "three")]
page.claim("on common pixels, where all cameras see, three have a smaller median error than any two",
           median[-1] < min(median[:-1]), f"{median[-1]:.2f} against {listed(median[:-1], 2)} cm")  # fmt: skip
view = {name: 100 * np.mean([c > 0 for _, c in maps[name]]) for name in ("camera 0", "three")}
page.claim("the fused map inherits the overlap of the fields of view: less of the view has confidence",
           view["three"] < view["camera 0"], f"{view['three']:.1f} against {view['camera 0']:.1f} %")  # fmt: skip
# On one plane, the mean of the cameras' rays is their number divided by the number of cameras.
one_plane = {"dsi.num_planes": 1, "fusion.across_cameras": "arithmetic"}
votes = [np.sum([k.confidence for k in keyframes(recording, windows, {**METHODS[name], **one_plane})], dtype=float)
         for name in (*ONES, "three")]  # fmt: skip
millions = 1e-6 / len(windows) * np.array([3 * votes[3], sum(votes[:3])])
page.claim("cameras are not processed in pairs: votes on a plane are the sum of the cameras' votes",
           np.isclose(*millions, rtol=1e-4), listed(millions, 3) + " million in a window")  # fmt: skip
page.write()
