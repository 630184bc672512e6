// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "maps/cloud/global_cloud.h"
#include "maps/cloud/map_point.h"
#include "maps/metrics/depth_metrics.h"
#include "tracking_stub/presets/presets.h"

namespace efm::test {

/// A preset with its events and poses. Tests map it in several ways and compare with the truth.
class SimulatedRecording {
 public:
  explicit SimulatedRecording(const SimulationOptions& options);
  /// @param events one vector per camera of the simulation.
  SimulatedRecording(Simulation simulation, std::vector<std::vector<Event>> events);
  /// Returns desk_stereo with seed 1, simulated once for all tests (ctest's fixture `recordings`).
  /// @throws std::runtime_error if it has not been simulated.
  static const SimulatedRecording& desk();

  const Simulation& simulation() const { return simulation_; }
  const std::vector<std::vector<Event>>& events() const { return events_; }  ///< Per camera.
  const std::vector<StampedPose>& poses() const { return poses_; }

  std::vector<KeyframeDepthMap> map(const FusionMapperOptions& options) const;

  /// Returns the true z-depth in the keyframe's view, metres.
  cv::Mat1f truthOf(const KeyframeDepthMap& keyframe) const;
  /// Returns estimate and truth of each pixel with an estimate; the truth is within one pixel.
  std::vector<DepthPair> pairs(const KeyframeDepthMap& keyframe) const;

  /// Returns the median distance of a cloud's points to the nearest point of any surface, metres.
  double medianDistanceToSurfaces(const MapCloud& cloud) const;
  /// Returns the share of a cloud's points that are farther than `distance_m` from any surface.
  double shareBeyond(const MapCloud& cloud, double distance_m) const;

 private:
  Simulation simulation_;
  std::vector<std::vector<Event>> events_;
  std::vector<StampedPose> poses_;
};

/// Returns all keyframes in one cloud with voxels of 1 cm.
MapCloud::ConstPtr globalCloudOf(const std::vector<KeyframeDepthMap>& keyframes,
                                 const GlobalCloudOptions& options = {});

}  // namespace efm::test
