// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "mapping/dsi/fusion_rule.h"
#include "mapping/dsi/plane_values.h"

namespace efm {

/// Which axis is fused first. The paper writes S_t∘S_c for cameras first, S_c∘S_t for time first.
enum class FusionOrder { kCamerasThenTime, kTimeThenCameras };

/// "cameras_then_time", "time_then_cameras".
std::string_view nameOf(FusionOrder order);
/// @throws std::invalid_argument naming the value and the known names.
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

/// The numbers of inputs of a plane.
struct FusionInputs {
  int cameras = 1;          ///< At least 1.
  int slots_per_group = 1;  ///< Of each camera; at least 1.
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
    kCameras,  ///< Also each camera alone, across time: a plane of memory per camera.
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
