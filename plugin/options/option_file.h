// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "plugin/options/option_keys.h"
#include "plugin/session/event_fusion_options.h"

namespace efm {

/// Where an option of somebody else's file stands.
struct OptionPlace {
  std::string name;              ///< What errors begin with: "host.ini, section mapper_dsi:".
  std::filesystem::path folder;  ///< What paths are relative to; empty: the working folder.
};

/// Reads options from .ini files and from the command line, strictly: what is not understood is an
/// error that names the file and line, the section, the key, the value and what was expected.
/// (`mrpt::config::CConfigFile` reads "abc" as 0 and ignores unknown keys and missing files.)
///
/// Keys that are not given keep what they were. Comments start with ';', '#' or "//", at the start
/// of a line or after a blank. Paths are relative to the file that says them; on the command line,
/// to where that was typed.
class OptionReader {
 public:
  /// @param start what keys that are not given keep.
  explicit OptionReader(const EventFusionOptions& start = {}) : options_(start) {}

  /// @throws std::runtime_error where the file cannot be read; std::invalid_argument at an unknown
  /// section or key, a key given twice, or a value of the wrong kind.
  void readFile(const std::filesystem::path& path);
  /// As `readFile`, of text that is called `name` in errors.
  void readText(std::string_view text, const std::string& name);
  /// Overrides one option: "section.key=value". The last one counts.
  /// @throws std::invalid_argument as `readFile` does.
  void set(std::string_view assignment);
  /// Sets one option that stands in a file of somebody else's, where its section has another name.
  /// @param value up to a comment.
  /// @throws std::invalid_argument as `readFile` does.
  void set(std::string_view section, std::string_view key, std::string_view value,
           const OptionPlace& place);

  /// @throws std::invalid_argument where a value is out of range.
  EventFusionOptions options() const;

 private:
  void assign(std::string_view section, std::string_view key, std::string_view value,
              const std::string& place);

  EventFusionOptions options_;
  std::filesystem::path folder_;  // of the file being read, which paths in it are relative to
  std::map<std::pair<std::string, std::string>, std::string> places_;  // (section, key) -> where
};

}  // namespace efm
