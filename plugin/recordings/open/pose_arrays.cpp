// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "plugin/recordings/columns/npy_array.h"
#include "plugin/recordings/files/file_content.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/recordings/streams/time_unit.h"
#include "plugin/recordings/text/text_table.h"

namespace efm {
namespace {

/// The arrays of a recording's poses; `times` is null if each row of `poses` begins with a time.
/// `rotations` are quaternions if `poses` are positions alone.
struct PoseArrays {
  std::shared_ptr<NpyArray> times;
  std::shared_ptr<NpyArray> poses;
  std::shared_ptr<NpyArray> rotations = nullptr;
};

std::string stemOf(const std::string& member) {
  return std::filesystem::path(member).stem().string();
}

Rigid3 poseOf(const PoseArrays& arrays, std::uint64_t row) {
  std::vector<double> numbers;
  for (const auto& array : {arrays.poses, arrays.rotations}) {
    for (std::size_t k = arrays.times ? 0 : 1; array && k < array->columns(); ++k) {
      numbers.push_back(NpyArray::columnOf(array, k).number(row));
    }
  }
  const auto has = [&](const char* word) {
    return arrays.rotations && arrays.rotations->name().find(word) != std::string::npos;
  };
  if (has("wxyz") || has("w_first") || has("scalar_first")) {
    std::rotate(numbers.begin() + 3, numbers.begin() + 4, numbers.end());
  }
  Rigid3 T_world_body = transformOf(numbers);
  if (arrays.rotations) {
    T_world_body.translation *= metresOf(headerWord(stemOf(arrays.poses->name())).unit).value_or(1);
  }
  return T_world_body;
}

std::string shapeOf(const NpyArray& array) {
  return fmt::format("({})", fmt::join(array.header().shape, ", "));
}

/// What an array may be, by its shape.
enum class Kind { kTimes, kTimedPoses, kPoses, kPositions, kQuaternions, kOther };

Kind kindOf(const NpyArray& array) {
  const std::vector<std::uint64_t>& shape = array.header().shape;
  if (shape.size() == 3) return shape[1] == 4 && shape[2] == 4 ? Kind::kPoses : Kind::kOther;
  if (shape.size() == 1) return Kind::kTimes;
  constexpr std::pair<std::uint64_t, Kind> kColumns[] = {{1, Kind::kTimes},
                                                         {3, Kind::kPositions},
                                                         {4, Kind::kQuaternions},
                                                         {7, Kind::kPoses},
                                                         {8, Kind::kTimedPoses}};
  for (const auto& [columns, kind] : kColumns) {
    if (shape.size() == 2 && shape[1] == columns) return kind;
  }
  return Kind::kOther;
}

bool namesTimes(const std::string& member) { return headerWord(stemOf(member)).isTime(); }

bool namesPoses(const std::string& member) {
  const std::string name = stemOf(member);
  return name == "poses" || name == "pose" || name == "T_world_body" || name == "trajectory";
}

PoseArrays openPoseArrays(const std::filesystem::path& file) {
  if (!isCompressed(file)) {
    auto poses = std::make_shared<NpyArray>(file);
    if (kindOf(*poses) == Kind::kTimedPoses) return {nullptr, std::move(poses)};
    throw std::runtime_error(
        fmt::format("{}: shape {}: expected N rows of 8 numbers, t tx ty tz qx qy qz qw, or a .npz "
                    "file with times and poses",
                    file.string(), shapeOf(*poses)));
  }
  std::map<Kind, std::vector<std::string>> members;
  std::string all;
  for (const std::string& member : membersOf(file)) {
    std::string shape;
    try {
      const NpyArray array(file, member);
      shape = shapeOf(array);
      members[kindOf(array)].push_back(member);
    } catch (const std::runtime_error&) {
      shape = "(no numbers)";  // EVIMO2's meta: Python objects
    }
    all += (all.empty() ? "" : ", ") + member + " " + shape;
    if (stemOf(member) == "w2c" || stemOf(member) == "world_to_camera") {
      throw std::runtime_error(
          fmt::format("{}: {}: expected its inverse, T_world_body", file.string(), member));
    }
  }
  // Opens the member of a kind: the only one, or the only one with a fitting name.
  const auto open = [&](Kind kind, const char* what, bool (*has_name)(const std::string&)) {
    std::vector<std::string> found = members[kind];
    const auto unfit = [&](const std::string& name) { return !has_name || !has_name(name); };
    if (found.size() != 1)
      found.erase(std::remove_if(found.begin(), found.end(), unfit), found.end());
    if (found.size() == 1) return std::make_shared<NpyArray>(file, found.front());
    throw std::runtime_error(fmt::format(
        "{}: has {}: expected an array of N times, and one of N poses, N x 7 (tx ty tz qx qy qz "
        "qw) "
        "or N x 4 x 4, or N x 3 positions and N x 4 quaternions (x y z w); {} is not clear",
        file.string(), all, what));
  };
  if (members[Kind::kTimedPoses].size() == 1) {
    return {nullptr, open(Kind::kTimedPoses, "", nullptr)};
  }
  auto times = open(Kind::kTimes, "the times", namesTimes);
  if (members[Kind::kPoses].empty() && !members[Kind::kPositions].empty()) {
    return {std::move(times), open(Kind::kPositions, "the positions", nullptr),
            open(Kind::kQuaternions, "the quaternions", nullptr)};
  }
  return {std::move(times), open(Kind::kPoses, "the poses", namesPoses)};
}

/// Returns the exponent of the unit of times: from the array's name, else from the first times.
int timeExponentOf(const RowColumn& times, const std::string& name, const ReaderOptions& options) {
  constexpr std::uint64_t kSample = 4096;
  const auto exponent = headerWord(stemOf(name)).time_exponent;
  if (exponent) return *exponent;  // for example t_us.npy
  TimeSample sample;
  for (std::uint64_t row = 0; row < std::min(times.rows->size(), kSample); ++row) {
    const double t = times.number(row);
    sample.add(t, !isReal(times.type) || std::floor(t) == t);
  }
  if (options.pose_time_unit.empty()) requireTimesOfPoses(sample, name, options);
  return sample.whole ? poseTimeExponent(options, sample, name) : 0;
}

}  // namespace

std::vector<StampedPose> readPoseArrays(const std::filesystem::path& file,
                                        const ReaderOptions& options) {
  const PoseArrays arrays = openPoseArrays(file);
  NpyArray& poses = *arrays.poses;
  const std::shared_ptr<NpyArray> times_array = arrays.times ? arrays.times : arrays.poses;
  for (const auto& array : {times_array, arrays.rotations}) {
    if (!array || array->size() == poses.size()) continue;
    throw std::runtime_error(fmt::format("{}: {} rows: expected {}, as {} has", array->name(),
                                         array->size(), poses.size(), poses.name()));
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
      result.push_back({*t_ns, poseOf(arrays, row)});
    } catch (const std::runtime_error& error) {
      throw poses.failAt(row, error.what());
    }
  }
  return result;
}

}  // namespace efm
