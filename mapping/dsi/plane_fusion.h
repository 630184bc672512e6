// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <string_view>
#include <vector>

#include "mapping/dsi/fusion_rule.h"
#include "mapping/dsi/plane_values.h"
#include "mapping/sweep/tile_votes.h"

namespace efm {

/// Which axis is fused first. The paper writes S_t∘S_c for cameras first, S_c∘S_t for time first.
enum class FusionOrder { kCamerasThenTime, kTimeThenCameras };

/// "cameras_then_time", "time_then_cameras".
std::string_view nameOf(FusionOrder order);
/// @throws std::invalid_argument naming the value and what is known.
FusionOrder fusionOrderFromName(std::string_view name);

/// How the DSIs of several cameras and sub-intervals become one (Ghosh and Gallego 2022, Sec. 3.4
/// and 3.5): any rule on either axis, in either order. Algorithm 1 is harmonic across cameras with
/// one sub-interval, and the same as harmonic across cameras after arithmetic across time;
/// Algorithm 2 is arithmetic across time after harmonic across cameras, the default.
struct FusionOptions {
  FusionRule across_cameras = FusionRule::kHarmonic;
  FusionRule across_time = FusionRule::kArithmetic;
  FusionOrder order = FusionOrder::kCamerasThenTime;
};

/// What a plane is fused of.
struct FusionInputs {
  int cameras = 1;  ///< At least 1.
  int slots = 1;    ///< Per camera and group, at least 1.
  int groups = 1;   ///< Fused each by itself, then summed; at least 1.
};

/// Fuses one plane of the DSIs of all cameras and sub-intervals, in groups where there are several:
/// the sum of what the groups give. Holds a plane for the votes, one for each axis and one for the
/// sum, whatever the number of cameras, sub-intervals and groups. An axis with one input is left
/// out, bit for bit.
class PlaneFusion {
 public:
  /// Fills the plane with the ray density of one camera in one slot of the time axis; those of
  /// group g begin at g * slots.
  using Vote = std::function<void(int camera, int slot, PlaneValues& votes)>;
  /// The same on a tile, where votes may wait until it is known which densities matter.
  using TileVote = std::function<void(int camera, int slot, TileDensity& density)>;

  /// What else is kept of a plane.
  enum class Keep {
    kFusedOnly,
    kCameras,  ///< Also each camera alone, fused across time: a plane of memory per camera.
  };

  /// @param voxels of a plane or of a part of it: each is fused by itself.
  /// @param kernel an available one.
  PlaneFusion(const FusionOptions& options, const FusionInputs& inputs, std::size_t voxels,
              Keep keep = Keep::kFusedOnly, VotingKernel kernel = fastestKernel());

  /// Asks for every input once. @return the fused plane, until the next call.
  const PlaneValues& fuse(const Vote& vote);
  /// The same bits. Two cameras under an AND-like rule are fused only where both have votes.
  const PlaneValues& fuse(const TileVote& vote);

  /// A camera's own plane after `fuse`, where cameras are kept.
  const PlaneValues& ofCamera(int camera) const {
    const auto c = static_cast<std::size_t>(camera);
    return groups_ == 1 ? cameras_[c].values() : camera_sums_[c];
  }

 private:
  const PlaneValues& fuseInner(int group, int outer, const Vote& vote);
  const PlaneValues& fuseGroup(int group, const Vote& vote);
  void addPairOfGroup(int group, const TileVote& vote);

  bool cameras_first_;
  int slots_;
  int groups_;
  int inner_count_;
  int outer_count_;
  PlaneValues votes_;
  FusionAccumulator inner_;
  FusionAccumulator outer_;
  std::vector<FusionAccumulator> cameras_;
  bool pairs_;       // whether a group is a pair, zero where either is
  PlaneValues sum_;  // of several groups, or of pairs
  std::vector<PlaneValues> camera_sums_;
};

}  // namespace efm
