// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>

#include <map>
#include <optional>

#include "plugin/mrpt/pose_observation.h"

namespace efm {

/// T_world_rig of an observed pose: T_world_body * T_body_rig, with the options' T_body_rig if they
/// have one.
Rigid3 rigPose(const ObservedPose& observed, const std::optional<Rigid3>& T_body_rig);

/// The newest pose of the rig from each source, with the covariance that the tracker states.
class TrackerPoses {
 public:
  /// @param observation a pose, with the content `observed`.
  void add(const mrpt::obs::CObservation& observation, const ObservedPose& observed,
           const Rigid3& T_world_rig);
  /// @param selected the source that is used; before it is selected, the first one with poses in
  /// the
  ///   world counts.
  /// @return null before its first pose.
  const mrpt::poses::CPose3DPDFGaussian* newest(const std::optional<PoseSourceId>& selected) const;
  void clear() { newest_.clear(); }

 private:
  struct Newest {
    std::int64_t t_ns = 0;
    mrpt::poses::CPose3DPDFGaussian pose;
  };
  std::map<PoseSourceId, Newest> newest_;
};

}  // namespace efm
