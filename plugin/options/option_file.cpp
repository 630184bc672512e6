// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/options/option_file.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "event_fusion/engine.h"
#include "mapping/base/named_choice.h"
#include "mapping/base/text.h"
#include "plugin/options/option_keys.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSuffix = ".ini";

/// Returns the folder of the option files: installed, or in the project; empty if there is none.
fs::path configFolder() {
  Dl_info own{};
  std::error_code error;
  if (dladdr(reinterpret_cast<void*>(&configFolder), &own) != 0) {
    const fs::path library = fs::weakly_canonical(own.dli_fname, error);
    const fs::path installed = library.parent_path() / EFM_DATA_FROM_LIBRARY / "config";
    if (!error && fs::is_directory(installed, error)) return installed;
  }
  const fs::path source = EFM_CONFIG_DIR;
  return fs::is_directory(source, error) ? source : fs::path();
}

/// Returns the origin of an option: "rig.ini:3: [dsi]".
std::string originOf(std::string_view line, std::string_view section) {
  return fmt::format("{}: [{}]", line, section);
}

template <typename... Values>
[[noreturn]] void reject(fmt::format_string<Values...> format, Values&&... values) {
  throw std::invalid_argument(fmt::format(format, std::forward<Values>(values)...));
}

/// Returns the part of an error about the known sections.
std::string expectedSection(std::string_view section) {
  std::vector<std::string> sections;
  for (const NamedOption& option : listOptions({})) {
    const std::string name = fmt::format("[{}]", option.section);
    if (sections.empty() || sections.back() != name) sections.push_back(name);
  }
  return expectedName(fmt::format("[{}]", section), sections);
}

void requireSection(std::string_view origin, std::string_view section) {
  if (isOptionSection(section)) return;
  reject("{}: unknown section [{}]: {}", origin, printable(section), expectedSection(section));
}

/// Origin of options of the command line.
constexpr std::string_view kSet = "--set";

/// Returns a key as the user gave it: "rig.ini:3: [dsi] num_planes", or "--set dsi.num_planes".
std::string keyText(const OptionOrigin& origin, std::string_view section, std::string_view key) {
  return origin.name == kSet ? fmt::format("{} {}.{}", kSet, section, printable(key))
                             : fmt::format("{} {}", origin.name, printable(key));
}

/// Returns the error of an unknown key. For a key of an earlier version, it says the new name, or
/// that the key was removed.
std::string unknownKey(std::string_view section, std::string_view key) {
  static constexpr struct {
    std::string_view section;
    std::string_view key;
    const char* error;
  } kFormerKeys[] = {
      {"fusion", "revote", "was removed with re-voting"},
      {"fusion", "revote_power", "was removed with re-voting"},
      {"keyframes", "min_visible_share", "is called min_visible_fraction now"},
      {"depth", "min_excess", "is called min_local_contrast now"},
      {"depth", "min_quality", "was replaced by min_probability (0 to below 1; the default is 0.9)"},
  };
  for (const auto& former : kFormerKeys) {
    if (former.section == section && former.key == key) return former.error;
  }
  std::vector<std::string> keys;
  for (const NamedOption& option : listOptions({})) {
    if (option.key == key) return fmt::format("unknown key: it is one of [{}]", option.section);
    if (option.section == section) keys.emplace_back(option.key);
  }
  return "unknown key: " + expectedName(key, keys);
}

bool startsComment(std::string_view text) {
  return text.substr(0, 1) == ";" || text.substr(0, 1) == "#" || text.substr(0, 2) == "//";
}

/// Returns a line, or a value, without its comment.
std::string_view withoutComment(std::string_view line) {
  for (std::size_t i = 0; i < line.size(); ++i) {
    const bool after_blank = i == 0 || line[i - 1] == ' ' || line[i - 1] == '\t';
    if (after_blank && startsComment(line.substr(i))) return line.substr(0, i);
  }
  return line;
}

}  // namespace

void OptionReader::readFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  // A folder can be opened, but not read.
  if (!file || (file.peek() != std::ifstream::traits_type::eof() && !(text << file.rdbuf())) ||
      std::filesystem::is_directory(path)) {
    throw std::runtime_error("cannot read the option file " + path.string());
  }
  readText(text.str(), {path.string(), path.parent_path()});
}

void OptionReader::readText(std::string_view text, const OptionOrigin& file) {
  text = withoutByteOrderMark(text);
  std::map<OptionId, int> lines;  // line of each option in this text
  std::string section;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    const std::string_view line = trimmed(withoutComment(text.substr(0, end)));
    text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
    const std::string here = fmt::format("{}:{}", file.name, number);
    if (line.empty()) continue;

    if (line.front() == '[' && line.back() == ']') {
      section = trimmed(line.substr(1, line.size() - 2));
      requireSection(here, section);
      continue;
    }
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos || section.empty()) {
      reject("{}: {}: expected [section] or, below a section, key = value", here, inQuotes(line));
    }
    const std::string key(trimmed(line.substr(0, equals)));
    const auto [first, is_new] = lines.emplace(std::make_pair(section, key), number);
    if (!is_new) {
      reject("{} {}: given twice, first in line {}", originOf(here, section), printable(key),
             first->second);
    }
    assign(section, key, trimmed(line.substr(equals + 1)), {originOf(here, section), file.folder});
  }
}

