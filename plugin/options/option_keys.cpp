// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/options/option_keys.h"

#include <array>
#include <charconv>
#include <optional>
#include <stdexcept>
#include <type_traits>

#include "mapping/geometry/angle.h"

namespace efm {
namespace {

template <typename Field>
OptionKey option(std::string_view section, std::string_view key, Field field) {
  using Value = std::decay_t<std::invoke_result_t<Field, EventFusionOptions&>>;
  return {section, key,
          [field](EventFusionOptions& options, std::string_view text) {
            parseInto(text, field(options));
          },
          [field](const EventFusionOptions& options) { return valueOf(field(options)); },
          std::is_same_v<Value, std::filesystem::path>};
}

/// A key whose field is a std::optional, which a word of its own leaves empty.
template <typename Field>
OptionKey optionOr(std::string_view word, std::string_view section, std::string_view key,
                   Field field) {
  return {section, key,
          [field, word](EventFusionOptions& options, std::string_view text) {
            auto& target = field(options);
            target.reset();
            if (text == word) return;
            try {
              parseInto(text, target.emplace());
            } catch (const std::invalid_argument& error) {
              throw std::invalid_argument(std::string(error.what()) + ", or " + std::string(word));
            }
          },
          [field, word](const EventFusionOptions& options) {
            const auto& source = field(options);
            return source ? valueOf(*source) : OptionValue(std::string(word));
          }};
}

/// Degrees with the fewest digits that are these radians: what was written, where that had no more
/// than 15.
double degreesThatReadAs(double angle_rad) {
  double angle_deg = angle_rad / kRadiansPerDegree;
  for (const int digits : {15, 16, 17}) {
    std::array<char, 32> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), angle_deg,
                                   std::chars_format::scientific, digits - 1)
                         .ptr;
    double rounded_deg = 0;
    std::from_chars(text.data(), end, rounded_deg);
    if (rounded_deg * kRadiansPerDegree == angle_rad) return rounded_deg;
  }
  return angle_deg;
}

/// A key in degrees whose field is in radians.
template <typename Field>
OptionKey degrees(std::string_view section, std::string_view key, Field field) {
  return {section, key,
          [field](EventFusionOptions& options, std::string_view text) {
            double value = 0;
            parseInto(text, value);
            field(options) = value * kRadiansPerDegree;
          },
          [field](const EventFusionOptions& options) {
            return valueOf(degreesThatReadAs(field(options)));
          },
          false};
}

}  // namespace

