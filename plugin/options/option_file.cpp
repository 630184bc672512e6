// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/options/option_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "mapping/base/named_choice.h"
#include "mapping/base/text.h"

namespace efm {
namespace {

/// The origin of an option: "rig.ini:3: [dsi]".
std::string originOf(std::string_view line, std::string_view section) {
  return fmt::format("{}: [{}]", line, section);
}

template <typename... Values>
[[noreturn]] void refuse(fmt::format_string<Values...> format, Values&&... values) {
  throw std::invalid_argument(fmt::format(format, std::forward<Values>(values)...));
}

std::string bracketed(std::string_view section) { return "[" + std::string(section) + "]"; }

void requireSection(std::string_view origin, std::string_view section) {
  if (isOptionSection(section)) return;
  refuse("{}: unknown section [{}]: {}", origin, printable(section),
         expectedName(bracketed(section), optionSections()));
}

/// The origin of what the command line sets.
constexpr std::string_view kSet = "--set";

/// A key as the user gave it: "rig.ini:3: [dsi] num_planes", or "--set dsi.num_planes".
std::string keyText(const OptionOrigin& origin, std::string_view section, std::string_view key) {
  return origin.name == kSet ? fmt::format("{} {}.{}", kSet, section, printable(key))
                             : fmt::format("{} {}", origin.name, printable(key));
}

/// What an error says of an unknown key.
std::string unknownKey(std::string_view section, std::string_view key) {
  for (const OptionKey& entry : optionKeys()) {
    if (entry.key == key) return fmt::format("unknown key: it is one of [{}]", entry.section);
  }
  return "unknown key: " + expectedName(key, optionKeysOf(section));
}

bool isWordCharacter(char c) {
  return c == '_' || std::isalnum(static_cast<unsigned char>(c)) != 0;
}

/// Whether a text has a word.
bool mentions(std::string_view text, std::string_view word) {
  for (std::size_t at = text.find(word); at != std::string_view::npos;
       at = text.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    const bool begins = at == 0 || !isWordCharacter(text[at - 1]);
    if (begins && (end == text.size() || !isWordCharacter(text[end]))) return true;
  }
  return false;
}

bool startsComment(std::string_view text) {
  return text.substr(0, 1) == ";" || text.substr(0, 1) == "#" || text.substr(0, 2) == "//";
}

}  // namespace

std::string_view withoutComment(std::string_view line) {
  for (std::size_t i = 0; i < line.size(); ++i) {
    const bool after_blank = i == 0 || line[i - 1] == ' ' || line[i - 1] == '\t';
    if (after_blank && startsComment(line.substr(i))) return line.substr(0, i);
  }
  return line;
}

void OptionReader::readFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  // Reading, not opening, is what fails for a folder.
  if (!file || (file.peek() != std::ifstream::traits_type::eof() && !(text << file.rdbuf())) ||
      std::filesystem::is_directory(path)) {
    throw std::runtime_error("cannot read the option file " + path.string());
  }
  readLines(text.str(), {path.string(), path.parent_path()});
}

void OptionReader::readText(std::string_view text, const std::string& name) {
  readLines(text, {name, {}});
}

void OptionReader::readLines(std::string_view text, const OptionOrigin& file) {
  text = withoutByteOrderMark(text);
  std::map<std::pair<std::string, std::string>, int> lines;  // of this text
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
      refuse("{}: {}: expected [section] or, below a section, key = value", here, inQuotes(line));
    }
    const std::string key(trimmed(line.substr(0, equals)));
    const auto [first, is_new] = lines.emplace(std::make_pair(section, key), number);
    if (!is_new) {
      refuse("{} {}: given twice, first in line {}", originOf(here, section), printable(key),
             first->second);
    }
    assign(section, key, trimmed(line.substr(equals + 1)), {originOf(here, section), file.folder});
  }
}

void OptionReader::set(std::string_view assignment) {
  const std::size_t dot = assignment.find('.');
  const std::size_t equals = assignment.find('=');
  if (dot == std::string_view::npos || equals == std::string_view::npos || dot > equals) {
    refuse("--set {}: expected section.key=value", printable(assignment));
  }
  const std::string_view section = trimmed(assignment.substr(0, dot));
  requireSection("--set " + printable(assignment), section);
  assign(section, trimmed(assignment.substr(dot + 1, equals - dot - 1)),
         trimmed(assignment.substr(equals + 1)), {std::string(kSet), {}});
}

