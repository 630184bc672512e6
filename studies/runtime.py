# SPDX-License-Identifier: BSD-3-Clause
"""The time of a keyframe, and the formula of its complexity (Ghosh and Gallego 2022, Secs. 3.7 and 4.9, Table 6).

The paper: O(N_c N_e N_Z + N_s N_c N_Z N_p + N_Z N_p + N_p N_k): votes, fusion, arg max, threshold. Here votes, fusion and
arg max are one pass, so their costs are fitted to keyframes of many sizes, with one size changed at a time.
"""

from time import process_time

import numpy as np
from lab import PAPER, RULES, Page, between, pick
from matplotlib import pyplot

import event_fusion as ef

# N_e events of each camera, N_c cameras, N_s sub-intervals, N_Z planes, width and height (N_p pixels)
USUAL = dict(events=pick(235_000, 20_000), cameras=2, parts=1, planes=100, scale=1.0)
VARIED = {
    "events": [round(times * USUAL["events"]) for times in pick((0.25, 0.5, 2, 4), (0.25, 0.5))],
    "planes": [50, 200],
    "cameras": [1, 3, 4],
    "parts": [2, 4, 8],
    "scale": [0.5, 2.0],
}
NAMES = {"events": "N_e", "planes": "N_Z", "cameras": "N_c", "parts": "N_s", "scale": "N_p"}


def size_of(sizes):
    return round(346 * sizes["scale"]), round(260 * sizes["scale"])


def prepared(sizes, rule="harmonic"):
    """Return what maps a number of windows of random events, 1 s and 0.5 m of travel, in one thread: processor seconds."""
    (width, height), random = size_of(sizes), np.random.default_rng(1)
    K = np.array([[0.65 * width, 0, width / 2], [0, 0.65 * width, height / 2], [0, 0, 1]])
    cameras, events = [], []
    for camera in range(sizes["cameras"]):
        T_rig_cam = np.eye(4)
        T_rig_cam[0, 3] = 0.1 * camera
        cameras.append(ef.Camera(width, height, K, T_rig_cam=T_rig_cam))
        x, y = (random.integers(0, side, sizes["events"]) for side in (width, height))
        t = np.sort(random.integers(0, 10**9, sizes["events"]))
        events.append(ef.events(x, y, random.integers(0, 2, sizes["events"]), t))
    times, poses = np.arange(0, 1_000_000_001, 1_000_000), np.tile(np.eye(4), (1001, 1, 1))
    poses[:, 0, 3] = np.linspace(0, 0.5, len(times))
    changes = {"fusion.across_cameras": rule, "dsi.num_planes": sizes["planes"], "fusion.subintervals": sizes["parts"]}
    options = {**PAPER, **between(0.8, 8), **changes, "depth.max_confidence": "keyframe", "performance.threads": 1}

    def seconds(windows):
        began = process_time()
        ef.keyframes(cameras, events, (times, poses), [(0, 10**9)] * windows, options)
        return process_time() - began

    return seconds


def milliseconds(cases):
    """Return the time of a keyframe of each case, without the reading of arrays: the least of rounds over all cases."""
    few, many = pick((1, 5), (1, 2))
    least = np.min([[[case(few), case(many)] for case in cases] for _ in range(pick(6, 1))], axis=0)
    return list(1e3 * (least[:, 1] - least[:, 0]) / (many - few))


def terms(sizes):
    """Return the sizes of votes, fusion and arg max in the formula."""
    voxels = sizes["planes"] * np.prod(size_of(sizes))
    return sizes["cameras"] * sizes["events"] * sizes["planes"], sizes["parts"] * sizes["cameras"] * voxels, voxels


def fitted(samples, measured):
    """Return the nanoseconds of each term by least squares of relative errors; terms with negative costs are left out."""
    costs, used = np.zeros(3), [0, 1, 2]
    while True:
        matrix = np.array([[1e-6 * terms(sizes)[i] for i in used] for sizes in samples]) / np.array(measured)[:, None]
        solution = np.linalg.lstsq(matrix, np.ones(len(samples)), rcond=None)[0]
        if solution.min() >= 0:
            costs[used] = solution
            return costs
        used.pop(int(np.argmin(solution)))


