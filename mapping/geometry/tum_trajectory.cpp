// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/tum_trajectory.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "mapping/base/number_text.h"
#include "mapping/base/quoted_text.h"
#include "mapping/base/text_parsing.h"
#include "mapping/geometry/rounded_rotation.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

constexpr std::array<std::string_view, 8> kFieldNames = {"t",  "tx", "ty", "tz",
                                                         "qx", "qy", "qz", "qw"};

std::runtime_error fieldError(std::size_t field, std::string_view text, const char* expected) {
  return std::runtime_error(std::string(kFieldNames[field]) + " = " + inQuotes(text) +
                            ": expected " + expected);
}

double numberIn(const std::vector<std::string_view>& fields, std::size_t field) {
  const std::optional<double> value = parseFinite(fields[field]);
  if (!value) throw fieldError(field, fields[field], "a finite number");
  return *value;
}

std::runtime_error quaternionError(const std::vector<std::string_view>& fields, double norm) {
  std::string values;
  for (std::size_t field = 4; field < fields.size(); ++field) {
    values += (values.empty() ? "" : " ") + std::string(fields[field]);
  }
  NumberText text(6);
  text << "qx qy qz qw = " << inQuotes(values) << ", of length " << norm
       << ": expected a rotation, of length 1 within 1 %";
  double squares = 0;
  for (std::size_t field = 1; field <= 4; ++field) squares += std::pow(numberIn(fields, field), 2);
  text << (std::abs(squares - 1) < 0.01
               ? "; tx ty tz qx has length 1: is the order t qx qy qz qw tx ty tz? "
               : "; are the columns t tx ty tz qx qy qz qw? ")
       << "A header names other ones";
  return std::runtime_error(text.str());
}

}  // namespace

StampedPose parseTumPose(const std::vector<std::string_view>& fields, int time_exponent) {
  if (fields.size() != kFieldNames.size()) {
    throw std::runtime_error(std::to_string(fields.size()) +
                             " fields: expected 8, t tx ty tz qx qy qz qw" +
                             (fields.size() == 7 ? " (angles are not read)" : ""));
  }
  const std::optional<std::int64_t> t_ns = parseTimeIn(fields[0], time_exponent);
  if (!t_ns) throw fieldError(0, fields[0], "a time in decimal seconds");
  if (*t_ns >= kEndOfTimeNs || *t_ns <= -kEndOfTimeNs) {
    throw fieldError(0, fields[0], "a time within 4.6e9 s of 0");
  }
  StampedPose pose;
  pose.t_ns = *t_ns;
  pose.T_world_rig.translation = {numberIn(fields, 1), numberIn(fields, 2), numberIn(fields, 3)};
  const Eigen::Quaterniond numbers(numberIn(fields, 7), numberIn(fields, 4), numberIn(fields, 5),
                                   numberIn(fields, 6));
  const auto rotation = rotationNear(numbers);
  if (!rotation) throw quaternionError(fields, numbers.coeffs().stableNorm());
  pose.T_world_rig.rotation = *rotation;
  return pose;
}

std::vector<StampedPose> readTumTrajectory(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) throw std::runtime_error(file.string() + ": cannot be opened for reading");
  return readTumTrajectory(stream, file.string());
}

std::vector<StampedPose> readTumTrajectory(std::istream& stream, const std::string& name) {
  std::vector<StampedPose> poses;
  std::string line;
  for (std::size_t number = 1; std::getline(stream, line); ++number) {
    const std::string_view content = number == 1 ? withoutByteOrderMark(line) : line;
    const std::vector<std::string_view> fields = splitWords(content.substr(0, content.find('#')));
    if (fields.empty()) continue;
    try {
      poses.push_back(parseTumPose(fields));
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(name + ":" + std::to_string(number) + ": " + error.what());
    }
  }
  if (stream.bad()) throw std::runtime_error(name + ": cannot be read to its end");
  return poses;
}

std::vector<StampedPose> readPosesFile(const std::filesystem::path& file) {
  std::vector<StampedPose> poses = readTumTrajectory(file);
  if (!poses.empty()) return poses;
  throw std::runtime_error(file.string() +
                           ": no poses: expected at least one line t tx ty tz qx qy qz qw");
}

void writeTumTrajectory(const std::filesystem::path& file, const std::vector<StampedPose>& poses) {
  std::ofstream stream(file);
  writeTumTrajectory(stream, poses);
  stream.close();
  if (!stream) throw std::runtime_error(file.string() + ": cannot be written");
}

void writeTumTrajectory(std::ostream& stream, const std::vector<StampedPose>& poses) {
  stream << "# t tx ty tz qx qy qz qw\n";
  for (const StampedPose& pose : poses) writeTumPose(stream, pose);
}

void writeTumPose(std::ostream& stream, const StampedPose& pose) {
  const Eigen::Vector3d& p = pose.T_world_rig.translation;
  const Eigen::Quaterniond& q = pose.T_world_rig.rotation;
  NumberText line;
  line << formatSeconds(pose.t_ns) << ' ' << p.x() << ' ' << p.y() << ' ' << p.z() << ' ' << q.x()
       << ' ' << q.y() << ' ' << q.z() << ' ' << q.w() << '\n';
  stream << line.str();
}

}  // namespace efm
