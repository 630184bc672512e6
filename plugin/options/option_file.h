// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mapping/base/option.h"
#include "plugin/session/event_fusion_options.h"

namespace efm {

/// Origin of options: a file.
struct OptionOrigin {
  std::string name;              ///< Begin of error texts: "host.ini, section mapper_dsi:".
  std::filesystem::path folder;  ///< Folder of relative paths; empty: the working folder.
};

/// Reads options from .ini files and from the command line, strictly: an error names the file and
/// line, the section, the key, the value and the expected kind. (`mrpt::config::CConfigFile` reads
/// "abc" as 0 and ignores unknown keys and missing files.)
///
/// Keys that are not given keep their values. Comments start with ';', '#' or "//", at the start
/// of a line or after a blank. Paths are relative to the folder of their file; on the command line,
/// to the working folder.
class OptionReader {
 public:
  /// @param start values of keys that are not given.
  explicit OptionReader(const EventFusionOptions& start = defaultOptions()) : options_(start) {}

  /// @throws std::runtime_error if the file cannot be read; std::invalid_argument for an unknown
  /// section or key, a key given twice, or a value of the wrong kind.
  void readFile(const std::filesystem::path& path);
  /// Reads text as `readFile` does.
  void readText(std::string_view text, const OptionOrigin& file);
  /// Overrides one option: "section.key=value". The last value of an option counts.
  /// @throws std::invalid_argument as `readFile` does.
  void set(std::string_view assignment);
  /// Sets one option of a host's file, whose section has another name there.
  /// @param value the text after the equals sign; a comment may follow the value.
  /// @throws std::invalid_argument as `readFile` does.
  void set(std::string_view section, std::string_view key, std::string_view value,
           const OptionOrigin& origin);

  /// @throws std::invalid_argument if a value is out of range. If two values contradict each other,
  /// the error begins with the value that was given last.
  EventFusionOptions options() const;
  /// Returns the values without a check.
  const EventFusionOptions& unchecked() const { return options_; }

  /// Returns where and how an option was given: "rig.ini:3: [dsi] num_planes = 0", or "--set
  /// dsi.num_planes=0". Empty if it was not given.
  std::string given(std::string_view section, std::string_view key) const;
  /// Returns where and how the options were given, without options that were not given: "
  /// (rig.ini:3: [dsi] width = 9)".
  std::string origins(const std::vector<OptionId>& options) const;
  /// Returns the error, without its section, after the place where its option was given;
  /// std::nullopt if the option was not given.
  std::optional<std::string> wrongOption(const OptionError& error) const;

 private:
  void assign(std::string_view section, std::string_view key, std::string_view value,
              const OptionOrigin& origin);
  [[noreturn]] void rejectOutOfRange(const OptionError& error) const;

  struct Given {
    std::string text;
    int order = 0;  // number of this assignment, from 1
  };
  EventFusionOptions options_;
  std::map<OptionId, Given> given_;
  int assignments_ = 0;
};

/// Returns the names of the option files without ".ini", sorted: "default", "dsec", … They lie
/// where `cmake --install` puts them, or in the project's config/.
std::vector<std::string> configNames();

/// Returns the option file of a name. A path is returned unchanged.
/// @param given_as begin of the error's text: "--config ".
/// @throws std::invalid_argument if there is no such file, or, with the known names, if the name is
/// unknown.
std::filesystem::path findConfig(const std::string& name_or_path, const std::string& given_as = {});

}  // namespace efm
