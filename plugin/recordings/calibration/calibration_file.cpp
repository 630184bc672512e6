// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/calibration/calibration_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "mapping/base/npy_header.h"
#include "mapping/base/number_bytes.h"
#include "mapping/base/text.h"
#include "plugin/recordings/calibration/calibration_formats.h"
#include "plugin/recordings/calibration/yaml_entry.h"
#include "plugin/recordings/files/file_content.h"

namespace efm {
namespace {

std::string camerasInWords(std::size_t count) {
  return fmt::format("{} camera{}", count, count == 1 ? "" : "s");
}

/// @throws std::runtime_error if the file cannot be read, or is too large for a calibration.
std::string readText(const std::filesystem::path& file) {
  constexpr std::uintmax_t kMaxBytes = 10'000'000;
  std::error_code error;
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file, error)) {
    throw std::runtime_error(file.string() + ": cannot be opened for reading");
  }
  if (std::filesystem::file_size(file, error) > kMaxBytes && !error) {
    throw std::runtime_error(
        fmt::format("{}: larger than 10 MB: expected {}", file.string(), kCalibrationFiles));
  }
  std::ostringstream text;
  text << stream.rdbuf();
  return std::string(withoutByteOrderMark(text.str()));
}

/// Returns the first word outside comments; empty if there is none.
std::string firstWord(const std::string& text) {
  std::istringstream stream(text);
  std::string word;
  while (stream >> word && word.front() == '#') {
    std::getline(stream, word);
    word.clear();
  }
  return word;
}

/// Returns the numbers of an array, row after row. @param text of a .npy file.
std::vector<double> numbersInNpy(const std::string& text, const std::string& name) {
  std::vector<double> numbers;
  try {
    const NpyHeader header = parseNpyHeader(text);
    requirePlainRows(header);
    for (std::size_t at = header.data_begin;
         numbers.size() < header.count() && at + header.element_bytes <= text.size();
         at += header.element_bytes) {
      numbers.push_back(numberAt(&text[at], header.type, header.big_endian));
    }
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{}: {}", name, error.what()));
  }
  return numbers;
}

/// Returns the arrays of a .npz file that have numbers, by their names in lower case.
std::map<std::string, std::vector<double>> arraysIn(const std::filesystem::path& file) {
  constexpr std::size_t kMaxBytes = 100'000;
  std::map<std::string, std::vector<double>> arrays;
  for (const std::string& member : membersOf(file)) {
    std::string name = std::filesystem::path(member).stem().string();
    for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    try {
      arrays[name] = numbersInNpy(firstContentOf(file, kMaxBytes, member), member);
    } catch (const std::runtime_error&) {  // Python objects, as the rotations of OpenCV's tutorial
    }
  }
  return arrays;
}

/// Reads the camera's matrix and the coefficients of a lens from a .npz file.
Calibration readCameraArrays(const std::filesystem::path& file) {
  constexpr std::pair<const char*, const char*> kNames[] = {
      {"mtx", " mtx k camera_matrix cameramatrix matrix intrinsic intrinsics "},
      {"dist", " dist d dist_coeffs distcoeffs distortion distortion_coefficients "}};
  YAML::Node node(YAML::NodeType::Map);
  for (const auto& [array, numbers] : arraysIn(file)) {
    for (const auto& [key, names] : kNames) {
      if (std::string_view(names).find(" " + array + " ") == std::string_view::npos) continue;
      for (const double number : numbers) node[key].push_back(fmt::format("{}", number));
    }
  }
  if (!node["mtx"] || !node["dist"]) {
    throw std::runtime_error(file.string() +
                             ": expected arrays mtx, 3 x 3, and dist, as OpenCV's tutorial saves");
  }
  if (node["dist"].size() == 4) {
    throw std::runtime_error(
        file.string() +
        ": four coefficients are of a radtan or of a fisheye lens: expected five (k1 k2 p1 p2 0), "
        "or YAML of a Kalibr camera chain with distortion_model: equidistant");
  }
  return {file, {{{*readOneCamera(YamlEntry(file.string(), "", node)), {}, 0}}}};
}

Calibration readYamlCalibration(const std::filesystem::path& file) {
  const YAML::Node root = loadYaml(file.string());
  if (root.IsMap()) {
    const YamlEntry entry(file.string(), "", root);
    if (entry.has("cam0")) return {file, readCamchain(file), readCamchainImu(file)};
    if (entry.has("intrinsics") && entry.has("extrinsics")) return readDsecCalibration(entry, file);
    if (entry.has("value0")) return readBasaltCalibration(entry, file);
    if (entry.has("cameras")) return {file, readDvCameras(entry)};
    if (const auto camera = readOneCamera(entry)) return {file, {{{*camera, {}, 0}}}};
  }
  throw std::runtime_error(
      fmt::format("{}: not a calibration: expected {}", file.string(), kCalibrationFiles));
}

