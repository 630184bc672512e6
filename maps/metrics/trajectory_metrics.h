// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "maps/metrics/sample_statistics.h"
#include "maps/metrics/trajectory_association.h"

namespace efm {

/// How an estimated trajectory is laid over the true one before absolute errors are taken.
enum class TrajectoryAlignment {
  kSe3,     ///< The rotation and translation of least squares over all positions; no scale.
  kOrigin,  ///< The first poses coincide.
  kNone,    ///< As they are.
};

/// T_world_map, which lays the estimate over the truth. SE(3) is that of Umeyama (PAMI 1991) with
/// scale 1, as evo and rpg_trajectory_evaluation (Zhang and Scaramuzza, IROS 2018, Sec. III) use.
/// @throws std::invalid_argument where there is no pair, or, for SE(3), fewer than three or all
/// positions on a line: a turn about that line changes nothing.
Rigid3 alignTrajectories(const std::vector<PosePair>& pairs, TrajectoryAlignment alignment);

/// An error per pair, in their order.
struct PoseErrors {
  std::vector<double> translation_m;
  std::vector<double> rotation_rad;  ///< The angle of the rotation between the two, 0 to pi.
};

/// Absolute trajectory error: |p_truth - p_estimate| and the angle between the rotations, the
/// estimate laid over the truth by T_world_map. Their root mean squares are "ATE" (Sturm et al.,
/// IROS 2012; Zhang and Scaramuzza, IROS 2018; evo's `evo_ape` with translation_part and
/// angle_rad).
PoseErrors absoluteErrors(const std::vector<PosePair>& pairs, const Rigid3& T_world_map);

/// How far apart the two poses of a relative error are.
struct RelativeSpacing {
  enum class Unit {
    kFrames,   ///< So many pairs on: `evo_rpe --delta_unit f --all_pairs`.
    kMetres,   ///< So far along the true path: sub-trajectories as Geiger et al., CVPR 2012.
    kSeconds,  ///< So long: Sturm et al., IROS 2012.
  };
  Unit unit = Unit::kFrames;
  double amount = 1;  ///< Above 0; of frames a whole number.
};

/// Relative pose error: of every pair that has another so far on, the motion between the two is
/// held against the true one, E = (T_truth_i^-1 T_truth_j)^-1 (T_est_i^-1 T_est_j) (Sturm et al.,
/// IROS 2012, Eq. 1); its translation's length and its rotation's angle are the errors. No
/// alignment has a part in it. Of metres and seconds, the other end is the pair nearest to so far
/// on (the first of equals), off by less than a fifth of the spacing, as rpg_trajectory_evaluation
/// has it.
/// @throws std::invalid_argument where the spacing is not as said.
PoseErrors relativeErrors(const std::vector<PosePair>& pairs, const RelativeSpacing& spacing);

/// The length of the path through the true positions, metres.
double trueLength(const std::vector<PosePair>& pairs);

}  // namespace efm
