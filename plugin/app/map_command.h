// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "plugin/app/progress.h"
#include "plugin/app/recording_interval.h"
#include "plugin/recordings/open/open_recording.h"

namespace efm {

/// The common arguments of `map` and `depth`.
struct MappingArguments {
  /// The option file, its name without ".ini" (see `findConfig`), or empty: the defaults.
  std::string config;
  RecordingSource source;
  TimeArguments times;          ///< Of the window, for `depth`.
  std::filesystem::path out;    ///< Empty: named after the recording, in the working folder.
  bool force = false;           ///< Write into a folder that holds other files.
  bool plain_pictures = false;  ///< depth.png and confidence.png without enlargement and bar.
  bool strict = false;          ///< A warning is an error.
  Verbosity verbosity = Verbosity::kNormal;
  std::vector<std::string> sets;  ///< section.key=value
};

struct MapArguments : MappingArguments {
  bool view = false;                    ///< Show the growing map in a window.
  std::filesystem::path record_frames;  ///< Folder for a picture per keyframe; empty: none.
};

struct DepthArguments : MappingArguments {
  /// Time of the reference view. Default: middle or end of the window, by the options.
  std::optional<TimeArgument> t_ref;
  bool save_dsi = false;
};

/// `event-fusion map`: plays a recording and writes the map's folder. Prints a summary to stdout,
/// warnings and errors to stderr.
/// SIGINT, SIGTERM or SIGHUP ends the run as the end of the recording would; a second one kills it.
/// In the first look at the recording (automatic options) it ends without a result: Interrupted.
/// @return the process's exit status: 0 only if the whole recording is mapped, 130 where a signal
/// stopped it.
/// @throws std::exception if the options or the recording cannot be read, or a file cannot be
/// written.
int runMap(const MapArguments& arguments);

/// `event-fusion depth`: maps one window. SIGINT, SIGTERM or SIGHUP ends it without a result,
/// unless the keyframe is made: then its files are written.
/// @throws Interrupted if a signal came before; an earlier result stays.
int runDepth(const DepthArguments& arguments);

}  // namespace efm
