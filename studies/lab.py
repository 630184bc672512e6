# SPDX-License-Identifier: BSD-3-Clause
"""What the studies share: simulated recordings, the paper's options, errors at equal pixels, and a page per study.

Run a study as ``PYTHONPATH=build/release/python python3 studies/NAME.py``; ``studies/run.py`` runs all. --cache keeps
simulated events: empty it after a change of the simulator. A new study is named in run.py, too. A page goes to OUT/NAME.md, its numbers to OUT/NAME.csv, its figures to OUT/NAME*.png.
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import hashlib
import os
import pathlib
import textwrap

import numpy as np
from PIL import Image

import event_fusion as ef

ROOT = pathlib.Path(__file__).resolve().parent.parent
#: Real trajectories and calibrations.
DATA = pathlib.Path(os.environ.get("EFM_SHARED_DATA", ROOT.parent / "shared/data"))

#: Algorithm 1 of the paper (Ghosh and Gallego 2022). A study changes some: {**PAPER, "dsi.num_planes": 50}.
PAPER = {
    "dsi.num_planes": 100,  # even in inverse depth, as by default
    "fusion.across_cameras": "harmonic",
    "depth.extraction": "paper",  # adaptive threshold of 5 x 5 pixels on the largest values of the rays, Sec. 3.2
    "depth.threshold_c": 5,
    "depth.median_size": 5,
    "depth.max_confidence": "sequence",  # white: a robust maximum of all windows
    # What the paper does not have:
    "depth.subplane": False,
    "fusion.split_polarity": False,
    "fusion.time_slices": 1,
    "refinement.correct_motion": False,
}
RULES = ("min", "harmonic", "geometric", "arithmetic", "rms", "max")  # in the order of the means


def between(near, far):
    """Return the options of the depths, in metres."""
    return {"dsi.min_depth_m": near, "dsi.max_depth_m": far}


ONE_CAMERA = {"rig.cameras": 0}


def arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument("--quick", action="store_true", help="tiny: shows that it runs; its numbers mean nothing")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "docs/studies", help="folder of the page")
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release", help="folder of the build")
    parser.add_argument("--cache", type=pathlib.Path, default=ROOT / "build/studies_cache", help="folder of events")
    return parser.parse_args()


ARGUMENTS = arguments()
BUILD = ARGUMENTS.build


def pick(full, quick):
    """Return the setting of this run."""
    return quick if ARGUMENTS.quick else full


@dataclasses.dataclass(frozen=True)
class Recording:
    """A simulation, what its cameras recorded, and the poses to map with."""

    simulation: ef.Simulation
    cameras: list
    events: list  # of each camera
    points: list  # for each event the point (x, y, z) of the world that it saw; NaN for noise
    poses: tuple

    def but(self, **changes):
        """Return the recording with errors; the truth does not change."""
        return dataclasses.replace(self, **changes)

    def windows(self, seconds, count):
        """Return `count` windows (begin, end, time of the view: the middle), nanoseconds, evenly spread; many overlap."""
        start, end = self.simulation.start, self.simulation.end
        length = min(round(seconds * 1e9), end - start)
        begins = [start + (end - start - length) * i // max(count - 1, 1) for i in range(count)]
        return [(begin, begin + length, begin + length // 2) for begin in begins]

    def truth(self, keyframe):
        """Return the true depth at the true pose of the keyframe's time."""
        return self.simulation.depth(keyframe)

    @property
    def focal_baseline(self):
        """Focal length times baseline, for bad-pix."""
        left, right = self.simulation.cameras[:2]
        return left.K[0, 0] * np.linalg.norm((np.linalg.inv(left.T_rig_cam) @ right.T_rig_cam)[:3, 3])


def described(value):
    """Return an argument of a simulation as text, for the name of its file."""
    if isinstance(value, (list, tuple)) and value and isinstance(value[0], ef.Camera):
        return repr([(repr(c), c.K.tolist(), c.coefficients, c.T_rig_cam.tolist()) for c in value])
    if isinstance(value, tuple):  # poses
        return hashlib.sha1(b"".join(np.ascontiguousarray(part).tobytes() for part in value)).hexdigest()
    return repr(value)


