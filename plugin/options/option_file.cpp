// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/options/option_file.h"

#include <algorithm>
#include <fstream>
#include <initializer_list>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "mapping/options/quoted_text.h"

namespace efm {
namespace {

std::string joined(std::initializer_list<std::string_view> parts) {
  std::string text;
  for (const std::string_view part : parts) text += part;
  return text;
}

/// Where an option stands: "rig.ini:3: [dsi]".
std::string placeOf(std::string_view origin, std::string_view section) {
  return joined({origin, ": [", section, "]"});
}

[[noreturn]] void refuse(std::initializer_list<std::string_view> message) {
  throw std::invalid_argument(joined(message));
}

bool startsComment(std::string_view text) {
  return text.substr(0, 1) == ";" || text.substr(0, 1) == "#" || text.substr(0, 2) == "//";
}

/// The line up to a comment, which starts the line or follows a blank.
std::string_view withoutComment(std::string_view line) {
  for (std::size_t i = 0; i < line.size(); ++i) {
    const bool after_blank = i == 0 || line[i - 1] == ' ' || line[i - 1] == '\t';
    if (after_blank && startsComment(line.substr(i))) return line.substr(0, i);
  }
  return line;
}

/// Says what paths are relative to for as long as it lives, also where reading throws.
class FolderScope {
 public:
  FolderScope(std::filesystem::path& current, std::filesystem::path folder) : current_(current) {
    current_ = std::move(folder);
  }
  ~FolderScope() { current_.clear(); }
  FolderScope(const FolderScope&) = delete;
  FolderScope& operator=(const FolderScope&) = delete;

 private:
  std::filesystem::path& current_;
};

}  // namespace

void OptionReader::readFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  // Reading, not opening, is what fails for a folder.
  if (!file || (file.peek() != std::ifstream::traits_type::eof() && !(text << file.rdbuf())) ||
      std::filesystem::is_directory(path)) {
    throw std::runtime_error("cannot read the option file " + path.string());
  }
  const FolderScope scope(folder_, path.parent_path());
  readText(text.str(), path.string());
}

void OptionReader::readText(std::string_view text, const std::string& name) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // some editors begin files with it
  if (text.substr(0, kByteOrderMark.size()) == kByteOrderMark) {
    text.remove_prefix(kByteOrderMark.size());
  }
  std::map<std::pair<std::string, std::string>, int> lines;  // of this text
  std::string section;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    const std::string_view line = trimmed(withoutComment(text.substr(0, end)));
    text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
    const std::string origin = name + ":" + std::to_string(number);
    if (line.empty()) continue;

    if (line.front() == '[' && line.back() == ']') {
      section = trimmed(line.substr(1, line.size() - 2));
      if (!isOptionSection(section)) {
        refuse({origin, ": unknown section [", printable(section),
                "]; known: ", knownOptionSections()});
      }
      continue;
    }
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos || section.empty()) {
      refuse(
          {origin, ": ", inQuotes(line), ": expected [section] or, below a section, key = value"});
    }
    const std::string key(trimmed(line.substr(0, equals)));
    const auto [first, is_new] = lines.emplace(std::make_pair(section, key), number);
    if (!is_new) {
      refuse({placeOf(origin, section), " ", printable(key), ": given twice, first in line ",
              std::to_string(first->second)});
    }
    assign(section, key, trimmed(line.substr(equals + 1)), placeOf(origin, section));
  }
}

void OptionReader::set(std::string_view assignment) {
  const std::size_t dot = assignment.find('.');
  const std::size_t equals = assignment.find('=');
  if (dot == std::string_view::npos || equals == std::string_view::npos || dot > equals) {
    refuse({"--set ", printable(assignment), ": expected section.key=value"});
  }
  const std::string_view section = trimmed(assignment.substr(0, dot));
  if (!isOptionSection(section)) {
    refuse({"--set ", printable(assignment), ": unknown section [", printable(section),
            "]; known: ", knownOptionSections()});
  }
  assign(section, trimmed(assignment.substr(dot + 1, equals - dot - 1)),
         trimmed(assignment.substr(equals + 1)), placeOf("--set", section));
}

void OptionReader::set(std::string_view section, std::string_view key, std::string_view value,
                       const OptionPlace& place) {
  if (!isOptionSection(section))
    refuse({place.name, " unknown section; known: ", knownOptionSections()});
  const FolderScope scope(folder_, place.folder);
  assign(section, key, trimmed(withoutComment(value)), place.name);
}

void OptionReader::assign(std::string_view section, std::string_view key, std::string_view value,
                          const std::string& place) {
  const auto& keys = optionKeys();
  const auto entry = std::find_if(keys.begin(), keys.end(), [&](const OptionKey& candidate) {
    return candidate.section == section && candidate.key == key;
  });
  if (entry == keys.end()) {
    refuse({place, " ", printable(key), ": unknown key; known: ", knownOptionKeys(section)});
  }
  try {
    const std::filesystem::path path = folder_ / value;
    entry->read(options_, entry->is_path && !value.empty() ? path.native() : value);
  } catch (const std::invalid_argument& error) {
    refuse({place, " ", printable(key), " = ", printable(value), ": ", error.what()});
  }
  places_[{std::string(section), std::string(key)}] = place;
}

EventFusionOptions OptionReader::options() const {
  try {
    options_.mapper.validate();
    options_.cloud.validate();
    options_.refinement.validate();
  } catch (const std::invalid_argument& error) {
    // The structs say "key = value: must be ..."; they know neither sections nor files.
    const std::string message = error.what();
    const std::string key = message.substr(0, message.find(" = "));
    for (const OptionKey& entry : optionKeys()) {
      if (entry.key != key) continue;
      const auto place = places_.find({std::string(entry.section), key});
      refuse({place == places_.end() ? placeOf("default", entry.section) : place->second, " ",
              message});
    }
    throw;
  }
  return options_;
}

}  // namespace efm
