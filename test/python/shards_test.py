# SPDX-License-Identifier: BSD-3-Clause
"""A recording that is mapped in shards, and joined: the result is that of one run."""

import json
import os
import subprocess
import sys

import pytest

import event_fusion as ef

DESK = os.path.join(os.environ["EFM_RECORDINGS"], "desk_stereo")
OPTIONS = {"dsi.num_planes": 20, "dsi.min_depth_m": 0.5, "dsi.max_depth_m": 5, "keyframes.window_s": 0.1, "keyframes.stride_s": 0.024,
           "refinement.enabled": True, "refinement.max_points": 100, "output.camera_maps": True}  # fmt: skip
SETS = [f"--set={key}={str(value).lower()}" for key, value in OPTIONS.items()]
TIMES = ["seconds", "cpu_seconds", "votes_per_second", "peak_memory_bytes", "session", "threads"]


def program(*words, status=0, env=None):
    words = [os.environ["EFM_EVENT_FUSION"], *map(str, words)]
    result = subprocess.run(words, capture_output=True, text=True, env={**os.environ, **(env or {})})
    assert result.returncode == status, result.stderr
    return result.stdout + result.stderr


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """One run, and a plan of three shards, of which the last is empty, with the folders of the others."""
    folder = tmp_path_factory.mktemp("shards")
    program("map", DESK, *SETS, "--out", folder / "one", "-q")
    text = program("plan", DESK, *SETS, "--shards", 3, "--out", folder / "plan.json")
    keyframes = len(ef.Session(folder / "one"))
    assert 64 < keyframes <= 128 and f"{keyframes} keyframes in 3 shards" in text and "empty: the last 1 of them" in text
    assert "a shard reads its part" in text
    assert parallel(folder, os.environ["EFM_EVENT_FUSION"]).returncode == 0
    return folder


def parallel(folder, name, *words):
    """Runs docs/cluster.md's command: GNU parallel counts from 1, so that the first shard is in s1."""
    options = ["--jobs", "2", "--joblog", folder / "jobs.log", "--retries", "2", *words, "-N0"]
    command = f"{name} map --plan {folder}/plan.json --out {folder}/s{{#}} -q"
    return subprocess.run(["parallel", *options, command, ":::", "1", "2", "3"], capture_output=True, text=True)


def status_of(shard):
    return json.loads((shard / "status.json").read_text())


def test_the_joined_map_is_that_of_one_run(planned):
    shards = [planned / f"s{number}" for number in (3, 2, 1)]  # the last one is empty
    before = {shard: os.stat(shard / "session.mcap").st_mtime_ns for shard in shards[1:]}
    names = ["PARALLEL_SEQ", "SLURM_ARRAY_TASK_ID", "JOB_COMPLETION_INDEX", "AWS_BATCH_JOB_ARRAY_INDEX"]
    for name in names:  # what is complete is not made again
        number = 2 if name == "PARALLEL_SEQ" else 1
        program("map", "--plan", planned / "plan.json", "--out", planned / "s2", "-q", env={name: str(number)})
    assert parallel(planned, "false", "--resume-failed").returncode == 0  # none has failed: `false` is not run
    assert all((status_of(shard)["state"], status_of(shard)["progress"]) == ("done", 1) for shard in shards)
    assert before == {shard: os.stat(shard / "session.mcap").st_mtime_ns for shard in before}
    program("join", planned / "plan.json", *shards, "--out", planned / "joined", "-q")
    names = sorted(str(path.relative_to(planned / "one")) for path in (planned / "one").rglob("*") if path.is_file())
    joined = [str(path.relative_to(planned / "joined")) for path in (planned / "joined").rglob("*") if path.is_file()]
    assert sorted([*names, "status.json"]) == sorted(joined)
    for name in names:
        if name in ("report.json", "map.html", "session.mcap"):  # they have times
            continue
        assert (planned / "one" / name).read_bytes() == (planned / "joined" / name).read_bytes(), name
    reports = [json.loads((planned / folder / "report.json").read_text()) for folder in ("one", "joined")]
    for report in reports:
        for key in TIMES:
            report.pop(key, None)
    assert reports[0] == reports[1]
    one, joined = ef.Session(planned / "one"), ef.Session(planned / "joined")
    assert one.run == joined.run and len(one) == len(joined)
    for a, b in zip(one.keyframes, joined.keyframes):
        assert a.t == b.t and (a.depth == b.depth).all() and (a.pose == b.pose).all()


