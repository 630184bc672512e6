// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/geometry/trajectory_check.h"
#include "plugin/checks/pose_motion.h"
#include "plugin/recordings/streams/sample.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/pose_source_selector.h"
#include "plugin/session/session_status.h"

namespace efm {

/// Event rate over a recording of any length, in constant memory: a fixed number of bins. If time
/// exceeds the last bin, neighbouring bins are joined and all become twice as wide.
class EventRate {
 public:
  /// Adds an event. An event with a time before the first event counts for the first bin.
  void add(std::int64_t t_ns) {
    if (!start_ns_) start_ns_ = t_ns;
    std::int64_t bin = t_ns < *start_ns_ ? 0 : (t_ns - *start_ns_) >> log2_width_;
    for (; bin >= kBins; bin >>= 1) joinBins();
    ++counts_[static_cast<std::size_t>(bin)];
  }

  /// Returns the events per second in equal intervals that divide [t0, t1]. An event counts for all
  /// intervals that its bin overlaps: a bin is at most 1/4096 of the time from the first event on.
  std::vector<double> over(std::int64_t t0_ns, std::int64_t t1_ns, int intervals) const;
  /// Returns the number of events in [t0, t1). Each bin counts in proportion to its overlap.
  double countIn(std::int64_t t0_ns, std::int64_t t1_ns) const;

 private:
  static constexpr std::int64_t kBins = 8192;

  void joinBins();

  std::optional<std::int64_t> start_ns_;
  int log2_width_ = 10;  // nanoseconds
  std::array<std::uint64_t, kBins> counts_{};
};

/// Returns the fraction of the events' time with poses, 0 to 1.
double overlapOf(const TimeSpan& events, const TimeSpan& poses);

/// Returns a line of block characters (UTF-8), one per value: eight heights up to the largest
/// value, and a blank for 0.
std::string sparkline(const std::vector<double>& values);

/// What of a recording is counted. The default: as recorded.
struct StatisticsOptions {
  std::vector<int> cameras;  ///< The cameras that take part; empty: all.
  std::string pose_source;   ///< Label of the source; empty: the best source.
  /// Motion is measured within windows of this length.
  double window_s = 1.0;
};

/// Returns the options for the recording of a map that are known before the mapping.
StatisticsOptions statisticsOptions(const EventFusionOptions& options);

/// Times of events or poses, in the order of the recording, on the trajectory's clock.
struct StreamStatistics {
  std::uint64_t count = 0;
  std::optional<std::int64_t> first_ns;
  std::optional<std::int64_t> last_ns;
  std::int64_t max_gap_ns = 0;  ///< Largest gap between two additions.
  std::int64_t max_gap_start_ns = 0;

  /// Adds a number of times in the closed interval [from, until].
  void add(std::int64_t from_ns, std::int64_t until_ns, std::uint64_t number);
  double seconds() const;
  double rate() const;  ///< Per second; 0 if the stream has no duration.
};

/// Statistics of the events of one camera.
struct CameraStatistics {
  std::string label;
  RigCamera camera;
  StreamStatistics events;
  std::uint64_t positive = 0;  ///< Events of positive polarity.
  EventRate rate;
  /// Events per pixel, row-major; empty if the sensor is too large to count them.
  std::vector<std::uint32_t> pixels;

  std::vector<std::int64_t> newest_ns;  ///< Times of the events in the last packet.
};

/// Statistics of the poses of one source.
struct PoseStatistics {
  StreamStatistics poses;
  std::size_t order = 0;  ///< Rank among the sources, by the first poses.
  double path_m = 0;
  double max_speed = 0;          ///< m/s, over at least 10 ms.
  double max_rotation_rate = 0;  ///< rad/s, over at least 10 ms.
  double lever_m = 0;            ///< Largest distance from the tracked body to the rig.
  double max_shift_m = 0;        ///< Largest distance from the first pose of a window.
  double max_rotation_rad = 0;   ///< Largest rotation from the first pose of a window.
  PoseMotion motion;
  TrajectoryCheck check;  ///< Do the poses belong to one body?

  void add(const StampedPose& pose, std::int64_t window_ns);

 private:
  std::optional<StampedPose> step_begin_;
  std::optional<StampedPose> window_begin_;
};

/// Collects statistics of a recording from each of its samples, for `warningsOf`. Memory does not
/// grow with the recording. Not thread-safe.
class RecordingStatistics {
 public:
  using Cameras = std::map<int, CameraStatistics>;  ///< The cameras that take part, by index.

  explicit RecordingStatistics(StatisticsOptions options = {}) : options_(std::move(options)) {}

  /// Sets the length of the windows in which motion is measured. Call it before the first pose.
  void setWindow(double window_s) { options_.window_s = window_s; }
  /// Sets the cameras, before the first events. @param recorded may be empty: without labels.
  void setCameras(const Rig& rig, const std::vector<RecordedCamera>& recorded);
  /// @return false if the sample is neither events nor a pose.
  bool add(const Sample& sample);
  /// @param packet must have its events in time order.
  void addEvents(const EventPacket& packet);
  void addPose(const PoseSample& pose);

  const Cameras& cameras() const { return cameras_; }
  const std::map<PoseSourceId, PoseStatistics>& poseSources() const { return pose_sources_; }
  /// Returns the source whose poses are used (see PoseSourceSelector); null if there is none.
  const PoseStatistics* usedPoses() const;
  /// Returns the times of the first and the last event of all cameras.
  std::optional<TimeSpan> eventSpan() const;
  /// Return the number of events before the first pose, and after the last pose, of all sources.
  std::uint64_t eventsBeforePoses() const { return events_before_poses_; }
  std::uint64_t eventsAfterPoses() const { return events_after_poses_; }

 private:
  void countAroundPose(std::int64_t t_ns);

  StatisticsOptions options_;
  Cameras cameras_;
  std::map<PoseSourceId, PoseStatistics> pose_sources_;
  StreamStatistics poses_;  // poses of all sources
  std::uint64_t events_before_poses_ = 0;
  std::uint64_t events_after_poses_ = 0;
};

}  // namespace efm
