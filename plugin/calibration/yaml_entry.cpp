// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/calibration/yaml_entry.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>
#include <limits>
#include <utility>

#include "mapping/options/quoted_text.h"

namespace efm {
namespace {

constexpr double kMaxRotationError = 1e-3;

std::string lineOf(const YAML::Mark& mark) {
  return mark.is_null() ? "" : ":" + std::to_string(mark.line + 1);
}

std::string inWords(const YAML::Node& node) {
  if (node.IsScalar()) return inQuotes(node.Scalar());
  if (node.IsSequence()) return "a list";
  return node.IsMap() ? "keys" : "nothing";
}

}  // namespace

YamlEntry::YamlEntry(std::string file, std::string name, const YAML::Node& node)
    : file_(std::move(file)), name_(std::move(name)), node_(node) {
  if (!node_.IsMap()) throw fail(node_, "expected keys and values");
}

std::string YamlEntry::text(const char* key) const {
  const YAML::Node value = find(key);
  if (!value.IsScalar()) throw fail(value, std::string(key) + ": expected a word");
  return value.Scalar();
}

std::vector<double> YamlEntry::numbers(const char* key, const char* expected) const {
  return numbersOf(find(key), key, expected);
}

std::vector<double> YamlEntry::numbers(const char* key, std::size_t count,
                                       const char* expected) const {
  return numbersOf(find(key), key, count, expected);
}

Rigid3 YamlEntry::transform(const char* key) const {
  constexpr const char* kExpected = "4 rows of 4 numbers";
  const YAML::Node rows = find(key);
  if (!rows.IsSequence() || rows.size() != 4) throw failKey(rows, key, kExpected);
  Eigen::Matrix4d matrix;
  for (int row = 0; row < 4; ++row) {
    const std::vector<double> values =
        numbersOf(rows[static_cast<std::size_t>(row)], key, 4, kExpected);
    matrix.row(row) = Eigen::RowVector4d::Map(values.data());
  }

  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const double error =
      (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= kMaxRotationError)) {
    throw failKey(key, "a matrix whose columns are off orthonormal by " + std::to_string(error),
                  "a rotation, to 0.001");
  }
  if (rotation.determinant() < 0) throw failKey(key, "a reflection", "a rotation");
  if (matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    throw failKey(key, "a matrix with another last row", "0 0 0 1 there");
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d nearest = svd.matrixU() * svd.matrixV().transpose();
  return {Eigen::Quaterniond(nearest).normalized(), matrix.topRightCorner<3, 1>()};
}

YAML::Node YamlEntry::find(const char* key) const {
  const YAML::Node value = node_[key];
  if (!value) throw fail(node_, std::string(key) + " is missing");
  return value;
}

std::vector<double> YamlEntry::numbersOf(const YAML::Node& list, const char* key,
                                         const char* expected) const {
  if (!list.IsSequence()) throw failKey(list, key, expected);
  std::vector<double> values;
  for (const YAML::Node& item : list) {
    double value = std::numeric_limits<double>::quiet_NaN();
    if (!item.IsScalar() || !YAML::convert<double>::decode(item, value) || !std::isfinite(value)) {
      throw failKey(item, key, "finite numbers");
    }
    values.push_back(value);
  }
  return values;
}

std::vector<double> YamlEntry::numbersOf(const YAML::Node& list, const char* key, std::size_t count,
                                         const char* expected) const {
  std::vector<double> values = numbersOf(list, key, expected);
  if (values.size() == count) return values;
  throw fail(list, std::string(key) + ": " + std::to_string(values.size()) + " numbers: expected " +
                       expected);
}

std::runtime_error YamlEntry::failKey(const char* key, const std::string& found,
                                      const std::string& expected) const {
  return fail(find(key), std::string(key) + " = " + found + ": expected " + expected);
}

std::runtime_error YamlEntry::fail(const std::string& what) const { return fail(node_, what); }

std::runtime_error YamlEntry::failKey(const YAML::Node& node, const char* key,
                                      const std::string& expected) const {
  return fail(node, std::string(key) + " = " + inWords(node) + ": expected " + expected);
}

std::runtime_error YamlEntry::fail(const YAML::Node& node, const std::string& what) const {
  return std::runtime_error(file_ + lineOf(node.Mark()) + ": " + name_ +
                            (name_.empty() ? "" : ": ") + what);
}

YAML::Node loadYaml(const std::string& file) {
  try {
    return YAML::LoadFile(file);
  } catch (const YAML::BadFile&) {
    throw std::runtime_error(file + ": cannot be opened for reading");
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(file + lineOf(error.mark) + ": not YAML: " + error.msg);
  }
}

}  // namespace efm
