// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/maps/CMultiMetricMap.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/poses/CPose3DPDF.h>

#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "maps/cloud/map_point.h"
#include "plugin/session/input_queue.h"
#include "plugin/session/mapping_session.h"

namespace efm {

/// A keyframe of a simplemap. Shared with those who asked for the map: never changed.
struct SimpleMapFrame {
  mrpt::poses::CPose3DPDF::Ptr pose;
  mrpt::obs::CSensoryFrame::Ptr frame;
};

/// The map as it was at one moment.
struct MapSnapshot {
  std::vector<StampedPose> trajectory;     ///< Of all keyframes, those of the initial map first.
  std::vector<Rigid3> T_odom_ref;          ///< Of the others: by the tracker.
  std::vector<SimpleMapFrame> frames;      ///< The newest keyframes, as those of a simplemap.
  MapCloud::ConstPtr points;               ///< The exported points.
  mrpt::maps::CMultiMetricMap metric_map;  ///< The points as a CPointsMapXYZI.
};

/// The poses T_world_ref of all keyframes at t_ref, those of the initial map first.
struct KeyframePoses {
  std::vector<StampedPose> in_map;
  std::vector<StampedPose> by_tracker;  ///< They differ for refined keyframes.
};
/// @param T_odom_ref of the last keyframes by the tracker.
KeyframePoses keyframePoses(std::vector<StampedPose> in_map, const std::vector<Rigid3>& T_odom_ref);

/// A mapping session as the map builder hosts it: in the caller's thread (PlaybackMapping) or in a
/// thread of its own (LiveMapping). Thread-safe.
class HostedMapping {
 public:
  struct Callbacks {
    /// All run without a lock, in the thread that maps.
    std::function<void(const KeyframeDepthMap&)> on_keyframe;
    std::function<void(const std::shared_ptr<const MapSnapshot>&)> on_map;
    std::function<void(const std::string&)> warn;
    std::function<void(const std::string&)> info;
  };

  virtual ~HostedMapping() = default;

  /// @throws std::invalid_argument where the packet is refused.
  virtual void addEvents(CameraPacket packet) = 0;
  /// Counts a packet that is not to be mapped, and gives up its windows.
  virtual void skipEvents(const CameraPacket& packet) = 0;
  virtual void addPose(const QueuedPose& pose) = 0;
  /// Maps the rest.
  virtual void finish() = 0;
  /// Ends without mapping the rest: input is lost from now on, and no callback comes after the
  /// current one.
  virtual void stop() = 0;
  /// False in a thread of the mapping's own: within a callback. `stop` does not wait there.
  virtual bool mayStopHere() const { return true; }

  virtual void setSink(DsiSink* sink) = 0;
  virtual void setClock(ProcessorClock clock) = 0;

  /// The pose of the rig on the body, from the options.
  virtual std::optional<Rigid3> T_body_rig() const = 0;
  virtual SessionStatus status() const = 0;
  virtual MapCloud::ConstPtr points() = 0;
  virtual KeyframePoses keyframePoses() = 0;
  /// The keyframes of a simplemap.
  virtual std::size_t simpleMapSize() const = 0;
  virtual void copyTo(mrpt::maps::CSimpleMap& map) = 0;
  /// Valid until the next call, or the end of this object.
  virtual const mrpt::maps::CMultiMetricMap* metricMap() = 0;
  /// Null where the mapping makes none.
  virtual std::shared_ptr<const MapSnapshot> snapshot() const { return nullptr; }
  /// The newest keyframe's depth map, empty before the first one, and its planes.
  virtual std::pair<cv::Mat1f, DepthPlanesOptions> newestDepth() const = 0;
};

/// Logs the automatic options and why. Where no scene was found, as a warning.
void tellChoice(const SessionStatus& status, const HostedMapping::Callbacks& callbacks);

}  // namespace efm
