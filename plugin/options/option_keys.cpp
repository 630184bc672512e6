// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/options/option_keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "mapping/base/text.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// @throws std::invalid_argument saying what is expected, where there is no value.
template <typename Value>
Value valueOr(const std::optional<Value>& value, const char* expected) {
  if (!value) throw std::invalid_argument(expected);
  return *value;
}

/// Items separated by commas, each read by `parse`; nothing where one is none.
template <typename Parse>
auto parseList(std::string_view text, const Parse& parse) {
  using Item = typename decltype(parse(text))::value_type;
  std::optional<std::vector<Item>> items(std::in_place);
  while (!text.empty()) {
    const std::size_t comma = text.find(',');
    const std::optional<Item> item = parse(trimmed(text.substr(0, comma)));
    if (!item || comma + 1 == text.size()) return std::optional<std::vector<Item>>();
    items->push_back(*item);
    text = comma == std::string_view::npos ? std::string_view{} : text.substr(comma + 1);
  }
  return items;
}

/// Nanoseconds from seconds, exactly.
std::optional<std::int64_t> parseTime(std::string_view text) {
  const std::optional<std::int64_t> t_ns = parseSeconds(text);
  const bool in_range = t_ns && -kEndOfTimeNs < *t_ns && *t_ns < kEndOfTimeNs;
  return in_range ? t_ns : std::nullopt;
}

/// Items separated by commas.
template <typename Item, typename Text>
std::string listText(const std::vector<Item>& items, const Text& text_of) {
  std::string list;
  for (const Item& item : items) list += (list.empty() ? "" : ",") + text_of(item);
  return list;
}

/// The fewest digits that read back the same.
std::string shortestText(double number) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  return {digits.data(), end};
}

}  // namespace

void parseInto(std::string_view text, double& field) {
  field = valueOr(parseFinite(text), "must be a number");
}
void parseInto(std::string_view text, int& field) {
  field = valueOr(parseNumber<int>(text), "must be a whole number");
}
void parseInto(std::string_view text, std::int64_t& field) {
  field = valueOr(parseNumber<std::int64_t>(text), "must be a whole number");
}
void parseInto(std::string_view text, std::uint32_t& field) {
  field = valueOr(parseNumber<std::uint32_t>(text), "must be a whole number, 0 to 4294967295");
}

void parseInto(std::string_view text, bool& field) {
  if (text != "true" && text != "false") throw std::invalid_argument("must be true or false");
  field = text == "true";
}

void parseInto(std::string_view text, std::string& field) { field = text; }
void parseInto(std::string_view text, std::filesystem::path& field) { field = text; }

void parseInto(std::string_view text, std::vector<int>& field) {
  field = valueOr(parseList(text, parseNumber<int>),
                  "must be whole numbers separated by commas, or nothing");
}

void parseInto(std::string_view text, Eigen::Vector3d& field) {
  const auto items = parseList(text, parseFinite);
  if (!items || items->size() != 3) {
    throw std::invalid_argument("must be three numbers separated by commas");
  }
  field = Eigen::Vector3d::Map(items->data());
}

void parseInto(std::string_view text, MaxConfidence& field) {
  if (text == "keyframe" || text == "sequence") {
    field = {text == "keyframe" ? WhiteLevel::kKeyframe : WhiteLevel::kSequence, 0};
  } else {
    field = MaxConfidence::of(valueOr(parseFinite(text), "must be a number, keyframe or sequence"));
  }
}

void parseInto(std::string_view text, std::vector<std::int64_t>& field) {
  field = valueOr(parseList(text, parseTime),
                  "must be seconds within 4.6e9 of 0, separated by commas, or nothing");
}

// The error shows an unknown name; known names are printable.
#define EFM_PARSE_CHOICE(Choice, fromName) \
  void parseInto(std::string_view text, Choice& field) { field = fromName(printable(text)); }
EFM_PARSE_CHOICE(KeyframePolicyKind, keyframePolicyFromName)
EFM_PARSE_CHOICE(ReferenceTime, referenceTimeFromName)
EFM_PARSE_CHOICE(PlaneSpacing, planeSpacingFromName)
EFM_PARSE_CHOICE(FusionRule, fusionRuleFromName)
EFM_PARSE_CHOICE(FusionOrder, fusionOrderFromName)
EFM_PARSE_CHOICE(SubintervalSplit, subintervalSplitFromName)
EFM_PARSE_CHOICE(SubintervalShuffle, subintervalShuffleFromName)
EFM_PARSE_CHOICE(ExtractionMethod, extractionMethodFromName)
EFM_PARSE_CHOICE(VotingKernel, votingKernelFromName)
EFM_PARSE_CHOICE(Consistency, consistencyFromName)
#undef EFM_PARSE_CHOICE

