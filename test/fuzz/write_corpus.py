#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the fuzzers' first inputs, with the scripts of test/formats: a recording of two cameras with 60 events each.

    write_corpus.py [CORPUS_FOLDER]    default: corpus beside this file
"""
import pathlib
import subprocess
import sys
import tempfile

import h5py
import numpy as np

HERE = pathlib.Path(__file__).parent
FORMATS = HERE.parent / "formats"


def write_dataset(folder):
    for camera in range(2):
        lines = []
        for i in range(60):
            t_us = 1_000_000 + 700 * (i // 3) + (20_000 if i > 40 else 0)
            lines.append(f"{t_us / 1e6:.9f} {3 * i % 40 + i % 3} {i // 3 % 30 + camera} {i // 6 % 2}\n")
        (folder / f"cam{camera}").mkdir(parents=True)
        (folder / f"cam{camera}/events.txt").write_text("".join(lines))
    (folder / "camchain.yaml").write_text("cam0:\n  resolution: [64, 48]\ncam1:\n  resolution: [64, 48]\n")
    (folder / "poses.txt").write_text("1.0 0 0 0 0 0 0 1\n2.0 0 0 0 0 0 0 1\n")


def run(script, dataset, out):
    subprocess.run([FORMATS / script, dataset, out], check=True)


def write(corpus, name, file, data):
    (corpus / name).mkdir(parents=True, exist_ok=True)
    (corpus / name / file).write_bytes(data)


def write_chunks(path, corpus):
    """Chunks of 500 numbers of two bytes, in each filter of undo_filters.cpp."""
    filters = (dict(compression=32001, compression_opts=(0, 0, 0, 0, 1, 1, 5)), dict(compression="lzf"),
               dict(compression="gzip"), dict(compression="gzip", shuffle=True), dict(compression="lzf", shuffle=True))
    with h5py.File(path, "w") as file:
        for n, options in enumerate(filters):
            numbers = (np.arange(500) * 7 % 346).astype("u2")
            data = file.create_dataset(str(n), data=numbers, chunks=(500,), **options)
            header = bytes([n, 1]) + (numbers.nbytes - 1).to_bytes(2, "little")
            write(corpus, "hdf5_chunks", f"filter{n}", header + data.id.read_direct_chunk((0,))[1])


def main(corpus=HERE / "corpus"):
    corpus = pathlib.Path(corpus)
    with tempfile.TemporaryDirectory() as scratch:
        scratch = pathlib.Path(scratch)
        write_dataset(scratch / "dataset")
        run("write_raw.py", scratch / "dataset", scratch / "raw")
        for kind in ("evt2", "evt21", "evt21_legacy", "evt3"):
            data = (scratch / "raw" / kind / "cam0.raw").read_bytes()
            write(corpus, "raw", kind, data)
            words_at = 0
            while data[words_at:words_at + 2] == b"% ":
                words_at = data.index(b"\n", words_at) + 1
            if kind != "evt21_legacy":
                write(corpus, kind, "words", data[words_at:])
        run("write_aedat4.py", scratch / "dataset", scratch / "aedat4")
        for kind in ("none", "lz4", "zstd"):
            write(corpus, "aedat4", kind, (scratch / "aedat4" / f"{kind}.aedat4").read_bytes())
        write_chunks(scratch / "chunks.h5", corpus)


if __name__ == "__main__":
    main(*sys.argv[1:2])
