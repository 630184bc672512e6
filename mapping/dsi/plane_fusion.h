// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "mapping/dsi/dsi_grid.h"

namespace efm {

namespace kernels {
struct FusionSteps;
}  // namespace kernels

/// How the ray densities of several DSIs become one, voxel by voxel (Ghosh and Gallego 2022,
/// Eqs. 6-11): means of n inputs with equal weights, symmetric, and ordered
/// min <= harmonic <= geometric <= arithmetic <= rms <= max.
enum class FusionRule { kMin, kHarmonic, kGeometric, kArithmetic, kRms, kMax };

/// "min", "harmonic", "geometric", "arithmetic", "rms", "max".
std::string_view nameOf(FusionRule rule);
FusionRule fusionRuleFromName(std::string_view name);
/// Whether zero in any input makes the mean zero.
bool isAndLike(FusionRule rule);
/// All rules, in their order.
const std::vector<FusionRule>& allFusionRules();
/// The rule's arithmetic.
const kernels::FusionSteps& stepsOf(FusionRule rule);

/// The mean of planes under one rule. Inputs are added one by one, so that one plane of memory
/// serves any number of them. Inputs are ray densities, not negative. One input is its own mean,
/// bit for bit.
class FusionAccumulator {
 public:
  /// @param inputs of each mean; at least 1.
  FusionAccumulator(FusionRule rule, int inputs, std::size_t voxels);

  /// A plane for the next input. It saves a copy where that input becomes the mean's first value.
  PlaneValues& next();
  /// Adds an input. The first one after a complete mean begins the next mean.
  /// @param values a plane of voxels, or `next()`.
  void add(const PlaneValues& values);
  /// Whether all inputs of the mean are added.
  bool isComplete() const { return added_ == inputs_; }
  /// The complete mean.
  const PlaneValues& mean() const { return mean_; }

 private:
  bool isFirst() const { return added_ == 0 || isComplete(); }

  const kernels::FusionSteps* steps_;
  int inputs_;
  int added_ = 0;
  PlaneValues mean_;
  PlaneValues next_;
};

/// Which axis is fused first. The paper writes S_t∘S_c for cameras first, S_c∘S_t for time first.
enum class FusionOrder { kCamerasThenTime, kTimeThenCameras };

/// "cameras_then_time", "time_then_cameras".
std::string_view nameOf(FusionOrder order);
FusionOrder fusionOrderFromName(std::string_view name);

/// How the DSIs of several cameras and sub-intervals become one (Ghosh and Gallego 2022, Sec. 3.4
/// and 3.5): any rule on either axis, in either order. Algorithm 1 is harmonic across cameras with
/// one sub-interval, and the same as harmonic across cameras after arithmetic across time;
/// Algorithm 2 is arithmetic across time after harmonic across cameras, the default.
struct FusionOptions {
  FusionRule across_cameras = FusionRule::kHarmonic;
  FusionRule across_time = FusionRule::kArithmetic;
  FusionOrder order = FusionOrder::kCamerasThenTime;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("across_cameras", self.across_cameras);
    visit("across_time", self.across_time);
    visit("order", self.order);
  }
};

/// The numbers of inputs of a plane.
struct FusionInputs {
  int cameras = 1;          ///< Number of cameras, at least 1.
  int slots_per_group = 1;  ///< Slots of each camera; at least 1.
  int groups = 1;           ///< Each is fused by itself; the fused groups are summed. At least 1.
};

/// One input of a plane: a camera in a slot of the time axis. The slots of group g begin at
/// g * `FusionInputs::slots_per_group`.
struct CameraSlot {
  int camera = 0;
  int slot = 0;
};

/// Fuses one plane of the DSIs of all cameras, sub-intervals and groups. Holds two planes for each
/// axis and one for the sum of groups, for any number of inputs. An axis with one input is left
/// out, bit for bit.
///
/// Use: `begin`; then, for each of `inputs`, write it to `next` and `add` it; then `fused`.
class PlaneFusion {
 public:
  /// Which planes are fused.
  enum class Keep {
    kFusedOnly,
    kCameras,  ///< Fuses also each camera alone, across time: a plane of memory per camera.
  };

  /// @param voxels of a plane or of a tile of it.
  PlaneFusion(const FusionOptions& options, const FusionInputs& inputs, std::size_t voxels,
              Keep keep = Keep::kFusedOnly);

  /// All inputs, in the order in which they are added.
  const std::vector<CameraSlot>& inputs() const { return inputs_; }
  /// Begins a plane.
  void begin();
  /// The buffer for the ray density of the next input.
  PlaneValues& next() { return inner_.next(); }
  void add(const CameraSlot& input);
  /// The fused plane, after the last input.
  const PlaneValues& fused() const { return groups_ == 1 ? groupMean().mean() : sum_; }
  /// A camera's own plane, where cameras are kept.
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
  PlaneValues sum_;                         // of several groups
  std::vector<FusionAccumulator> cameras_;  // where they are kept
  std::vector<PlaneValues> camera_sums_;
};

}  // namespace efm