void OptionReader::set(std::string_view assignment) {
  const std::size_t dot = assignment.find('.');
  const std::size_t equals = assignment.find('=');
  if (dot == std::string_view::npos || equals == std::string_view::npos || dot > equals) {
    reject("--set {}: expected section.key=value", printable(assignment));
  }
  const std::string_view section = trimmed(assignment.substr(0, dot));
  requireSection("--set " + printable(assignment), section);
  assign(section, trimmed(assignment.substr(dot + 1, equals - dot - 1)),
         trimmed(assignment.substr(equals + 1)), {std::string(kSet), {}});
}

void OptionReader::set(std::string_view section, std::string_view key, std::string_view value,
                       const OptionOrigin& origin) {
  if (!isOptionSection(section)) {
    reject("{} unknown section: {}", origin.name, expectedSection(section));
  }
  assign(section, key, trimmed(withoutComment(value)), origin);
}

void OptionReader::assign(std::string_view section, std::string_view key, std::string_view value,
                          const OptionOrigin& origin) {
  const char* const equals = origin.name == kSet ? "=" : " = ";
  const std::string text = keyText(origin, section, key) + equals + printable(value);
  bool known = false;
  try {
    known = setOption(options_, section, key, value, origin.folder);
  } catch (const std::invalid_argument& error) {
    reject("{}: {}", text, error.what());
  }
  if (!known) reject("{}: {}", keyText(origin, section, key), unknownKey(section, key));
  given_[{std::string(section), std::string(key)}] = {text, ++assignments_};
}

EventFusionOptions OptionReader::options() const {
  EventFusionOptions options = options_;
  fitAutomatic(options.automatic, options.mapper);
  try {
    options.validate();
  } catch (const OptionError& error) {  // the structs know neither sections nor files
    rejectOutOfRange(error);
  }
  return options;
}

void OptionReader::rejectOutOfRange(const OptionError& error) const {
  const std::vector<NamedOption> all = listOptions(options_);
  const auto named = [&](std::string_view key) {
    return std::find_if(all.begin(), all.end(),
                        [&](const NamedOption& option) { return option.key == key; });
  };
  const auto find = [&](const NamedOption& option) {
    const auto found = given_.find({std::string(option.section), std::string(option.key)});
    return found == given_.end() ? Given() : found->second;
  };
  const auto option = named(error.key);
  if (option == all.end()) throw error;
  const Given own = find(*option);
  const std::string own_text =
      own.order > 0 ? own.text
                    : fmt::format("default: [{}] {} = {}", option->section, error.key, error.value);
  std::string others;
  for (const std::string& key : error.other_keys) {
    const NamedOption& other = *named(key);
    const Given given = find(other);
    if (given.order > own.order) {
      reject("{}: contradicts {}, which must be {}", given.text, own_text, error.expected);
    }
    others += fmt::format(
        " ({})",
        given.order > 0 ? given.text : fmt::format("{} = {} by default", key, textOf(other.value)));
  }
  reject("{}: must be {}{}", own_text, error.expected, others);
}

std::string OptionReader::origins(const std::vector<OptionId>& options) const {
  std::string text;
  for (const auto& [option, given] : given_) {
    if (std::count(options.begin(), options.end(), option) > 0) text += " (" + given.text + ")";
  }
  return text;
}

std::optional<std::string> OptionReader::wrongOption(const OptionError& error) const {
  for (const auto& [option, given] : given_) {
    const bool same_section = error.section.empty() || error.section == option.first;
    if (same_section && error.key == option.second) return given.text + ": " + error.sentence;
  }
  return std::nullopt;
}

std::string OptionReader::given(std::string_view section, std::string_view key) const {
  const auto found = given_.find({std::string(section), std::string(key)});
  return found == given_.end() ? std::string() : found->second.text;
}

std::vector<std::string> configNames() {
  std::vector<std::string> names;
  const fs::path folder = configFolder();
  if (folder.empty()) return names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == kSuffix) names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

fs::path findConfig(const std::string& name_or_path, const std::string& given_as) {
  std::error_code ignored;
  const fs::path path = name_or_path;
  if (fs::is_regular_file(path, ignored)) return path;
  if (path.extension() == kSuffix) {
    if (fs::exists(path, ignored)) return path;  // reading reports the error
    reject("{}: no such option file", name_or_path);
  }
  const std::vector<std::string> names = configNames();
  if (std::binary_search(names.begin(), names.end(), name_or_path)) {
    return configFolder() / (name_or_path + kSuffix);
  }
  reject("{}{}: no such option file: {}", given_as, inQuotes(name_or_path),
         expectedName(name_or_path, names));
}

Options::Options() : reader_(std::make_shared<OptionReader>()) {}

Options::Options(const EventFusionOptions& values)
    : reader_(std::make_shared<OptionReader>(values)), as_they_are_(true) {}

template <typename Change>
void Options::change(const Change& change) {
  OptionReader reader = *reader_;
  change(reader);
  reader_ = std::make_shared<OptionReader>(std::move(reader));
  as_they_are_ = false;
}

void Options::set(std::string_view key, std::string_view value) {
  const std::size_t dot = key.find('.');
  if (dot == std::string_view::npos) reject("option {}: expected section.key", inQuotes(key));
  const std::string_view section = key.substr(0, dot);
  change([&](OptionReader& reader) {
    reader.set(section, key.substr(dot + 1), value,
               {fmt::format("options: [{}]", printable(section)), {}});
  });
}

void Options::read(const std::filesystem::path& ini) {
  change([&](OptionReader& reader) { reader.readFile(findConfig(ini.string())); });
}

EventFusionOptions Options::values() const {
  return as_they_are_ ? reader_->unchecked() : reader_->options();
}

}  // namespace efm
