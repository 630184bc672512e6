// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/calibration/calibration_file.h"

#include <fmt/format.h>

#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "mapping/options/quoted_text.h"
#include "mapping/options/text_parsing.h"
#include "plugin/calibration/camchain.h"

namespace efm {
namespace {

std::string camerasInWords(std::size_t count) {
  return fmt::format("{} camera{}", count, count == 1 ? "" : "s");
}

/// The first word outside comments; empty where there is none.
std::string firstWord(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::error_code ignored;
  if (!stream || std::filesystem::is_directory(file, ignored)) {
    throw std::runtime_error(file.string() + ": cannot be opened for reading");
  }
  std::string word;
  while (stream >> word && word.front() == '#') {
    std::getline(stream, word);
    word.clear();
  }
  return word;
}

std::vector<double> readNumbers(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::vector<double> numbers;
  std::string line;
  for (std::size_t number = 1; std::getline(stream, line); ++number) {
    for (const std::string_view word :
         splitWords(std::string_view(line).substr(0, line.find('#')))) {
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
                                  "expected a camera chain with resolution");
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

void Calibration::requireCameras(std::size_t count) const {
  if (rig.cameras.size() == count) return;
  throw std::invalid_argument(fmt::format("{}: {}: expected {}, as the recording has",
                                          file.string(), camerasInWords(rig.cameras.size()),
                                          count));
}

void Calibration::requireLike(const Rig& recorded) const {
  for (std::size_t i = 0; i < recorded.cameras.size(); ++i) {
    const CameraModel& model = recorded.cameras[i].model;
    camera(i, CameraSize{model.width, model.height});
  }
  requireCameras(recorded.cameras.size());
}

Calibration readCalibration(const std::filesystem::path& file) {
  const std::string word = firstWord(file);
  if (!word.empty() && word.front() == '{') {
    throw std::runtime_error(file.string() +
                             ": JSON is not read yet: expected a camera chain as Kalibr has it, or "
                             "nine numbers, fx fy cx cy k1 k2 p1 p2 k3");
  }
  Calibration calibration{file, {}};
  if (parseNumber<double>(word)) {
    CameraModel model = readUzhCalibration(file, {1, 1});  // any size: it is not in the file
    model.width = 0;
    model.height = 0;
    calibration.rig.cameras.push_back({model, {}, 0});
  } else {
    calibration.rig = readCamchain(file);
  }
  return calibration;
}

CameraModel readUzhCalibration(const std::filesystem::path& file, CameraSize size) {
  const std::vector<double> numbers = readNumbers(file);
  if (numbers.size() != 9) {
    throw std::runtime_error(fmt::format("{}: {} numbers: expected 9, fx fy cx cy k1 k2 p1 p2 k3",
                                         file.string(), numbers.size()));
  }
  CameraModel model;
  model.width = size.width;
  model.height = size.height;
  model.fx = numbers[0];
  model.fy = numbers[1];
  model.cx = numbers[2];
  model.cy = numbers[3];
  model.distortion = DistortionModel::kRadtan;
  model.coefficients.assign(numbers.begin() + 4, numbers.end());
  try {
    model.validate();
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
  return model;
}

}  // namespace efm
