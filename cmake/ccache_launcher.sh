#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# ccache as this project needs it: precompiled headers are cached, and so is what another clone of
# the same sources compiled.
root=$(cd "$(dirname "$0")/.." && pwd)
export CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
export CCACHE_BASEDIR="$root" CCACHE_NOHASHDIR=1
exec ccache "$@"
