#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The paper's table on DSEC: dsec.py FOLDER.

Data set: M. Gehrig et al., "DSEC: A Stereo Event Camera Dataset for Driving Scenarios", RA-L 2021.
Page:     https://dsec.ifi.uzh.ch (Download, training sequence zurich_city_04_a). Licence and sizes: see the page.
Files:    of zurich_city_04_a_{events_left,events_right,calibration,disparity_event}.zip, each unpacked into a
          folder of its name, and zurich_city_04_a_disparity_timestamps.txt; all of them in FOLDER, or in
          FOLDER/zurich_city_04_a.
Poses:    the data set has none. The authors give those of a LiDAR's odometry, at 10 Hz:
          zurich_city_04-odometry/pose.bag in data/DSEC of https://github.com/tub-rip/dvs_mcemvs. Give the file by
          --poses, or put it there as pose.bag. cam_to_lidar.yaml moves them to the left camera. For the poses of
          the left camera: --hand-eye none.

The table: Algorithm 1, with and without the morphological filter, and the monocular method, on 35 s; a window of
0.2 s begins every 0.1 s, and its reference view is at its end: 350 windows of some 3.5 million events. Try
--windows 5 first.

Truth: disparities of the LiDAR in the rectified view of the left event camera, 16-bit PNG / 256, at 10 Hz, up to
50 m. The matrix cams_03 of cam_to_cam.yaml makes points of them, and R_rect0 turns these into the camera's frame,
as in the authors' script. The poses carry the points of the nearest map, at most 0.1 s away, to the keyframe's
view; the authors' script takes them as they are.

