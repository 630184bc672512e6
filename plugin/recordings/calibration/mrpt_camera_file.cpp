// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/calibration/mrpt_camera_file.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "mapping/base/text.h"
#include "plugin/recordings/calibration/camera_entry.h"

namespace efm {
namespace {

constexpr const char* kLeft = "_LEFT";
constexpr const char* kRight = "_RIGHT";
constexpr const char* kPose = "_LEFT2RIGHT_POSE";

/// The line without blanks and a comment.
std::string_view iniContent(std::string_view line) {
  for (const std::string_view comment : {";", "#", "//", "%"}) {
    line = line.substr(0, line.find(comment));
  }
  return trimmed(line);
}

std::string_view takeIniLine(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = iniContent(text.substr(0, end));
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

bool isSection(std::string_view line) {
  return line.size() > 2 && line.front() == '[' && line.back() == ']' &&
         line.find_first_of(", ") == std::string_view::npos;
}

/// A value in brackets is a list.
YAML::Node nodeOf(std::string_view value) {
  if (value.size() < 2 || value.front() != '[' || value.back() != ']') {
    return YAML::Node(std::string(value));
  }
  YAML::Node list(YAML::NodeType::Sequence);
  for (const std::string_view word : splitWords(value.substr(1, value.size() - 2), " \t\r,")) {
    list.push_back(std::string(word));
  }
  return list;
}

/// Sections and their keys, so that YamlEntry reads the values as strictly as those of YAML.
std::map<std::string, YAML::Node> iniSections(std::string_view text,
                                              const std::filesystem::path& file) {
  std::map<std::string, YAML::Node> sections;
  std::string section;
  for (int number = 1; !text.empty(); ++number) {
    const std::string_view line = takeIniLine(text);
    if (line.empty()) continue;
    if (isSection(line)) {
      section = std::string(line.substr(1, line.size() - 2));
      sections.emplace(section, YAML::Node(YAML::NodeType::Map));
      continue;
    }
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos) {
      throw std::runtime_error(fmt::format("{}:{}: {}: expected [section] or key = value",
                                           file.string(), number, inQuotes(line)));
    }
    sections[section][std::string(trimmed(line.substr(0, equals)))] =
        nodeOf(trimmed(line.substr(equals + 1)));
  }
  return sections;
}

CameraModel mrptCamera(const YamlEntry& entry) {
  CameraModel model;
  model.fx = entry.number("fx");
  model.fy = entry.number("fy");
  model.cx = entry.number("cx");
  model.cy = entry.number("cy");
  const std::vector<double> size = entry.numbers("resolution", 2, "2, width height");
  setSensorSize(entry, "resolution", size[0], size[1], model);

  const char* const key = entry.has("distortion_model") ? "distortion_model" : "distortion";
  const std::string distortion = entry.has(key) ? entry.text(key) : "plumb_bob";
  if (distortion == "plumb_bob") {
    model.distortion = DistortionModel::kRadtan;
    model.coefficients = entry.numbers("dist", 0, "a list of numbers");
    while (model.coefficients.size() > 5 && model.coefficients.back() == 0) {
      model.coefficients.pop_back();
    }
  } else if (distortion == "kannala_brandt") {
    model.distortion = DistortionModel::kEquidistant;
    model.coefficients = entry.numbers("dist", 4, "4, k1 k2 k3 k4");
  } else if (distortion != "none") {
    throw entry.failKey(key, inQuotes(distortion), "none, plumb_bob or kannala_brandt");
  }
  requireValid(entry, model);
  return model;
}

Rigid3 mrptPose(const YamlEntry& entry) {
  constexpr const char* kKey = "pose_quaternion";
  const std::vector<double> v = entry.numbers(kKey, 7, "7, x y z qw qx qy qz");
  const Eigen::Quaterniond rotation(v[3], v[4], v[5], v[6]);
  const double norm = rotation.norm();
  if (!(std::abs(norm - 1) <= 1e-3)) {
    throw entry.failKey(kKey, fmt::format("a quaternion of length {:g}", norm),
                        "a rotation, of length 1 to 0.001");
  }
  return {rotation.normalized(), {v[0], v[1], v[2]}};
}

}  // namespace

bool looksLikeIni(std::string_view text) {
  while (!text.empty()) {
    const std::string_view line = takeIniLine(text);
    if (!line.empty()) return isSection(line);
  }
  return false;
}

Rig readMrptCameras(std::string_view text, const std::filesystem::path& file) {
  const std::map<std::string, YAML::Node> sections = iniSections(text, file);
  const auto entry_of = [&](const std::string& name) {
    const auto found = sections.find(name);
    if (found != sections.end()) {
      return YamlEntry(file.string(), "[" + name + "]", found->second);
    }
    throw std::runtime_error(fmt::format(
        "{}: [{}] is missing: expected it with the cameras' sections", file.string(), name));
  };
  std::vector<std::string> cameras;
  for (const auto& [name, keys] : sections) {
    if (keys["fx"]) cameras.push_back(name);
  }
  Rig rig;
  if (cameras.size() == 1) {
    rig.cameras.push_back({mrptCamera(entry_of(cameras[0])), {}, 0});
    return rig;
  }
  const std::string prefix =
      cameras.empty() ? ""
                      : cameras[0].substr(0, std::min(cameras[0].rfind('_'), cameras[0].size()));
  if (cameras != std::vector<std::string>{prefix + kLeft, prefix + kRight}) {
    throw std::runtime_error(fmt::format(
        "{}: {} sections with fx: expected one camera, or [NAME_LEFT] and [NAME_RIGHT], as MRPT's "
        "camera calibration writes them",
        file.string(), cameras.size()));
  }
  rig.cameras.push_back({mrptCamera(entry_of(cameras[0])), {}, 0});
  rig.cameras.push_back({mrptCamera(entry_of(cameras[1])), mrptPose(entry_of(prefix + kPose)), 0});
  return rig;
}

}  // namespace efm
