#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Costs of the Python package, measured: python_bench.py PROGRAM RECORDING [EVENTS_OF_THE_LARGE_FILE].

Prints the processor time of keyframes from arrays against the program's; the memory while events are read, and while
maps are made again and again; the time of two mappers in two threads; and the time to read a large HDF5 file against
h5py alone. RECORDING is a stereo recording of 2 s or more with poses.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import threading
import time

import h5py
import numpy as np

import event_fusion as ef

program, path = sys.argv[1], sys.argv[2]
large = int(float(sys.argv[3])) if len(sys.argv) > 3 else 20_000_000
OPTIONS = {"dsi.min_depth_m": 0.5, "dsi.max_depth_m": 6.5, "dsi.num_planes": 100,
           "keyframes.window_s": 0.5, "keyframes.stride_s": 0.5}


def memory_mb():
    """Return the memory that is in use now."""
    return int(open("/proc/self/statm").read().split()[1]) * resource.getpagesize() / 1e6


def arrays_of(recording):
    """Return all that a mapper takes."""
    return recording.rig, [np.concatenate(list(recording.events(c))) for c in range(len(recording.rig))], recording.poses


def map_arrays(rig, events, poses, options):
    mapper = ef.Mapper(options)
    for camera in rig:
        mapper.add_camera(camera)
    mapper.add_poses(*poses)
    for camera, part in enumerate(events):
        mapper.add_events(camera, part)
    mapper.finish()
    return mapper


def keyframe_cost(arrays):
    shares = []
    for _ in range(5):
        with tempfile.TemporaryDirectory() as out:
            settings = [f"--set={key}={value}" for key, value in OPTIONS.items()]
            subprocess.run([program, "map", path, "-q", "--force", "--out", out, *settings], check=True)
            report = json.load(open(os.path.join(out, "report.json")))
        cpu = report["cpu_seconds"]
        of_program = cpu["once"]["tables"] + cpu["events"]["filter"]
        of_program += sum(cpu["keyframes"][stage] for stage in ("sweep", "depth", "refine", "map"))
        begin = time.process_time()
        map_arrays(*arrays, OPTIONS)
        shares.append((time.process_time() - begin, of_program))
    python, of_program = np.median(shares, axis=0)
    keyframes = report["keyframes"]
    each = [len(events) / keyframes for events in arrays[1]]
    print(f"keyframe of {' + '.join(f'{n:.0f}' for n in each)} events: {python / keyframes:.4f} s from arrays, "
          f"{of_program / keyframes:.4f} s by the program without reading and writing: {python / of_program:.3f} times")


def thread_gain(arrays):
    one = {**OPTIONS, "performance.threads": 1}
    begin = time.perf_counter()
    for _ in range(2):
        map_arrays(*arrays, one)
    in_turn = time.perf_counter() - begin
    threads = [threading.Thread(target=map_arrays, args=(*arrays, one)) for _ in range(2)]
    begin = time.perf_counter()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    print(f"two mappers of one thread: {in_turn:.2f} s in turn, {time.perf_counter() - begin:.2f} s in two threads")


def leak():
    with tempfile.TemporaryDirectory() as folder:
        ef.simulate("slider", duration=0.05, out=folder + "/slider")
        used = []
        for i in range(1001):
            recording = ef.open(folder + "/slider")
            made = ef.map(recording, {"dsi.min_depth_m": 0.5, "dsi.max_depth_m": 5, "keyframes.window_s": 0.04})
            assert len(made.keyframes) > 0 and sum(len(part) for part in recording.events()) > 0
            if i % 200 == 0:
                used.append(round(memory_mb()))
        print("memory after 0, 200, … 1000 opens and maps:", *used, "MB")


def reading(count):
    with tempfile.TemporaryDirectory() as folder:
        file = folder + "/large.h5"
        random = np.random.default_rng(1)
        part = 5_000_000
        with h5py.File(file, "w") as h5:
            sets = {name: h5.create_dataset(f"events/{name}", (count,), kind, chunks=(100_000,))
                    for name, kind in (("x", "u2"), ("y", "u2"), ("p", "u1"), ("t", "i8"))}
            for begin in range(0, count, part):
                n = min(part, count - begin)
                sets["x"][begin : begin + n] = random.integers(0, 640, n)
                sets["y"][begin : begin + n] = random.integers(0, 480, n)
                sets["p"][begin : begin + n] = random.integers(0, 2, n)
                sets["t"][begin : begin + n] = np.arange(begin, begin + n)  # microseconds
        begin = time.perf_counter()
        with h5py.File(file) as h5:
            for at in range(0, count, 1_000_000):
                for name in "xypt":
                    h5[f"events/{name}"][at : at + 1_000_000]
        alone = time.perf_counter() - begin
        before, most, read = memory_mb(), 0.0, 0
        begin = time.perf_counter()
        for events in ef.open(file, sensor_size=(640, 480)).events():
            read += len(events)
            most = max(most, memory_mb())
        ours = time.perf_counter() - begin
        assert read == count
        print(f"{count} events of HDF5: {ours:.2f} s, h5py alone {alone:.2f} s: {ours / alone:.2f} times; "
              f"memory {before:.0f} MB before, up to {most:.0f} MB")


arrays = arrays_of(ef.open(path))
keyframe_cost(arrays)
thread_gain(arrays)
reading(large)
leak()
