# SPDX-License-Identifier: BSD-3-Clause
"""What the studies share: the paper's options, the windows, the true depth in a keyframe's view, tables and
pictures.

The paper is S. Ghosh and G. Gallego, "Multi-Event-Camera Depth Estimation and Outlier Rejection by Refocused
Events Fusion", Advanced Intelligent Systems, 2022. "The authors' files" are the option files and the evaluation
script in https://github.com/tub-rip/dvs_mcemvs (mapper_emvs_stereo/cfg and scripts), where the paper's text
leaves a value out."""

from __future__ import annotations

import argparse
import json
import pathlib
import sys
import tempfile
import warnings
from typing import Any, Callable, Iterator, NamedTuple, Optional, Sequence

import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

import event_fusion as ef  # noqa: E402
from event_fusion import plot  # noqa: E402

CALIBRATIONS = pathlib.Path(__file__).resolve().parents[2] / "config" / "calibration"

# Algorithm 1: one sub-interval, the harmonic mean of the cameras, adaptive Gaussian threshold and median filter.
_PAPER = {
    "dsi.num_planes": 100,
    "dsi.spacing": "inverse",
    "fusion.across_cameras": "harmonic",
    "fusion.across_time": "arithmetic",
    "fusion.subintervals": 1,
    "fusion.split_polarity": False,
    "fusion.time_slices": 1,
    "depth.extraction": "paper",
    "depth.threshold_kernel": 5,
    "depth.max_confidence": "sequence",
    "depth.subplane": False,
    "refinement.correct_motion": "false",
}


def _two(cameras: str, time: str, order: str) -> dict[str, Any]:
    return {
        "fusion.across_cameras": cameras,
        "fusion.across_time": time,
        "fusion.order": order,
        "fusion.subintervals": 2,
    }


# The paper's rows, H_c∘A_t: the harmonic mean of the cameras after the arithmetic mean of the sub-intervals.
METHODS: dict[str, dict[str, Any]] = {
    "EMVS (monocular)": {"rig.cameras": "0"},
    "H_c∘A_t (Alg. 1)": {},
    "H_c∘A_t (Alg. 1) + MF": {"depth.dilate": True},
    "H_c∘H_t": _two("harmonic", "harmonic", "time_then_cameras"),
    "H_t∘A_c": _two("arithmetic", "harmonic", "cameras_then_time"),
    "A_c∘H_t": _two("arithmetic", "harmonic", "time_then_cameras"),
    "A_c∘A_t": _two("arithmetic", "arithmetic", "time_then_cameras"),
    "A_t∘H_c": _two("harmonic", "arithmetic", "cameras_then_time"),
    "A_t∘H_c + shuffling": {**_two("harmonic", "arithmetic", "cameras_then_time"), "fusion.shuffle": "shift"},
}
FUNCTIONS = {
    f"{letter}_c∘A_t": {"fusion.across_cameras": rule}
    for letter, rule in zip(
        ("min", "H", "G", "A", "RMS", "max"), ("min", "harmonic", "geometric", "arithmetic", "rms", "max")
    )
}
DEFAULT = "our default options"


class DataError(Exception):
    """The files of a data set are not what a study needs; the text says what to do."""


class PaperSequence(NamedTuple):
    """A sequence of a data set, as the paper and the authors' files use it."""

    start_s: float  # from the first event of the left camera
    stop_s: float
    near_m: float
    far_m: float
    threshold_c: float = 5
    median_size: int = 5


def methods_of(
    rows: dict[str, dict[str, Any]], sequence: PaperSequence, arguments: argparse.Namespace
) -> dict[str, dict[str, Any]]:
    """Return the options of each row: those of the paper, or of --method, our default, or both."""
    names, which = arguments.method or list(rows), arguments.options
    for name in names:
        if name not in rows:
            raise DataError(f"--method {name}: expected one of: {', '.join(rows)}")
    limits = {"dsi.min_depth_m": sequence.near_m, "dsi.max_depth_m": sequence.far_m}
    depth = {"depth.threshold_c": sequence.threshold_c, "depth.median_size": sequence.median_size}
    made = {} if which == "default" else {name: {**_PAPER, **limits, **depth, **rows[name]} for name in names}
    made = made if which == "paper" else {**made, DEFAULT: limits}
    for name in list(made)[:-1]:  # once is enough: the rows have the same poses and cameras
        made[name] = {**made[name], "checks.enabled": False}
    return made


