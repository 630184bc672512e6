// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "plugin/options/option_value.h"
#include "plugin/session/event_fusion_options.h"

namespace efm {

/// One key: the functions that read its field from text and return its value.
struct OptionKey {
  std::string_view section;
  std::string_view key;
  std::function<void(EventFusionOptions&, std::string_view)> read;
  std::function<OptionValue(const EventFusionOptions&)> value;
  bool is_path = false;
};

/// The table of all options. Reading, overriding and reporting use it alone, and so cannot differ.
const std::vector<OptionKey>& optionKeys();

/// One option as the files name it.
struct NamedOption {
  std::string_view section;
  std::string_view key;
  OptionValue value;
};

/// All options, in the order of the table.
std::vector<NamedOption> listOptions(const EventFusionOptions& options);
/// Whether an option file may have a section of this name.
bool isOptionSection(std::string_view section);

/// The error for a key that an earlier version had: its new name, or that it is gone. Empty for
/// other keys.
std::string_view formerOptionError(std::string_view section, std::string_view key);

/// The keys of a section; none of an unknown one.
std::vector<std::string> optionKeysOf(std::string_view section);
/// All sections: "[rig]", …
std::vector<std::string> optionSections();

}  // namespace efm