page = Page("runtime", "8. Runtime and complexity")
samples = [("", USUAL)] + [(name, {**USUAL, name: value}) for name, values in VARIED.items() for value in values]
measured = milliseconds([prepared(sizes) for _, sizes in samples])
costs = fitted([sizes for _, sizes in samples], measured)
formula = [1e-6 * float(np.dot(costs, terms(sizes))) for _, sizes in samples]

page.text(f"""The paper's sizes: N_e = 235 thousand events of each of N_c = 2 cameras, N_p = 90 thousand pixels, N_Z = 100
    planes. Random events, 0.5 m of travel; processor time of one thread. Fitted: {costs[0]:.2f} ns a vote,
    {costs[1]:.2f} ns a voxel of each input, {costs[2]:.2f} ns a voxel.""")
one, two, halves = (
    next(i for i, (_, s) in enumerate(samples) if s["cameras"] == cameras and s["parts"] == parts and s["events"] == USUAL["events"] and s["planes"] == 100 and s["scale"] == 1)
    for cameras, parts in ((1, 1), (2, 1), (2, 2))
)  # fmt: skip
columns = [samples[i][1] for i in (one, two, halves)]
steps = [[f"{1e-6 * costs[i] * terms(sizes)[i]:.1f}" for sizes in columns] for i in range(3)]
page.table(
    ["step [ms]", "EMVS", "paper", "Alg. 1", "paper", "Alg. 2", "paper"],
    [["DSI creation", steps[0][0], "234.0", steps[0][1], "520.0", steps[0][2], "520.0"],
     ["fusion", steps[1][0], "-", steps[1][1], "51.1", steps[1][2], "98.0"],
     ["arg max", steps[2][0], "36.3", steps[2][1], "35.6", steps[2][2], "35.6"],
     ["measured", f"{measured[one]:.1f}", "", f"{measured[two]:.1f}", "", f"{measured[halves]:.1f}", ""]],
)  # fmt: skip
page.table(["varied", "to", "measured [ms]", "formula [ms]"],
           [[NAMES.get(name, "none"), sizes.get(name, ""), f"{m:.1f}", f"{f:.1f}"] for (name, sizes), m, f in zip(samples, measured, formula)])  # fmt: skip
worst = max(abs(f / m - 1) for f, m in zip(formula, measured))
page.claim("the formula fits all sizes within a quarter", worst <= 0.25, f"{worst:.0%} at worst",
           "It has no sorting into tiles, no caches and no shared passes.")  # fmt: skip
few, many = (measured[samples.index(("planes", {**USUAL, "planes": planes}))] for planes in VARIED["planes"])
fixed = few - (many - few) * VARIED["planes"][0] / (VARIED["planes"][1] - VARIED["planes"][0])
page.claim("two cameras take 1.8 to 2.3 times the time of one", 1.8 <= measured[two] / measured[one] <= 2.3,
           f"{measured[two] / measured[one]:.2f}; paper 2.2",
           f"{fixed:.0f} ms of a keyframe of two cameras depend neither on the planes nor, mostly, on the cameras.")  # fmt: skip
share = costs[0] * terms(USUAL)[0] / np.dot(costs, terms(USUAL))
page.claim("DSI creation takes longest", share > 0.5, f"{share:.0%} of Alg. 1")
by_rule = dict(zip(RULES, milliseconds([prepared(USUAL, rule) for rule in RULES])))
slowest = max(by_rule.values()) / min(by_rule.values())
page.claim("the slowest function of fusion takes at most 1.25 times the fastest", slowest <= 1.25,
           f"{slowest:.2f}; " + ", ".join(f"{rule} {ms:.0f} ms" for rule, ms in by_rule.items()))  # fmt: skip

figure, ax = pyplot.subplots(figsize=(7, 4), layout="constrained")
for name in VARIED:
    of_name = [i for i, (varied, _) in enumerate(samples) if varied in ("", name)]
    ratios = sorted((samples[i][1][name] / USUAL[name], formula[i] / measured[i]) for i in of_name)
    ax.plot(*zip(*ratios), "o-", markersize=3, label=NAMES[name])
ax.axhline(1, color="black", linewidth=0.8)
ax.set(xscale="log", xlabel="size over the paper's", ylabel="formula over measurement", ylim=(0.5, 1.5))
ax.grid(alpha=0.3)
ax.legend(frameon=False, fontsize="small")
page.figure(figure, "The fitted formula over the measured time")
page.write()
