// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <optional>
#include <string>
#include <vector>

#include "mapping/base/option.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/survey/scene_depths.h"

namespace efm {

/// Options whose values are chosen from the data: `auto` in an option file.
struct AutomaticOptions {
  bool min_depth_m = false;
  bool max_depth_m = false;
  bool num_planes = false;
  bool window_s = false;
  bool stride_s = false;
  bool voxel_size_m = false;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("min_depth_m", self.min_depth_m);
    visit("max_depth_m", self.max_depth_m);
    visit("num_planes", self.num_planes);
    visit("window_s", self.window_s);
    visit("stride_s", self.stride_s);
    visit("voxel_size_m", self.voxel_size_m);
  }
  bool any() const {
    return min_depth_m || max_depth_m || num_planes || window_s || stride_s || voxel_size_m;
  }
};

/// The result of `chooseOptions`.
struct OptionChoice {
  std::vector<ChosenOption> options;
  bool found_scene = false;
  /// The parallax of a unit of inverse depth in a typical window, pixels per 1/m. Without a scene,
  /// it is the parallax for which the number of planes would be chosen.
  double parallax_px_m = 0;
  /// True if the parallax proves the depths of the scene. Otherwise the limits are a guess.
  bool is_proven = false;
  std::optional<double> voxel_size_m = std::nullopt;  ///< Of the map, if it is automatic.
};

/// Sets automatic options to values that fit the other options, until the values are chosen.
void fitAutomatic(const AutomaticOptions& automatic, FusionMapperOptions& options);

/// Returns the number of planes: 100; up to 400 if planes would be more than a pixel of parallax
/// apart; down to 25 if they would be less than a tenth of a pixel (unobservable) apart.
int automaticPlanes(const DepthPlanesOptions& limits, double parallax_px_m);

/// Returns the options of a first pass over a recording: consecutive windows of `window_s`.
FusionMapperOptions surveyOptions(FusionMapperOptions options, double window_s);

/// Replaces automatic options:
/// - depth limits: the range of nearly all points of a coarse sweep over a wide range, widened;
/// - the window: as long as most of the view stays in sight, up to a second, and a quarter of the
///   recording; the stride: half of the window;
/// - planes: neighbouring planes are about a pixel of parallax apart, over the cameras and the
///   window's motion;
/// - the voxels of the map: as large as a pixel at the median depth.
/// The same samples give the same choice.
/// @param duration_s of the part of the recording with poses; std::nullopt: not known yet.
/// @param options in: the values that are kept if nothing can be chosen; out: the choice.
/// @param samples of the recording; may be empty.
OptionChoice chooseOptions(const AutomaticOptions& automatic, const Rig& rig,
                           const std::vector<WindowSample>& samples,
                           std::optional<double> duration_s, FusionMapperOptions& options);

/// Replaces automatic depth limits by a range that holds nearly every scene, 0.3 to 100 m. It is
/// for recordings without a visible scene. The other options keep their values.
OptionChoice chooseWideDepths(const AutomaticOptions& automatic, FusionMapperOptions& options);

/// Automatic depth limits that follow the scene from keyframe to keyframe, for live operation,
/// where the rest of the recording is unknown. They depend on the keyframes alone.
class DepthFollower {
 public:
  /// @param automatic the options that may change. @param planes of the first keyframe.
  /// @param parallax_px_m of the windows, for the number of planes: see `automaticPlanes`.
  DepthFollower(const AutomaticOptions& automatic, const DepthPlanesOptions& planes,
                double parallax_px_m)
      : automatic_(automatic), planes_(planes), parallax_px_m_(parallax_px_m) {}

  /// Updates the limits.
  /// @param depth of a keyframe that was mapped with `planes`: metres; 0: no depth.
  /// @return whether the planes of the next keyframe differ.
  bool follow(const cv::Mat1f& depth);
  const DepthPlanesOptions& planes() const { return planes_; }
  /// Returns the number of consecutive keyframes that had hardly any point, or many points at an
  /// automatic limit: the limits may not fit the scene.
  int misfits() const { return misfits_; }

 private:
  AutomaticOptions automatic_;
  DepthPlanesOptions planes_;
  double parallax_px_m_;
  int misfits_ = 0;
};

}  // namespace efm
