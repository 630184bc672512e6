// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "maps/cloud/global_cloud.h"
#include "maps/cloud/map_point.h"
#include "maps/metrics/depth_metrics.h"
#include "tracking_stub/presets/presets.h"

namespace efm::test {

/// A preset with its events and poses, to be mapped in several ways and held against the truth.
class SimulatedRecording {
 public:
  explicit SimulatedRecording(const SimulationOptions& options);
  /// @param events of each camera of the simulation.
  SimulatedRecording(Simulation simulation, std::vector<std::vector<Event>> events);
  /// desk_stereo with seed 1, simulated once for all tests (the fixture `recordings` of ctest).
  /// @throws std::runtime_error where it has not been simulated.
  static const SimulatedRecording& desk();

  const Simulation& simulation() const { return simulation_; }
  const std::vector<std::vector<Event>>& events() const { return events_; }  ///< Per camera.
  const std::vector<StampedPose>& poses() const { return poses_; }

  std::vector<KeyframeDepthMap> map(const FusionMapperOptions& options) const;

  /// The true z-depth in the keyframe's view.
  cv::Mat1f truthOf(const KeyframeDepthMap& keyframe) const;
  /// Estimate and truth wherever there is an estimate, the truth within one pixel.
  std::vector<DepthPair> pairs(const KeyframeDepthMap& keyframe) const;

  /// Median distance of a cloud's points to the nearest point of any surface, metres.
  double medianDistanceToSurfaces(const MapCloud& cloud) const;
  /// Share of a cloud's points that are farther than this from any surface.
  double shareBeyond(const MapCloud& cloud, double distance_m) const;

 private:
  Simulation simulation_;
  std::vector<std::vector<Event>> events_;
  std::vector<StampedPose> poses_;
};

/// All keyframes in one cloud of voxels of a centimetre.
MapCloud::ConstPtr globalCloudOf(const std::vector<KeyframeDepthMap>& keyframes,
                                 const GlobalCloudOptions& options = {});

}  // namespace efm::test
