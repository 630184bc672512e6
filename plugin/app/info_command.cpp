// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/info_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <exception>
#include <map>
#include <optional>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "plugin/app/progress.h"
#include "plugin/app/recording_interval.h"
#include "plugin/app/system_info.h"
#include "plugin/formats/open_recording.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/pose_observation.h"

namespace efm {
namespace {

/// Times of events or poses, in the order of the recording.
struct Stream {
  std::uint64_t count = 0;
  std::optional<std::int64_t> first_ns;
  std::optional<std::int64_t> last_ns;
  std::int64_t max_gap_ns = 0;
  std::int64_t max_gap_start_ns = 0;

  void add(std::int64_t t_ns) {
    ++count;
    if (last_ns && t_ns - *last_ns > max_gap_ns) {
      max_gap_ns = t_ns - *last_ns;
      max_gap_start_ns = *last_ns;
    }
    first_ns = std::min(first_ns.value_or(t_ns), t_ns);
    last_ns = std::max(last_ns.value_or(t_ns), t_ns);
  }
  double seconds() const { return first_ns ? secondsBetween(*first_ns, *last_ns) : 0.0; }
  double rate() const { return seconds() > 0 ? static_cast<double>(count) / seconds() : 0.0; }
};

struct CameraInfo {
  CameraModel model;
  Stream events;
  std::vector<Event> newest;  // the last packet: the next pose may lie within it
};

std::uint64_t countEvents(const std::vector<Event>& events, std::int64_t from_ns,
                          std::int64_t until_ns) {
  return static_cast<std::uint64_t>(std::count_if(
      events.begin(), events.end(),
      [&](const Event& event) { return event.t_ns >= from_ns && event.t_ns < until_ns; }));
}

/// The contents of a recording.
class Contents {
 public:
  std::uint64_t observations = 0;
  std::map<std::string, CameraInfo> cameras;  // by label
  std::map<PoseSourceId, Stream> pose_sources;
  Stream poses;                                 // of all sources
  std::uint64_t events_before_poses = 0;        // earlier than the first pose
  std::uint64_t events_after_poses = 0;         // later than the last pose
  std::map<std::string, std::uint64_t> others;  // by class

  void add(const mrpt::obs::CObservation& observation) {
    ++observations;
    if (const auto* packet = dynamic_cast<const CObservationEvents*>(&observation)) {
      addPacket(*packet);
    } else if (const auto source = poseSourceOf(observation)) {
      const std::int64_t t_ns = poseIn(observation)->t_ns;
      pose_sources[*source].add(t_ns);
      addPose(t_ns);
    } else {
      ++others[observation.GetRuntimeClass()->className];
    }
  }

 private:
  void addPacket(const CObservationEvents& packet) {
    CameraInfo& camera = cameras[packet.sensorLabel];
    camera.model = packet.camera;
    for (const Event& event : packet.events) camera.events.add(event.t_ns);
    if (poses.last_ns) {
      events_before_poses += countEvents(packet.events, -kMaxTimeNs, *poses.first_ns);
      events_after_poses += countEvents(packet.events, *poses.last_ns + 1, kMaxTimeNs);
    }
    camera.newest = packet.events;
  }

  /// The recording is in the order of time: a new pose can lie only within the last packet of each
  /// camera.
  void addPose(std::int64_t t_ns) {
    const bool first = poses.count == 0;
    poses.add(t_ns);
    if (*poses.last_ns == t_ns) events_after_poses = 0;
    for (const auto& [label, camera] : cameras) {
      const std::uint64_t not_before = countEvents(camera.newest, t_ns, kMaxTimeNs);
      if (first) events_before_poses += camera.events.count - not_before;
      if (*poses.last_ns == t_ns) {
        events_after_poses += countEvents(camera.newest, t_ns + 1, kMaxTimeNs);
      }
    }
  }
};

std::string asText(const CameraModel& model) {
  constexpr int kUnknown = 65'535;
  const std::string size = model.width == kUnknown
                               ? "unknown size"
                               : fmt::format("{}x{} pixels", model.width, model.height);
  if (model.fx <= 0) return size + ", no calibration";
  return fmt::format("{}, focal length {:g} px, distortion {}", size, model.fx,
                     nameOf(model.distortion));
}

void printStream(const Stream& stream, const char* what) {
  fmt::print("{} {}", stream.count, what);
  if (stream.first_ns) {
    fmt::print(" from {} s to {} s ({:g} s, {:g} per second)", formatSeconds(*stream.first_ns),
               formatSeconds(*stream.last_ns), stream.seconds(), stream.rate());
  }
  fmt::print("\n");
}

void print(const Contents& contents, const RecordingCounts& counts) {
  fmt::print("{} observations\n", contents.observations);
  for (const auto& [label, camera] : contents.cameras) {
    fmt::print("{}: {}\n  ", label, asText(camera.model));
    printStream(camera.events, "events");
  }
  for (const auto& [source, poses] : contents.pose_sources) {
    fmt::print("{}:\n  ", asText(source));
    printStream(poses, "poses");
    if (poses.count > 1) {
      fmt::print("  largest gap {:g} s, after {} s\n", 1e-9 * static_cast<double>(poses.max_gap_ns),
                 formatSeconds(poses.max_gap_start_ns));
    }
  }
  if (contents.pose_sources.empty()) fmt::print("0 poses\n");
  fmt::print("  {} events before the first pose, {} after the last\n", contents.events_before_poses,
             contents.events_after_poses);
  for (const auto& [name, count] : contents.others)
    fmt::print("{}: {} observations\n", name, count);
  if (counts.sorted_events > 0) {
    fmt::print("{} events out of order by up to 10 ms\n", counts.sorted_events);
  }
  warnOfLosses(counts);
}

}  // namespace

int runInfo(const InfoArguments& arguments) {
  const int status = arguments.system ? printSystem() : 0;
  if (arguments.source.files.empty()) return status;
  RecordingSource source = arguments.source;
  source.faults.latency_ns = 0;  // latency changes no time stamp
  source.complete = false;
  const std::unique_ptr<Recording> recording =
      openInterval(source, resolve(arguments.times, source));
  Contents contents;
  std::exception_ptr stopped;
  {
    Progress progress;
    try {
      while (const auto observation = recording->next()) {
        contents.add(*observation);
        progress.showFraction("reading", recording->progress());
      }
    } catch (const std::exception&) {
      stopped = std::current_exception();
    }
  }
  print(contents, recording->counts());
  if (stopped) std::rethrow_exception(stopped);
  return status;
}

}  // namespace efm
