// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/calibration/calibration_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "mapping/base/number_bytes.h"
#include "mapping/base/text.h"
#include "maps/io/npy_header.h"
#include "plugin/recordings/calibration/calibration_formats.h"
#include "plugin/recordings/calibration/yaml_entry.h"

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

Calibration readYamlCalibration(const std::filesystem::path& file) {
  const YAML::Node root = loadYaml(file.string());
  if (root.IsMap()) {
    const YamlEntry entry(file.string(), "", root);
    if (entry.has("cam0")) return {file, readCamchain(file), readCamchainImu(file)};
    if (entry.has("intrinsics") && entry.has("extrinsics")) return readDsecCalibration(entry, file);
    if (entry.has("value0")) return readTumVieCalibration(entry, file);
    if (entry.has("cameras")) return {file, readDvCameras(entry)};
    if (const auto camera = readOneCamera(entry)) return {file, {{{*camera, {}, 0}}}};
  }
  throw std::runtime_error(
      fmt::format("{}: not a calibration: expected {}", file.string(), kCalibrationFiles));
}

std::vector<double> readNumbers(const std::filesystem::path& file,
                                std::string_view blanks = kLineBlanks) {
  std::ifstream stream(file);
  std::vector<double> numbers;
  std::string line;
  for (std::size_t number = 1; std::getline(stream, line); ++number) {
    const std::string_view content = number == 1 ? withoutByteOrderMark(line) : line;
    for (const std::string_view word : splitWords(content.substr(0, content.find('#')), blanks)) {
      const std::optional<double> value = parseFinite(word);
      if (!value) {
        throw std::runtime_error(fmt::format("{}:{}: {}: expected a finite number", file.string(),
                                             number, inQuotes(word)));
      }
      numbers.push_back(*value);
    }
  }
  if (!stream.eof()) throw std::runtime_error(file.string() + ": cannot be opened for reading");
  return numbers;
}

/// Returns the numbers of an array, row after row.
std::vector<double> numbersInNpy(const std::string& text, const std::filesystem::path& file) {
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
    throw std::runtime_error(fmt::format("{}: {}", file.string(), error.what()));
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
  if (!parseNumber<double>(firstWord(text))) return readYamlCalibration(file);
  return readUzhCalibration(file);
}

Calibration readUzhCalibration(const std::filesystem::path& file) {
  const std::vector<double> numbers = readNumbers(file);
  const bool sized = numbers.size() == 11;
  if (numbers.size() != 9 && !sized) {
    throw std::runtime_error(
        fmt::format("{}: {} numbers: expected 9, fx fy cx cy k1 k2 p1 p2 k3, or width height, too",
                    file.string(), numbers.size()));
  }
  CameraModel model = radtanLens(file, {numbers.begin(), numbers.begin() + 4},
                                 {numbers.begin() + 4, numbers.begin() + 9});
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
  constexpr const char* kKey = "T_body_rig";
  constexpr const char* kExpected =
      "expected YAML, T_body_rig: 4 rows of 4 numbers, from the rig's frame to that of the tracked "
      "body; these numbers as text or .npy; a Kalibr camera chain with T_cam_imu, easy_handeye's "
      "result, DSEC's "
      "cam_to_lidar.yaml, or TUM-VIE's mocap-imu-calibration*.json";
  const std::string text = readText(file);
  if (text.compare(0, 2, "PK") == 0) {
    throw std::runtime_error(
        fmt::format("{}: an archive, as .npz of NumPy: {}", file.string(), kExpected));
  }
  const bool npy = looksLikeNpy(text);
  const bool only_numbers = text.find_first_of(":{<") == std::string::npos;
  const std::vector<double> numbers = npy            ? numbersInNpy(text, file)
                                      : only_numbers ? readNumbers(file, " \t\r,;[]")
                                                     : std::vector<double>();
  if (numbers.size() == 16) {
    const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(numbers.data());
    if (const auto T_body_rig = transformNear(matrix)) return *T_body_rig;
    throw std::runtime_error(
        file.string() +
        ": a 4x4 matrix: expected a rotation and a last row 0 0 0 1, both to 0.001");
  }
  const YAML::Node root = npy ? YAML::Node() : loadYaml(file.string());
  if (root.IsMap()) {
    const YamlEntry entry(file.string(), "", root);
    if (entry.has(kKey)) return entry.transform(kKey);
    if (entry.has("transformation")) return readEasyHandEye(entry);
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
