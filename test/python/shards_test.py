# SPDX-License-Identifier: BSD-3-Clause
"""A recording that is mapped in shards, and joined: the result is that of one run."""

import json
import os
import subprocess

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
    for number in (2, 0, 1):
        # GNU parallel counts from 1, Slurm and others from 0.
        env = [{"PARALLEL_SEQ": str(number + 1)}, {"SLURM_ARRAY_TASK_ID": str(number)}, {"JOB_COMPLETION_INDEX": str(number)}][number % 3]
        program("map", "--plan", folder / "plan.json", "--out", folder / f"s{number}", "-q", env=env)
    return folder


def test_the_joined_map_is_that_of_one_run(planned):
    shards = [planned / f"s{number}" for number in (2, 1, 0)]  # the last one is empty
    before = {shard: os.stat(shard / "session.mcap").st_mtime_ns for shard in shards[1:]}
    for number in range(3):  # what is complete is not made again
        program("map", "--plan", planned / "plan.json", "--shard", number, "--out", planned / f"s{number}", "-q")
    assert before == {shard: os.stat(shard / "session.mcap").st_mtime_ns for shard in before}
    program("join", planned / "plan.json", *shards, "--out", planned / "joined", "-q")
    names = sorted(str(path.relative_to(planned / "one")) for path in (planned / "one").rglob("*") if path.is_file())
    assert names == sorted(str(path.relative_to(planned / "joined")) for path in (planned / "joined").rglob("*") if path.is_file())
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
    plan, shard = planned / "plan.json", planned / "s1"
    begin, end = (json.loads(plan.read_text())["shards"][1][key] for key in ("begin", "end"))
    (tmp_path / "cut").mkdir()
    data = (shard / "session.mcap").read_bytes()
    (tmp_path / "cut" / "session.mcap").write_bytes(data[: len(data) // 2])
    part = len(ef.Session(tmp_path / "cut"))
    assert 0 < part < end - begin
    rest = [planned / f"s{number}" for number in (0, 2)]
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
    changed["run"]["version"] = "0.0.1"
    (tmp_path / "changed.json").write_text(json.dumps(changed))
    assert 'version was "0.0.1"' in program("map", "--plan", tmp_path / "changed.json", "--shard", 1, "--out", tmp_path / "z", "-q", status=1)
    (tmp_path / "no.json").write_text("{}")
    assert "no plan" in program("map", "--plan", tmp_path / "no.json", "--shard", 1, "--out", tmp_path / "z", status=1)
    for option in ("keyframes.policy=baseline", "depth.max_confidence=sequence", "live.enabled=true"):
        assert "cannot be divided" in program("plan", DESK, f"--set={option}", "--shards", 2, "--out", tmp_path / "p.json", status=2)
