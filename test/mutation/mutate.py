#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Makes random wrong changes, one at a time, in a copy of the tree, and tells which the tests notice.

A change is made by pattern in the text of a source file; the compiler says whether it is C++, and one that
leaves all programs as they were, byte for byte, is none. See README.md beside it.
"""
import argparse
import collections
import hashlib
import json
import os
import random
import re
import resource
import shutil
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
TREE = os.environ.get("EFM_MUTATION_TREE", os.path.join(ROOT, "build", "mutation"))
BUILD = os.path.join(TREE, "build", "release")
MEMORY_BYTES = 12 << 30

Change = collections.namedtuple("Change", "kind file begin end text")


# --- Changes -------------------------------------------------------------------------------------

def code_of(text):
    """The text with blanks for comments, strings, characters and preprocessor lines."""
    pattern = re.compile(r'//[^\n]*|/\*.*?\*/|R"\((?:.|\n)*?\)"|"(?:\\.|[^"\\\n])*"'
                         r"|(?<![\w])'(?:\\.|[^'\\\n])*'|^[ \t]*#(?:[^\n\\]|\\.|\\\n)*", re.S | re.M)
    return pattern.sub(lambda m: re.sub(r"[^\n]", " ", m.group()), text)


NEGATED = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "!=", "!=": "=="}
BOUNDARY = {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}
TWINS = [("x", "y"), ("width", "height"), ("rows", "cols"), ("fx", "fy"), ("cx", "cy"), ("front", "back"),
         ("min", "max"), ("t0_ns", "t1_ns"), ("lower_bound", "upper_bound"), ("floor", "ceil"), ("floor", "round"),
         ("first", "second"), ("u", "v"), ("break", "continue"), ("true", "false"), ("begin", "end"),
         ("rotation", "rotation.inverse()"), ("min_depth_m", "max_depth_m"),
         ("T_world_rig", "T_world_rig.inverse()"), ("any_of", "all_of")]
SYMMETRIC = re.compile(r"\b(?:min|max|minmax|hypot|swap|isSame\w*|areEqual|\w*[dD]istance)$")
UNITS = [("1e-9", "1e-6"), ("1e9", "1e6"), ("1e-6", "1e-3"), ("1e6", "1e3"), ("1e-3", "1"), ("1000", "1"),
         ("kRadiansPerDegree", "1.0"), ("kNanosecondsPerSecond", "1'000'000"), ("100", "1")]


def other_constant(number):
    if re.fullmatch(r"\d+", number):
        value = int(number)
        return [str(value + 1)] + ([str(value - 1)] if value > 0 else []) + ([str(2 * value)] if value > 1 else [])
    return [f"({number} * 2)", f"({number} / 2)"] if float(number) != 0 else ["1.0"]


def by_pattern(kind, pattern, replacements, code, file, group=1):
    for match in re.finditer(pattern, code, re.M):
        for text in replacements(match):
            yield Change(kind, file, match.start(group), match.end(group), text)


def changes_in(file, text):
    """All changes of a file."""
    code = code_of(text)

    def made(kind, pattern, replacements, group=1):
        return by_pattern(kind, pattern, replacements, code, file, group)

    yield from made("boundary", r" (<=|>=|<|>) ", lambda m: [BOUNDARY[m[1]]])
    yield from made("comparison", r" (<=|>=|<|>|==|!=) ", lambda m: [NEGATED[m[1]]])
    yield from made("arithmetic", r" ([-+*/]) ", lambda m: [{"+": "-", "-": "+", "*": "/", "/": "*"}[m[1]]])
    yield from made("arithmetic", r" ([-+])= ", lambda m: [{"+": "-", "-": "+"}[m[1]]])
    yield from made("off by one", r"( [-+] 1)\b(?![.'])", lambda m: [""])
    yield from made("off by one", r"\.size\(\)(?! [-+])()", lambda m: [" - 1"])
    yield from made("sign", r"(?:[(,=?:] |\(|\breturn )(-)(?=[\w(])", lambda m: [""])
    yield from made("logic", r" (&&|\|\|) ", lambda m: [{"&&": "||", "||": "&&"}[m[1]]])
    yield from made("logic", r"(?<![\w!])(!)(?=[\w(])", lambda m: [""])
    yield from made("logic", r"\b(?:if|while) \(()(?=[\w.\->]+(?:\([\w.]*\))?\))", lambda m: ["!"])
    for match in re.finditer(r"\w\(([\w.\->*&\[\]]+), ([\w.\->*&\[\]]+)\)", code):
        if match[1] != match[2] and not SYMMETRIC.search(code[:match.start() + 1]):
            yield Change("swapped arguments", file, match.start(1), match.end(2), f"{match[2]}, {match[1]}")
    yield from made("statement left out", r"^ +([\w.\->\[\]*:]+(?:\([^;{}\n]*\)| [-+*/|&]?= [^;{}\n]*|\+\+)(?=;$))",
                    lambda m: [] if re.match(r"return|using|throw|break", m[1]) else [""])
    yield from made("statement left out", r"^ +((?:\+\+|--)[\w.\->\[\]]+)(?=;$)", lambda m: [""])
    yield from made("statement left out", r"^ +(if \([^{}\n]*\) (?:return|continue|break|throw)\b[^{}\n]*;)$",
                    lambda m: [""])
    yield from made("early return", r"^  ()\w[^;{}\n]*;$", lambda m: ["return {}; ", "return; "])
    yield from made("constant", r"(?<![\w.'])(\d+(?:\.\d+)?(?:e-?\d+)?)(?![\w.'])", lambda m: other_constant(m[1]))
    for one, other in TWINS:
        for old, new in ((one, other), (other, one)):
            if re.fullmatch(r"\w+", old):
                yield from made("twin", rf"(?<!\w)({old})(?!\w)", lambda m, new=new: [new])
    for one, other in UNITS:
        yield from made("unit", r"(?<![\w.'])(" + re.escape(one) + r")(?![\w.'])", lambda m, other=other: [other])


def line_of(text, change):
    """The number of the line, its text before and after."""
    begin = text.rfind("\n", 0, change.begin) + 1
    end = text.find("\n", change.end)
    after = text[begin:change.begin] + change.text + text[change.end:end]
    return text.count("\n", 0, change.begin) + 1, text[begin:end].strip(), after.strip()


def changes_of_folder(folder, seed):
    """All changes of a folder in random order: first a kind, then one of it, each as likely as another."""
    kinds = collections.defaultdict(list)
    for name in sorted(os.listdir(os.path.join(ROOT, folder))):
        if name.endswith((".h", ".cpp")):
            file = f"{folder}/{name}"
            with open(os.path.join(ROOT, file)) as source:
                text = source.read()
            for change in changes_in(file, text):
                kinds[change.kind].append(change)
    order = random.Random(f"{seed} {folder}")
    for changes in kinds.values():
        order.shuffle(changes)
    while kinds:
        kind = order.choice(sorted(kinds))
        yield kinds[kind].pop()
        if not kinds[kind]:
            del kinds[kind]


# --- The copy of the tree ------------------------------------------------------------------------

def copy_tree():
    """Copies what differs: the build stays warm, and a change that was left is undone."""
    files = subprocess.run(["git", "-C", ROOT, "ls-files", "-z", "-co", "--exclude-standard"], check=True,
                           capture_output=True, text=True)
    for file in filter(None, files.stdout.split("\0")):
        source, copy = os.path.join(ROOT, file), os.path.join(TREE, file)
        if not os.path.exists(source):
            continue
        with open(source, "rb") as content:
            new = content.read()
        if os.path.exists(copy):
            with open(copy, "rb") as content:
                if content.read() == new:
                    continue
        os.makedirs(os.path.dirname(copy), exist_ok=True)
        shutil.copy(source, copy)


def configure():
    data = os.environ.get("EFM_SHARED_DATA", os.path.join(ROOT, "..", "shared", "data"))
    subprocess.run(["cmake", "--preset", "release", "-S", TREE, "-B", BUILD, "-DEFM_BUILD_LONG=OFF",
                    "-DEFM_SPLIT_LIBRARIES=ON", f"-DEFM_SHARED_DATA={os.path.realpath(data)}"],
                   check=True, stdout=subprocess.DEVNULL)


def build(targets):
    return subprocess.run(["cmake", "--build", BUILD, "--target", *targets],
                          stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0


def content_of(path):
    with open(path, "rb") as file:
        return file.read()


class Program:
    """A test program and what it runs: libraries of the tree, and the command where its tests call it."""

    def __init__(self, name):
        self.name = name
        self.targets = [name]
        self.files = [os.path.join(BUILD, "bin", name)]
        if not build(self.targets):
            sys.exit("mutate.py: the tree does not build")
        libraries = [name for name in sorted(os.listdir(os.path.join(BUILD, "lib"))) if name.endswith(".so")]
        if b"bin/event-fusion" in content_of(self.files[0]):
            self.targets += ["event-fusion", *(name[3:-3] for name in libraries)]
            self.files.append(os.path.join(BUILD, "bin", "event-fusion"))
        else:
            linked = subprocess.run(["ldd", self.files[0]], capture_output=True, text=True).stdout
            libraries = [name for name in libraries if name in linked]
        self.files += [os.path.join(BUILD, "lib", name) for name in libraries]
        if not build(self.targets):
            sys.exit("mutate.py: the tree does not build")
        self.unchanged = self.bytes()

    def bytes(self):
        """A hash of what the tests run."""
        digest = hashlib.sha256()
        for file in self.files:
            digest.update(content_of(file))
        return digest.hexdigest()


# Nothing outside the test's own folder of temporary files can be written: a wrong change may delete anything.
GUARDED = """mount --make-rprivate / && awk '$2 !~ "^/(proc|sys|dev)" {print $2}' /proc/self/mounts |
while read -r folder; do mount -o remount,bind,ro "$folder" 2>&1; done >/dev/null
mount -t tmpfs tmpfs /tmp && exec "$@" """


def run_test(program, limit_s):
    """The first test that fails; None where all pass."""
    environment = {**os.environ, "TMPDIR": "/tmp"}
    command = ["timeout", "-k", "5", str(limit_s), os.path.join(BUILD, "bin", program), "--gtest_fail_fast",
               "--gtest_brief=1"]
    process = subprocess.run(
        ["unshare", "-m", "-n", "sh", "-c", GUARDED, "sh", *command], cwd=BUILD, env=environment,
        stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace",
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES)))
    if process.returncode == 0:
        return None
    if process.returncode in (124, 137):
        return f"{program}: no end within {limit_s} s"
    failed = re.search(r"\[  FAILED  \] ([^ ,]+)", process.stdout)
    return failed[1] if failed else f"a crash of {program}"


def read_folders():
    """The test programs of each folder, in the order in which they run."""
    folders = {}
    with open(os.path.join(HERE, "folders.txt")) as table:
        for line in table:
            if line.strip() and not line.startswith("#"):
                folder, programs = line.split(":")
                folders[folder] = programs.split()
    return folders


def read_set_aside():
    """(file, line before, line after) of the changes that nobody can observe."""
    known = set()
    path = os.path.join(HERE, "set_aside.txt")
    file = old = None
    with open(path) as lines:
        for line in lines:
            if line.startswith("file: "):
                file = line[6:].strip()
            elif line.startswith("- "):
                old = line[2:].strip()
            elif line.startswith("+"):
                known.add((file, old, line[1:].strip()))
    return known


# --- The run -------------------------------------------------------------------------------------

class Run:
    def __init__(self, arguments):
        self.arguments = arguments
        self.folders = read_folders()
        self.set_aside = read_set_aside()
        self.programs = {}
        self.limits_s = {}
        self.results = []

    def prepare(self, folders):
        copy_tree()
        configure()
        names = sorted({name for folder in folders for name in self.folders[folder]})
        if not build(["event-fusion"]):  # makes the recordings that tests read
            sys.exit("mutate.py: the tree does not build")
        self.programs = {name: Program(name) for name in names}
        subprocess.run(["ctest", "--preset", "release", "-R", "^(recordings|formats)$"], cwd=TREE, check=True,
                       stdout=subprocess.DEVNULL)
        for program in names:  # a test that fails anyway notices nothing
            begin = time.monotonic()
            failed = run_test(program, 1800)
            if failed:
                sys.exit(f"mutate.py: {failed} fails without a change")
            self.limits_s[program] = int(3 * (time.monotonic() - begin)) + 20

    def outcome(self, folder, change, text):
        """(outcome, who noticed it)"""
        path = os.path.join(TREE, change.file)
        with open(path, "w") as file:
            file.write(text[:change.begin] + change.text + text[change.end:])
        outcome = "same program"
        try:
            for program in (self.programs[name] for name in self.folders[folder]):
                if not build(program.targets):
                    return "did not build", ""
                if program.bytes() == program.unchanged:
                    continue
                outcome = "survived"
                noticed = run_test(program.name, self.limits_s[program.name])
                if noticed:
                    return "caught", noticed
            return outcome, ""
        finally:
            with open(path, "w") as file:
                file.write(text)

    def try_change(self, folder, change):
        with open(os.path.join(ROOT, change.file)) as source:
            text = source.read()
        number, old, new = line_of(text, change)
        outcome, noticed = self.outcome(folder, change, text)
        if outcome == "survived" and (change.file, old, new) in self.set_aside:
            outcome = "set aside"
        result = {"folder": folder, "kind": change.kind, "file": change.file, "line": number, "old": old, "new": new,
                  "outcome": outcome, "noticed": noticed}
        self.results.append(result)
        with open(os.path.join(TREE, "build", "results.jsonl"), "a") as log:
            log.write(json.dumps(result) + "\n")
        if outcome not in ("did not build", "same program"):
            print(f"{outcome}: {change.file}:{number} ({change.kind}) {noticed}\n  - {old}\n  + {new}", flush=True)
        return outcome

    def run_folder(self, folder):
        counted = 0
        for change in changes_of_folder(folder, self.arguments.seed):
            if counted == self.arguments.count:
                return
            counted += self.try_change(folder, change) in ("caught", "survived")

    def repeat(self, path):
        """The survivors of an earlier run, where their lines are still there."""
        with open(path) as log:
            earlier = [json.loads(line) for line in log]
        for result in earlier:
            if result["outcome"] != "survived" or result["folder"] not in self.folders:
                continue
            with open(os.path.join(ROOT, result["file"])) as source:
                text = source.read()
            same = [change for change in changes_in(result["file"], text)
                    if line_of(text, change)[1:] == (result["old"], result["new"])]
            if not same:
                print(f"gone: {result['file']}:{result['line']}: {result['old']}")
                continue
            self.try_change(result["folder"], min(
                same, key=lambda change: abs(line_of(text, change)[0] - result["line"])))

    def print_table(self):
        columns = ("caught", "survived", "set aside", "same program", "did not build")
        print(f"\n| folder | noticed | {' | '.join(columns)} |\n{'|---' * (len(columns) + 2)}|")
        folders = list(dict.fromkeys(result["folder"] for result in self.results))
        for folder in [*folders, "all"]:
            counts = collections.Counter(
                result["outcome"] for result in self.results if folder in ("all", result["folder"]))
            made = counts["caught"] + counts["survived"]
            share = f"{100 * counts['caught'] / made:.0f} %" if made else "-"
            print(f"| {folder} | {share} | " + " | ".join(str(counts[column]) for column in columns) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", action="append", default=[], help="mapping/sweep, or all below one: plugin")
    parser.add_argument("--count", type=int, default=10, help="changes of a folder that are caught or survive")
    parser.add_argument("--seed", default="1")
    parser.add_argument("--again", metavar="RESULTS", help="the survivors of an earlier run's results.jsonl alone")
    parser.add_argument("--list", action="store_true", help="the first changes of each folder, without making them")
    arguments = parser.parse_args()
    run = Run(arguments)
    folders = [folder for folder in run.folders
             if not arguments.folder or any(folder == r or folder.startswith(r + "/") for r in arguments.folder)]
    if not folders:
        sys.exit("mutate.py: no such folder")
    if arguments.list:
        for folder in folders:
            for _, change in zip(range(arguments.count), changes_of_folder(folder, arguments.seed)):
                with open(os.path.join(ROOT, change.file)) as source:
                    number, old, new = line_of(source.read(), change)
                print(f"{change.file}:{number} ({change.kind})\n  - {old}\n  + {new}")
        return
    run.prepare(folders)
    if arguments.again:
        run.folders = {folder: run.folders[folder] for folder in folders}
        run.repeat(arguments.again)
    else:
        for folder in folders:
            run.run_folder(folder)
    run.print_table()


if __name__ == "__main__":
    main()