OptionValue valueOf(double field) { return field; }
OptionValue valueOf(int field) { return std::int64_t{field}; }
OptionValue valueOf(std::int64_t field) { return field; }
OptionValue valueOf(std::uint32_t field) { return std::int64_t{field}; }
OptionValue valueOf(bool field) { return field; }
OptionValue valueOf(const std::vector<int>& field) {
  return listText(field, [](int item) { return std::to_string(item); });
}
OptionValue valueOf(const std::string& field) { return field; }
OptionValue valueOf(const Eigen::Vector3d& field) {
  return shortestText(field.x()) + "," + shortestText(field.y()) + "," + shortestText(field.z());
}
OptionValue valueOf(const MaxConfidence& field) {
  if (field.level == WhiteLevel::kFixed) return field.fixed;
  return std::string(field.level == WhiteLevel::kKeyframe ? "keyframe" : "sequence");
}
OptionValue valueOf(const std::filesystem::path& field) { return field.string(); }
OptionValue valueOf(const std::vector<std::int64_t>& times_ns) {
  return listText(times_ns, formatSeconds);
}

std::string textOf(const OptionValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return std::to_string(*whole);
  return shortestText(std::get<double>(value));
}

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

/// A key whose field is a std::optional, which the word "auto" leaves empty.
template <typename Field>
OptionKey optionOrAuto(std::string_view section, std::string_view key, Field field) {
  return {section, key,
          [field](EventFusionOptions& options, std::string_view text) {
            auto& target = field(options);
            target.reset();
            if (text == "auto") return;
            try {
              parseInto(text, target.emplace());
            } catch (const std::invalid_argument& error) {
              throw std::invalid_argument(error.what() + std::string(", or auto"));
            }
          },
          [field](const EventFusionOptions& options) {
            const auto& source = field(options);
            return source ? valueOf(*source) : OptionValue(std::string("auto"));
          }};
}

/// A key whose value is chosen from the data by the word "auto".
template <typename Field, typename Flag>
OptionKey optionOrChosen(std::string_view section, std::string_view key, Field field, Flag flag) {
  return {section, key,
          [field, flag](EventFusionOptions& options, std::string_view text) {
            flag(options) = text == "auto";
            if (text == "auto") return;
            try {
              parseInto(text, field(options));
            } catch (const std::invalid_argument& error) {
              throw std::invalid_argument(error.what() + std::string(", or auto"));
            }
          },
          [field, flag](const EventFusionOptions& options) {
            return flag(options) ? OptionValue(std::string("auto")) : valueOf(field(options));
          }};
}