def recorded(*preset, **arguments):
    """Simulate, or read the events from the cache."""
    simulation = ef.Simulation(*preset, **arguments)
    key = repr((ef.__version__, preset, sorted((name, described(value)) for name, value in arguments.items())))
    file = ARGUMENTS.cache / f"{hashlib.sha1(key.encode()).hexdigest()[:16]}.npz"
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        arrays = {}
        for i, (events, points) in enumerate(simulation.events()):
            arrays |= {f"events{i}": events, f"points{i}": points}
        unfinished = file.with_suffix(f".{os.getpid()}.npz")
        np.savez(unfinished, **arrays)
        unfinished.rename(file)
    with np.load(file) as arrays:
        cameras = range(len(simulation.cameras))
        events, points = ([arrays[f"{name}{i}"] for i in cameras] for name in ("events", "points"))
    return Recording(simulation, simulation.cameras, events, points, simulation.poses())


def mvsec_room(seconds=10):
    """MVSEC's two DAVIS346 on the smoothed trajectory of indoor_flying1 through a furnished room."""
    trajectory, calibration = DATA / "trajectories/mvsec_indoor_flying1.txt", DATA / "calibration/mvsec/camchain.yaml"
    return recorded(scene="room", trajectory=trajectory, calibration=calibration, duration=pick(float(seconds), 0.2))


def keyframes(recording, windows, options):
    return ef.keyframes(recording.cameras, recording.events, recording.poses, windows, options)


# Errors


def local_contrast(confidence):
    """Return the confidence minus its Gaussian mean of 5 x 5."""
    kernel, padded = np.array([1, 4, 6, 4, 1]) / 16, np.pad(confidence.astype(float), 2, mode="reflect")
    rows = sum(k * padded[i : i + confidence.shape[0]] for i, k in enumerate(kernel))
    return confidence - sum(k * rows[:, i : i + confidence.shape[1]] for i, k in enumerate(kernel))


def strongest(depth, confidence, count):
    """Return the `count` depths with the highest local contrast (more, if some are equal); 0 elsewhere."""
    has_depth = depth > 0
    if np.count_nonzero(has_depth) <= count:
        return depth
    contrast = np.where(has_depth, local_contrast(confidence), -np.inf)
    least = np.partition(contrast, -count, axis=None)[-count] if count else np.inf
    return np.where(contrast >= least, depth, 0)


def errors(depths, truths, focal_baseline=None, **options):
    """Return the errors of all maps together. A depth is compared with the most favourable truth within one pixel."""
    options = {"tolerance_px": 1, **options}
    return ef.evaluate.depth(list(depths), list(truths), focal_baseline=focal_baseline, **options)["all"]


def around(image, fill):
    """Return the nine images of each pixel and its neighbours."""
    padded = np.pad(image, 1, constant_values=fill)
    return [padded[y : y + image.shape[0], x : x + image.shape[1]] for y, x in np.ndindex(3, 3)]


