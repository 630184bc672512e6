// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <yaml-cpp/yaml.h>
#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "mapping/geometry/rigid3.h"

namespace efm {

/// A part of a YAML file whose values are read strictly: every error is a std::runtime_error
/// "FILE:LINE: NAME: KEY = VALUE: expected …".
class YamlEntry {
 public:
  /// @param name name of the part in errors; empty for the whole file.
  YamlEntry(std::string file, std::string name, const YAML::Node& node);

  bool has(const char* key) const { return static_cast<bool>(node_[key]); }
  std::string text(const char* key) const;
  /// Reads finite numbers: a list, lists in it one after another, or a matrix of OpenCV.
  /// @param count expected number of numbers; 0: any.
  /// @param expected the meaning of the numbers, for errors.
  std::vector<double> numbers(const char* key, std::size_t count, const char* expected) const;
  double number(const char* key) const;
  /// Reads a matrix, row by row, as `numbers`.
  Eigen::MatrixXd matrix(const char* key, int rows, int columns) const;
  /// Reads a 3x3 matrix. It may have errors of 1e-3 (rounding); the nearest rotation is taken.
  Eigen::Quaterniond rotation(const char* key) const;
  /// Reads a 4x4 matrix; its rotation is taken as in `rotation`.
  Rigid3 transform(const char* key) const;

  /// Returns the keys and values below a key; errors name them "NAME: KEY".
  YamlEntry section(const char* key) const;
  /// Returns the keys and values of an item of a list; `index` is from 0.
  YamlEntry item(const char* key, std::size_t index) const;
  /// Returns the only part that has a key, with the values of the whole beside it; std::nullopt if
  /// there is none.
  std::optional<YamlEntry> onlyPart(const char* key) const;
  std::size_t sizeOf(const char* key) const { return find(key).size(); }

  std::runtime_error failKey(const char* key, std::string_view found,
                             std::string_view expected) const;
  std::runtime_error fail(std::string_view what) const { return fail(node_, what); }

 private:
  YAML::Node find(const char* key) const;
  std::string nameOf(const std::string& part) const;
  Eigen::Quaterniond rotationIn(const Eigen::Matrix3d& matrix, const char* key) const;
  void addNumbers(const YAML::Node& node, const char* key, std::vector<double>& values) const;
  std::runtime_error failNode(const YAML::Node& node, const char* key,
                              std::string_view expected) const;
  std::runtime_error fail(const YAML::Node& node, std::string_view what) const;

  std::string file_;
  std::string name_;
  YAML::Node node_;
};

/// Reads YAML, JSON, or XML of OpenCV's FileStorage.
/// @throws std::runtime_error naming the file, and the line that is not YAML.
YAML::Node loadYaml(const std::string& file);

}  // namespace efm