/// The degrees with the fewest digits that are these radians: the written ones, if they had no more
/// than 15 digits.
double degreesThatReadAs(double angle_rad) {
  const double angle_deg = angle_rad / kRadiansPerDegree;
  for (const int decimals : {14, 15, 16}) {
    const double rounded_deg =
        parseFinite(fmt::format("{:.{}e}", angle_deg, decimals)).value_or(angle_deg);
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
// The field of all options, of the refiner and of the keyframe mapper.
#define FIELD(path) \
  [](auto& o) -> auto& { return o.path; }
#define REFINER(path) FIELD(refinement.refiner.path)
#define KEYFRAME(path) FIELD(mapper.keyframe.path)
  static const std::vector<OptionKey> keys = {
      option("rig", "calibration", FIELD(rig.calibration)),
      option("rig", "hand_eye", FIELD(rig.hand_eye)),
      option("rig", "cameras", FIELD(mapper.cameras)),
      option("rig", "time_offsets_s", FIELD(rig.time_offsets_ns)),
      option("rig", "pose_source", FIELD(rig.pose_source)),
      option("rig", "max_pose_gap_s", FIELD(mapper.trajectory.max_pose_gap_s)),
      option("rig", "exclude_silent", KEYFRAME(exclude_silent)),

      option("keyframes", "policy", FIELD(mapper.policy.policy)),
      optionOrChosen("keyframes", "window_s", FIELD(mapper.policy.window_s),
                     FIELD(automatic.window_s)),
      optionOrChosen("keyframes", "stride_s", FIELD(mapper.policy.stride_s),
                     FIELD(automatic.stride_s)),
      option("keyframes", "window_events", FIELD(mapper.policy.window_events)),
      option("keyframes", "min_baseline_ratio", FIELD(mapper.policy.min_baseline_ratio)),
      option("keyframes", "min_visible_fraction", FIELD(mapper.policy.min_visible_fraction)),
      option("keyframes", "reference", FIELD(mapper.policy.reference)),
      option("keyframes", "max_events_per_camera", KEYFRAME(max_events_per_camera)),

      optionOrChosen("dsi", "min_depth_m", KEYFRAME(planes.min_depth_m),
                     FIELD(automatic.min_depth_m)),
      optionOrChosen("dsi", "max_depth_m", KEYFRAME(planes.max_depth_m),
                     FIELD(automatic.max_depth_m)),
      optionOrChosen("dsi", "num_planes", KEYFRAME(planes.num_planes), FIELD(automatic.num_planes)),
      option("dsi", "spacing", KEYFRAME(planes.spacing)),
      option("dsi", "reference_camera", KEYFRAME(reference_camera)),
      optionOrAuto("dsi", "fov_deg", KEYFRAME(view.fov_deg)),
      optionOrAuto("dsi", "width", KEYFRAME(view.width)),
      optionOrAuto("dsi", "height", KEYFRAME(view.height)),
      option("dsi", "rv_offset_m", KEYFRAME(view.offset_m)),

      option("fusion", "across_cameras", KEYFRAME(sweep.fusion.across_cameras)),
      option("fusion", "across_time", KEYFRAME(sweep.fusion.across_time)),
      option("fusion", "order", KEYFRAME(sweep.fusion.order)),
      option("fusion", "subintervals", KEYFRAME(subintervals.count)),
      option("fusion", "split", KEYFRAME(subintervals.split)),
      option("fusion", "shuffle", KEYFRAME(subintervals.shuffle)),
      option("fusion", "shuffle_seed", KEYFRAME(subintervals.shuffle_seed)),
      option("fusion", "split_polarity", KEYFRAME(split.polarity)),
      option("fusion", "time_slices", KEYFRAME(split.time_slices)),
      option("fusion", "late", FIELD(late_fusion)),

      option("depth", "extraction", KEYFRAME(extraction.extraction)),
      option("depth", "threshold_kernel", KEYFRAME(extraction.threshold_kernel)),
      option("depth", "min_local_contrast", KEYFRAME(extraction.min_local_contrast)),
      option("depth", "min_quality", KEYFRAME(extraction.min_quality)),
      option("depth", "threshold_c", KEYFRAME(extraction.threshold_c)),
      option("depth", "max_confidence", KEYFRAME(extraction.max_confidence)),
      option("depth", "median_size", KEYFRAME(extraction.median_size)),
      option("depth", "dilate", KEYFRAME(extraction.dilate)),
      option("depth", "subplane", KEYFRAME(extraction.subplane)),

      option("map", "voxel_size_m", FIELD(cloud.voxel_size_m)),
      option("map", "min_keyframes", FIELD(cloud.min_keyframes)),
      option("map", "outlier_radius_m", FIELD(cloud.outliers.outlier_radius_m)),
      option("map", "outlier_min_neighbors", FIELD(cloud.outliers.outlier_min_neighbors)),
      option("map", "consistency", FIELD(cloud.consistency.consistency)),
      option("map", "consistency_tolerance", FIELD(cloud.consistency.consistency_tolerance)),
      option("map", "consistency_cell_deg", FIELD(cloud.consistency.consistency_cell_deg)),
      option("map", "max_contradictions", FIELD(cloud.consistency.max_contradictions)),

      option("filter", "hot_pixels", FIELD(mapper.filter.hot_pixels)),
      option("filter", "hot_pixel_ratio", FIELD(mapper.filter.hot_pixel.ratio)),
      option("filter", "hot_pixel_period_s", FIELD(mapper.filter.hot_pixel.period_s)),
      option("filter", "hot_pixel_min_events", FIELD(mapper.filter.hot_pixel.min_events)),
      option("filter", "background_activity_s", FIELD(mapper.filter.background_activity_s)),

      option("refinement", "enabled", FIELD(refinement.enabled)),
      option("refinement", "background", FIELD(refinement.background)),
      option("refinement", "window", REFINER(window)),
      option("refinement", "map_keyframes", REFINER(map_keyframes)),
      option("refinement", "max_points", REFINER(points.max_points)),
      option("refinement", "max_map_points", REFINER(points.max_map_points)),
      option("refinement", "tracker_noise_m", REFINER(tracker.noise_m)),
      degrees("refinement", "tracker_noise_deg", REFINER(tracker.noise_rad)),
      option("refinement", "tracker_drift", REFINER(tracker.drift_m)),
      degrees("refinement", "tracker_drift_deg_per_m", REFINER(tracker.drift_rad)),
      option("refinement", "adapt_tracker", REFINER(adapt_tracker)),
      option("refinement", "robust_sigmas", REFINER(registration.alignment.robust_sigmas)),
      option("refinement", "first_distance_px", REFINER(registration.first_distance_px)),
      option("refinement", "last_distance_px", REFINER(registration.last_distance_px)),
      option("refinement", "loops", REFINER(loop.loops)),
      option("refinement", "loop_min_overlap", REFINER(loop.loop_min_overlap)),
      option("refinement", "loop_min_inliers", REFINER(loop.loop_min_inliers)),
      option("refinement", "loop_max_sigma_m", REFINER(loop.loop_max_sigma_m)),
      degrees("refinement", "loop_max_sigma_deg", REFINER(loop.loop_max_sigma_rad)),
      option("refinement", "loop_checks", REFINER(loop.loop_checks)),
      option("refinement", "correct_motion", KEYFRAME(motion.correct_motion)),
      option("refinement", "motion_sigma_m_s", KEYFRAME(motion.motion_sigma_m_s)),
      option("refinement", "motion_sigma_deg_s", KEYFRAME(motion.motion_sigma_deg_s)),
      option("refinement", "motion_rounds", KEYFRAME(motion.motion_rounds)),

      option("live", "enabled", FIELD(live.enabled)),
      option("live", "max_event_rate", FIELD(live.max_event_rate)),
      option("live", "max_queue_events", FIELD(live.max_queue_events)),
      option("live", "max_queue_mb", FIELD(live.max_queue_mb)),
      option("live", "max_pose_wait_s", FIELD(live.max_pose_wait_s)),
      option("live", "max_keyframes", FIELD(live.max_keyframes)),
      option("live", "max_speed_m_s", FIELD(live.max_speed_m_s)),
      option("live", "max_turn_deg_s", FIELD(live.max_turn_deg_s)),

      option("output", "camera_maps", KEYFRAME(camera_maps)),
      option("output", "event_images", KEYFRAME(event_images)),
      option("output", "ply", FIELD(ply)),

      optionOrAuto("performance", "threads", KEYFRAME(sweep.threads)),
      optionOrAuto("performance", "kernel", KEYFRAME(sweep.kernel)),
      option("performance", "packet_error_px", KEYFRAME(packets.packet_error_px)),
  };
#undef KEYFRAME
#undef REFINER
#undef FIELD
  return keys;
}

std::string_view formerOptionError(std::string_view section, std::string_view key) {
  struct FormerKey {
    std::string_view section;
    std::string_view key;
    std::string_view error;
  };
  static constexpr FormerKey kFormerKeys[] = {
      {"fusion", "revote", "was removed with re-voting"},
      {"fusion", "revote_power", "was removed with re-voting"},
      {"keyframes", "min_visible_share", "is called min_visible_fraction now"},
      {"depth", "min_excess", "is called min_local_contrast now"},
  };
  for (const FormerKey& former : kFormerKeys) {
    if (former.section == section && former.key == key) return former.error;
  }
  return {};
}

std::vector<std::string> optionKeysOf(std::string_view section) {
  std::vector<std::string> keys;
  for (const OptionKey& entry : optionKeys()) {
    if (entry.section == section) keys.emplace_back(entry.key);
  }
  return keys;
}

std::vector<std::string> optionSections() {
  std::vector<std::string> sections;
  std::string_view last;
  for (const OptionKey& entry : optionKeys()) {
    if (entry.section != last) sections.push_back("[" + std::string(entry.section) + "]");
    last = entry.section;
  }
  return sections;
}

std::vector<NamedOption> listOptions(const EventFusionOptions& options) {
  std::vector<NamedOption> list;
  for (const OptionKey& entry : optionKeys()) {
    list.push_back({entry.section, entry.key, entry.value(options)});
  }
  return list;
}

bool isOptionSection(std::string_view section) { return !optionKeysOf(section).empty(); }

}  // namespace efm