const std::vector<OptionKey>& optionKeys() {
  using std::string_view_literals::operator""sv;
  static const std::vector<OptionKey> keys = {
      option(
          "rig"sv, "calibration"sv, [](auto& o) -> auto& { return o.rig.calibration; }),
      option(
          "rig"sv, "hand_eye"sv, [](auto& o) -> auto& { return o.rig.hand_eye; }),
      option(
          "rig"sv, "cameras"sv, [](auto& o) -> auto& { return o.mapper.cameras; }),
      option(
          "rig"sv, "time_offsets_s"sv, [](auto& o) -> auto& { return o.rig.time_offsets_ns; }),
      option(
          "rig"sv, "pose_source"sv, [](auto& o) -> auto& { return o.rig.pose_source; }),
      option(
          "rig"sv, "max_pose_gap_s"sv,
          [](auto& o) -> auto& { return o.mapper.trajectory.max_pose_gap_s; }),
      option(
          "rig"sv, "exclude_silent"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.exclude_silent; }),

      option(
          "keyframes"sv, "policy"sv, [](auto& o) -> auto& { return o.mapper.keyframes.policy; }),
      option(
          "keyframes"sv, "window_s"sv,
          [](auto& o) -> auto& { return o.mapper.keyframes.window_s; }),
      option(
          "keyframes"sv, "stride_s"sv,
          [](auto& o) -> auto& { return o.mapper.keyframes.stride_s; }),
      option(
          "keyframes"sv, "window_events"sv,
          [](auto& o) -> auto& { return o.mapper.keyframes.window_events; }),
      option(
          "keyframes"sv, "min_baseline_ratio"sv,
          [](auto& o) -> auto& { return o.mapper.keyframes.min_baseline_ratio; }),
      option(
          "keyframes"sv, "min_visible_share"sv,
          [](auto& o) -> auto& { return o.mapper.keyframes.min_visible_share; }),
      option(
          "keyframes"sv, "reference"sv,
          [](auto& o) -> auto& { return o.mapper.keyframes.reference; }),

      option(
          "dsi"sv, "min_depth_m"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.planes.min_depth_m; }),
      option(
          "dsi"sv, "max_depth_m"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.planes.max_depth_m; }),
      option(
          "dsi"sv, "num_planes"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.planes.num_planes; }),
      option(
          "dsi"sv, "spacing"sv, [](auto& o) -> auto& { return o.mapper.keyframe.planes.spacing; }),
      option(
          "dsi"sv, "reference_camera"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.reference_camera; }),
      optionOr(
          "auto"sv, "dsi"sv, "fov_deg"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.view.fov_deg; }),
      optionOr(
          "auto"sv, "dsi"sv, "width"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.view.width; }),
      optionOr(
          "auto"sv, "dsi"sv, "height"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.view.height; }),
      option(
          "dsi"sv, "rv_offset_m"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.view.offset_m; }),

      option(
          "fusion"sv, "across_cameras"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.sweep.fusion.across_cameras; }),
      option(
          "fusion"sv, "across_time"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.sweep.fusion.across_time; }),
      option(
          "fusion"sv, "order"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.sweep.fusion.order; }),
      option(
          "fusion"sv, "subintervals"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.subintervals.count; }),
      option(
          "fusion"sv, "split"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.subintervals.split; }),
      option(
          "fusion"sv, "shuffle"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.subintervals.shuffle; }),
      option(
          "fusion"sv, "shuffle_seed"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.subintervals.shuffle_seed; }),
      option(
          "fusion"sv, "split_polarity"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.split.polarity; }),
      option(
          "fusion"sv, "time_slices"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.split.time_slices; }),
      option(
          "fusion"sv, "late"sv, [](auto& o) -> auto& { return o.late_fusion; }),

      option(
          "depth"sv, "extraction"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.extraction.extraction; }),
      option(
          "depth"sv, "threshold_kernel"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.extraction.threshold_kernel; }),
      option(
          "depth"sv, "min_excess"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.extraction.min_excess; }),
      option(
          "depth"sv, "min_quality"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.extraction.min_quality; }),
      option(
          "depth"sv, "threshold_c"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.extraction.threshold_c; }),
      option(
          "depth"sv, "max_confidence"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.extraction.max_confidence; }),
      option(
          "depth"sv, "median_size"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.extraction.median_size; }),
      option(
          "depth"sv, "dilate"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.extraction.dilate; }),
      option(
          "depth"sv, "subplane"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.extraction.subplane; }),

      option(
          "map"sv, "voxel_size_m"sv, [](auto& o) -> auto& { return o.cloud.voxel_size_m; }),
      option(
          "map"sv, "min_keyframes"sv, [](auto& o) -> auto& { return o.cloud.min_keyframes; }),
      option(
          "map"sv, "outlier_radius_m"sv,
          [](auto& o) -> auto& { return o.cloud.outliers.outlier_radius_m; }),
      option(
          "map"sv, "outlier_min_neighbors"sv,
          [](auto& o) -> auto& { return o.cloud.outliers.outlier_min_neighbors; }),
      option(
          "map"sv, "consistency"sv,
          [](auto& o) -> auto& { return o.cloud.consistency.consistency; }),
      option(
          "map"sv, "consistency_tolerance"sv,
          [](auto& o) -> auto& { return o.cloud.consistency.consistency_tolerance; }),
      option(
          "map"sv, "consistency_cell_deg"sv,
          [](auto& o) -> auto& { return o.cloud.consistency.consistency_cell_deg; }),
      option(
          "map"sv, "max_contradictions"sv,
          [](auto& o) -> auto& { return o.cloud.consistency.max_contradictions; }),

      option(
          "filter"sv, "hot_pixels"sv, [](auto& o) -> auto& { return o.mapper.filter.hot_pixels; }),
      option(
          "filter"sv, "hot_pixel_ratio"sv,
          [](auto& o) -> auto& { return o.mapper.filter.hot_pixel.ratio; }),
      option(
          "filter"sv, "hot_pixel_period_s"sv,
          [](auto& o) -> auto& { return o.mapper.filter.hot_pixel.period_s; }),
      option(
          "filter"sv, "hot_pixel_min_events"sv,
          [](auto& o) -> auto& { return o.mapper.filter.hot_pixel.min_events; }),
      option(
          "filter"sv, "background_activity_s"sv,
          [](auto& o) -> auto& { return o.mapper.filter.background_activity_s; }),

      option(
          "refinement"sv, "enabled"sv, [](auto& o) -> auto& { return o.refinement.enabled; }),
      option(
          "refinement"sv, "background"sv, [](auto& o) -> auto& { return o.refinement.background; }),
      option(
          "refinement"sv, "window"sv, [](auto& o) -> auto& { return o.refinement.refiner.window; }),
      option(
          "refinement"sv, "map_keyframes"sv,
          [](auto& o) -> auto& { return o.refinement.refiner.map_keyframes; }),
      option(
          "refinement"sv, "max_points"sv,
          [](auto& o) -> auto& { return o.refinement.refiner.points.max_points; }),
      option(
          "refinement"sv, "max_map_points"sv,
          [](auto& o) -> auto& { return o.refinement.refiner.points.max_map_points; }),
      option(
          "refinement"sv, "tracker_noise_m"sv,
          [](auto& o) -> auto& { return o.refinement.refiner.tracker.noise_m; }),
      degrees(
          "refinement"sv, "tracker_noise_deg"sv,
          [](auto& o) -> auto& { return o.refinement.refiner.tracker.noise_rad; }),
      option(
          "refinement"sv, "tracker_drift"sv,
          [](auto& o) -> auto& { return o.refinement.refiner.tracker.drift_m; }),
      degrees(
          "refinement"sv, "tracker_drift_deg_per_m"sv,
          [](auto& o) -> auto& { return o.refinement.refiner.tracker.drift_rad; }),
      option(
          "refinement"sv, "adapt_tracker"sv,
          [](auto& o) -> auto& { return o.refinement.refiner.adapt_tracker; }),
      option(
          "refinement"sv, "robust_sigmas"sv, [](auto& o) -> auto& {
            return o.refinement.refiner.registration.alignment.robust_sigmas;
          }),
      option(
          "refinement"sv, "first_distance_px"sv,
          [](auto& o) -> auto& { return o.refinement.refiner.registration.first_distance_px; }),
      option(
          "refinement"sv, "last_distance_px"sv,
          [](auto& o) -> auto& { return o.refinement.refiner.registration.last_distance_px; }),
      option(
          "refinement"sv, "loops"sv,
          [](auto& o) -> auto& { return o.refinement.refiner.loop.loops; }),
      option(
          "refinement"sv, "loop_min_overlap"sv,
          [](auto& o) -> auto& { return o.refinement.refiner.loop.loop_min_overlap; }),
      option(
          "refinement"sv, "loop_min_inliers"sv,
          [](auto& o) -> auto& { return o.refinement.refiner.loop.loop_min_inliers; }),
      option(
          "refinement"sv, "loop_max_sigma_m"sv,
          [](auto& o) -> auto& { return o.refinement.refiner.loop.loop_max_sigma_m; }),
      degrees(
          "refinement"sv, "loop_max_sigma_deg"sv,
          [](auto& o) -> auto& { return o.refinement.refiner.loop.loop_max_sigma_rad; }),
      option(
          "refinement"sv, "loop_checks"sv,
          [](auto& o) -> auto& { return o.refinement.refiner.loop.loop_checks; }),
      option(
          "refinement"sv, "correct_motion"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.motion.correct_motion; }),
      option(
          "refinement"sv, "motion_sigma_m_s"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.motion.motion_sigma_m_s; }),
      option(
          "refinement"sv, "motion_sigma_deg_s"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.motion.motion_sigma_deg_s; }),
      option(
          "refinement"sv, "motion_rounds"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.motion.motion_rounds; }),

      option(
          "output"sv, "camera_maps"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.camera_maps; }),
      option(
          "output"sv, "event_images"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.event_images; }),

      optionOr(
          "auto"sv, "performance"sv, "threads"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.sweep.threads; }),
      optionOr(
          "auto"sv, "performance"sv, "kernel"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.sweep.kernel; }),
      option(
          "performance"sv, "packet_error_px"sv,
          [](auto& o) -> auto& { return o.mapper.keyframe.packets.packet_error_px; }),
  };
  return keys;
}

std::string knownOptionKeys(std::string_view section) {
  std::string known;
  for (const OptionKey& entry : optionKeys()) {
    if (entry.section == section) known += (known.empty() ? "" : ", ") + std::string(entry.key);
  }
  return known;
}

std::string knownOptionSections() {
  std::string known;
  std::string_view last;
  for (const OptionKey& entry : optionKeys()) {
    if (entry.section != last) {
      known += (known.empty() ? "[" : ", [") + std::string(entry.section) + "]";
    }
    last = entry.section;
  }
  return known;
}

std::vector<NamedOption> listOptions(const EventFusionOptions& options) {
  std::vector<NamedOption> list;
  for (const OptionKey& entry : optionKeys()) {
    list.push_back({entry.section, entry.key, entry.value(options)});
  }
  return list;
}

bool isOptionSection(std::string_view section) { return !knownOptionKeys(section).empty(); }

}  // namespace efm
