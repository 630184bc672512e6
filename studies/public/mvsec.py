#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The paper's tables on MVSEC's indoor flights: mvsec.py FOLDER.

Data set: A. Zhu et al., "The Multivehicle Stereo Event Camera Dataset", RA-L 2018.
Page:     https://daniilidis-group.github.io/mvsec (Download, HDF5 files). Licence: see the page.
Files:    indoor_flying{1,2,3}_data.hdf5 and indoor_flying{1,2,3}_gt.hdf5. The bags of the same sequences have
          1.2, 1.7 and 1.8 GB (data) and 2.6, 3.2 and 3.5 GB (gt). camchain-imucam-indoor_flying.yaml of
          indoor_flying_calib.zip is used if it is in FOLDER, and else the copy of its numbers in
          config/calibration/mvsec.yaml.

Tables (--table):
    methods     Algorithms 1 and 2 on windows of 1 s (tables of the supplementary material, and their mean)
    functions   the six fusion functions across cameras on windows of 0.1 s
    intervals   2, 4 and 8 sub-intervals, A_t∘H_c (the paper has only the mean of the sequences)
A window begins every 50 ms: 4000 windows of 1 s for each row of `methods`, in all sequences. Try --windows 20
first.

Truth: davis/left/depth_image_raw, depth along z in the raw pixels of the left camera, at 20 Hz, up to 8.4 m. Each
pixel becomes a point by the lens of the calibration. The poses carry the points of the nearest map in time, at
most 50 ms away, to the keyframe's undistorted view, where each falls into its nearest pixel. Errors are over the
points of all windows. The figures of a mean are the means of the three sequences, as in the paper.

What the paper leaves out:
- the times: "200 s" in all. The authors' files have 10 to 65, 10 to 79 and 10 to 89 s (203 s), which are used
  here. They count from the beginning of the bag, and here from the first event of the left camera;
- whether windows overlap: its text says no, its tables have 4000 depth maps at 20 Hz, as the authors' files have;
- C = 14 and a median of 9 pixels, in the authors' files of windows of 1 s; the same is used here for 0.1 s;
- the robust maximum of the sequence: here depth.max_confidence = sequence, in the authors' files 57.7, 78 and
  78.8;
- the shift of the shuffled sub-intervals: here the second camera's intervals are exchanged (fusion.shuffle =
  shift);
