// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/playback/stored_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>

#include "mapping/base/atomic_file.h"
#include "mapping/base/picture_file.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/options/tracker_fault_keys.h"
#include "plugin/playback/output_checks.h"
#include "plugin/results/output/result_folder.h"
#include "plugin/session_file/run_record.h"

namespace efm {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Returns whether the images of a keyframe are there, in its folder and those of single cameras.
/// @param reads whether they must be those of its depths, too: a crash of the machine may lose
/// files that were written in the minute before it.
bool hasImages(const fs::path& folder, const KeyframeDepthMap& keyframe, bool reads) {
  const auto has = [&](const fs::path& of, const DepthMap& map) {
    for (const char* name :
         {"depth.tiff", "confidence.tiff", "probability.tiff", "depth.png", "confidence.png"}) {
      if (!fs::exists(of / name)) return false;
      if (reads && decodePicture(readBytes(of / name)).empty()) return false;
    }
    if (!reads) return true;
    const cv::Mat depth = decodePicture(readBytes(of / "depth.tiff"));
    return depth.type() == CV_32FC1 && depth.size() == map.depth.size() &&
           cv::countNonZero(depth != map.depth) == 0;
  };
  try {
    return has(folder, keyframe.map) &&
           std::all_of(keyframe.camera_maps.begin(), keyframe.camera_maps.end(),
                       [&](const CameraDepthMap& of_one) {
                         return has(folder / fmt::format("cam{}", of_one.camera), of_one.map);
                       });
  } catch (const std::runtime_error&) {
    return false;
  }
}

/// Finds the keyframes that can be used: those before the first one whose images are not whole, or
/// that was made after the run was stopped.
void findUsable(StoredRun& stored) {
  constexpr std::chrono::minutes kWritten(2);  // after that, a file is on the disk
  const auto timeOf = [](const fs::path& file) {
    std::error_code missing;
    return fs::last_write_time(file, missing);
  };
  const SessionFile& session = *stored.session;
  const auto newest = timeOf(session.path());
  for (std::size_t i = 0; i < session.keyframes(); ++i) {
    const KeyframeDepthMap keyframe = session.keyframe(i);
    const std::string name = formatSeconds(keyframe.window.t_ref_ns);
    const fs::path images = stored.folder / "keyframes" / name;
    const bool is_new = timeOf(images / "depth.tiff") > newest - kWritten;
    if (!hasImages(images, keyframe, is_new) || keyframe.after_stop) return;
    stored.names.push_back(name);
    stored.kernels.insert(keyframe.kernel);
  }
}

Json limitsOf(const TimeLimits& limits) {
  const auto text = [](const std::optional<std::int64_t>& t_ns) {
    return t_ns ? Json(formatSeconds(*t_ns)) : Json();
  };
  return {{"t0", text(limits.t0_ns)}, {"t1", text(limits.t1_ns)}};
}

}  // namespace

Json runOf(const MapJob& job) {
  const RecordingSource source = job.sourceNow();
  Json run = runOf(job.options);
  run["files"] = fingerprintOf(inputsOf(source), job.out);
  run["limits"] = limitsOf(job.options.mapper.limits);
  const ReaderOptions& reader = source.reader;
  run["reading"] = {{"format", source.format},
                    {"topics", reader.topics},
                    {"event_columns", reader.columns},
                    {"time_unit", reader.time_unit},
                    {"pose_time_unit", reader.pose_time_unit},
                    {"skip_bad_events", source.skip_bad_events},
                    {"cameras", source.cameras},
                    {"plain_pictures", job.plain_pictures}};
  if (const auto& size = reader.sensor_size)
    run["reading"]["sensor_size"] = {size->width, size->height};
  run["perturbation"] = asJson(source.faults);
  if (job.shard) run["shard"] = {job.shard->begin, job.shard->end};
  // As a file has it: names need not be UTF-8.
  return Json::parse(run.dump(-1, ' ', false, Json::error_handler_t::replace));
}

