// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <exception>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "mapping/dsi/dsi_grid.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/sweep/space_sweep.h"
#include "plugin/app/commands.h"
#include "plugin/app/program.h"
#include "plugin/app/recording_interval.h"
#include "plugin/checks/health_checks.h"
#include "plugin/playback/progress.h"
#include "plugin/playback/recording_info.h"
#include "plugin/playback/session_map.h"
#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/open/open_recording.h"
#include "plugin/session/session_status.h"
#include "plugin/session_file/session_file.h"

namespace efm {
namespace {

std::string asText(const CameraModel& model) {
  const std::string size =
      knownSize(model) ? fmt::format("{}x{} pixels", model.width, model.height) : "unknown size";
  if (!isCalibrated(model)) return size + ", no calibration";
  const Eigen::Vector2d view_deg = fieldOfView(model) / kRadiansPerDegree;
  return fmt::format(
      "{}, focal length {:g} px, distortion {}, field of view {:.1f} x {:.1f} degrees", size,
      model.fx, nameOf(model.distortion), view_deg.x(), view_deg.y());
}

void printStream(const StreamStatistics& stream, const char* what) {
  fmt::print("{} {}", stream.count, what);
  if (stream.first_ns) {
    fmt::print(" from {} s to {} s ({:g} s, {:g} per second)", formatSeconds(*stream.first_ns),
               formatSeconds(*stream.last_ns), stream.seconds(), stream.rate());
  }
  fmt::print("\n");
}

/// Prints a camera's event rate over the time of all cameras' events.
void printRate(const EventRate& rate, std::int64_t first_ns, std::int64_t last_ns) {
  constexpr int kIntervals = 40;
  const std::vector<double> rates = rate.over(first_ns, last_ns, kIntervals);
  const double max = *std::max_element(rates.begin(), rates.end());
  if (max > 0) fmt::print("  rate |{}| up to {:.3g} per second\n", sparkline(rates), max);
}

void printCameras(const RecordingStatistics& statistics) {
  const auto span = statistics.eventSpan();
  for (const auto& [index, camera] : statistics.cameras()) {
    fmt::print("{}: {}\n  ", camera.label, asText(camera.camera.model));
    printStream(camera.events, "events");
    if (span) printRate(camera.rate, span->first_ns, span->last_ns);
  }
  const auto& cameras = statistics.cameras();
  for (auto a = cameras.begin(); a != cameras.end(); ++a) {
    for (auto b = std::next(a); b != cameras.end(); ++b) {
      fmt::print("baseline {} to {}: {:g} m\n", a->second.label, b->second.label,
                 baselineOf(a->second.camera, b->second.camera));
    }
  }
}

void printPoses(const RecordingStatistics& statistics) {
  std::optional<std::int64_t> start_ns;
  if (const auto events = statistics.eventSpan()) start_ns = events->first_ns;
  for (const auto& [source, used] : statistics.poseSources()) {
    const StreamStatistics& poses = used.poses;
    fmt::print("{}:\n  ", asText(source));
    printStream(poses, "poses");
    if (poses.count < 2) continue;
    fmt::print("  largest gap {:g} s, after {}\n", 1e-9 * static_cast<double>(poses.max_gap_ns),
               timeText(poses.max_gap_start_ns, start_ns));
    fmt::print("  path {:.4g} m, speed {:.3g} m/s on average, up to {:.3g} m/s and {:.3g} rad/s\n",
               used.path_m, poses.seconds() > 0 ? used.path_m / poses.seconds() : 0.0,
               used.max_speed, used.max_rotation_rate);
  }
  if (statistics.poseSources().empty()) {
    fmt::print("0 poses\n");
  } else if (const auto events = statistics.eventSpan()) {
    const StreamStatistics& poses = statistics.usedPoses()->poses;
    fmt::print("  the poses cover {:.1f} % of the events' time\n",
               100 * overlapOf(*events, {*poses.first_ns, *poses.last_ns}));
  }
  fmt::print("  {} events before the first pose, {} after the last\n",
             statistics.eventsBeforePoses(), statistics.eventsAfterPoses());
}

void printTransforms(const std::vector<RecordedTransform>& transforms) {
  constexpr std::size_t kMost = 12;
  for (std::size_t i = 0; i < std::min(transforms.size(), kMost); ++i) {
    fmt::print("transform {}->{}{}: {} messages\n", transforms[i].parent, transforms[i].child,
               transforms[i].moves ? ", moves" : "", transforms[i].count);
  }
  if (transforms.size() > kMost) fmt::print("  and {} more\n", transforms.size() - kMost);
}

void print(const RecordingInfo& info) {
  fmt::print("{} observations\n", info.observations);
  printCameras(info.statistics);
  printPoses(info.statistics);
  for (const RecordedTopic& topic : info.counts.topics) {
    fmt::print("topic {} ({}): {} messages", topic.name, topic.type, topic.messages);
    if (topic.from_ns > topic.until_ns) {
      fmt::print("\n");
    } else {
      fmt::print(" between {} s and {} s\n", formatSeconds(topic.from_ns),
                 formatSeconds(topic.until_ns));
    }
  }
  printTransforms(info.counts.transforms);
  for (const auto& [name, count] : info.others) fmt::print("{}: {} observations\n", name, count);
  if (info.counts.sorted_events > 0) {
    fmt::print("{} events out of order by up to 10 ms\n", info.counts.sorted_events);
  }
  if (info.true_depth_maps > 0) {
    fmt::print("truth: {} depth maps of camera 0\n", info.true_depth_maps);
  }
  if (info.chosen.empty()) return;
  fmt::print("the options that are auto would be:\n");
  for (const ChosenOption& option : info.chosen) {
    fmt::print("  {} = {:g}: {}\n", option.key, option.value, option.reason);
  }
}

/// Returns the sizes of the data caches that the system reports.
std::string cacheSizes() {
  std::string sizes;
  for (const auto& [name, key] : {std::pair("L1d", _SC_LEVEL1_DCACHE_SIZE),
                                  {"L2", _SC_LEVEL2_CACHE_SIZE},
                                  {"L3", _SC_LEVEL3_CACHE_SIZE}}) {
    const long bytes = sysconf(key);
    if (bytes <= 0) continue;
    sizes += fmt::format("{}{} {} KiB", sizes.empty() ? "" : ", ", name, bytes / 1024);
  }
  return sizes.empty() ? "unknown" : sizes;
}

/// Prints the processor, its cores and caches, its kernels and the chosen kernel.
void printSystem() {
  fmt::print("event-fusion {}\nprocessor: {}\ncores: {}\ncaches: {}\n", EFM_VERSION,
             processorName(), SpaceSweepOptions().threadsOrCores(), cacheSizes());
  for (const VotingKernel kernel : availableKernels()) {
    fmt::print("kernel {}{}\n", nameOf(kernel),
               kernel == fastestKernel() ? ": chosen where [performance] kernel = auto" : "");
  }
}

/// Prints what a session file has.
void printSession(const std::filesystem::path& file, bool as_json) {
  using Json = nlohmann::ordered_json;
  const SessionFile session(file);
  const Json& run = session.run();
  const Json report = Json::parse(session.report(), nullptr, false);
  Json info = {{"session", file.string()},
               {"version", run.value("version", "")},
               {"keyframes", session.keyframes()},
               {"generations", session.generations()},
               {"complete", session.isComplete()}};
  if (session.keyframes() > 0) {
    info["first_s"] = formatSeconds(session.keyframe(0).window.t_ref_ns);
    info["last_s"] = formatSeconds(session.keyframe(session.keyframes() - 1).window.t_ref_ns);
  }
  if (!session.damage().empty()) info["damage"] = session.damage();
  for (const auto& recorded : run.value("files", Json::array())) {
    info["recording"].push_back(recorded.value("name", ""));
  }
  if (report.is_object()) {
    for (const char* key : {"points", "map_hash", "quality", "stopped_at"}) {
      if (report.contains(key)) info[key] = report[key];
    }
  }
  if (as_json) return fmt::print("{}\n", info.dump(2, ' ', false, Json::error_handler_t::replace));
  for (const auto& [key, value] : info.items()) {
    const Json& shown = key == "quality" && value.is_object() ? value.at("word") : value;
    fmt::print("{:<12} {}\n", key,
               shown.is_string() ? shown.get<std::string>()
                                 : shown.dump(-1, ' ', false, Json::error_handler_t::replace));
  }
}

}  // namespace

int runInfo(const InfoArguments& arguments) {
  if (arguments.system) printSystem();
  if (arguments.source.files.empty()) return 0;
  if (const auto session = sessionAt(arguments.source.files.front());
      session && arguments.source.files.size() == 1) {
    printSession(*session, arguments.json);
    return 0;
  }
  RecordingSource source = arguments.source;
  source.limits = RecordingTimes(source).resolve(arguments.times);
  RecordingInfo info;
  {
    Progress progress("reading", arguments.verbosity);
    info = readInfo(source, [&](double fraction) { progress.show(fraction); });
  }
  if (arguments.json) {
    fmt::print("{}\n", infoJson(info));
  } else if (arguments.verbosity != Verbosity::kQuiet) {
    print(info);
  }
  if (!info.error.empty()) throw std::runtime_error(info.error);
  printWarnings(info.warnings);
  printWarnings(info.notes, "note");
  return arguments.strict && failStrictly(info.warnings) ? kFailedStatus : 0;
}

std::string processorName() {
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    const auto colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != std::string::npos) {
      return line.substr(colon + 2);
    }
  }
  std::string board;
  std::getline(std::ifstream("/sys/firmware/devicetree/base/model"), board, '\0');
  return board.empty() ? "unknown" : board;
}

}  // namespace efm
