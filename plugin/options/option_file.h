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

/// The origin of options: a file.
struct OptionOrigin {
  std::string name;              ///< Errors begin with it: "host.ini, section mapper_dsi:".
  std::filesystem::path folder;  ///< Paths are relative to it; empty: the working folder.
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
  /// @param start the values of keys that are not given.
  explicit OptionReader(const EventFusionOptions& start = defaultOptions()) : options_(start) {}

  /// @throws std::runtime_error where the file cannot be read; std::invalid_argument at an unknown
  /// section or key, a key given twice, or a value of the wrong kind.
  void readFile(const std::filesystem::path& path);
  /// Reads text as `readFile` does.
  void readText(std::string_view text, const OptionOrigin& file);
  /// Overrides one option: "section.key=value". The last one counts.
  /// @throws std::invalid_argument as `readFile` does.
  void set(std::string_view assignment);
  /// Sets one option of a host's file, in which its section has another name.
  /// @param value the text behind the equals sign; a comment may follow the value.
  /// @throws std::invalid_argument as `readFile` does.
  void set(std::string_view section, std::string_view key, std::string_view value,
           const OptionOrigin& origin);

  /// @throws std::invalid_argument where a value is out of range. Of two values that contradict
  /// each other, the error begins with the one that was given last.
  EventFusionOptions options() const;

  /// Where and how an option was given: "rig.ini:3: [dsi] num_planes = 0", or
  /// "--set dsi.num_planes=0". Empty if it was not given.
  std::string given(std::string_view section, std::string_view key) const;
  /// Where and how those of the options were given that were given: " (rig.ini:3: [dsi] width =
  /// 9)".
  std::string origins(const std::vector<OptionId>& options) const;
  /// The error, without its section, behind where and how its option was given. std::nullopt if it
  /// was not given.
  std::optional<std::string> wrongOption(const OptionError& error) const;

 private:
  void assign(std::string_view section, std::string_view key, std::string_view value,
              const OptionOrigin& origin);
  [[noreturn]] void refuseOutOfRange(const OptionError& error) const;

  struct Given {
    std::string text;
    int order = 0;  // the n-th of all
  };
  EventFusionOptions options_;
  std::map<OptionId, Given> given_;
  int assignments_ = 0;
};

}  // namespace efm