/// Returns the numbers of a text. @param blanks separate them.
std::vector<double> numbersIn(std::string_view text, const std::filesystem::path& file,
                              std::string_view blanks = kLineBlanks) {
  std::vector<double> numbers;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view line = takeLine(text);
    for (const std::string_view word : splitWords(line.substr(0, line.find('#')), blanks)) {
      if (const std::optional<double> value = parseFinite(word)) {
        numbers.push_back(*value);
        continue;
      }
      throw std::runtime_error(fmt::format("{}:{}: {}: expected a finite number", file.string(),
                                           number, inQuotes(word)));
    }
  }
  return numbers;
}

}  // namespace

RigCamera Calibration::camera(std::size_t index, const std::optional<CameraSize>& sensor) const {
  if (index >= rig.cameras.size()) {
    throw std::invalid_argument(
        fmt::format("{}: {}, but the recording has camera {}: expected one for each", file.string(),
                    camerasInWords(rig.cameras.size()), index));
  }
  RigCamera camera = rig.cameras[index];
  const CameraSize size = {camera.model.width, camera.model.height};
  if (size.width == 0) {
    if (!sensor) {
      throw std::invalid_argument(file.string() +
                                  ": no size of the sensor, and the recording does not say it: "
                                  "expected --sensor-size WIDTHxHEIGHT, or a camera chain with "
                                  "resolution");
    }
    camera.model.width = sensor->width;
    camera.model.height = sensor->height;
  } else if (sensor && (sensor->width != size.width || sensor->height != size.height)) {
    throw std::invalid_argument(
        fmt::format("{}: camera {} has {}x{} pixels: expected {}x{} pixels, as the recording has",
                    file.string(), index, size.width, size.height, sensor->width, sensor->height));
  }
  return camera;
}

Calibration Calibration::of(std::size_t count, const std::vector<int>& selected) const {
  Calibration less = *this;
  if (rig.cameras.size() <= count || selected.size() != count) return less;
  less.rig.cameras.clear();
  for (const int camera : selected) {
    if (camera < 0 || static_cast<std::size_t>(camera) >= rig.cameras.size()) return *this;
    less.rig.cameras.push_back(rig.cameras[static_cast<std::size_t>(camera)]);
  }
  return less;
}

void Calibration::requireCameras(std::size_t count) const {
  const std::size_t own = rig.cameras.size();
  if (own == count) return;
  std::string last;  // the last cameras, as many as the recording has
  for (std::size_t i = own - std::min(count, own); i < own && own > count; ++i) {
    last += fmt::format("{}{}", last.empty() ? "" : ",", i);
  }
  throw std::invalid_argument(fmt::format(
      "{}: {}: expected {}, as the recording has{}", file.string(), camerasInWords(own), count,
      last.empty()
          ? ""
          : fmt::format(
                "; `map --calibration {} --set rig.cameras={}` (Python: cameras=[{}]) takes "
                "the camera {} (or others of 0 to {})",
                file.string(), last, last, last, own - 1)));
}

void Calibration::requireLike(const Rig& recorded) const {
  for (std::size_t i = 0; i < recorded.cameras.size(); ++i) {
    camera(i, knownSize(recorded.cameras[i].model));
  }
  requireCameras(recorded.cameras.size());
}

Calibration readCalibration(const std::filesystem::path& file) {
  const std::string text = readText(file);
  if (looksLikeIni(text)) return {file, readMrptCameras(text, file)};
  if (text.compare(0, 2, "PK") == 0) return readCameraArrays(file);
  std::string first = firstWord(text);
  if (!first.empty() && first.find_first_of(",;") != first.npos)
    first.resize(first.find_first_of(",;"));
  if (!parseNumber<double>(first)) return readYamlCalibration(file);
  return readUzhCalibration(file);
}