def test_an_unfinished_shard_goes_on_and_mistakes_are_named(planned, tmp_path):
    plan, shard = planned / "plan.json", planned / "s2"
    begin, end = (json.loads(plan.read_text())["shards"][1][key] for key in ("begin", "end"))
    (tmp_path / "cut").mkdir()
    data = (shard / "session.mcap").read_bytes()
    (tmp_path / "cut" / "session.mcap").write_bytes(data[: len(data) // 2])
    part = len(ef.Session(tmp_path / "cut"))
    assert 0 < part < end - begin
    rest = [planned / f"s{number}" for number in (1, 3)]
    for words, text in (
        ((*rest, tmp_path / "cut"), f"{part} of {end - begin} keyframes: expected a shard that ended"),
        ((*rest, rest[0]), "the same shard as"),
        (rest, "shards 1 are missing"),
        ((planned / "one", *rest), "no shard of"),
        ((tmp_path, rest[0]), "shards 1 are missing: expected the folders of all; no session.mcap is in"),
    ):
        assert text in program("join", plan, *words, "--out", tmp_path / "out", status=1)
    assert "shard 3: expected 0 to 2" in program("map", "--plan", plan, "--shard", 3, "--out", tmp_path / "x", status=2)
    assert "PARALLEL_SEQ=0" in program("map", "--plan", plan, "--out", tmp_path / "x", status=2, env={"PARALLEL_SEQ": "0"})
    assert "--shard: expected a number" in program("map", "--plan", plan, "--out", tmp_path / "x", status=2)
    assert "a folder of its own" in program("map", "--plan", plan, "--shard", 0, "--out", shard, status=1)
    changed = json.loads(plan.read_text())
    changed["run"]["files"][0]["bytes"] += 1
    (tmp_path / "changed.json").write_text(json.dumps(changed))
    assert "events.txt" in program("map", "--plan", tmp_path / "changed.json", "--shard", 1, "--out", tmp_path / "y", "-q", status=1)
    assert (status_of(tmp_path / "y")["state"], status_of(tmp_path / "y")["exit_status"]) == ("failed", 1)
    assert "events.txt" in status_of(tmp_path / "y")["reason"]
    changed["run"]["version"] = "0.0.1"
    (tmp_path / "changed.json").write_text(json.dumps(changed))
    assert 'version was "0.0.1"' in program("map", "--plan", tmp_path / "changed.json", "--shard", 1, "--out", tmp_path / "z", "-q", status=1)
    counts = json.loads(plan.read_text())
    counts["windows_ns"][begin + 1][3] += 1
    (tmp_path / "counts.json").write_text(json.dumps(counts))
    words = ("map", "--plan", tmp_path / "counts.json", "--shard", 1, "--out", tmp_path / "c", "-q")
    joined = ("join", tmp_path / "counts.json", *rest, tmp_path / "c", "--out", tmp_path / "out")
    assert f"keyframe {begin + 1} at" in program(*words, status=1) and "by the plan" in status_of(tmp_path / "c")["reason"]
    assert f"{tmp_path}/c (keyframe {begin + 1} at" in program(*joined, status=1)
    damaged = json.loads(plan.read_text())
    damaged["shards"][1]["begin"] += 1
    (tmp_path / "damaged.json").write_text(json.dumps(damaged))
    assert "shards that divide them all" in program("map", "--plan", tmp_path / "damaged.json", "--shard", 1, "--out", tmp_path / "z", status=1)
    (tmp_path / "z").mkdir(exist_ok=True)
    (tmp_path / "z" / "status.json.new").write_text("")  # a process that was killed leaves it
    assert "0 to 2" in program("map", "--plan", plan, "--shard", 3, "--out", tmp_path / "z", status=2)
    program("map", "--plan", plan, "--shard", 1, "--out", tmp_path / "z", "-q")
    (tmp_path / "no.json").write_text("{}")
    assert "no plan" in program("plan", DESK, "--shards", 2, "--out", tmp_path / "no.json", status=1)
    assert "no plan" in program("map", "--plan", tmp_path / "no.json", "--shard", 1, "--out", tmp_path / "z", status=1)
    for option in ("keyframes.policy=baseline", "depth.max_confidence=sequence", "live.enabled=true"):
        assert "cannot be divided" in program("plan", DESK, f"--set={option}", "--shards", 2, "--out", tmp_path / "p.json", status=2)


CALIBRATION = f"--calibration={DESK}/camchain.yaml"
FORMATS = {
    "write_hdf5.py": ["m3ed/desk_data.h5", "--poses=m3ed/desk_pose_gt.h5"],
    "write_ros2_bag.py": ["evt3.mcap", CALIBRATION],
}


@pytest.mark.parametrize("script", FORMATS)
def test_a_part_that_is_read_by_itself_has_the_same_events(tmp_path, monkeypatch, script):
    """The second shard, read by the index of its format, and read from the begin."""
    writer = os.path.join(os.environ["EFM_SOURCE"], "test/formats", script)
    subprocess.run([sys.executable, writer, DESK, tmp_path], check=True)
    monkeypatch.chdir(tmp_path)
    sets = [f"--set={key}={value}" for key, value in OPTIONS.items() if "dsi" in key or "keyframes" in key]
    text = program("plan", *FORMATS[script], *sets, "--set=dsi.num_planes=8", "--shards", 2, "--out", "plan.json")
    assert "a shard reads its part" in text
    plan = json.loads((tmp_path / "plan.json").read_text())
    assert plan["shards"][1]["begin"] == 64 < plan["keyframes"]
    (tmp_path / "all.json").write_text(json.dumps({**plan, "from_begin": "a test"}))
    for name in ("plan", "all"):
        program("map", "--plan", f"{name}.json", "--shard", 1, "--out", name, "-q")
    part, all_read = ef.Session("plan"), ef.Session("all")
    assert len(part) == len(all_read) == plan["keyframes"] - 64
    for a, b in zip(part.keyframes, all_read.keyframes):
        assert a.t == b.t and (a.depth == b.depth).all() and (a.confidence == b.confidence).all() and (a.pose == b.pose).all()
    reads = [json.loads((tmp_path / name / "report.json").read_text())["events"]["read"] for name in ("plan", "all")]
    assert reads[0] < 0.8 * reads[1]