void OptionReader::set(std::string_view section, std::string_view key, std::string_view value,
                       const OptionOrigin& origin) {
  if (!isOptionSection(section)) {
    refuse("{} unknown section: {}", origin.name,
           expectedName(bracketed(section), optionSections()));
  }
  assign(section, key, trimmed(withoutComment(value)), origin);
}

void OptionReader::assign(std::string_view section, std::string_view key, std::string_view value,
                          const OptionOrigin& origin) {
  const auto& keys = optionKeys();
  const auto entry = std::find_if(keys.begin(), keys.end(), [&](const OptionKey& candidate) {
    return candidate.section == section && candidate.key == key;
  });
  if (entry == keys.end()) {
    const std::string_view former = formerOptionError(section, key);
    refuse("{}: {}", keyText(origin, section, key),
           former.empty() ? unknownKey(section, key) : std::string(former));
  }
  const char* const equals = origin.name == kSet ? "=" : " = ";
  const std::string text = keyText(origin, section, key) + equals + printable(value);
  try {
    const std::filesystem::path path = origin.folder / value;
    entry->read(options_, entry->is_path && !value.empty() ? path.native() : value);
  } catch (const std::invalid_argument& error) {
    refuse("{}: {}", text, error.what());
  }
  given_[{std::string(section), std::string(key)}] = {text, ++assignments_};
}

EventFusionOptions OptionReader::options() const {
  EventFusionOptions options = options_;
  fitAutomatic(options.automatic, options.mapper);
  try {
    options.mapper.validate();
    options.cloud.validate();
    options.refinement.validate();
    options.live.validate();
  } catch (const std::invalid_argument& error) {
    // The structs say "key = value: must be ..."; they know neither sections nor files.
    const std::string message = error.what();
    const std::size_t equals = message.find(" = ");
    const std::size_t colon = message.find(": ", equals);
    if (colon == std::string::npos) throw;
    for (const OptionKey& entry : optionKeys()) {
      if (entry.key != message.substr(0, equals)) continue;
      refuseOutOfRange(entry, message.substr(0, colon), message.substr(colon + 2));
    }
    throw;
  }
  return options;
}

/// @param value "key = value".
void OptionReader::refuseOutOfRange(const OptionKey& entry, const std::string& value,
                                    const std::string& expected) const {
  const auto find = [this](const OptionKey& key) {
    const auto found = given_.find({std::string(key.section), std::string(key.key)});
    return found == given_.end() ? Given() : found->second;
  };
  const Given own = find(entry);
  const std::string own_text =
      own.order > 0 ? own.text : fmt::format("default: [{}] {}", entry.section, value);
  std::string others;
  for (const OptionKey& other : optionKeys()) {
    if (other.section != entry.section || other.key == entry.key) continue;
    if (!mentions(expected, other.key)) continue;
    const Given given = find(other);
    if (given.order > own.order) {
      refuse("{}: contradicts {}, which {}", given.text, own_text, expected);
    }
    others += fmt::format(" ({})", given.order > 0 ? given.text
                                                   : fmt::format("{} = {} by default", other.key,
                                                                 textOf(other.value(options_))));
  }
  refuse("{}: {}{}", own_text, expected, others);
}

std::string OptionReader::withOrigins(std::string error) const {
  const std::string said = error;
  for (const auto& [name, given] : given_) {
    const std::string shown = fmt::format("[{}] {}", name.first, name.second);
    if (mentions(said, shown)) error += " (" + given.text + ")";
  }
  return error;
}

std::optional<std::string> OptionReader::wrongOption(const std::string& error) const {
  for (const auto& [name, given] : given_) {
    const std::string section = fmt::format("[{}] ", name.first);
    std::size_t begin = error.find(section + name.second + " ");
    if (begin != std::string::npos) {
      begin += section.size();
    } else if (error.rfind(name.second + " = ", 0) == 0) {
      begin = 0;
    } else {
      continue;
    }
    if (error.find(": must be ", begin) == std::string::npos) continue;
    return given.text + ": " + error.substr(begin);
  }
  return std::nullopt;
}

std::string OptionReader::given(std::string_view section, std::string_view key) const {
  const auto found = given_.find({std::string(section), std::string(key)});
  return found == given_.end() ? std::string() : found->second.text;
}

}  // namespace efm
