// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "mapping/base/named_choice.h"
#include "mapping/base/option.h"
#include "mapping/dsi/dsi_grid.h"

namespace efm {

namespace kernels {
struct FusionSteps;
}  // namespace kernels

/// The mean that fuses the ray densities of several DSIs, voxel by voxel (Ghosh and Gallego 2022,
/// Eqs. 6-11). All means are symmetric, give n inputs equal weights, and are ordered:
/// min <= harmonic <= geometric <= arithmetic <= rms <= max.
///
/// `kPairs` is no mean, and is for cameras alone: the sum of the harmonic means of the first input
/// with each other input. A wrong depth still needs the votes of two cameras, but not all cameras
/// need to see an edge. Of two inputs it is the harmonic mean.
enum class FusionRule { kMin, kHarmonic, kGeometric, kArithmetic, kRms, kMax, kPairs };

template <>
inline constexpr NamedChoice<FusionRule> kNamesOf<FusionRule>[] = {
    {FusionRule::kMin, "min"},
    {FusionRule::kHarmonic, "harmonic"},
    {FusionRule::kGeometric, "geometric"},
    {FusionRule::kArithmetic, "arithmetic"},
    {FusionRule::kRms, "rms"},
    {FusionRule::kMax, "max"},
    {FusionRule::kPairs, "pairs"},
};
/// Returns whether the mean is zero if any input is zero.
bool isAndLike(FusionRule rule);
/// Returns all means, in the order of the enum.
const std::vector<FusionRule>& allFusionRules();
/// Returns the rule's arithmetic; for `kPairs` that of one pair.
const kernels::FusionSteps& stepsOf(FusionRule rule);

/// The mean of planes by one rule. Inputs are added one by one, so that one plane of memory is
/// enough for any number of inputs. Inputs are ray densities, never negative. The mean of a single
/// input has the same bits as the input.
class FusionAccumulator {
 public:
  /// @param inputs the number of inputs of each mean, at least 1.
  /// @param all_pairs see FusionOptions.
  FusionAccumulator(FusionRule rule, int inputs, std::size_t voxels, bool all_pairs = false);

  /// Returns a plane for the next input. A first input that is written to it needs no copy.
  PlaneValues& next();
  /// Adds an input. The first input after a complete mean begins the next mean.
  /// @param values a plane of voxels, or `next()`.
  void add(const PlaneValues& values);
  /// Returns whether all inputs of the mean are added.
  bool isComplete() const { return added_ == inputs_; }
  /// Returns the complete mean.
  const PlaneValues& mean() const { return mean_; }

 private:
  bool isFirst() const { return added_ == 0 || isComplete(); }
  void addPairs(const PlaneValues& values, bool first);

  const kernels::FusionSteps* steps_;
  int inputs_;
  bool pairs_;
  bool all_pairs_;
  std::vector<PlaneValues> kept_;  // for pairs: the inputs that make pairs with later inputs
  PlaneValues pair_;
  int added_ = 0;
  PlaneValues mean_;
  PlaneValues next_;
};

/// The axis that is fused first. The paper has S_t∘S_c for cameras first, S_c∘S_t for time first.
enum class FusionOrder { kCamerasThenTime, kTimeThenCameras };

template <>
inline constexpr NamedChoice<FusionOrder> kNamesOf<FusionOrder>[] = {
    {FusionOrder::kCamerasThenTime, "cameras_then_time"},
    {FusionOrder::kTimeThenCameras, "time_then_cameras"},
};

/// The fusion of the DSIs of several cameras and sub-intervals (Ghosh and Gallego 2022, Sec. 3.4
/// and 3.5): any rule on either axis, in either order. Algorithm 1 is harmonic across cameras with
/// one sub-interval; arithmetic across time, then harmonic across cameras, gives the same result.
/// Algorithm 2 is harmonic across cameras, then arithmetic across time. The default differs from it
/// with three and more cameras: their pairs are summed.
struct FusionOptions {
  FusionRule across_cameras = FusionRule::kPairs;
  FusionRule across_time = FusionRule::kArithmetic;
  FusionOrder order = FusionOrder::kCamerasThenTime;
  bool all_pairs =
      false;  ///< `kPairs`: of all inputs, not of the first one alone. No file's option.

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("across_cameras", self.across_cameras);
    visit("across_time", self.across_time);
    visit("order", self.order);
  }
  void validate() const;
};

/// The numbers of inputs of a plane.
struct FusionInputs {
  int cameras = 1;          ///< Number of cameras, at least 1.
  int slots_per_group = 1;  ///< Number of slots of each camera in a group, at least 1.
  int groups = 1;           ///< Number of groups, at least 1: fused alone, then summed.
};

/// One input of a plane: a camera in a slot of the time axis. The slots of group g begin at
/// g * `FusionInputs::slots_per_group`.
struct CameraSlot {
  int camera = 0;
  int slot = 0;
};

/// Fuses one plane of the DSIs of all cameras, sub-intervals and groups. Its memory is two planes
/// per axis and one for the sum of groups, for any number of inputs. An axis with one input changes
/// no bit.
///
/// Use: `begin`; then write each input of `inputs` to `next` and `add` it; then `fused`.
class PlaneFusion {
 public:
  /// The planes that are fused.
  enum class Keep {
    kFusedOnly,
    kCameras,  ///< Fuses also each camera alone, across time: a plane of memory per camera.
  };

  /// @param voxels the number of voxels of a plane, or of a tile of a plane.
  PlaneFusion(const FusionOptions& options, const FusionInputs& inputs, std::size_t voxels,
              Keep keep = Keep::kFusedOnly);

  /// Returns all inputs, in the order in which they are added.
  const std::vector<CameraSlot>& inputs() const { return inputs_; }
  /// Begins a plane.
  void begin();
  /// Returns the buffer for the ray density of the next input.
  PlaneValues& next() { return inner_.next(); }
  void add(const CameraSlot& input);
  /// Returns the fused plane, after the last input.
  const PlaneValues& fused() const { return groups_ == 1 ? groupMean().mean() : sum_; }
  /// Returns a camera's own plane. Needs `Keep::kCameras`.
  const PlaneValues& ofCamera(int camera) const {
    const auto c = static_cast<std::size_t>(camera);
    return groups_ == 1 ? cameras_[c].mean() : camera_sums_[c];
  }

 private:
  const FusionAccumulator& groupMean() const { return outer_count_ == 1 ? inner_ : outer_; }

  int groups_;
  int outer_count_;
  std::vector<CameraSlot> inputs_;
  FusionAccumulator inner_;
  FusionAccumulator outer_;
  PlaneValues sum_;                         // of the groups, if there are several
  std::vector<FusionAccumulator> cameras_;  // for `Keep::kCameras`
  std::vector<PlaneValues> camera_sums_;
};

}  // namespace efm