# == Files and windows


def needed(path: pathlib.Path, where: str) -> pathlib.Path:
    """Return a path that exists."""
    if not path.exists():
        raise DataError(f"{path} is missing: {where}")
    return path


class Windows(NamedTuple):
    first_ns: int
    count: int
    duration_s: float
    stride_s: float
    reference: str  # middle or end

    @property
    def end_ns(self) -> int:
        """The end of the last window, and a bit more: windows begin at an event, so they may end later."""
        return self.first_ns + round(1e9 * (self.duration_s + (self.count - 0.95) * self.stride_s))

    def options(self) -> dict[str, Any]:
        return {
            "keyframes.policy": "period",
            "keyframes.window_s": self.duration_s,
            "keyframes.stride_s": self.stride_s,
            "keyframes.reference": self.reference,
        }


def first_event(recording: ef.Recording, name: str) -> int:
    for events in recording.events(0, chunk=1):
        return int(events["t"][0])
    raise DataError(f"{name}: the left camera has no event")


def windows_of(
    name: str,
    recording: ef.Recording,
    sequence: PaperSequence,
    arguments: argparse.Namespace,
    duration_s: float,
    stride_s: float,
    reference: str = "middle",
    truth_ns: Optional[np.ndarray] = None,
) -> Windows:
    """Return the windows of a sequence. With a truth, the first reference time is that of a true depth map."""
    begin = first_event(recording, name)
    first = begin + round(1e9 * (sequence.start_s if arguments.start is None else arguments.start))
    stop = begin + round(1e9 * (sequence.stop_s if arguments.stop is None else arguments.stop))
    if stop - first < round(1e9 * duration_s):
        raise DataError(f"{name}: from --start to --stop is less than a window of {duration_s} s")
    to_reference = round(1e9 * duration_s / (1 if reference == "end" else 2))
    if truth_ns is not None:
        last = stop - round(1e9 * duration_s) + to_reference
        inside = truth_ns[(truth_ns >= first + to_reference) & (truth_ns <= last)]
        if len(inside) == 0:
            raise DataError(
                f"{name}: the true depths are from {truth_ns.min() / 1e9:.3f} to {truth_ns.max() / 1e9:.3f} s, and "
                f"the windows from {first / 1e9:.3f} to {stop / 1e9:.3f} s: are both of the same sequence?"
            )
        first = int(inside[0]) - to_reference
    count = int((stop - first - 1e9 * duration_s) / (1e9 * stride_s) + 1e-6) + 1
    return Windows(first, min(count, arguments.windows or count), duration_s, stride_s, reference)


# == True depth


