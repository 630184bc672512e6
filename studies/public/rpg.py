#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The paper's depth and confidence maps on the RPG sequences of ECCV 2018: rpg.py FOLDER.

Data set: Y. Zhou et al., "Semi-Dense 3D Reconstruction with a Stereo Event Camera", ECCV 2018.
Page:     https://rpg.ifi.uzh.ch/ECCV18_stereo_davis.html (reader.bag), and for the edited bags
          (rpg_monitor_edited.bag, rpg_boxes_edited.bag) https://sites.google.com/view/esvo-project-page/home.
          Licence and sizes: see the pages.
Files:    these bags; camchain.yaml (Kalibr), from the calibration of the page; hand_eye.yaml with T_body_rig,
          4x4: the left camera on the body that the motion capture tracks.

The data set has no true depth, and the paper shows pictures: --figure methods has Algorithm 1, A_t∘H_c and
A_c∘A_t with two sub-intervals, and the monocular method; --figure functions the six fusion functions. The table
has the number of depths, the part of the pixels that has one, and the quality that the program finds by the map's
own evidence.

What the paper leaves out: the windows, and which sequence the figure of the fusion functions shows. The authors'
files have one window of each sequence, from the beginning of the bag (here: from the first event of the left
camera), with the view at its middle: reader 4.8 to 5.6 s (C = 10, median 7), monitor 13.5 to 14.5 s (C = 5,
median 5), boxes 0 to 0.5 s (C = 5, median 5)."""

from __future__ import annotations

import argparse
import pathlib

import _study as study
import event_fusion as ef

PAGE = "download it from https://rpg.ifi.uzh.ch/ECCV18_stereo_davis.html"
ESVO = "download it from https://sites.google.com/view/esvo-project-page/home"
SEQUENCES = {
    "reader": ("reader.bag", PAGE, study.PaperSequence(4.8, 5.6, 0.55, 6.25, 10, 7)),
    "monitor": ("rpg_monitor_edited.bag", ESVO, study.PaperSequence(13.5, 14.5, 0.55, 6.25, 5, 5)),
    "boxes": ("rpg_boxes_edited.bag", ESVO, study.PaperSequence(0, 0.5, 0.55, 6.25, 5, 5)),
}
FIGURES = {
    "methods": {
        name: study.METHODS[name] for name in ("EMVS (monocular)", "H_c∘A_t (Alg. 1)", "A_t∘H_c", "A_c∘A_t")
    },
    "functions": study.FUNCTIONS,
}


def main(arguments: argparse.Namespace) -> None:
    chosen = arguments.sequence or list(SEQUENCES)
    for name in chosen:
        study.needed(arguments.folder / SEQUENCES[name][0], SEQUENCES[name][1])
    calibration = arguments.calibration or arguments.folder / "camchain.yaml"
    hand_eye = arguments.hand_eye or arguments.folder / "hand_eye.yaml"
    study.needed(calibration, f"write the calibration of {PAGE[22:]} as a Kalibr camera chain")
    study.needed(hand_eye, "write the left camera's pose on the tracked body as YAML with T_body_rig, 4x4")
    rows = []
    for name in chosen:
        file, _, sequence = SEQUENCES[name]
        given = {"calibration": calibration, "hand_eye": hand_eye, "topics": arguments.topics or ()}
        recording = ef.open(arguments.folder / file, **given)
        start = sequence.start_s if arguments.start is None else arguments.start
        stop = sequence.stop_s if arguments.stop is None else arguments.stop
        length = round(stop - start, 9)  # one window
        windows = study.windows_of(name, recording, sequence, arguments, length, length)
        recording = ef.open(arguments.folder / file, **given, t0=windows.first_ns, t1=windows.end_ns)
        rows += study.counted_rows(name, recording, windows, FIGURES[arguments.figure], sequence, arguments)
    study.finish(arguments, [study.table("RPG ECCV18, one window of each sequence", study.COUNTS, rows)])


if __name__ == "__main__":
    parser = study.parser_of(__doc__, "study_rpg", list(SEQUENCES))
    parser.add_argument("--figure", choices=FIGURES, default="methods", help="default: methods")
    parser.add_argument("--hand-eye", type=pathlib.Path, help="instead of hand_eye.yaml")
    parser.add_argument("--topics", default="", help="topics of events and poses, if a bag has several")
    study.run(main, parser)