def best_truth(depth, truth):
    """Return the truth within a pixel that is nearest in inverse depth; NaN without one."""
    best = np.full(depth.shape, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        for near in around(np.where(truth > 0, truth, np.nan), np.nan):
            nearer = np.abs(1 / near - 1 / depth) < np.abs(1 / best - 1 / depth)
            best = np.where(np.isfinite(near) & (nearer | np.isnan(best)), near, best)
    return best


def dilated(mask):
    """Return the pixels with a pixel of the mask within one column and row."""
    return np.any(around(mask, False), axis=0)


@dataclasses.dataclass
class Depths:
    """The depth maps of a method in each window, and their errors: of its own pixels, of the pixels that all methods
    have, and of equal numbers of pixels (the fewest of all methods; those with the highest local contrast)."""

    maps: list  # of (depth, confidence)
    own: dict = None
    common: dict = None
    equal: dict = None


def score(recording, maps, truths):
    """Return the errors of each method's maps, by name: `maps` has (depth, confidence) of each window."""
    scored = {name: Depths(of_method) for name, of_method in maps.items()}
    common, fewest = [], []
    for window in zip(*maps.values()):
        common.append(np.all([depth > 0 for depth, _ in window], axis=0))
        fewest.append(min(np.count_nonzero(depth) for depth, _ in window))
    for of_method in scored.values():
        depths = [depth for depth, _ in of_method.maps]
        at_common = [np.where(mask, depth, 0) for depth, mask in zip(depths, common)]
        equal = [strongest(depth, confidence, count) for (depth, confidence), count in zip(of_method.maps, fewest)]
        of_method.own, of_method.common, of_method.equal = (
            errors(of, truths, recording.focal_baseline) for of in (depths, at_common, equal)
        )
    return scored


def compare(recording, windows, methods, make=keyframes):
    """Map the windows with the options of each method, and compare all with the truth."""
    made = {name: make(recording, windows, options) for name, options in methods.items()}
    truths = [recording.truth(keyframe) for keyframe in next(iter(made.values()))]
    return score(recording, {name: [(k.depth, k.confidence) for k in of] for name, of in made.items()}, truths)


def of(results, key, pixels="own", scale=1.0):
    """Return an error of each method, times a scale."""
    return [scale * getattr(result, pixels)[key] for result in results.values()]


# Pages

#: Columns of a table of errors: title, key of `ef.evaluate.depth`, scale, decimals.
COLUMNS = (
    ("mean [cm]", "mean_abs_m", 100, 2),
    ("median [cm]", "median_abs_m", 100, 2),
    ("bad-pix [%]", "bad_pix_5px", 100, 2),
    ("SILog", "silog", 1, 2),
    ("AErrR [%]", "aerrr", 100, 2),
    ("log RMSE", "log_rmse", 1, 2),
    ("δ<1.25 [%]", "delta_1", 100, 2),
    ("δ<1.25² [%]", "delta_2", 100, 2),
    ("δ<1.25³ [%]", "delta_3", 100, 2),
    ("points [thousand]", "points", 1e-3, 1),
)


def grows(values):
    return all(a < b for a, b in zip(values, values[1:]))


def listed(values, decimals=1):
    return ", ".join(f"{value:.{decimals}f}" for value in values)


def filled(words, indent=""):
    words = " ".join(words.split())
    return textwrap.fill(words, 118, subsequent_indent=indent, break_on_hyphens=False, break_long_words=False)


class Page:
    """The page of a study: text, tables, figures, and claims that the program checks."""

    def __init__(self, name, title):
        self.name, self.rows = name, []
        self.parts = [f"# {title}", "[How to read the pages](../studies.md#how-to-read-the-pages)"]
        print(title, flush=True)

    def text(self, words):
        self.parts.append(filled(words))

    def table(self, head, rows):
        lines = [head, ["---"] + ["---:"] * (len(head) - 1), *rows]
        self.parts.append("\n".join("|" + "|".join(map(str, line)) + "|" for line in lines))

    def numbers(self, part, results, pixels=("own", "common", "equal")):
        """Write all errors of methods into the .csv file, under the name of a part of the study."""
        for name, result in results.items():
            for which in pixels:
                of_pixels = getattr(result, which)
                cells = (f"{scale * of_pixels.get(key, np.nan):.{decimals}f}" for _, key, scale, decimals in COLUMNS)
                self.rows.append([part, name, which, *cells])

    def errors(self, part, results, pixels="own", columns=(0, 1, 2, 9), paper=None):
        """Write a short table of errors, all of them into the .csv file; `paper`: a last column."""
        self.numbers(part, results)
        head, rows = ["", *(COLUMNS[i][0] for i in columns)], []
        for name, result in results.items():
            at = getattr(result, pixels)
            rows.append([name, *(f"{COLUMNS[i][2] * at[COLUMNS[i][1]]:.{COLUMNS[i][3]}f}" for i in columns)])
            if paper:
                rows[-1].append(paper[name])
        self.table(head + (["paper"] if paper else []), rows)

    def claim(self, claim, holds, figures, departure=""):
        """Write a claim, of the paper or our own, and whether the numbers agree; `departure`: why they do not."""
        words = f"- **{'agrees' if holds else 'departs'}**: {claim} ({figures})."
        line = filled(f"{words} {departure}" if departure and not holds else words, "  ")
        if self.parts[-1].startswith("- "):
            self.parts[-1] += "\n" + line
        else:
            self.parts.append(line)

    def figure(self, figure, caption, suffix=""):
        """Write a figure of matplotlib, with 128 colours: a small file."""
        file = f"{self.name}{suffix}.png"
        ARGUMENTS.out.mkdir(parents=True, exist_ok=True)
        figure.savefig(ARGUMENTS.out / file, dpi=100)
        with Image.open(ARGUMENTS.out / file) as image:
            image.convert("RGB").quantize(128).save(ARGUMENTS.out / file, optimize=True)
        self.parts.append(f"![{caption}]({file})\n\n*{caption}*")

    def write(self):
        ARGUMENTS.out.mkdir(parents=True, exist_ok=True)
        (ARGUMENTS.out / f"{self.name}.md").write_text("\n\n".join(self.parts) + "\n")
        if self.rows:
            with open(ARGUMENTS.out / f"{self.name}.csv", "w", newline="") as file:
                head = ["part", "method", "pixels", *(column[0] for column in COLUMNS)]
                csv.writer(file, lineterminator="\n").writerows([head, *self.rows])