def rays(camera: ef.Camera) -> np.ndarray:
    """Return the viewing ray (x/z, y/z, 1) of each pixel, rows × columns × 3; NaN where the lens has none."""
    v, u = np.mgrid[: camera.height, : camera.width]
    K, c = camera.K, [*camera.coefficients, 0, 0, 0, 0, 0][:5]
    distorted = np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1]], -1)
    ray = distorted.copy()
    if camera.distortion == "equidistant":  # r_d = θ (1 + c0 θ² + …); Newton's method
        r_d = np.hypot(*np.moveaxis(distorted, -1, 0))
        θ = np.minimum(r_d, 1.4)
        for _ in range(20):
            bent = θ * (1 + θ**2 * (c[0] + θ**2 * (c[1] + θ**2 * (c[2] + θ**2 * c[3]))))
            slope = 1 + θ**2 * (3 * c[0] + θ**2 * (5 * c[1] + θ**2 * (7 * c[2] + θ**2 * 9 * c[3])))
            θ = np.clip(θ - (bent - r_d) / np.where(slope > 0.1, slope, 0.1), 0, 1.5)
        ray = distorted * (np.tan(θ) / np.maximum(r_d, 1e-12))[..., None]
        ray[np.abs(bent - r_d) > 1e-4] = np.nan
    elif camera.distortion != "none":  # radtan; fixed point
        for _ in range(40):
            x, y = np.moveaxis(ray, -1, 0)
            r2 = x * x + y * y
            radial = 1 + r2 * (c[0] + r2 * (c[1] + r2 * c[4]))
            shift = [2 * c[2] * x * y + c[3] * (r2 + 2 * x * x), c[2] * (r2 + 2 * y * y) + 2 * c[3] * x * y]
            ray = (distorted - np.stack(shift, -1)) / radial[..., None]
    return np.concatenate([ray, np.ones_like(ray[..., :1])], -1)


