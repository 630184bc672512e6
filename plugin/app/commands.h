// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plugin/app/recording_interval.h"
#include "plugin/evaluation/cloud_evaluation.h"
#include "plugin/evaluation/depth_evaluation.h"
#include "plugin/evaluation/trajectory_evaluation.h"
#include "plugin/playback/map_job.h"
#include "plugin/playback/progress.h"
#include "plugin/recordings/open/mrpt_library.h"
#include "plugin/recordings/open/open_recording.h"
#include "tracking_stub/presets/presets.h"

namespace efm {

// Each `run…` function returns the process's exit status.

struct InfoArguments {
  RecordingSource source;
  TimeArguments times;
  bool strict = false;  ///< True: a warning is an error.
  bool system = false;  ///< Also print the processor and its kernels; a recording is optional.
  bool json = false;    ///< Print `infoJson`.
  Verbosity verbosity = Verbosity::kNormal;
};

/// `event-fusion info`: prints the contents of a recording; if quiet, only its warnings.
/// @throws std::exception if the recording cannot be read to its end. The contents before the error
/// have been printed.
int runInfo(const InfoArguments& arguments);

/// Returns Linux's "model name" or, on Arm processors without it, the name of the board; "unknown"
/// if there is neither.
std::string processorName();

struct ImportArguments {
  RecordingSource source;
  TimeArguments times;
  std::filesystem::path out;
  RawlogCompression compression = RawlogCompression::kGzip;
  Verbosity verbosity = Verbosity::kNormal;
};

/// `event-fusion import`: writes a recording as a rawlog. Replaces an earlier rawlog, but no other
/// file. The recording may lack poses or calibration. If it is damaged, the data before the damage
/// are written, and the status is 1.
/// @throws Interrupted if a signal came; std::exception if no event can be read or the rawlog
/// cannot be written. Then there is no rawlog.
int runImport(const ImportArguments& arguments);

struct ExportArguments {
  RecordingSource source;
  TimeArguments times;
  std::string format;  ///< A name of `exportFormats`.
  std::filesystem::path out;
  Verbosity verbosity = Verbosity::kNormal;
  std::vector<std::string> sets;                  ///< Of sessions: section.key=value.
  std::vector<double> box_m;                      ///< Of sessions: x0 y0 z0 x1 y1 z1, or empty.
  std::vector<std::filesystem::path> transforms;  ///< T_first_this of further sessions.
  bool registers = false;                         ///< Register further sessions with the first.
  bool store = false;                             ///< Add the poses to the session.
};

/// Returns the formats that this build writes.
std::vector<std::string> exportFormats();

/// `event-fusion export`: writes a recording for other tools. The cameras' time offsets are added
/// to the time stamps. Poses are those of camera 0, T_world_cam0. Incomplete or damaged recordings
/// and errors are handled as in `runImport`.
int runExport(const ExportArguments& arguments);

struct ViewArguments {
  std::filesystem::path path;  ///< The folder of a map, its map.html, or a session.
};

/// `event-fusion view`: opens map.html with the system's program for pages (`xdg-open`, `open`),
/// and prints its path. If there is no screen or no such program, it says so on stderr. This is no
/// error: any browser can open the page.
int runView(const ViewArguments& arguments);

/// The common arguments of `map` and `depth`.
struct MappingArguments {
  /// The option file, its name without ".ini" (see `findConfig`), or empty: the defaults.
  std::string config;
  RecordingSource source;
  TimeArguments times;          ///< Limits of the recording; for `depth`, of the window.
  std::filesystem::path out;    ///< Empty: named after the recording, in the working folder.
  bool force = false;           ///< Allow a folder that holds other files.
  bool plain_pictures = false;  ///< No enlargement or colour bar in depth.png and confidence.png.
  bool strict = false;          ///< True: a warning is an error.
  Verbosity verbosity = Verbosity::kNormal;
  std::vector<std::string> sets;  ///< section.key=value
};

struct MapArguments : MappingArguments {
  bool view = false;                          ///< Show the growing map in a window.
  std::filesystem::path record_frames;        ///< Folder for a picture per keyframe; empty: none.
  bool resume = false;                        ///< Go on with the keyframes of an earlier run.
  std::filesystem::path plan;                 ///< Of `plan`: make one of its shards.
  std::optional<std::size_t> shard;           ///< Its number, from 0.
  std::shared_ptr<const PlannedMap> planned;  ///< See MapJob, as the next two.
  std::optional<KeyframeRange> keyframes;
  std::vector<std::shared_ptr<const SessionFile>> by_shards;
  std::function<void(const char* activity, double fraction)> on_progress;
  std::function<void(const std::string& text)> on_error;
};

struct PlanArguments {
  std::vector<std::string> words;  ///< The arguments of `map`.
  std::size_t shards = 0;
  std::filesystem::path out;
  Verbosity verbosity = Verbosity::kNormal;
};

/// Returns the arguments of `map` for the words of a command line.
/// @throws UsageError as the program does.
MapArguments mapArgumentsOf(const std::vector<std::string>& words);
/// Plans the map of the arguments of `map`. @throws as runMap.
PlannedMap planMapOf(const MapArguments& arguments);

/// `event-fusion plan`: finds the keyframes of a recording, and divides them into shards.
int runPlan(const PlanArguments& arguments);
/// `event-fusion map --plan`: makes the keyframes of a shard. A shard that is complete stays.
int runShard(const MapArguments& arguments);

struct JoinArguments {
  std::filesystem::path plan;
  std::vector<std::filesystem::path> shards;  ///< The folders of all shards, in any order.
  std::filesystem::path out;
  Verbosity verbosity = Verbosity::kNormal;
};

/// `event-fusion join`: makes the map of the keyframes of all shards: that of one run.
int runJoin(const JoinArguments& arguments);

struct DepthArguments : MappingArguments {
  /// Time of the reference view. Default: middle or end of the window, as the options say.
  std::optional<TimeArgument> t_ref;
  bool save_dsi = false;
};

/// `event-fusion map`: plays a recording and writes the map's folder. Prints a summary to stdout,
/// warnings and errors to stderr. SIGINT, SIGTERM or SIGHUP ends the run as the end of the
/// recording would; a second signal kills it. During the first look at the recording (automatic
/// options), a signal ends the run without a result: Interrupted.
/// @return the status: 0 only if the whole recording is mapped, 130 if a signal stopped the run.
/// @throws std::exception if the options or the recording cannot be read, or a file cannot be
/// written.
int runMap(const MapArguments& arguments);

/// `event-fusion depth`: maps one window. SIGINT, SIGTERM or SIGHUP before the keyframe is made
/// ends the run without a result. After that, the files of the keyframe are written.
/// @throws Interrupted if a signal came before the keyframe; an earlier result stays.
int runDepth(const DepthArguments& arguments);

struct SimulateArguments {
  SimulationOptions simulation;       ///< Without poses and cameras: with a scene they are read.
  std::filesystem::path trajectory;   ///< See `readPoses`: T_world_cam0.
  std::string time_unit;              ///< Of its times, where the file names none.
  std::filesystem::path calibration;  ///< Kalibr camera chain.
  std::filesystem::path out;
  Verbosity verbosity = Verbosity::kNormal;
};

/// `event-fusion simulate`: simulates a recording with exact truth and writes it as a dataset
/// folder.
/// @throws Interrupted if a signal came; std::exception if the arguments are not valid or a file
/// cannot be written. Then there is no result.
int runSimulate(const SimulateArguments& arguments);

/// The common arguments of `evaluate`.
struct EvaluateArguments {
  std::filesystem::path estimate;
  std::filesystem::path truth;
  bool json = false;
};

struct EvaluateDepthArguments : EvaluateArguments {
  std::optional<double> focal_px;
  std::optional<double> baseline_m;
  DepthEvaluationOptions options;
};

struct EvaluateMapArguments : EvaluateArguments {
  CloudEvaluationOptions options;
};

struct EvaluateTrajectoryArguments : EvaluateArguments {
  std::string alignment = "se3";  ///< se3, origin or none.
  std::vector<double> lengths_m;
  std::vector<double> deltas_s;
  std::vector<double> frames;
  TrajectoryEvaluationOptions options;
};

/// `event-fusion evaluate …`: prints the errors of results and draws them if asked for.
/// @throws std::exception if the results cannot be compared, or a file cannot be written.
int runEvaluateDepth(const EvaluateDepthArguments& arguments);
int runEvaluateMap(const EvaluateMapArguments& arguments);
int runEvaluateTrajectory(const EvaluateTrajectoryArguments& arguments);

/// Parses the command line. Prints the help or the version, if asked for.
/// @return a function that runs the chosen command, if there is one, and returns the exit status.
/// @throws UsageError if the command line is wrong.
std::function<int()> parseCommandLine(int argc, char** argv);

}  // namespace efm