- how the truth was undistorted, and the clock between events, poses and truth: their times are used as they are."""

from __future__ import annotations

import argparse
import pathlib
from typing import Any

import numpy as np

import _study as study
import event_fusion as ef

PAGE = "download it from https://daniilidis-group.github.io/mvsec (Download, HDF5 files)"
MAX_TRUTH_M = 8.4
SEQUENCES = {
    "indoor_flying1": study.PaperSequence(10, 65, 1, 6.5, 14, 9),
    "indoor_flying2": study.PaperSequence(10, 79, 1, 6.5, 14, 9),
    "indoor_flying3": study.PaperSequence(10, 89, 1, 6.5, 14, 9),
}

# The paper's figures: ten numbers each for flying 1, 2 and 3.
_METHODS = {
    "EMVS (monocular)": """39.37 14.95 3.05 4.72 13.25 22.10 82.03 93.43 97.62 1.21
        31.42 13.01 6.15 4.56 13.37 21.80 84.07 94.72 97.88 1.17
        30.54 15.09 2.31 3.33 11.59 18.27 88.16 96.45 98.47 1.42""",
    "ESVO": """24.04 10.21 2.54 2.94 9.76 17.17 91.43 96.53 98.55 1.95
        21.34 8.97 3.75 3.48 9.32 19.14 91.60 95.88 97.86 1.89
        29.62 12.61 3.78 4.02 11.50 20.20 88.28 94.88 97.52 2.29""",
    "H_c∘A_t (Alg. 1)": """22.53 9.72 1.30 1.94 7.91 14.11 93.49 97.50 99.17 0.96
        18.20 8.49 1.77 1.78 8.13 13.59 95.53 98.13 99.08 0.65
        19.49 10.38 0.99 1.43 7.35 12.01 96.09 98.60 99.38 0.82""",
    "H_c∘A_t (Alg. 1) + MF": """23.33 9.90 1.39 2.08 8.12 14.61 93.16 97.28 99.05 3.48
        18.58 8.68 1.86 1.81 8.19 13.71 95.27 98.07 99.09 2.42
        20.02 10.59 1.02 1.50 7.50 12.30 95.79 98.51 99.36 3.11""",
    "H_c∘H_t": """24.38 10.81 1.40 2.11 8.59 14.71 92.53 97.38 99.15 1.24
        22.47 10.13 2.92 2.46 9.41 16.07 92.66 97.19 98.79 1.39
        23.48 11.99 1.36 1.95 8.58 14.01 93.79 97.90 99.14 1.79""",
    "H_t∘A_c": """23.78 10.37 1.26 2.03 8.36 14.41 92.72 97.54 99.21 1.02
        21.37 9.86 2.50 2.26 9.13 15.41 93.41 97.60 98.92 1.18
        22.68 11.83 1.24 1.81 8.35 13.50 94.33 98.14 99.24 1.55""",
    "A_c∘H_t": """24.48 10.78 1.39 2.14 8.62 14.81 92.48 97.34 99.13 1.20
        22.28 10.06 2.81 2.40 9.35 15.88 92.80 97.28 98.82 1.34
        23.29 11.97 1.32 1.91 8.52 13.86 93.94 97.97 99.17 1.72""",
    "A_c∘A_t": """21.93 9.35 1.22 1.87 7.75 13.85 93.65 97.65 99.23 0.87
        19.04 8.76 2.24 1.99 8.44 14.40 94.68 97.89 99.02 1.01
        20.17 10.68 1.06 1.53 7.59 12.40 95.67 98.48 99.36 1.09""",
    "A_t∘H_c": """22.32 9.63 1.31 1.92 7.85 14.02 93.62 97.51 99.17 1.03
        19.82 8.91 2.55 2.09 8.60 14.77 94.16 97.55 98.94 1.17
        20.61 10.74 1.13 1.59 7.68 12.64 95.40 98.35 99.30 1.23""",
    "A_t∘H_c + shuffling": """23.92 10.60 1.28 2.01 8.40 14.36 92.76 97.55 99.21 1.11
        21.66 9.91 2.60 2.22 9.16 15.27 93.14 97.53 98.92 1.22
        22.24 11.60 1.17 1.73 8.17 13.20 94.58 98.21 99.27 1.39""",
}
# Mean, median, bad-pix and points, each for flying 1, 2 and 3.
_FUNCTIONS = {
    "min_c∘A_t": "58.13 68.79 49.96 24.07 39.20 20.35 17.40 38.82 12.40 6.13 12.72 5.83",
    "H_c∘A_t": "60.16 68.83 51.94 25.45 39.63 21.15 18.58 38.91 13.70 6.61 13.54 6.27",
    "G_c∘A_t": "63.57 70.48 55.22 28.17 41.51 22.97 20.30 39.68 15.30 6.90 14.18 6.35",
    "A_c∘A_t": "78.78 79.95 60.35 38.15 47.63 25.03 27.20 44.64 17.56 5.97 14.53 4.50",
    "RMS_c∘A_t": "99.15 88.46 88.21 61.73 55.71 47.45 36.84 48.89 29.86 7.65 17.48 5.41",
    "max_c∘A_t": "109.30 93.81 104.52 75.44 61.71 66.56 41.31 51.64 36.27 9.25 19.99 6.92",
}
_INTERVALS = {
    "A_t∘H_c, N_s = 2": "20.92 9.76 1.66 1.86 8.05 13.81 94.39 97.80 99.14 1.14",
    "A_t∘H_c, N_s = 4": "20.49 9.58 1.63 1.94 7.88 13.65 94.64 97.82 99.15 1.19",
    "A_t∘H_c, N_s = 8": "19.80 9.27 1.56 1.84 7.63 13.31 94.99 97.90 99.19 1.20",
}
_OF_INTERVALS = {
    name: {**study.METHODS["A_t∘H_c"], "fusion.subintervals": int(name.split()[-1])} for name in _INTERVALS
}
# Of each table: rows, seconds of a window, indices of its columns.
TABLES = {
    "methods": (study.METHODS, 1.0, range(10)),
    "functions": (study.FUNCTIONS, 0.1, (0, 1, 2, 9)),
    "intervals": (_OF_INTERVALS, 1.0, range(10)),
}


def paper_figures(table: str, flight: int) -> dict[str, list[float]]:
    """Return the paper's rows for flying 1, 2 or 3; 0: the mean of the sequences."""
    nan = float("nan")
    if table == "intervals":
        return {name: [float(n) if flight == 0 else nan for n in text.split()] for name, text in _INTERVALS.items()}
    made = {}
    for name, text in (_METHODS if table == "methods" else _FUNCTIONS).items():
        values = np.array(text.split(), float)
        of_flights = values.reshape(3, 10) if table == "methods" else values.reshape(4, 3).T
        made[name] = list(of_flights.mean(0) if flight == 0 else of_flights[flight - 1])
    return made


