// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/info_command.h"

#include <algorithm>
#include <cstdint>
#include <exception>
#include <iostream>
#include <map>
#include <optional>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "plugin/app/progress.h"
#include "plugin/formats/open_recording.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/pose_observation.h"
#include "plugin/recordings/time_cut.h"

namespace efm {
namespace {

/// Times of a stream of things, in the order of the recording.
struct Stream {
  std::uint64_t count = 0;
  std::optional<std::int64_t> first_ns;
  std::optional<std::int64_t> last_ns;
  std::int64_t largest_gap_ns = 0;
  std::int64_t largest_gap_at_ns = 0;  ///< Where it begins.

  void add(std::int64_t t_ns) {
    ++count;
    if (last_ns && t_ns - *last_ns > largest_gap_ns) {
      largest_gap_ns = t_ns - *last_ns;
      largest_gap_at_ns = *last_ns;
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
  std::vector<Event> newest;  // the last packet: a pose may come that lies within it
};

std::uint64_t countEvents(const std::vector<Event>& events, std::int64_t from_ns,
                          std::int64_t until_ns) {
  return static_cast<std::uint64_t>(std::count_if(
      events.begin(), events.end(),
      [&](const Event& event) { return event.t_ns >= from_ns && event.t_ns < until_ns; }));
}

/// What a recording holds, gathered observation by observation.
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

  /// In the order of time a pose can only lie within the last packet of each camera.
  void addPose(std::int64_t t_ns) {
    const bool first = poses.count == 0;
    poses.add(t_ns);
    if (*poses.last_ns == t_ns) events_after_poses = 0;
    for (const auto& [label, camera] : cameras) {
      if (first)
        events_before_poses += camera.events.count - countEvents(camera.newest, t_ns, kMaxTimeNs);
      if (*poses.last_ns == t_ns)
        events_after_poses += countEvents(camera.newest, t_ns + 1, kMaxTimeNs);
    }
  }
};

void printStream(const Stream& stream, const char* what) {
  std::cout << stream.count << " " << what;
  if (stream.first_ns) {
    std::cout << " from " << formatSeconds(*stream.first_ns) << " s to "
              << formatSeconds(*stream.last_ns) << " s (" << stream.seconds() << " s, "
              << stream.rate() << " per second)";
  }
  std::cout << "\n";
}

void print(const Contents& contents, const RecordingCounts& counts) {
  std::cout << contents.observations << " observations\n";
  for (const auto& [label, camera] : contents.cameras) {
    std::cout << label << ": " << camera.model.width << "x" << camera.model.height
              << " pixels, focal length " << camera.model.fx << " px, distortion "
              << nameOf(camera.model.distortion) << "\n  ";
    printStream(camera.events, "events");
  }
  for (const auto& [source, poses] : contents.pose_sources) {
    std::cout << asText(source) << ":\n  ";
    printStream(poses, "poses");
    if (poses.count > 1) {
      std::cout << "  largest gap " << 1e-9 * static_cast<double>(poses.largest_gap_ns)
                << " s, after " << formatSeconds(poses.largest_gap_at_ns) << " s\n";
    }
  }
  if (contents.pose_sources.empty()) std::cout << "0 poses\n";
  std::cout << "  " << contents.events_before_poses << " events before the first pose, "
            << contents.events_after_poses << " after the last\n";
  for (const auto& [name, count] : contents.others) {
    std::cout << name << ": " << count << " observations\n";
  }
  if (counts.sorted_events > 0) {
    std::cout << counts.sorted_events << " events out of order by up to 10 ms\n";
  }
}

}  // namespace

int runInfo(const InfoArguments& arguments) {
  RecordingSource source = arguments.source;
  source.faults.latency_ns = 0;  // stamps are what counts
  const std::unique_ptr<Recording> recording =
      cutTime(openRecording(source), arguments.t0_ns, arguments.t1_ns);
  Contents contents;
  std::exception_ptr stopped;
  {
    Progress progress;
    try {
      while (const auto observation = recording->next()) {
        contents.add(*observation);
        progress.showShare("reading", recording->progress());
      }
    } catch (const std::exception&) {
      stopped = std::current_exception();
    }
  }
  print(contents, recording->counts());
  if (stopped) std::rethrow_exception(stopped);
  return 0;
}

}  // namespace efm
