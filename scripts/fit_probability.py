#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fit the networks that give a depth its probability (mapping/depth/depth_probability.h) to simulated recordings.

    PYTHONPATH=build/release/python scripts/fit_probability.py candidates WORK_FOLDER
    cmake --build --preset release        # the inputs of the second network depend on the first one
    PYTHONPATH=build/release/python scripts/fit_probability.py neighbours WORK_FOLDER
    PYTHONPATH=build/release/python scripts/fit_probability.py check WORK_FOLDER

The first and the second command write mapping/depth/probability_weights.h. The third maps recordings with seeds of
their own, and prints how often depths are right, by probability. A depth is right if it is within 10 % of the true
depth of its pixel or of one of the eight pixels around it. `event-fusion` must be in PATH, for recordings that are
no presets.
"""
from __future__ import annotations

import argparse
import pathlib
import re
import subprocess

import event_fusion as ef
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
WEIGHTS = ROOT / "mapping/depth/probability_weights.h"
WINDOWS_S = (0.1, 0.2, 0.5)
WINDOWS_OF_EACH = 7
POINTS_OF_A_WINDOW = 6000
FEW_EVENTS = 0.15  # per pixel and camera: a fault that the fit includes, with a weight of
FEW_WEIGHT = 0.3
NETWORKS = {"candidates": ("kCandidateNetwork", 16), "neighbours": ("kNeighbourNetwork", 8)}

Rows = "tuple[np.ndarray, np.ndarray, np.ndarray]"  # inputs, whether the depth is right, weights


def recordings(work: pathlib.Path, seed: int) -> list[pathlib.Path]:
    """Simulate the seven presets, a desk with a noisy sensor, and two scenes around a path. Folders that are there stay."""
    made = []

    def simulate(name: str, *arguments: str) -> None:
        folder = work / f"{name}_{seed}"
        made.append(folder)
        if folder.exists():
            return
        print("simulating", folder, flush=True)
        subprocess.run(["event-fusion", "simulate", "-q", *arguments, "--out", str(folder)], check=True)

    for preset in ef.simulation_presets():
        long = ("--duration", "3") if preset == "room_stereo" else ()
        simulate(preset, "--preset", preset, "--seed", str(seed), *long)
    noisy = "--threshold-on 0.2 --threshold-off 0.24 --mismatch 0.05 --noise-hz 1 --refractory-us 100"
    simulate("desk_noisy", "--preset", "desk_stereo", "--seed", str(seed + 1), *noisy.split())
    for scene, preset in (("street", "desk_stereo"), ("room", "trinocular")):
        path = work / f"{preset}_{seed}"
        simulate(
            f"{scene}_{preset}", "--scene", scene, "--trajectory", str(path / "poses.txt"), "--calibration",
            str(path / "camchain.yaml"), "--duration", "1", "--seed", str(seed),
        )  # fmt: skip
    return made


def errors_of(depth: np.ndarray, x: np.ndarray, y: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return relative errors, each against the best truth within a pixel; NaN without a truth there."""
    rows, columns = truth.shape
    best = np.full(len(depth), np.inf)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            near = truth[np.clip(y + dy, 0, rows - 1), np.clip(x + dx, 0, columns - 1)]
            with np.errstate(divide="ignore", invalid="ignore"):
                error = np.abs(depth / near - 1)
            best = np.fmin(best, np.where(near > 0, error, np.inf))
    return np.where(np.isfinite(best), best, np.nan)


def windows_of(folder: pathlib.Path, recording: ef.Recording, length_s: float) -> list[int]:
    """Return the times of true depth maps in the middle of windows that fit, evenly chosen."""
    info = recording.info()
    first = max(camera["first_ns"] for camera in info["cameras"]) + round(length_s / 2 * 1e9)
    last = min(camera["last_ns"] for camera in info["cameras"]) - round(length_s / 2 * 1e9)
    names = [file.stem for file in (folder / "depth").glob("cam0_*.tiff")]
    times = sorted(round(float(name.removeprefix("cam0_")) * 1e9) for name in names)
    times = [t for t in times if first <= t <= last]
    chosen = np.unique(np.linspace(0, len(times) - 1, WINDOWS_OF_EACH).round().astype(int)) if times else []
    return [times[i] for i in chosen]


