// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "plugin/formats/open_recording.h"

namespace efm {

/// What `map` and `depth` have in common on the command line.
struct MappingArguments {
  std::filesystem::path config;
  RecordingSource source;
  std::filesystem::path out;
  std::vector<std::string> sets;  ///< section.key=value
};

struct MapArguments : MappingArguments {
  std::optional<std::int64_t> t0_ns;
  std::optional<std::int64_t> t1_ns;
};

struct DepthArguments : MappingArguments {
  std::int64_t t0_ns = 0;
  std::int64_t t1_ns = 0;
  std::optional<std::int64_t> t_ref_ns;  ///< The middle of the window (or its end, by the options).
  bool save_dsi = false;
};

/// `event-fusion map`: plays a recording and writes the map's folder; a summary goes to stdout,
/// warnings and what went wrong to stderr.
/// @return the process's exit status: 0 only where the whole recording became a map.
/// @throws std::exception where the options or the recording cannot be read, or a file not written.
int runMap(const MapArguments& arguments);

/// `event-fusion depth`: one keyframe of a chosen window.
int runDepth(const DepthArguments& arguments);

}  // namespace efm
