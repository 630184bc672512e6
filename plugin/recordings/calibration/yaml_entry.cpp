// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/calibration/yaml_entry.h"

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include <cmath>
#include <fstream>
#include <optional>
#include <utility>

#include "mapping/base/text.h"

namespace efm {
namespace {

std::string placeOf(const std::string& file, const YAML::Mark& mark) {
  return mark.is_null() ? file : fmt::format("{}:{}", file, mark.line + 1);
}

/// Parses a number without yaml-cpp, which would use the locale of the host program.
std::optional<double> finiteIn(const YAML::Node& node) {
  std::string_view text = node.Scalar();
  if (text.substr(0, 1) == "+" && text.substr(1, 1) != "-") text.remove_prefix(1);
  return parseFinite(text);
}

/// Returns a part of a document that OpenCV's FileStorage wrote, as YAML.
YAML::Node yamlOf(const cv::FileNode& part) {
  YAML::Node node;
  if (part.isMap()) {
    for (const std::string& key : part.keys()) node[key] = yamlOf(part[key]);
  } else if (part.isSeq()) {
    for (const cv::FileNode& item : part) node.push_back(yamlOf(item));
  } else if (part.isString()) {
    node = part.string();
  } else if (part.isInt() || part.isReal()) {
    node = fmt::format("{}", part.real());
  }
  return node;
}

/// @throws std::runtime_error for elements within elements that would overflow the parser's stack.
void requireFlatXml(const std::string& file) {
  constexpr int kMaxDepth = 100;
  std::ifstream stream(file);
  int depth = 0;
  for (char c = '\0', last = '\0'; stream.get(c); last = c) {
    if (last == '<') depth += c == '/' ? -1 : c == '?' || c == '!' ? 0 : 1;
    if (last == '/' && c == '>') --depth;
    if (depth <= kMaxDepth) continue;
    throw std::runtime_error(
        fmt::format("{}: XML of over {} nested elements: expected a calibration", file, kMaxDepth));
  }
}

/// Returns the document in an XML file of OpenCV's FileStorage.
YAML::Node loadXml(const std::string& file) {
  requireFlatXml(file);
  try {
    return yamlOf(
        cv::FileStorage(file, cv::FileStorage::READ | cv::FileStorage::FORMAT_XML).root());
  } catch (const cv::Exception& error) {
    throw std::runtime_error(fmt::format("{}: not XML of OpenCV: {}", file, error.err));
  }
}

}  // namespace

YamlEntry::YamlEntry(std::string file, std::string name, const YAML::Node& node)
    : file_(std::move(file)), name_(std::move(name)), node_(node) {
  if (!node_.IsMap()) throw fail("expected keys and values");
}

std::string YamlEntry::text(const char* key) const {
  const YAML::Node value = find(key);
  if (!value.IsScalar()) throw fail(value, fmt::format("{}: expected a word", key));
  return value.Scalar();
}

std::vector<double> YamlEntry::numbers(const char* key, std::size_t count,
                                       const char* expected) const {
  const YAML::Node list = find(key);
  const bool is_matrix = list.IsMap() && list["data"];  // of OpenCV
  if (!is_matrix && !list.IsSequence()) throw failNode(list, key, expected);
  std::vector<double> values;
  addNumbers(is_matrix ? list["data"] : list, key, values);
  if (count == 0 || values.size() == count) return values;
  throw fail(list, fmt::format("{}: {} numbers: expected {}", key, values.size(), expected));
}

void YamlEntry::addNumbers(const YAML::Node& node, const char* key,
                           std::vector<double>& values) const {
  if (node.IsSequence()) {
    for (const YAML::Node& item : node) addNumbers(item, key, values);
    return;
  }
  const auto number = finiteIn(node);
  if (!number) throw failNode(node, key, "finite numbers");
  values.push_back(*number);
}

double YamlEntry::number(const char* key) const {
  const YAML::Node value = find(key);
  if (const auto number = finiteIn(value)) return *number;
  throw failNode(value, key, "a finite number");
}

Eigen::MatrixXd YamlEntry::matrix(const char* key, int rows, int columns) const {
  const std::string expected = fmt::format("{} rows of {} numbers", rows, columns);
  const std::vector<double> values =
      numbers(key, static_cast<std::size_t>(rows * columns), expected.c_str());
  return Eigen::Map<const Eigen::Matrix<double, -1, -1, Eigen::RowMajor>>(values.data(), rows,
                                                                          columns);
}

Eigen::Quaterniond YamlEntry::rotationIn(const Eigen::Matrix3d& matrix, const char* key) const {
  if (const auto rotation = rotationNear(matrix)) return *rotation;
  const double error =
      (matrix * matrix.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  const std::string found =
      error > 1e-3 ? fmt::format("a matrix whose columns are off orthonormal by {:f}", error)
                   : "a reflection";
  throw failKey(key, found, "a rotation, to 0.001");
}

Eigen::Quaterniond YamlEntry::rotation(const char* key) const {
  return rotationIn(matrix(key, 3, 3), key);
}

Rigid3 YamlEntry::transform(const char* key) const {
  const Eigen::Matrix4d T_a_b = matrix(key, 4, 4);
  const Eigen::Quaterniond rotation = rotationIn(T_a_b.topLeftCorner<3, 3>(), key);
  if (T_a_b.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    throw failKey(key, "a matrix with another last row", "0 0 0 1 there");
  }
  return {rotation, T_a_b.topRightCorner<3, 1>()};
}

std::string YamlEntry::nameOf(const std::string& part) const {
  return name_.empty() ? part : fmt::format("{}: {}", name_, part);
}

YamlEntry YamlEntry::section(const char* key) const { return {file_, nameOf(key), find(key)}; }

YamlEntry YamlEntry::item(const char* key, std::size_t index) const {
  const YAML::Node list = find(key);
  if (!list.IsSequence() || list.size() <= index) {
    throw failNode(list, key, fmt::format("a list of at least {} items", index + 1));
  }
  return {file_, nameOf(fmt::format("{}[{}]", key, index)), list[index]};
}

std::optional<YamlEntry> YamlEntry::onlyPart(const char* key) const {
  std::vector<std::string> names;
  for (const auto& part : node_) {
    if (part.first.IsScalar() && part.second.IsMap() && part.second[key]) {
      names.push_back(part.first.Scalar());
    }
  }
  if (names.empty()) return std::nullopt;
  if (names.size() > 1) {
    throw fail(fmt::format("{} cameras, {}: expected one, or a camera chain as Kalibr writes it",
                           names.size(), fmt::join(names, " and ")));
  }
  YAML::Node part = YAML::Clone(node_[names.front()]);
  for (const auto& value : node_) {
    if (!value.second.IsScalar() || !value.first.IsScalar()) continue;
    if (!part[value.first.Scalar()]) part[value.first.Scalar()] = value.second;
  }
  return YamlEntry(file_, nameOf(names.front()), part);
}

YAML::Node YamlEntry::find(const char* key) const {
  const YAML::Node value = node_[key];
  if (!value) throw fail(fmt::format("{} is missing", key));
  return value;
}

std::runtime_error YamlEntry::failKey(const char* key, std::string_view found,
                                      std::string_view expected) const {
  return fail(find(key), fmt::format("{} = {}: expected {}", key, found, expected));
}

std::runtime_error YamlEntry::failNode(const YAML::Node& node, const char* key,
                                       std::string_view expected) const {
  const std::string found = node.IsScalar()     ? inQuotes(node.Scalar())
                            : node.IsSequence() ? "a list"
                            : node.IsMap()      ? "keys"
                                                : "nothing";
  return fail(node, fmt::format("{} = {}: expected {}", key, found, expected));
}

std::runtime_error YamlEntry::fail(const YAML::Node& node, std::string_view what) const {
  return std::runtime_error(fmt::format("{}: {}{}{}", placeOf(file_, node.Mark()), name_,
                                        name_.empty() ? "" : ": ", what));
}

YAML::Node loadYaml(const std::string& file) {
  if (std::ifstream(file).get() == '<') return loadXml(file);
  try {
    return YAML::LoadFile(file);
  } catch (const YAML::BadFile&) {
    throw std::runtime_error(file + ": cannot be opened for reading");
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(fmt::format("{}: not YAML: {}", placeOf(file, error.mark), error.msg));
  }
}

}  // namespace efm
