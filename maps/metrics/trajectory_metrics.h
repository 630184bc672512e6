// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "maps/metrics/sample_statistics.h"

namespace efm {

/// An estimated pose and the true pose that is nearest in time.
struct PosePair {
  std::int64_t t_ns = 0;  ///< Time of the true pose.
  Rigid3 T_map_rig;       ///< The estimate. Its world is called `map` and may lie elsewhere.
  Rigid3 T_world_rig;     ///< The truth.
};

/// Pairs poses by time like evo (Grupp, "evo: Python package for the evaluation of odometry and
/// SLAM", 2017). Each pose of the shorter trajectory (of the estimate, if both have as many poses)
/// is paired with the pose of the other trajectory that is nearest in time; if two poses are
/// equally near, with the earlier pose. Poses more than `max_difference_s` apart are not paired.
/// The input need not be sorted; the result is.
/// @throws std::invalid_argument if `max_difference_s` is negative or not finite.
std::vector<PosePair> associatePoses(std::vector<StampedPose> estimate,
                                     std::vector<StampedPose> truth, double max_difference_s);

/// The alignment of an estimated trajectory with the true one, before absolute errors are taken.
enum class TrajectoryAlignment {
  kSe3,     ///< Least squares over all positions: rotation and translation, no scale.
  kOrigin,  ///< The first poses coincide.
  kNone,    ///< Not aligned.
};

/// Returns T_world_map, which aligns the estimate with the truth. SE(3) is the method of Umeyama
/// (PAMI 1991) with scale 1, as in evo and rpg_trajectory_evaluation (Zhang and Scaramuzza, IROS
/// 2018, Sec. III).
/// @throws std::invalid_argument without pairs; for SE(3) with fewer than three pairs, or if all
/// positions lie on a line: the rotation about that line is not determined.
Rigid3 alignTrajectories(const std::vector<PosePair>& pairs, TrajectoryAlignment alignment);

/// One error per pair, in the order of the pairs.
struct PoseErrors {
  std::vector<double> translation_m;
  std::vector<double> rotation_rad;  ///< The angle between both rotations, 0 to pi.
};

/// Returns absolute trajectory errors: |p_truth - p_estimate| and the angle between the rotations,
/// after alignment by T_world_map. Their root mean squares are the "ATE" (Sturm et al., IROS 2012;
/// Zhang and Scaramuzza, IROS 2018; evo's `evo_ape` with translation_part and angle_rad).
PoseErrors absoluteErrors(const std::vector<PosePair>& pairs, const Rigid3& T_world_map);

/// The distance between the two poses of a relative error.
struct RelativeSpacing {
  enum class Unit {
    kFrames,   ///< Number of pairs: `evo_rpe --delta_unit f --all_pairs`.
    kMetres,   ///< True path length: sub-trajectories as in Geiger et al., CVPR 2012.
    kSeconds,  ///< Duration: Sturm et al., IROS 2012.
  };
  Unit unit = Unit::kFrames;
  double amount = 1;  ///< Above 0; a whole number of frames.
};

/// Returns relative pose errors: the motion from each pair i to the pair j at the given spacing is
/// compared with the true motion, E = (T_truth_i^-1 T_truth_j)^-1 (T_est_i^-1 T_est_j) (Sturm et
/// al., IROS 2012, Eq. 1). The errors are the length of its translation and the angle of its
/// rotation. They do not depend on an alignment. In metres and seconds, j is the pair nearest to
/// the spacing (the first of several), off by less than a fifth of it, as in
/// rpg_trajectory_evaluation.
PoseErrors relativeErrors(const std::vector<PosePair>& pairs, const RelativeSpacing& spacing);

/// Returns the length of the path through the true positions, metres.
double trueLength(const std::vector<PosePair>& pairs);

}  // namespace efm