What the paper leaves out: the time of the 35 s. The authors' script has 0 to 35 s from the first event, which is
used here. C = 4, the median of 5 pixels and the view at the end of the window are those of the authors' file; the
robust maximum of the sequence is 468 there, and here depth.max_confidence = sequence."""

from __future__ import annotations

import argparse
import pathlib
from typing import Any, Optional

import numpy as np

import _study as study
import event_fusion as ef

NAME = "zurich_city_04_a"
PAGE = "download it from https://dsec.ifi.uzh.ch (Download), and unpack it into a folder of its name"
POSES = (
    "LiDAR odometry is data/DSEC/zurich_city_04-odometry/pose.bag of https://github.com/tub-rip/dvs_mcemvs; "
    "give it by --poses FILE"
)
SEQUENCE = study.PaperSequence(0, 35, 4, 200, 4, 5)
MAX_TRUTH_M = 50
FIGURES = {
    "EMVS (monocular)": "5.64 2.52 13.68 13.23 25.52 36.49 72.56 87.12 93.56 1.31",
    "ESVO": "3.88 1.56 12.08 9.23 18.89 30.80 84.53 92.57 95.63 3.40",
    "H_c∘A_t (Alg. 1)": "3.27 0.90 10.75 8.19 17.48 28.73 83.30 91.56 95.62 1.25",
    "H_c∘A_t (Alg. 1) + MF": "3.51 0.96 11.81 8.89 18.84 29.99 81.72 90.68 95.07 3.83",
}


def read_yaml(file: pathlib.Path) -> Any:
    try:
        import yaml
    except ImportError as error:
        raise study.DataError("this study needs PyYAML: apt install python3-yaml") from error
    try:
        return yaml.safe_load(file.read_text())
    except yaml.YAMLError as error:
        raise study.DataError(f"{file} is no YAML: {error}") from error


def points_of(disparity: np.ndarray, calibration: dict[str, Any]) -> np.ndarray:
    """Return the points of a disparity map, pixels, 0: none, in the frame of the left event camera (n, 3)."""
    v, u = np.nonzero(disparity)
    d = disparity[v, u]
    made = np.stack([u, v, d, np.ones_like(d)], 1) @ np.array(calibration["disparity_to_depth"]["cams_03"], float).T
    R_rect_cam = np.array(calibration["extrinsics"]["R_rect0"], float)
    return made[:, :3] / made[:, 3:] @ R_rect_cam  # rows: p_cam = R_rect_cam^T p_rect


def read_disparity(file: pathlib.Path, shape: tuple[int, int]) -> np.ndarray:
    from PIL import Image

    image = np.asarray(Image.open(file))
    if image.shape != shape:
        raise study.DataError(f"{file}: {image.shape[::-1]} pixels: expected the camera's {shape[::-1]}")
    if image.dtype.itemsize == 1:
        raise study.DataError(f"{file} has 8 bits: expected a disparity in 16 bits; {PAGE}")
    return image / 256


def main(arguments: argparse.Namespace) -> None:
    folder = arguments.folder / NAME if (arguments.folder / NAME).exists() else arguments.folder
    events = [study.needed(folder / f"{NAME}_events_{side}" / "events.h5", PAGE) for side in ("left", "right")]
    calibration = arguments.calibration or folder / f"{NAME}_calibration" / "cam_to_cam.yaml"
    study.needed(calibration, PAGE)
    hand_eye: Optional[pathlib.Path] = arguments.hand_eye or calibration.parent / "cam_to_lidar.yaml"
    if str(hand_eye) == "none":
        hand_eye = None
    else:
        study.needed(hand_eye, PAGE)
    poses = study.needed(arguments.poses or folder / "pose.bag", POSES)
    files = sorted(study.needed(folder / f"{NAME}_disparity_event", PAGE).glob("*.png"))
    timestamps = study.needed(folder / f"{NAME}_disparity_timestamps.txt", PAGE)
    times = np.loadtxt(timestamps, dtype="i8", ndmin=1) * 1000
    if len(times) == 0 or len(files) != len(times):
        raise study.DataError(
            f"{timestamps} has {len(times)} times, and {folder / f'{NAME}_disparity_event'} {len(files)} pictures: "
            f"expected as many, of one sequence; {PAGE}"
        )

    given = {"poses": poses, "calibration": calibration, "hand_eye": hand_eye or ""}
    windows = study.windows_of(NAME, ef.open(events, **given), SEQUENCE, arguments, 0.2, 0.1, "end", times)
    recording = ef.open(events, **given, t0=windows.first_ns, t1=windows.end_ns)
    matrices = read_yaml(calibration)
    for group, key in (("disparity_to_depth", "cams_03"), ("extrinsics", "R_rect0")):
        if key not in (matrices.get(group) or {}):
            raise study.DataError(f"{calibration} has no {group}: {key}: expected DSEC's cam_to_cam.yaml; {PAGE}")
    shape = (recording.rig[0].height, recording.rig[0].width)
    truth = study.Truth(times, lambda k: points_of(read_disparity(files[k], shape), matrices), recording.poses, 0.1)

    heads = study.columns("m")
    rows = {name: study.METHODS[name] for name in FIGURES if name in study.METHODS}
    measured = {}
    for method, options in study.methods_of(rows, SEQUENCE, arguments).items():
        row = study.map_row(
            f"{NAME}, {method}", recording, windows, options, (4, 200), arguments.out, truth, MAX_TRUTH_M
        )
        measured[method] = study.numbers(row.errors, heads)
    figures = {name: [float(n) for n in text.split()] for name, text in FIGURES.items()}
    title = f"DSEC {NAME}, windows of 0.2 s: {row.keyframes}"
    study.finish(
        arguments, [study.table(title, [head for head, _, _ in heads], list(study.beside(measured, figures)))]
    )


if __name__ == "__main__":
    parser = study.parser_of(__doc__, "study_dsec", [NAME])
    parser.add_argument("--poses", type=pathlib.Path, help="poses of the LiDAR")
    parser.add_argument("--hand-eye", type=pathlib.Path, help="default: cam_to_lidar.yaml; none: poses of the camera")
    study.run(main, parser)
