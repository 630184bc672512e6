// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/host_options.h"

#include <fmt/format.h>
#include <mrpt/config/CConfigFile.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "plugin/options/option_keys.h"

namespace efm {
namespace {

/// Returns the source's file, an empty path if the source is not a file.
std::filesystem::path fileOf(const mrpt::config::CConfigFileBase& source) {
  const auto* file = dynamic_cast<const mrpt::config::CConfigFile*>(&source);
  return file ? file->getAssociatedFile() : std::string();
}

std::string nameOf(const mrpt::config::CConfigFileBase& source) {
  const std::filesystem::path file = fileOf(source);
  return file.empty() ? "options" : file.string();
}

}  // namespace

std::string placeIn(const mrpt::config::CConfigFileBase& source, const std::string& section) {
  return nameOf(source) + ", section " + section + ":";
}

std::vector<std::string> sectionsBelow(const mrpt::config::CConfigFileBase& source,
                                       const std::string& prefix) {
  std::vector<std::string> sections;
  source.getAllSections(sections);
  const std::string begin = prefix + "_";
  const auto is_other = [&](const std::string& section) { return section.find(begin) != 0; };
  sections.erase(std::remove_if(sections.begin(), sections.end(), is_other), sections.end());
  return sections;
}

void readHostSection(const mrpt::config::CConfigFileBase& source, const std::string& host_section,
                     std::string_view section, OptionReader& reader) {
  std::vector<std::string> keys;
  source.getAllKeys(host_section, keys);
  // Without a file, paths in the values are relative to the working folder. The folder is absolute,
  // so that options saved to another folder name the same files.
  OptionOrigin origin{placeIn(source, host_section), {}};
  const std::filesystem::path file = fileOf(source);
  if (!file.empty()) origin.folder = std::filesystem::absolute(file).parent_path();
  for (const std::string& key : keys) {
    reader.set(section, key, source.read_string(host_section, key, ""), origin);
  }
}

void readHostOptions(const mrpt::config::CConfigFileBase& source, const std::string& prefix,
                     OptionReader& reader) {
  // MRPT treats a missing file as an empty file.
  if (const auto file = fileOf(source); !file.empty() && !std::filesystem::exists(file)) {
    throw std::runtime_error("cannot read the option file " + file.string());
  }
  if (!prefix.empty()) {
    const std::vector<std::string> ours = sectionsBelow(source, prefix);
    if (ours.empty()) {
      throw std::invalid_argument(
          fmt::format("{}: no section begins with {}_: expected sections such as [{}_dsi]",
                      nameOf(source), prefix, prefix));
    }
    for (const std::string& section : ours) {
      readHostSection(source, section, section.substr(prefix.size() + 1), reader);
    }
    return;
  }
  // A host may have its own [map] or [output]. If there are prefixed sections, only these are ours.
  const std::string prefixed = "event_fusion";
  if (!sectionsBelow(source, prefixed).empty()) {
    readHostOptions(source, prefixed, reader);
    return;
  }
  std::vector<std::string> sections;
  source.getAllSections(sections);
  for (const std::string& section : sections) {
    if (isOptionSection(section)) readHostSection(source, section, section, reader);
  }
}

void writeHostOptions(const EventFusionOptions& options, const std::string& prefix,
                      mrpt::config::CConfigFileBase& target) {
  const std::string begin = prefix.empty() ? "" : prefix + "_";
  for (const NamedOption& option : listOptions(options)) {
    target.write(begin + std::string(option.section), std::string(option.key),
                 textOf(option.value));
  }
}

}  // namespace efm
