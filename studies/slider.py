# SPDX-License-Identifier: BSD-3-Clause
"""The real slider (Mueggler et al., IJRR 2017): depth from 0.15 s of its events, against depth from its frames.

The recording has no true depth. Its frames have baselines of up to 0.3 m, the events 4.7 cm: a plane sweep of the frames
(Collins, CVPR 1996) with the true poses is much more accurate. The program slider_truth makes it (test/studies/frames).
"""

import subprocess
import tempfile

import numpy as np
from lab import BUILD, DATA, ONE_CAMERA, PAPER, Page, best_truth, between, dilated, pick, strongest
from matplotlib import pyplot
from pictures import bare

import event_fusion as ef
from event_fusion import plot

HORIZONTAL, VERTICAL = 1, 2  # the grey values' gradient is within 15° of vertical, within 30° of horizontal
SIZE = 180, 240
NAMES = ("depth", "grey", "kinds", "vertical_lines")


def slider_truth():
    """Return images of the view: depth [m], grey values, kind of the strongest edge within a pixel, lines of edges."""
    with tempfile.TemporaryDirectory() as folder:
        quick = ["--quick"] if pick(False, True) else []
        subprocess.run([BUILD / "bin/slider_truth", DATA / "slider_depth", folder, *quick], check=True)
        return {name: np.fromfile(f"{folder}/{name}.f32", "<f4").reshape(SIZE) for name in NAMES}


def slider():
    """Return cameras, events and poses, and the window: 0.15 s from the first event with a pose."""
    recording = ef.open(DATA / "slider_depth")
    events, poses = np.concatenate(list(recording.events())), recording.poses
    begin = int(events["t"][events["t"] >= poses[0][0]][0])
    return recording.rig, [events], poses, [(begin, begin + 150_000_000)]


def slider_errors(depth, truth):
    """Return numbers of points and errors in percent."""
    points, true = depth > 0, best_truth(depth, truth["depth"])
    error = np.where(points & np.isfinite(true), np.abs(depth - true) / true, np.nan)
    known = np.isfinite(error)

    def percent(part, whole):
        return 100 * np.count_nonzero(part) / max(1, np.count_nonzero(whole))

    wrong = error > 0.1
    return {
        "points": np.count_nonzero(points),
        "with truth": np.count_nonzero(known),
        "median [%]": 100 * np.nanmedian(error),
        "beyond 10 % [%]": percent(wrong, known),
        "vertical [%]": percent(wrong & (truth["kinds"] == VERTICAL), known & (truth["kinds"] == VERTICAL)),
        "horizontal [%]": percent(wrong & (truth["kinds"] == HORIZONTAL), known & (truth["kinds"] == HORIZONTAL)),
        "on horizontal edges [%]": percent(points & (truth["kinds"] == HORIZONTAL), points),
        "vertical edges covered [%]": percent(
            (truth["vertical_lines"] > 0) & dilated(points), truth["vertical_lines"] > 0
        ),
    }


def main():
    page = Page("slider", "11. The real slider")
    cameras, events, poses, window = slider()
    truth = slider_truth()
    aggregated = {"depth.extraction": "aggregated", "depth.subplane": True}
    split = {"fusion.split_polarity": True, "fusion.time_slices": 2}
    paper = {**PAPER, **between(0.47, 2.4), **ONE_CAMERA, "depth.max_confidence": "keyframe"}
    methods = {
        "EMVS (the paper)": paper,
        "between planes": {**paper, "depth.subplane": True},
        "split fusion": {**paper, "depth.subplane": True, **split},
        "aggregation": {**paper, **aggregated},
        "both (default)": {**paper, **aggregated, **split, "fusion.across_cameras": "pairs"},
    }

    def mapped(options):
        keyframe = ef.keyframes(cameras, events, poses, window, options)[0]
        return keyframe.depth, keyframe.confidence

    def strict_to_loose(options):
        """More points need a looser threshold; below 0.9 more candidates, too."""
        if options["depth.extraction"] == "paper":
            return [{"depth.threshold_c": c} for c in range(20, -1, -1)]
        probabilities = 1 - 0.001 * 1.06 ** np.arange(118)
        contrasts = 0.15 * np.clip(probabilities / 0.9, 0.3, 1)
        return [{"depth.min_probability": p, "depth.min_local_contrast": c} for p, c in zip(probabilities, contrasts)]

    count, equal, own = 2500, {}, {}
    for name, options in methods.items():
        own[name] = mapped(options)[0]
        enough = (mapped({**options, **threshold}) for threshold in strict_to_loose(options))
        equal[name] = strongest(*next(maps for maps in enough if np.count_nonzero(maps[0]) >= count), count)

    page.text(f"""`slider_depth` of the Event Camera Dataset: a DAVIS240C on a linear slider; 0.15 s, {len(events[0]):,} events
        in the file, 4.7 cm of travel; planes from 0.47 to 2.4 m. The truth is a plane sweep of the frames; errors are of
        points with a truth, with the best truth within a pixel. An edge is horizontal within 15°, vertical within 30°.
        All methods at {count:,} points with the highest local contrast, and the default as shipped:""")
    scores = {name: slider_errors(depth, truth) for name, depth in equal.items()}
    rows = {**scores, "default as shipped": slider_errors(own["both (default)"], truth)}
    head = list(next(iter(rows.values())))
    page.table(["", *head], [[name, *(f"{v:.2f}" if isinstance(v, float) else v for v in row.values())] for name, row in rows.items()])  # fmt: skip
    paper_score, ours = scores["EMVS (the paper)"], scores["both (default)"]
    for key, most in (("beyond 10 % [%]", 0.2), ("median [%]", 0.4), ("on horizontal edges [%]", 0.45)):
        ratio = ours[key] / paper_score[key]
        page.claim(f"{key}: the default has at most {most} times that of the paper", ratio <= most, f"{ratio:.2f}")
    covered = [score["vertical edges covered [%]"] for score in (paper_score, ours)]
    page.claim("as many vertical edges are covered", covered[1] >= covered[0], f"{covered[0]:.1f} and {covered[1]:.1f} %",
               "A probable depth has many neighbours that agree; short and faint edges have few.")  # fmt: skip

    figure, axes = pyplot.subplots(2, 3, figsize=(10, 5.2), layout="constrained")
    limits = (0.47, 2.4)
    axes[0, 0].imshow(truth["grey"], cmap="gray")
    plot.depth(truth["depth"], ax=axes[1, 0], limits=limits)
    for (upper, lower), name in zip(axes.T[1:], ("EMVS (the paper)", "both (default)")):
        plot.depth(equal[name], ax=upper, limits=limits)
        plot.error(equal[name], truth["depth"], ax=lower, tolerance_px=1)
        bare(upper, name)
        bare(lower, "its errors: grey right, blue too near, red too far")
    bare(axes[0, 0], "frame")
    bare(axes[1, 0], "depth of the frames")
    page.figure(figure, "Depth (near bright, 0.47 m, to far dark, 2.4 m) and errors of 2,500 points of both methods")
    page.write()


if __name__ == "__main__":
    main()
