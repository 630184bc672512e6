// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "plugin/formats/open_recording.h"

namespace efm {

/// The common arguments of `map` and `depth`.
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
  std::optional<std::int64_t> t_ref_ns;  ///< Default: middle or end of the window, by the options.
  bool save_dsi = false;
};

/// `event-fusion map`: plays a recording and writes the map's folder. Prints a summary to stdout,
/// warnings and errors to stderr.
/// SIGINT or SIGTERM ends the run as the end of the recording would; a second one kills it.
/// @return the process's exit status: 0 only if the whole recording is mapped, 130 where a signal
/// stopped it.
/// @throws std::exception if the options or the recording cannot be read, or a file cannot be
/// written.
int runMap(const MapArguments& arguments);

/// `event-fusion depth`: maps one window.
int runDepth(const DepthArguments& arguments);

}  // namespace efm
