// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/import_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/app/interruption.h"
#include "plugin/app/observed_statistics.h"
#include "plugin/app/output_checks.h"
#include "plugin/app/progress.h"
#include "plugin/app/recording_interval.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/pose_observation.h"
#include "plugin/recordings/open/open_recording.h"
#include "plugin/recordings/open/rawlog.h"
#include "plugin/session/health_checks.h"
#include "plugin/session/session_status.h"

namespace efm {
namespace {

/// An existing file is replaced only if it is a rawlog, and none of the inputs.
void refuseToDestroy(const ImportArguments& arguments) {
  if (std::filesystem::is_regular_file(arguments.out)) requireRawlog(arguments.out);
}

}  // namespace

int runImport(const ImportArguments& arguments) {
  refuseToReplace(arguments.out, inputsOf(arguments.source));
  refuseToDestroy(arguments);
  RecordingSource source = arguments.source;
  source.complete = false;
  const TimeLimits limits = resolve(arguments.times, source);
  const std::unique_ptr<Recording> recording = openInterval(source, limits);
  const Interruption interruption;
  RawlogWriter writer(arguments.out, arguments.compression);
  std::map<std::string, std::uint64_t> events;  // per label
  std::uint64_t all_events = 0;
  std::uint64_t poses = 0;
  std::uint64_t odometry = 0;  // of them
  std::uint64_t others = 0;
  std::map<int, CameraModel> cameras;
  std::optional<std::string> damage;
  {
    Progress progress("importing", arguments.verbosity);
    damage = readAll(*recording, [&](mrpt::obs::CObservation& observation) {
      interruption.check();
      writer.write(observation);
      if (const auto* packet = dynamic_cast<const CObservationEvents*>(&observation)) {
        cameras.emplace(packet->camera_index, packet->camera);
        events[packet->sensorLabel] += packet->events.size();
        all_events += packet->events.size();
      } else if (const auto poses_of = poseSourceOf(observation)) {
        ++poses;
        if (poses_of->kind == PoseKind::kOdometry) ++odometry;
      } else {
        ++others;
      }
      progress.show(recording->progress());
    });
    if (all_events == 0 && damage) throw std::runtime_error(*damage);
    if (all_events == 0) refuseLimitsWithoutEvents(source, limits);
    if (all_events + poses + others == 0) {
      throw std::runtime_error("the recording holds nothing " + limitsText(limits));
    }
    writer.close();
  }
  printWarnings(missingParts(cameras, all_events > 0, poses > 0));
  warnOfLosses(recording->counts());
  if (odometry > 0 && !arguments.source.hand_eye.empty()) {
    printWarnings({{"hand-eye-left-out",
                    fmt::format("odometry ({} observations) cannot hold the hand-eye transform: "
                                "give it to map as well (--hand-eye)",
                                odometry)}});
  }
  const int status = damage ? failAfter(*damage, all_events, poses, arguments.out) : 0;
  if (arguments.verbosity == Verbosity::kQuiet) return status;
  for (const auto& [label, count] : events) fmt::print("{}: {} events\n", label, count);
  if (others > 0) fmt::print("{} other observations\n", others);
  fmt::print("{} poses; {} events were out of order and sorted\n", poses,
             recording->counts().sorted_events);
  const auto bytes = static_cast<double>(std::filesystem::file_size(arguments.out));
  fmt::print("written to {}, {:.1f} MB, {:.2f} bytes per event\n", arguments.out.string(),
             bytes * 1e-6, all_events == 0 ? 0.0 : bytes / static_cast<double>(all_events));
  return status;
}

}  // namespace efm