Calibration readUzhCalibration(const std::filesystem::path& file) {
  const std::vector<double> numbers = numbersIn(readText(file), file, " \t\r,;");
  const bool sized = numbers.size() == 11;
  if (numbers.size() != 9 && !sized) {
    throw std::runtime_error(
        fmt::format("{}: {} numbers: expected 9, fx fy cx cy k1 k2 p1 p2 k3, or width height, too",
                    file.string(), numbers.size()));
  }
  const std::vector<double>& n = numbers;
  if (!sized && n[3] == 0 && n[6] == 0 && n[7] == 0 && n[8] == 1 && n[1] != 0) {
    throw std::runtime_error(file.string() +
                             ": a matrix with skew: expected fx 0 cx, 0 fy cy, 0 0 1");
  }
  CameraModel model = !sized && isCameraMatrix(n)
                          ? radtanLens(file, {n[0], n[4], n[2], n[5]}, std::vector<double>(5))
                          : radtanLens(file, n, {n.begin() + 4, n.begin() + 9});
  if (!sized) return {file, {{{model, {}, 0}}}};
  for (const double side : {numbers[9], numbers[10]}) {
    if (side >= 1 && side <= 65535 && std::floor(side) == side) continue;
    throw std::runtime_error(
        fmt::format("{}: {:g}: expected the sensor's width and height after nine numbers",
                    file.string(), side));
  }
  model.width = static_cast<int>(numbers[9]);
  model.height = static_cast<int>(numbers[10]);
  return {file, {{{model, {}, 0}}}};
}

CameraModel radtanLens(const std::filesystem::path& file, const std::vector<double>& k,
                       std::vector<double> coefficients) {
  CameraModel model{1, 1, k[0], k[1], k[2], k[3], DistortionModel::kRadtan, {}};
  model.coefficients = std::move(coefficients);
  try {
    model.validate();
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{}: {}", file.string(), error.what()));
  }
  model.width = model.height = 0;
  return model;
}

Rigid3 readHandEye(const std::filesystem::path& file, const Calibration* calibration) {
  constexpr const char* kExpected =
      "expected YAML, T_body_rig: 4 rows of 4 numbers, from the rig's frame to that of the tracked "
      "body; these numbers, or x y z qx qy qz qw, as text, .npy or .npz; a Kalibr camera chain "
      "with T_cam_imu, results of easy_handeye, OpenVINS or VINS, DSEC's cam_to_lidar.yaml, or "
      "TUM-VIE's mocap-imu-calibration*.json";
  const std::string text = readText(file);
  const bool npy = looksLikeNpy(text) || text.compare(0, 2, "PK") == 0;
  std::vector<double> numbers;
  if (looksLikeNpy(text)) {
    numbers = numbersInNpy(text, file.string());
  } else if (npy) {
    for (const auto& [name, array] : arraysIn(file)) {
      if (array.size() != 16 && array.size() != 7) continue;
      if (name.rfind("t_cam", 0) == 0) {
        throw std::runtime_error(
            fmt::format("{}: {}: expected its inverse, T_body_rig", file.string(), name));
      }
      if (!numbers.empty())
        throw std::runtime_error(file.string() + ": two transforms: expected one");
      numbers = array;
    }
  } else if (text.find_first_of(":{<") == std::string::npos) {
    numbers = numbersIn(text, file, " \t\r,;[]");
  }
  if (!numbers.empty()) {
    const bool other_order = text.find("qw") < text.find("qx") || text.find("[cm]") != text.npos ||
                             text.find("[mm]") != text.npos;
    try {
      if (other_order) throw std::runtime_error("expected x y z qx qy qz qw, in metres");
      return transformOf(numbers);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("{}: {}", file.string(), error.what()));
    }
  }
  const YAML::Node root = npy ? YAML::Node() : loadYaml(file.string());
  if (root.IsMap()) {
    const YamlEntry entry(file.string(), "", root);
    for (const char* key : {"T_body_rig", "body_T_cam0"}) {
      if (entry.has(key)) return entry.transform(key);
    }
    if (entry.has("extrinsicRotation")) {  // VINS-Mono
      const std::vector<double> p = entry.numbers("extrinsicTranslation", 3, "3, x y z");
      return {entry.rotation("extrinsicRotation"), {p[0], p[1], p[2]}};
    }
    if (entry.has("transformation") || entry.has("transform")) return readEasyHandEye(entry);
    if (entry.has("T_lidar_camRect1")) return readDsecHandEye(entry, calibration);
    if (entry.has("value0")) return readTumVieHandEye(entry, calibration);
    if (entry.has("cam0")) {
      if (const auto T_imu_rig = readCamchainImu(file)) return *T_imu_rig;
      throw entry.section("cam0").fail("T_cam_imu is missing: expected 4 rows of 4 numbers");
    }
  }
  throw std::runtime_error(fmt::format("{}: T_body_rig is missing: {}", file.string(), kExpected));
}

}  // namespace efm
