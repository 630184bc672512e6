#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The paper's depth and confidence maps on TUM-VIE: tumvie.py FOLDER.

Data set: S. Klenk et al., "TUM-VIE: The TUM Stereo Visual-Inertial Event Dataset", IROS 2021.
Page:     https://cvg.cit.tum.de/data/datasets/visual-inertial-event-dataset. Licence: see the page.
Files:    NAME-events_left.h5, NAME-events_right.h5, and NAME-vi_gt_data.tar.gz unpacked into NAME-vi_gt_data;
          camera-calibrationA.json and mocap-imu-calibrationA.json, with B for the sequences of calibration B.
          | sequence   | left   | right  | vi_gt_data |
          | mocap-6dof | 1.2 GB | 1.2 GB | 0.19 GB |
          | mocap-desk2| 1.4 GB | 1.3 GB | 0.17 GB |
          | skate-easy | 4.5 GB | 4.5 GB | 0.62 GB |
          | bike-easy  | 16.9 GB| 16.8 GB| 2.7 GB  |

The data set has no true depth, and the paper shows pictures: windows of 0.5 s, some 10 million events. The table
has the number of depths, the part of the pixels that has one, and the quality that the program finds by the map's
own evidence.

skate-easy and bike-easy left the motion-capture room: the paper has their poses from a visual-inertial odometry
(Basalt) of the frames and the IMU, which are not in the data set. Compute them, and give them as poses of the IMU
by --poses, with --hand-eye for T_imu_cam of the left event camera (YAML with T_body_rig). These two sequences are
left out if there is no --poses; with it, name one of them by --sequence.

What the paper leaves out: the times of its pictures. The authors' files have 10 to 22 s for mocap-desk2, which is
used for mocap-6dof, too. Their times of skate-easy and bike-easy (1 to 20 s) are in pieces of bags (1, and 3 to
5) whose beginning is not known: here 1 to 20 s of the whole sequence. Their reference view is at the window's
end, and in the room at its middle. C is 7 in mocap-desk2, and 5 in the other files; bike-easy ends at 100 m
there, and in the paper at 200 m. The clock offsets in the JSON files are not applied."""

from __future__ import annotations

import argparse
import pathlib

import _study as study
import event_fusion as ef

PAGE = "download it from https://cvg.cit.tum.de/data/datasets/visual-inertial-event-dataset"
SEQUENCES = {
    "mocap-6dof": (study.PaperSequence(10, 22, 0.45, 4, 7), "A", "middle"),
    "mocap-desk2": (study.PaperSequence(10, 22, 0.45, 4, 7), "A", "middle"),
    "skate-easy": (study.PaperSequence(1, 20, 1, 20, 5), "A", "end"),
    "bike-easy": (study.PaperSequence(1, 20, 3, 200, 5), "B", "end"),
}


def main(arguments: argparse.Namespace) -> None:
    chosen = arguments.sequence or [name for name in SEQUENCES if name.startswith("mocap")]
    if arguments.poses and (arguments.sequence is None or len(chosen) != 1):
        raise study.DataError("--poses has the poses of one sequence: name it by --sequence")
    opened = {}
    for name in chosen:
        events = [study.needed(arguments.folder / f"{name}-events_{side}.h5", PAGE) for side in ("left", "right")]
        in_room = name.startswith("mocap")
        if not in_room and not (arguments.poses and arguments.hand_eye):
            raise study.DataError(
                f"{name} has no poses of the motion capture: compute them, for example with Basalt "
                "(https://gitlab.com/VladyslavUsenko/basalt), and give --poses and --hand-eye"
            )
        letter = arguments.letter or SEQUENCES[name][1]
        calibration = arguments.calibration or arguments.folder / f"camera-calibration{letter}.json"
        hand_eye = arguments.hand_eye or arguments.folder / f"mocap-imu-calibration{letter}.json"
        poses = arguments.poses or arguments.folder / f"{name}-vi_gt_data" / "mocap_data.txt"
        for file in (calibration, hand_eye, poses):
            study.needed(file, PAGE)
        opened[name] = (events, {"poses": poses, "calibration": calibration, "hand_eye": hand_eye})
    rows = []
    for name, (events, given) in opened.items():
        sequence, _, reference = SEQUENCES[name]
        lengths = (arguments.window, arguments.window)  # they do not overlap
        windows = study.windows_of(name, ef.open(events, **given), sequence, arguments, *lengths, reference)
        recording = ef.open(events, **given, t0=windows.first_ns, t1=windows.end_ns)
        rows += study.counted_rows(name, recording, windows, {"H_c∘A_t (Alg. 1)": {}}, sequence, arguments)
    study.finish(arguments, [study.table(f"TUM-VIE, windows of {arguments.window} s", study.COUNTS, rows)])


if __name__ == "__main__":
    parser = study.parser_of(__doc__, "study_tumvie", list(SEQUENCES))
    parser.add_argument("--letter", choices=("A", "B"), help="calibration of the sequence, if not that of the study")
    parser.add_argument("--window", type=float, default=0.5, metavar="S", help="seconds of a window: 0.5")
    parser.add_argument("--poses", type=pathlib.Path, help="instead of mocap_data.txt")
    parser.add_argument("--hand-eye", type=pathlib.Path, help="instead of mocap-imu-calibration*.json")
    study.run(main, parser)