def depths_in(folder: pathlib.Path, length_s: float, few: bool = False, options: dict[str, object] | None = None):
    """Yield candidates and neighbours of each window, and the true depth map."""
    recording = ef.open(folder)
    chosen = {f"dsi.{of['key']}": of["value"] for of in recording.info()["chosen"] if "plane" in of["key"] or "depth" in of["key"]}
    chosen = {key: int(value) if key == "dsi.num_planes" else value for key, value in chosen.items()}
    if few:
        pixels = recording.rig[0].width * recording.rig[0].height
        chosen["keyframes.max_events_per_camera"] = int(FEW_EVENTS * pixels)
    for t in windows_of(folder, recording, length_s):
        half = round(length_s / 2 * 1e9)
        found = ef.candidates(recording, t - half, t + half, {**chosen, **(options or {})}, t_ref=t)
        yield found, ef.evaluate.true_depth(folder, t)


def judged(depths: np.ndarray, truth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the pixels that may be kept and have a truth, and whether their depths are right."""
    errors = errors_of(depths["depth"], depths["x"], depths["y"], truth)
    known = np.isfinite(errors) & (depths["probability"] > 0)
    return depths[known], errors[known] < 0.1


def rows_of(depths: np.ndarray, truth: np.ndarray, weight: float, random: np.random.Generator) -> Rows:
    depths, right = judged(depths, truth)
    known = np.arange(len(depths))
    if len(known) > POINTS_OF_A_WINDOW:
        known = random.choice(known, POINTS_OF_A_WINDOW, replace=False)
    return depths["inputs"][known], right[known], np.full(len(known), weight / max(1, len(known)))


def collect(work: pathlib.Path, network: str, seed: int) -> Rows:
    random = np.random.default_rng(seed)
    parts = []
    for folder in recordings(work, seed):
        for length_s in WINDOWS_S:
            for few in (False, True) if length_s == 0.2 else (False,):
                for found, truth in depths_in(folder, length_s, few):
                    parts.append(rows_of(getattr(found, network), truth, FEW_WEIGHT if few else 1, random))
            print(folder.name, length_s, len(parts), "windows", flush=True)
    inputs, right, weights = (np.concatenate(part) for part in zip(*parts))
    return inputs.astype(np.float64), right, weights


def fit(inputs: np.ndarray, right: np.ndarray, weights: np.ndarray, hidden: int) -> dict[str, np.ndarray]:
    """Minimise the log loss: Adam, 25 epochs, batches of 1024, a cosine step from 3e-3, weight decay 1e-5."""
    random = np.random.default_rng(1)
    weights = weights / weights.mean()
    mean = np.average(inputs, axis=0, weights=weights)
    sd = np.sqrt(np.average((inputs - mean) ** 2, axis=0, weights=weights))
    z = np.clip((inputs - mean) / sd, -5, 5)
    network = {
        "w1": random.normal(0, 1 / np.sqrt(z.shape[1]), (z.shape[1], hidden)),
        "b1": np.zeros(hidden),
        "w2": random.normal(0, 1 / np.sqrt(hidden), hidden),
        "b2": np.zeros(1),
    }
    moments = {key: [np.zeros_like(value), np.zeros_like(value)] for key, value in network.items()}
    epochs, batch = 25, 1024
    steps = epochs * (len(z) // batch)
    step = 0
    for _ in range(epochs):
        order = random.permutation(len(z))
        for begin in range(0, len(z) - batch + 1, batch):
            rows = order[begin : begin + batch]
            inner = np.tanh(z[rows] @ network["w1"] + network["b1"])
            p = 1 / (1 + np.exp(-(inner @ network["w2"] + network["b2"])))
            of_logit = weights[rows] * (p - right[rows]) / batch
            of_inner = of_logit[:, None] * network["w2"] * (1 - inner**2)
            slopes = {"w1": z[rows].T @ of_inner, "b1": of_inner.sum(0), "w2": inner.T @ of_logit, "b2": of_logit.sum(keepdims=True)}
            rate = 3e-3 * 0.5 * (1 + np.cos(np.pi * step / steps))
            step += 1
            for key, slope in slopes.items():
                first, second = moments[key]
                first += 0.1 * (slope - first)
                second += 0.001 * (slope**2 - second)
                change = first / (1 - 0.9**step) / (np.sqrt(second / (1 - 0.999**step)) + 1e-8)
                network[key] -= rate * (change + 1e-5 * network[key])
    return {"mean": mean, "sd": sd, **network}


def write(network: dict[str, np.ndarray], name: str) -> None:
    """Replace one network of the header."""

    def row(values: np.ndarray) -> str:
        return "{" + ", ".join(f"{value:.5g}F" if re.search("[.e]", f"{value:.5g}") else f"{value:.5g}.0F" for value in values) + "}"

    parts = [row(network["mean"]), row(network["sd"]), "{{" + ", ".join(map(row, network["w1"])) + "}}", row(network["b1"]), row(network["w2"]), row(network["b2"])[1:-1]]
    text = WEIGHTS.read_text()
    pattern = re.compile(rf"({name} = ){{.*?}};", re.S)
    assert pattern.search(text), name
    WEIGHTS.write_text(pattern.sub(lambda found: found[1] + "{" + ", ".join(parts) + "};", text))
    subprocess.run(["clang-format", "-i", str(WEIGHTS)], check=True)


def reliability(p: np.ndarray, right: np.ndarray, weights: np.ndarray) -> str:
    edges = [0, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 1]
    bins = zip(edges, edges[1:])
    shares = []
    for low, high in bins:
        within = (p >= low) & (p < high)
        if within.any():
            shares.append(f"{np.average(p[within], weights=weights[within]):.3f} {np.average(right[within], weights=weights[within]):.3f}")
    return "; ".join(shares)


def check(work: pathlib.Path, seed: int, options: dict[str, object], few: bool) -> None:
    """Print, for each recording: candidates, kept ones, wrong ones, and what the probability expected."""
    tallies = {network: [] for network in NETWORKS}
    print("recording             network      all    kept p > 0.9   wrong %   expected %")
    for folder in recordings(work, seed):
        of_recording = {network: [] for network in NETWORKS}
        for length_s in WINDOWS_S[:2] if "hd" in folder.name else WINDOWS_S:
            for found, truth in depths_in(folder, length_s, few, options):
                for network in NETWORKS:
                    depths, right = judged(getattr(found, network), truth)
                    of_recording[network].append((depths["probability"], right))
        for network, parts in of_recording.items():
            p, right = (np.concatenate(part) for part in zip(*parts))
            kept = p > 0.9
            wrong = 100 * (1 - right[kept].mean()) if kept.any() else float("nan")
            expected = 100 * (1 - p[kept].mean()) if kept.any() else float("nan")
            print(f"{folder.name:22}{network:11}{len(p):8}{kept.sum():10}{wrong:12.2f}{expected:12.2f}", flush=True)
            tallies[network] += [(p, right, np.full(len(p), 1 / max(1, len(p)))) for p, right in parts]
    for network, parts in tallies.items():
        print(network, "mean p and share of right depths, windows equal:", reliability(*(np.concatenate(part) for part in zip(*parts))))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("step", choices=[*NETWORKS, "check"])
    parser.add_argument("work", type=pathlib.Path, help="a folder for the simulated recordings, some 6 GB")
    parser.add_argument("--seed", type=int, help="of the recordings; by default 4711, and 5005 to check")
    parser.add_argument("--few", action="store_true", help="check with 0.15 events per pixel and camera")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="an option, to check with others")
    given = parser.parse_args()
    given.work.mkdir(parents=True, exist_ok=True)
    if given.step == "check":
        check(given.work, given.seed or 5005, dict(of.split("=", 1) for of in given.set), given.few)
        return
    name, hidden = NETWORKS[given.step]
    rows = collect(given.work, given.step, given.seed or 4711)
    network = fit(*rows, hidden)
    write(network, name)


if __name__ == "__main__":
    main()
