# SPDX-License-Identifier: BSD-3-Clause
"""Depth with wrong poses and clocks: noise and drift of the poses, late poses, a late camera.

The paper has no such experiment; it maps with the poses of odometry (Ghosh and Gallego 2022, Sec. 4.6, TUM-VIE).
"""

import numpy as np
from lab import ONE_CAMERA, PAPER, Page, between, errors, keyframes, mvsec_room, of, pick, score
from matplotlib import pyplot
from pictures import curves
from rotations import rotations


def tracked(recording, noise=0.0, drift=0.0, late=0.0):
    """Return the recording with the poses of a tracker at 100 Hz: `noise` mm and 0.05° per mm on each axis of a pose,
    `drift` mm/s and 0.02° per mm on each axis of the world, stamps `late` by ms."""
    simulation, random = recording.simulation, np.random.default_rng(1)
    times, true = simulation.poses(np.arange(simulation.start, simulation.end + 1, 10_000_000))
    seconds = 1e-9 * (times - simulation.start)[:, None]
    turned = rotations(np.radians(0.02 * drift) * seconds * np.ones(3))
    steps = np.diff(true[:, :3, 3], axis=0, prepend=true[:1, :3, 3])
    poses = true.copy()
    poses[:, :3, 3] = true[0, :3, 3] + np.cumsum(np.einsum("nij,nj->ni", turned, steps), axis=0)
    poses[:, :3, 3] += 1e-3 * drift * seconds + 1e-3 * noise * random.normal(size=steps.shape)
    noisy = rotations(np.radians(0.05 * noise) * random.normal(size=steps.shape))
    poses[:, :3, :3] = turned @ true[:, :3, :3] @ noisy
    return recording.but(poses=(times + round(1e6 * late), poses))


def with_late_camera(recording, late):
    """Return the recording with the stamps of the second camera `late` by ms."""
    left, right = recording.events
    right = right.copy()
    right["t"] += round(1e6 * late)
    return recording.but(events=[left, right])


KINDS = {  # title: unit, levels, name of a level, recording with a level
    "Noise of each pose": ("mm", (1, 2, 5, 10, 20), lambda mm: f"noise of {mm} mm, {0.05 * mm:.2f}°",
                            lambda recording, mm: tracked(recording, noise=mm)),
    "Drift": ("mm/s", (1, 2, 5, 10, 20, 50), lambda mm: f"drift of {mm} mm/s, {0.02 * mm:.2f}°/s",
              lambda recording, mm: tracked(recording, drift=mm)),
    "Poses late": ("ms", (1, 2, 5, 10, 20), lambda ms: f"poses {ms} ms late",
                   lambda recording, ms: tracked(recording, late=ms)),
    "Second camera late": ("ms", (1, 2, 5, 10, 20), lambda ms: f"camera {ms} ms late", with_late_camera),
}  # fmt: skip

page = Page("pose_accuracy", "10. Accuracy of the poses")
recording = mvsec_room()
windows = recording.windows(pick(0.5, 0.1), pick(8, 1))
TWO = {**PAPER, **between(1, 6.5)}
METHODS = {"one camera": {**TWO, **ONE_CAMERA}, "two cameras": TWO}
positions = recording.poses[1][:, :3, 3]
speed = np.linalg.norm(np.diff(positions, axis=0), axis=1).sum() / (1e-9 * np.ptp(recording.poses[0]))
page.text(f"""The paper has no such experiment. It finds (Sec. 4.6, TUM-VIE) that visual-inertial odometry is as good
    as motion capture for intervals of 0.5 s, and that the method needs accurate poses. Here: the recording of study
    1, {len(windows)} windows of 0.5 s, planes from 1 to 6.5 m, with one camera (EMVS) and two (Algorithm 1). The
    poses at 100 Hz have independent normal noise (NumPy's) on each axis; or a heading that rotates about each axis
    and a position that moves along each axis (the drone flies at {speed:.2f} m/s); or late stamps. Or the stamps of
    the second camera are late, which one camera does not notice. Errors are relative to the truth at the true pose;
    *in the world*: at the pose that was used.""")


def mapped(recording):
    """Return the keyframes of each method, and the median error in the world of two cameras."""
    made = {name: keyframes(recording, windows, options) for name, options in METHODS.items()}
    two = made["two cameras"]
    in_world = errors([k.depth for k in two], [recording.simulation.depth(k, k.pose) for k in two])
    return made, 100 * in_world["median_abs_m"]


exact = mapped(recording)
truths = [recording.truth(keyframe) for keyframe in exact[0]["two cameras"]]
rows, growth = [], {}
figure, axes = pyplot.subplots(2, 2, figsize=(9, 6.6), layout="constrained")
for ax, (title, (unit, levels, say, make)) in zip(axes.flat, KINDS.items()):
    levels = levels[: pick(None, 1)]
    runs = {"exact": exact, **{say(level): mapped(make(recording, level)) for level in levels}}
    results = {}
    for method in METHODS:
        maps = {name: [(k.depth, k.confidence) for k in made[method]] for name, (made, _) in runs.items()}
        results[method] = score(recording, maps, truths)
        page.numbers(f"{title}, {method}", results[method], ("own", "common"))
    one, two = results.values()
    for name in runs:
        if name != "exact" or not rows:  # once
            own, median = two[name].own, 100 * one[name].own["median_abs_m"]
            cells = 100 * own["mean_abs_m"], 100 * own["median_abs_m"], 100 * own["bad_pix_5px"], own["points"] / 1000
            rows.append([name, *(f"{cell:.2f}" for cell in (*cells, median))])
    medians = of(two, "median_abs_m", "own", 100)
    growth[title] = dict(zip(levels, np.divide(medians[1:], medians[0])))
    series = {"one camera": of(one, "median_abs_m", "own", 100), "two cameras": medians,
              "two cameras, common pixels": of(two, "median_abs_m", "common", 100),
              "two cameras, in the world": [in_world for _, in_world in runs.values()]}  # fmt: skip
    curves(ax, (0, *levels), series, f"{title} [{unit}]", "median error [cm]")
    ax.lines[-1].set_linestyle("--")  # it often lies on another one
    if title != "Drift":
        ax.get_legend().remove()
head = ["two cameras", "mean [cm]", "median [cm]", "bad-pix [%]", "points [thousand]", "one camera: median [cm]"]
page.table(head, rows)
page.figure(figure, "Median error over each kind of error")

level = min(2, max(growth["Drift"]))
name, ratio = KINDS["Drift"][2](level), growth["Drift"][level]
page.claim(f"in windows of 0.5 s odometry with a {name} is as good as exact poses: the median error is at most "
           "1.1 times as large", ratio <= 1.1, f"{ratio:.2f}")  # fmt: skip
late, apart = (growth[title][pick(20, 1)] for title in ("Poses late", "Second camera late"))
page.claim("a late camera does more harm than late poses", apart > late,
           f"{apart:.2f} and {late:.2f} times the median error of exact stamps at 20 ms")  # fmt: skip
page.write()