def in_view(points: np.ndarray, K: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Return the depth map of points (n, 3) of a view: the nearest point of each pixel; 0: none."""
    points = points[np.isfinite(points).all(1) & (points[:, 2] > 0)]
    points = points[np.argsort(-points[:, 2], kind="stable")]
    u, v = (np.rint(points[:, k] / points[:, 2] * K[k, k] + K[k, 2]).astype(int) for k in (0, 1))
    inside = (u >= 0) & (u < shape[1]) & (v >= 0) & (v < shape[0])
    depth = np.zeros(shape, "f4")
    depth[v[inside], u[inside]] = points[inside, 2]
    return depth


def pose_at(poses: tuple[np.ndarray, np.ndarray], t: int) -> Optional[np.ndarray]:
    """Return T_world_rig between two poses, or None outside of them."""
    times, matrices = poses
    after = int(np.searchsorted(times, t))
    if after == len(times) or (after == 0 and times[0] != t):
        return None
    if times[after] == t:
        return matrices[after]
    a, b = matrices[after - 1], matrices[after]
    part = float(t - times[after - 1]) / float(times[after] - times[after - 1])
    turn = a[:3, :3].T @ b[:3, :3]
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    sine = np.linalg.norm(axis)
    angle = np.arctan2(sine, (np.trace(turn) - 1) / 2)
    x, y, z = axis / max(sine, 1e-12)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    made = np.eye(4)
    made[:3, :3] = a[:3, :3] @ (
        np.eye(3) + np.sin(part * angle) * cross + (1 - np.cos(part * angle)) * cross @ cross
    )
    made[:3, 3] = (1 - part) * a[:3, 3] + part * b[:3, 3]
    return made


class Truth:
    """True depth maps: the nearest in time, at most max_gap_s away, carried to the keyframe's view by the poses.

    The paper's evaluation takes the nearest map as it is; carrying changes the more, the faster the camera moves."""

    def __init__(
        self,
        times_ns: np.ndarray,
        points_of: Callable[[int], np.ndarray],
        poses: tuple[np.ndarray, np.ndarray],
        max_gap_s: float,
    ):
        self.times_ns, self.points_of, self.poses, self.max_gap_s = times_ns, points_of, poses, max_gap_s

    def __call__(self, keyframe: ef.Keyframe) -> Optional[np.ndarray]:
        nearest = int(np.argmin(np.abs(self.times_ns - keyframe.t)))
        T_world_cam = pose_at(self.poses, int(self.times_ns[nearest]))
        if T_world_cam is None or abs(int(self.times_ns[nearest]) - keyframe.t) > 1e9 * self.max_gap_s:
            return None
        T_ref_cam = np.linalg.inv(keyframe.pose) @ T_world_cam
        points = self.points_of(nearest).reshape(-1, 3)
        return in_view(points @ T_ref_cam[:3, :3].T + T_ref_cam[:3, 3], keyframe.K, keyframe.depth.shape)


# == Mapping and comparing


class Row(NamedTuple):
    errors: Optional[dict[str, Any]]  # of evaluate.depth, over all points
    keyframes: int
    depths: int
    pixels: int
    quality: str


def map_row(
    title: str,
    recording: ef.Recording,
    windows: Windows,
    options: dict[str, Any],
    limits: tuple[float, float],
    out: pathlib.Path,
    truth: Optional[Truth] = None,
    max_depth: Optional[float] = None,
) -> Row:
    """Map the windows, compare the depth maps with the truth, and draw the first, middle and last keyframe."""
    print(f"{title}: windows: {windows.count}", file=sys.stderr)
    with tempfile.TemporaryDirectory(dir=out) as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore", ef.EventFusionWarning)  # they are printed below
        estimates, truths = pathlib.Path(folder, "estimate"), pathlib.Path(folder, "truth")
        estimates.mkdir()
        truths.mkdir()
        made = ef.map(recording, {**windows.options(), **options}, keep=False, progress=sys.stderr.isatty())
        keyframes = depths = pixels = compared = 0
        for keyframe in made:
            true = truth(keyframe) if truth else None
            if true is not None and (true > 0).any():
                name = f"{keyframe.t // 10**9}.{keyframe.t % 10**9:09}.npy"
                np.save(estimates / name, keyframe.depth)
                np.save(truths / name, true)
                compared += 1
            if keyframes in (0, windows.count // 2, windows.count - 1):
                draw(keyframe, true, limits, out / "pictures" / f"{_file_name(title)}_{keyframe.t / 1e9:.3f}.png")
            keyframes, pixels = keyframes + 1, pixels + keyframe.depth.size
            depths += int((keyframe.depth > 0).sum())
        report = made.report
        for name, text in made.warnings:
            print(f"  warning {name}: {text}", file=sys.stderr)
        if truth and compared == 0:
            raise DataError(f"{title}: no keyframe has true depths in its view within {truth.max_gap_s} s")
        (estimates / "report.json").write_text(json.dumps(report))  # focal length and baseline, for bad-pix
        errors = ef.evaluate.depth(estimates, truths, max_depth=max_depth) if truth and depths else None
    if errors:
        plot.precision_recall(errors).figure.savefig(out / "pictures" / f"{_file_name(title)}_precision_recall.png")
        plt.close("all")
    return Row(errors["all"] if errors else None, keyframes, depths, pixels, report["quality"]["word"])


COUNTS = ("keyframes", "depths", "pixels with a depth [%]", "quality")


def counted_rows(
    name: str,
    recording: ef.Recording,
    windows: Windows,
    rows: dict[str, dict[str, Any]],
    sequence: PaperSequence,
    arguments: argparse.Namespace,
) -> Iterator[tuple[str, Sequence[Any]]]:
    """Map a sequence without true depth by each method, and yield rows with the columns COUNTS."""
    limits = (sequence.near_m, sequence.far_m)
    for method, options in methods_of(rows, sequence, arguments).items():
        row = map_row(f"{name}, {method}", recording, windows, options, limits, arguments.out)
        quality = "–" if options.get("checks.enabled") is False else row.quality
        yield f"{name}, {method}", (row.keyframes, row.depths, 100 * row.depths / row.pixels, quality)


def _file_name(title: str) -> str:
    return "_".join("".join(letter if letter.isalnum() else " " for letter in title).split())


def draw(
    keyframe: ef.Keyframe, true: Optional[np.ndarray], limits: tuple[float, float], file: pathlib.Path
) -> None:
    """Draw depth and confidence of a keyframe; with a truth, also the truth and the error."""
    file.parent.mkdir(parents=True, exist_ok=True)
    count = 2 if true is None else 4
    figure, axes = plt.subplots(1, count, figsize=(5 * count, 4), layout="constrained")
    plot.depth(keyframe, axes[0], limits=limits)
    plot.confidence(keyframe, axes[1])
    if true is not None:
        plot.depth(true, axes[2], limits=limits).set_title("truth", fontsize="medium")
        plot.error(keyframe, true, axes[3])
    figure.savefig(file)
    plt.close(figure)


def columns(unit: str) -> list[tuple[str, str, float]]:
    """Return head, key of evaluate.depth and factor. The authors' script divides AErrR by the estimate."""
    length = {"cm": 100.0, "m": 1.0}[unit]
    return [
        (f"mean [{unit}]", "mean_abs_m", length),
        (f"median [{unit}]", "median_abs_m", length),
        ("bad-pix [%]", "bad_pix_5px", 100),
        ("SILog ×100", "silog", 1),
        ("AErrR [%]", "aerrr_by_estimate", 100),
        ("log RMSE ×100", "log_rmse", 1),
        ("δ<1.25 [%]", "delta_1", 100),
        ("δ<1.25² [%]", "delta_2", 100),
        ("δ<1.25³ [%]", "delta_3", 100),
        ("points [million]", "points", 1e-6),
    ]


def numbers(errors: Optional[dict[str, Any]], heads: Sequence[tuple[str, str, float]]) -> list[float]:
    """Return a row of the table; NaN where nothing was compared, and for bad-pix with a single camera."""
    found = errors or {"points": 0}
    return [found.get(key, float("nan")) * factor for _, key, factor in heads]


def table(title: str, heads: Sequence[str], rows: Sequence[tuple[str, Sequence[Any]]]) -> str:
    """Return a Markdown table. Numbers of the last column have four decimals, others two."""
    lines = [f"## {title}", "", "| | " + " | ".join(heads) + " |", "|---|" + "---:|" * len(heads)]
    for name, values in rows:
        cells = [
            value if isinstance(value, str)
            else str(value) if isinstance(value, int)
            else "–" if np.isnan(value)
            else f"{value:.{4 if 'million' in head else 2}f}"
            for head, value in zip(heads, values)
        ]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def beside(
    measured: dict[str, Sequence[float]], paper: dict[str, Sequence[float]]
) -> Iterator[tuple[str, Sequence[float]]]:
    """Yield the rows of the paper and, below each, the measured one."""
    for name in [*paper, *(name for name in measured if name not in paper)]:
        if name in paper:
            yield f"{name}, paper", paper[name]
        if name in measured:
            yield f"{name}, measured", measured[name]


# == The command line


def parser_of(doc: str, out: str, sequences: Sequence[str]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path, metavar="FOLDER", help="the folder of the downloaded files")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path(out), help=f"folder of the results: {out}")
    parser.add_argument("--sequence", action="append", choices=sequences, help="may be repeated; default: all")
    parser.add_argument("--windows", type=int, metavar="N", help="only the first N windows of each sequence")
    parser.add_argument("--options", choices=("paper", "default", "both"), default="both", help="default: both")
    parser.add_argument("--method", action="append", metavar="NAME", help="only this row; may be repeated")
    parser.add_argument("--start", type=float, metavar="S", help="seconds from the first event")
    parser.add_argument("--stop", type=float, metavar="S", help="see --start")
    parser.add_argument("--calibration", type=pathlib.Path, help="instead of the data set's file")
    return parser


def finish(arguments: argparse.Namespace, tables: Sequence[str]) -> None:
    """Print the tables and write them to table.md."""
    text = "\n".join(tables)
    print(text)
    (arguments.out / "table.md").write_text(text)


def run(main: Callable[[argparse.Namespace], None], parser: argparse.ArgumentParser) -> None:
    """Run a study. Errors of data and arguments are one sentence, with exit status 1."""
    arguments = parser.parse_args()
    try:
        needed(arguments.folder, "give the folder of the downloaded files")
        if arguments.windows is not None and arguments.windows < 1:
            raise DataError(f"--windows {arguments.windows}: expected 1 or above")
        arguments.out.mkdir(parents=True, exist_ok=True)
        main(arguments)
    except (DataError, OSError, ValueError) as error:
        print(f"{parser.prog}: {' '.join(str(error).split())}", file=sys.stderr)
        sys.exit(1)
