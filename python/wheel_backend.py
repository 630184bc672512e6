# SPDX-License-Identifier: BSD-3-Clause
"""Builds the wheel with CMake alone (PEP 517): `pip install .` downloads nothing.

The wheel has the module, the engine and MRPT's plugin, for the machine that built it: the libraries of Debian that they
use stay outside. EFM_BUILD names a build folder. If it is configured, it is used as it is.
"""

import base64
import hashlib
import os
import re
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from pathlib import Path

SOURCE = Path(__file__).resolve().parent.parent
BUILD = Path(os.environ.get("EFM_BUILD", SOURCE / "build" / "wheel")).resolve()
NAME = "event_fusion_mapper"
VERSION = re.search(r"VERSION (\d+\.\d+\.\d+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)
INFO = f"{NAME}-{VERSION}.dist-info"
_PYTHON = f"cp{sysconfig.get_config_var('py_version_nodot')}"
TAG = f"{_PYTHON}-{_PYTHON}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"
WHEEL = f"{NAME}-{VERSION}-{TAG}.whl"
METADATA = f"""Metadata-Version: 2.1
Name: event-fusion-mapper
Version: {VERSION}
Summary: Depth maps and point clouds from event cameras with known poses
License: BSD-3-Clause
Requires-Python: >=3.9
Requires-Dist: numpy>=1.20
Provides-Extra: plot
Requires-Dist: matplotlib; extra == "plot"
"""


def _about():
    wheel = f"Wheel-Version: 1.0\nGenerator: event-fusion-mapper\nRoot-Is-Purelib: false\nTag: {TAG}\n"
    licence = (SOURCE / "LICENSE").read_bytes()
    return {f"{INFO}/METADATA": METADATA.encode(), f"{INFO}/WHEEL": wheel.encode(), f"{INFO}/LICENSE": licence}


def _write(file, contents):
    rows = []
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as wheel:
        for name, data in sorted(contents.items()):
            wheel.writestr(name, data)
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            rows.append(f"{name},sha256={digest},{len(data)}\n")
        wheel.writestr(f"{INFO}/RECORD", "".join(rows) + f"{INFO}/RECORD,,\n")
    return Path(file).name


def _cmake(*arguments):
    subprocess.run(["cmake", *map(str, arguments)], check=True)


def _build():
    if not (BUILD / "CMakeCache.txt").exists():
        _cmake("-S", SOURCE, "-B", BUILD, "-DCMAKE_BUILD_TYPE=Release", "-DEFM_BUILD_TESTS=OFF",
               f"-DPython_EXECUTABLE={sys.executable}")
    _cmake("--build", BUILD, "--target", "efm_python", "mrpt-event-fusion", "--parallel")


def _files(folder):
    """Return the contents of files. Of a library and the links to it, the shortest name counts."""
    names = {}
    for file in folder.rglob("*"):
        if file.is_file():
            names.setdefault(file.resolve(), []).append(file.relative_to(folder).as_posix())
    return {min(links, key=len): file.read_bytes() for file, links in names.items()}


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    Path(metadata_directory, INFO).mkdir()
    for name, data in _about().items():
        Path(metadata_directory, name).write_bytes(data)
    return INFO


prepare_metadata_for_build_editable = prepare_metadata_for_build_wheel


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    _build()
    with tempfile.TemporaryDirectory() as stage:
        _cmake("--install", BUILD, "--prefix", stage, "--component", "wheel", "--strip")
        return _write(Path(wheel_directory, WHEEL), {**_files(Path(stage)), **_about()})


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    """`pip install -e .` refers to the build folder."""
    _build()
    reference = {f"{NAME}.pth": f"{BUILD / 'python'}\n".encode()}
    return _write(Path(wheel_directory, WHEEL), {**reference, **_about()})


def build_sdist(sdist_directory, config_settings=None):
    name = f"{NAME}-{VERSION}"
    file = Path(sdist_directory, f"{name}.tar.gz")
    subprocess.run(["git", "archive", "--format=tar.gz", f"--prefix={name}/", "-o", file, "HEAD"], cwd=SOURCE, check=True)
    return file.name