def open_truth(file: pathlib.Path) -> tuple[np.ndarray, Any]:
    """Return the times of the true depth maps, nanoseconds, and the maps."""
    try:
        import h5py
    except ImportError as error:
        raise study.DataError("this study needs h5py: apt install python3-h5py") from error
    data = h5py.File(file, "r", locking=False)  # as the engine opens it
    for key in ("davis/left/depth_image_raw", "davis/left/depth_image_raw_ts"):
        if key not in data:
            raise study.DataError(f"{file} has no {key}: it is not the whole file of the ground truth; {PAGE}")
    times = np.rint(data["davis/left/depth_image_raw_ts"][:] * 1e9).astype("i8")
    if len(times) == 0 or len(times) != len(data["davis/left/depth_image_raw"]):
        raise study.DataError(f"{file}: {len(times)} times of depth maps: expected one for each map; {PAGE}")
    return times, data["davis/left/depth_image_raw"]


def main(arguments: argparse.Namespace) -> None:
    rows, window_s, shown = TABLES[arguments.table]
    heads = [study.columns("cm")[k] for k in shown]
    calibration = arguments.calibration or arguments.folder / "camchain-imucam-indoor_flying.yaml"
    if arguments.calibration is None and not calibration.exists():
        calibration = study.CALIBRATIONS / "mvsec.yaml"
    tables, of_all = [], {}
    chosen = arguments.sequence or list(SEQUENCES)
    for name in chosen:
        for part in ("data", "gt"):
            study.needed(arguments.folder / f"{name}_{part}.hdf5", PAGE)
    for name in chosen:
        data, gt = (arguments.folder / f"{name}_{part}.hdf5" for part in ("data", "gt"))
        recording = ef.open([data, gt], calibration=calibration)
        times, images = open_truth(gt)
        windows = study.windows_of(name, recording, SEQUENCES[name], arguments, window_s, 0.05, truth_ns=times)
        recording = ef.open([data, gt], calibration=calibration, t0=windows.first_ns, t1=windows.end_ns)
        ray = study.rays(recording.rig[0])
        if images.shape[1:] != ray.shape[:2]:
            raise study.DataError(f"{gt}: depth maps of {images.shape[1:]}: expected {ray.shape[:2]}")
        truth = study.Truth(times, lambda k: ray * images[k][..., None], recording.poses, 0.05)
        measured = {}
        for method, options in study.methods_of(rows, SEQUENCES[name], arguments).items():
            row = study.map_row(
                f"{name}, {method}", recording, windows, options, (1, 6.5), arguments.out, truth, MAX_TRUTH_M
            )
            measured[method] = study.numbers(row.errors, heads)
            of_all.setdefault(method, []).append(measured[method])
        title = f"MVSEC {name}, windows of {window_s} s: {row.keyframes}"
        figures = paper_figures(arguments.table, int(name[-1])) if arguments.table != "intervals" else {}
        tables.append(study.table(title, [head for head, _, _ in heads], list(study.beside(measured, figures))))
    if len(chosen) == len(SEQUENCES):
        means = {method: list(np.mean(values, 0)) for method, values in of_all.items()}
        figures = paper_figures(arguments.table, 0)
        title = "MVSEC, mean of the three sequences"
        tables.append(study.table(title, [head for head, _, _ in heads], list(study.beside(means, figures))))
    study.finish(arguments, tables)


if __name__ == "__main__":
    parser = study.parser_of(__doc__, "study_mvsec", list(SEQUENCES))
    parser.add_argument("--table", choices=TABLES, default="methods", help="default: methods")
    study.run(main, parser)
