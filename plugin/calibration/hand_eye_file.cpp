// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/calibration/hand_eye_file.h"

#include <stdexcept>

#include "plugin/calibration/yaml_entry.h"

namespace efm {

Rigid3 readHandEye(const std::filesystem::path& file) {
  constexpr const char* kKey = "T_body_rig";
  const YAML::Node root = loadYaml(file.string());
  if (!root.IsMap() || !root[kKey]) {
    throw std::runtime_error(file.string() +
                             ": T_body_rig is missing: expected YAML, T_body_rig: 4 rows of 4 "
                             "numbers, from the rig's frame to that of the tracked body");
  }
  return YamlEntry(file.string(), "", root).transform(kKey);
}

}  // namespace efm
