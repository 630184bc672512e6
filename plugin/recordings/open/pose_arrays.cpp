// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "mapping/geometry/rigid3.h"
#include "plugin/recordings/columns/npy_array.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/recordings/streams/file_content.h"
#include "plugin/recordings/streams/time_unit.h"

namespace efm {
namespace {

Rigid3 poseFromVector(const std::array<double, 7>& v) {
  const Eigen::Quaterniond numbers(v[6], v[3], v[4], v[5]);
  if (const auto rotation = rotationNear(numbers)) return {*rotation, {v[0], v[1], v[2]}};
  throw std::runtime_error(fmt::format(
      "qx qy qz qw of length {:g}: expected a rotation, of length 1 within 1 %; are the columns "
      "in this order?",
      numbers.coeffs().stableNorm()));
}

Rigid3 poseFromMatrix(const Eigen::Matrix4d& numbers) {
  if (const auto T_world_body = transformNear(numbers)) return *T_world_body;
  throw std::runtime_error(
      "a 4x4 matrix: expected a rotation and a last row 0 0 0 1, both to 0.001");
}

/// @param first index of the pose's first column.
Rigid3 poseOf(const std::shared_ptr<NpyArray>& array, std::uint64_t row, std::size_t first) {
  const auto number = [&](std::size_t k) { return NpyArray::columnOf(array, k).number(row); };
  if (array->columns() == 16) {
    Eigen::Matrix4d matrix;
    for (int k = 0; k < 16; ++k) matrix(k / 4, k % 4) = number(static_cast<std::size_t>(k));
    if (matrix.allFinite()) return poseFromMatrix(matrix);
  } else {
    std::array<double, 7> values{};
    bool finite = true;
    for (std::size_t k = 0; k < values.size(); ++k) {
      values[k] = number(first + k);
      finite = finite && std::isfinite(values[k]);
    }
    if (finite) return poseFromVector(values);
  }
  throw std::runtime_error("a number is not finite: expected finite ones");
}

std::string shapeOf(const NpyArray& array) {
  return fmt::format("({})", fmt::join(array.header().shape, ", "));
}

/// The arrays of a recording's poses; `times` is null if each row of `poses` begins with a time.
struct PoseArrays {
  std::shared_ptr<NpyArray> times;
  std::shared_ptr<NpyArray> poses;
};

bool hasPoseShape(const NpyArray& array, bool with_time) {
  const std::vector<std::uint64_t>& shape = array.header().shape;
  if (shape.size() == 3) return !with_time && shape[1] == 4 && shape[2] == 4;
  return shape.size() == 2 && shape[1] == (with_time ? 8U : 7U);
}

bool hasTimeShape(const NpyArray& array) {
  const std::vector<std::uint64_t>& shape = array.header().shape;
  return shape.size() == 1 || (shape.size() == 2 && shape[1] == 1);
}

bool namesTimes(const std::string& member) {
  return headerWord(std::filesystem::path(member).stem().string()).isTime();
}

bool namesPoses(const std::string& member) {
  const std::string name = std::filesystem::path(member).stem().string();
  return name == "poses" || name == "pose" || name == "T_world_body" || name == "trajectory";
}

/// Opens the member that fits: the only candidate, or the only candidate with a fitting name.
std::shared_ptr<NpyArray> chooseArray(const std::filesystem::path& file,
                                      std::vector<std::string> candidates, const char* what,
                                      bool (*has_name)(const std::string&),
                                      const std::string& all) {
  if (candidates.size() != 1) {
    candidates.erase(std::remove_if(candidates.begin(), candidates.end(),
                                    [&](const std::string& name) { return !has_name(name); }),
                     candidates.end());
  }
  if (candidates.size() == 1) return std::make_shared<NpyArray>(file, candidates.front());
  throw std::runtime_error(fmt::format(
      "{}: has {}: expected an array of N times, and one of N poses, N x 7 (tx ty tz qx "
      "qy qz qw) or N x 4 x 4; {} is not clear",
      file.string(), all, what));
}

PoseArrays openPoseArrays(const std::filesystem::path& file) {
  if (!isCompressed(file)) {
    auto poses = std::make_shared<NpyArray>(file);
    if (hasPoseShape(*poses, true)) return {nullptr, std::move(poses)};
    throw std::runtime_error(
        fmt::format("{}: shape {}: expected N rows of 8 numbers, t tx ty tz qx qy qz qw, or a .npz "
                    "file with times and poses",
                    file.string(), shapeOf(*poses)));
  }
  std::vector<std::string> with_time;
  std::vector<std::string> poses;
  std::vector<std::string> times;
  std::string all;
  for (const std::string& member : membersOf(file)) {
    std::string shape;
    try {
      const NpyArray array(file, member);
      shape = shapeOf(array);
      if (hasPoseShape(array, true)) with_time.push_back(member);
      if (hasPoseShape(array, false)) poses.push_back(member);
      if (hasTimeShape(array)) times.push_back(member);
    } catch (const std::runtime_error&) {
      shape = "(no numbers)";  // EVIMO2's meta: Python objects
    }
    all += (all.empty() ? "" : ", ") + member + " " + shape;
  }
  if (with_time.size() == 1) {
    return {nullptr, std::make_shared<NpyArray>(file, with_time.front())};
  }
  return {chooseArray(file, times, "the times", namesTimes, all),
          chooseArray(file, poses, "the poses", namesPoses, all)};
}

/// Returns the exponent of the unit of times: from the array's name, else from the first times.
int timeExponentOf(const RowColumn& times, const std::string& name, const ReaderOptions& options) {
  constexpr std::uint64_t kSample = 4096;
  const auto exponent = headerWord(std::filesystem::path(name).stem().string()).time_exponent;
  if (exponent) return *exponent;  // for example t_us.npy
  TimeSample sample;
  for (std::uint64_t row = 0; row < std::min(times.rows->size(), kSample); ++row) {
    const double t = times.number(row);
    sample.add(t, !isReal(times.type) || std::floor(t) == t);
  }
  if (options.pose_time_unit.empty()) requireTimesOfPoses(sample, name);
  return sample.whole ? poseTimeExponent(options, sample, name) : 0;
}

}  // namespace

std::vector<StampedPose> readPoseArrays(const std::filesystem::path& file,
                                        const ReaderOptions& options) {
  const PoseArrays arrays = openPoseArrays(file);
  NpyArray& poses = *arrays.poses;
  const std::shared_ptr<NpyArray> times_array = arrays.times ? arrays.times : arrays.poses;
  if (times_array->size() != poses.size()) {
    throw std::runtime_error(fmt::format("{}: {} rows: expected {}, as {} has", times_array->name(),
                                         times_array->size(), poses.size(), poses.name()));
  }
  std::vector<StampedPose> result;
  if (poses.size() == 0) return result;
  const RowColumn times = NpyArray::columnOf(times_array, 0);
  const std::int64_t unit_ns = nanosecondsPer(timeExponentOf(times, times_array->name(), options));
  for (std::uint64_t row = 0; row < poses.size(); ++row) {
    const std::optional<std::int64_t> t_ns = times.time(row, unit_ns);
    if (!t_ns) {
      throw times_array->failAt(
          row, fmt::format("t = {}: expected {}", times.number(row), kExpectedTime));
    }
    try {
      result.push_back({*t_ns, poseOf(arrays.poses, row, arrays.times ? 0 : 1)});
    } catch (const std::runtime_error& error) {
      throw poses.failAt(row, error.what());
    }
  }
  return result;
}

}  // namespace efm
