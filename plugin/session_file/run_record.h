// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "mapping/geometry/rig.h"
#include "maps/cloud/map_point.h"
#include "plugin/session/event_fusion_options.h"

namespace efm {

/// Returns the first part of SessionFile::run: version, kernel, and the options as they were given.
nlohmann::ordered_json runOf(const EventFusionOptions& given);
/// Adds what is known before the first keyframe: cameras, options in use, and how they were chosen.
void addChosen(nlohmann::ordered_json& run, const Rig& rig, const EventFusionOptions& options,
               const std::vector<ChosenOption>& chosen);

/// Returns what identifies the files of a recording: a list of objects with name, bytes, and the
/// SHA-256 of the first and the last MiB. Folders have all their files, except pictures, clouds and
/// logs. A path that is empty or does not exist is left out.
/// @param out the result's folder, which may lie in a folder of the recording: it is left out.
nlohmann::ordered_json fingerprintOf(const std::vector<std::filesystem::path>& inputs,
                                     const std::filesystem::path& out = {});

/// Returns the differences between two runs in words, one each: "dsi.max_depth_m was 8, now 5".
/// Compares what a result depends on: recording, options (without threads), limits, faults,
/// version.
/// @param before, now `SessionFile::run`.
std::vector<std::string> differencesOf(const nlohmann::ordered_json& before,
                                       const nlohmann::ordered_json& now);

/// `mapHash` of a cloud that comes in parts: no point of a part has a smaller x than one before it.
class MapHasher {
 public:
  MapHasher();
  ~MapHasher();
  void add(const MapCloud& part);
  std::string finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace efm