std::optional<StoredRun> findStored(const MapJob& job, const Json& run,
                                    std::vector<std::string>& notes) {
  std::optional<StoredRun> best;
  std::string difference;  // why a file is not used
  const std::vector<fs::path> folders = ResultFolder::storedIn(job.out);
  for (const fs::path& folder : folders) {
    const fs::path file = folder / "session.mcap";
    if (!fs::exists(file)) continue;
    StoredRun found;
    found.folder = folder;
    try {
      found.session = std::make_shared<const SessionFile>(file);
    } catch (const std::runtime_error& error) {
      difference = error.what() + std::string(": expected a file that can be read, or no --resume");
      continue;
    }
    if (found.session->keyframes() == 0 || found.session->run().contains("exported_from")) continue;
    if (const auto differences = differencesOf(found.session->run(), run); !differences.empty()) {
      if (difference.empty()) {
        difference =
            fmt::format("{} holds {} keyframes of another run: {}: expected {}", file.string(),
                        found.session->keyframes(), fmt::join(differences, "; "),
                        job.shard ? "a folder of its own for each shard of each plan"
                                  : "the same options and recording, or no --resume");
      }
      continue;
    }
    if (best && best->session->keyframes() >= found.session->keyframes()) continue;
    best = std::move(found);
  }
  if (!best && !difference.empty()) throw std::runtime_error(difference);
  if (!best) {
    if (!job.shard)
      notes.push_back(job.out.string() + ": no keyframe is stored: the map begins anew");
    return best;
  }
  best->is_complete = best->folder == folders.front() && best->session->isComplete() &&
                      fs::exists(best->folder / "report.json");
  if (best->is_complete) {
    notes.push_back(job.out.string() + " is complete: nothing to do");
    return best;
  }
  findUsable(*best);
  const std::string& damage = best->session->damage();
  notes.push_back(fmt::format("goes on after the {} keyframes in {}{}", best->names.size(),
                              best->session->path().string(),
                              damage.empty() ? "" : " (" + damage + ")"));
  return best;
}

void requireSameChoice(const Json& earlier, const Json& run, const std::string& name,
                       const std::string& remedy) {
  Json before = earlier, now = run;
  for (Json* of : {&before, &now}) {
    (*of)["given"] = of->value("options", Json());
    of->erase("shard");
  }
  const std::vector<std::string> differences = differencesOf(before, now);
  if (differences.empty()) return;
  throw std::runtime_error(
      fmt::format("{}: it is of other options, or of another recording: {}: expected the same "
                  "recording, machine and libraries{}",
                  name, fmt::join(differences, "; "), remedy));
}

void StoredRun::removeOthers(const fs::path& result) const {
  if (!fs::exists(result / "keyframes")) return;
  for (const auto& entry : fs::directory_iterator(result / "keyframes")) {
    const std::string name = entry.path().filename().string();
    if (std::find(names.begin(), names.end(), name) == names.end()) fs::remove_all(entry.path());
  }
}

std::function<std::optional<KeyframeDepthMap>(const Window&)> storedKeyframes(
    std::vector<StoredKeyframes> sessions) {
  struct Cursor {
    std::size_t session = 0, next = 0;
    std::optional<KeyframeDepthMap> waiting;
  };
  return [sessions = std::move(sessions), cursor = std::make_shared<Cursor>()](
             const Window& window) -> std::optional<KeyframeDepthMap> {
    auto& [session, next, waiting] = *cursor;
    while (!waiting && session < sessions.size()) {
      if (next == sessions[session].count) {
        ++session;
        next = 0;
        continue;
      }
      waiting = sessions[session].session->keyframe(next++);
      waiting->T_world_ref = waiting->T_odom_ref;
    }
    if (!waiting) return std::nullopt;
    const Window& stored = waiting->window;
    if (stored.t0_ns == window.t0_ns && stored.t1_ns == window.t1_ns) {
      return std::exchange(waiting, std::nullopt);
    }
    if (window.t0_ns < stored.t0_ns) return std::nullopt;  // it had no keyframe
    throw std::runtime_error(fmt::format(
        "{}: keyframe {} is of the window from {} s to {} s: expected the window from {} s to {} s "
        "(made anew in another folder, it is right)",
        sessions[session].session->path().string(), next, formatSeconds(stored.t0_ns),
        formatSeconds(stored.t1_ns), formatSeconds(window.t0_ns), formatSeconds(window.t1_ns)));
  };
}

}  // namespace efm
