// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "mapping/base/option.h"
#include "plugin/session/event_fusion_options.h"

namespace efm {

/// Value of an option of any type.
using OptionValue = std::variant<bool, std::int64_t, double, std::string>;

/// Returns the text for a file. Numbers have the fewest digits that give the same value when read.
std::string textOf(const OptionValue& value);

/// Calls `use` with a section and the arguments of each line in the `fields` of option structs.
template <typename Use>
struct OptionLines {
  const Use& use;
  std::string_view section = {};

  template <typename Field>
  void operator()(std::string_view key, Field& field, const Allowed& allowed = {}) const {
    use(section, key, field, allowed);
  }
  template <typename Part>
  void operator()(Part& part) const {
    std::remove_const_t<Part>::fields(part, *this);
  }
};

/// Calls `use` with the section, key, field and range of all options, in the order of the files.
/// Reading, setting and listing of options use only this function, so they cannot differ.
template <typename Options, typename Use>
void visitOptions(Options& options, const Use& use) {
  OptionLines<Use> visit{use};
  auto& mapper = options.mapper;
  auto& keyframe = mapper.keyframe;

  visit.section = "rig";
  visit("calibration", options.rig.calibration);
  visit("hand_eye", options.rig.hand_eye);
  visit("cameras", mapper.cameras);
  visit("time_offsets_s", options.rig.time_offsets_ns);
  visit("pose_source", options.rig.pose_source);
  visit(mapper.trajectory);
  visit("exclude_silent", keyframe.exclude_silent);

  visit.section = "keyframes";
  visit(mapper.policy);
  visit("max_events_per_camera", keyframe.max_events_per_camera);

  visit.section = "dsi";
  visit(keyframe.planes);
  visit("reference_camera", keyframe.reference_camera);
  visit(keyframe.view);

  visit.section = "fusion";
  visit(keyframe.sweep.fusion);
  visit(keyframe.subintervals);
  visit(keyframe.split);
  visit("late", options.late_fusion);

  visit.section = "depth";
  visit(keyframe.extraction);

  visit.section = "map";
  visit(options.cloud);
  visit("min_keyframe_quality", options.min_keyframe_quality, Allowed::from(0, 1, "0 to 1"));

  visit.section = "filter";
  visit(mapper.filter);

  visit.section = "refinement";
  visit("enabled", options.refinement.enabled);
  visit("background", options.refinement.background);
  visit(options.refinement.refiner);
  visit(keyframe.motion);

  visit.section = "live";
  visit(options.live);

  visit.section = "checks";
  visit("enabled", options.checks);

  visit.section = "output";
  visit("camera_maps", keyframe.camera_maps);
  visit("event_images", keyframe.event_images);
  visit("ply", options.ply);
  visit("session", options.session);
  visit("session_file", options.session_file);

  visit.section = "performance";
  visit(keyframe.sweep);
  visit(keyframe.packets);
}

/// Option with its names in files.
struct NamedOption {
  std::string_view section;
  std::string_view key;
  OptionValue value;
};

/// Returns all options, in the order of the files. Reading a value back gives the same value.
std::vector<NamedOption> listOptions(const EventFusionOptions& options);
/// Sets an option from the text of a file. Paths are relative to `folder`.
/// @return false if there is no such option.
/// @throws std::invalid_argument saying what is expected: "must be a number, or auto".
bool setOption(EventFusionOptions& options, std::string_view section, std::string_view key,
               std::string_view text, const std::filesystem::path& folder);
/// Returns all options: an object of sections, which are objects of keys.
nlohmann::ordered_json asJson(const EventFusionOptions& options);
/// Returns a list of objects with key, value and reason.
nlohmann::ordered_json asJson(const std::vector<ChosenOption>& chosen);
/// Returns whether an option file may have a section of this name.
bool isOptionSection(std::string_view section);

}  // namespace efm
