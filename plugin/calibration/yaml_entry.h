// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include "mapping/geometry/rigid3.h"

namespace efm {

/// A part of a YAML file whose values are read strictly, and which knows how to call itself in
/// errors: every error is a std::runtime_error "FILE:LINE: NAME: KEY = VALUE: expected …".
class YamlEntry {
 public:
  /// @param name what errors call the part; empty for the whole file.
  YamlEntry(std::string file, std::string name, const YAML::Node& node);

  bool has(const char* key) const { return static_cast<bool>(node_[key]); }

  std::string text(const char* key) const;
  /// Finite numbers. @param expected what the numbers are, for errors.
  std::vector<double> numbers(const char* key, const char* expected) const;
  std::vector<double> numbers(const char* key, std::size_t count, const char* expected) const;
  /// 4x4, whose rotation may be off by 1e-3, as rounding leaves it; the nearest rotation is taken.
  Rigid3 transform(const char* key) const;

  std::runtime_error failKey(const char* key, const std::string& found,
                             const std::string& expected) const;
  std::runtime_error fail(const std::string& what) const;

 private:
  YAML::Node find(const char* key) const;
  std::vector<double> numbersOf(const YAML::Node& list, const char* key,
                                const char* expected) const;
  std::vector<double> numbersOf(const YAML::Node& list, const char* key, std::size_t count,
                                const char* expected) const;
  std::runtime_error failKey(const YAML::Node& node, const char* key,
                             const std::string& expected) const;
  std::runtime_error fail(const YAML::Node& node, const std::string& what) const;

  std::string file_;
  std::string name_;
  YAML::Node node_;
};

/// @throws std::runtime_error naming the file, and the line where it is not YAML.
YAML::Node loadYaml(const std::string& file);

}  // namespace efm
