// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/text/text_table.h"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/streams/time_unit.h"

namespace efm {
namespace {

bool isLetterOrDigit(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; }

/// Splits a line into fields. Fields between tabs, commas and semicolons may be empty.
std::vector<std::string_view> splitAt(std::string_view line, char separator) {
  if (separator == ' ') return splitWords(line);
  std::vector<std::string_view> fields = splitFields(line, {&separator, 1});
  if (!line.empty() && line.back() == separator) fields.emplace_back();
  return fields;
}

/// Returns a line without blanks and CR at its ends, but with tabs, which may separate empty
/// fields.
std::string_view withoutBlanks(std::string_view line) {
  while (!line.empty() && (line.back() == ' ' || line.back() == '\r')) line.remove_suffix(1);
  while (!line.empty() && line.front() == ' ') line.remove_prefix(1);
  return line;
}

/// Parses a number, which may be in quotes, have a decimal comma, or a comma after it.
bool isNumber(std::string_view field) {
  if (!field.empty() && field.back() == ',') field.remove_suffix(1);
  std::string plain;
  for (const char c : field) {
    if (c != '"') plain += c == ',' ? '.' : c;
  }
  return parseNumber<double>(plain).has_value();
}

/// Returns the separator of a line of at least four fields. Commas within numbers between blanks
/// are decimal commas, also where a comma and a blank separate the numbers.
char separatorOf(std::string_view line) {
  if (std::count(line.begin(), line.end(), ';') > std::count(line.begin(), line.end(), '\t'))
    return ';';
  if (line.find(',') == line.npos) return ' ';
  const std::vector<std::string_view> words = splitWords(line);
  bool decimal = false;
  for (const std::string_view word : words) {
    const std::size_t comma = word.find(',');
    if (comma >= word.size() - 1) continue;  // none, or at the end
    if (!isNumber(word)) return ',';
    decimal = true;
  }
  return decimal && words.size() >= 4 ? ' ' : ',';
}

bool isRow(const std::vector<std::string_view>& fields) {
  const auto numbers = std::count_if(fields.begin(), fields.end(), isNumber);
  return fields.size() >= 3 && 2 * static_cast<std::size_t>(numbers) >= fields.size();
}

/// Returns the names in a header's fields. In "t [us]" with a blank, the unit is no field.
std::vector<HeaderWord> namesIn(const std::vector<std::string_view>& fields, char separator) {
  std::vector<HeaderWord> names;
  for (const std::string_view field : fields) {
    HeaderWord word = headerWord(field);
    if (separator == ' ' && word.name.empty() && !word.unit.empty() && !names.empty()) {
      names.back().unit = word.unit;
      names.back().time_exponent = word.time_exponent;
    } else {
      names.push_back(std::move(word));
    }
  }
  return names;
}

/// Takes units from a line below the names that has a known one. @return whether it has.
bool takeUnits(const std::vector<std::string_view>& fields, std::vector<HeaderWord>& names) {
  std::vector<std::string> units;
  bool any = false;
  for (const std::string_view field : fields) {
    const HeaderWord word = headerWord(field);
    units.push_back(word.unit.empty() ? word.name : word.unit);
    any = any || metresOf(units.back()) || timeExponentOf(units.back());
  }
  if (!any || units.size() > names.size() + 1) return false;
  for (std::size_t k = 0; k < std::min(units.size(), names.size()); ++k) {
    if (units[k].empty() || units[k] == "-") continue;
    names[k].unit = units[k];
    names[k].time_exponent = timeExponentOf(units[k]);
  }
  return true;
}

/// The lines of a header so far, field by field.
struct HeaderLines {
  std::vector<std::string> stacked;  // of the lines with the same number of fields
  std::vector<HeaderWord> last;
  bool several = false;

  void add(const std::vector<std::string_view>& fields) {
    several = stacked.size() == fields.size();
    if (!several) stacked.assign(fields.size(), {});
    last.clear();
    for (std::size_t k = 0; k < fields.size(); ++k) {
      stacked[k] += (stacked[k].empty() ? "" : " ") + std::string(fields[k]);
      last.push_back(headerWord(fields[k]));
    }
  }
  std::vector<HeaderWord> names() const {
    std::vector<HeaderWord> words;
    for (std::size_t k = 0; several && k < last.size(); ++k) {
      words.push_back(last[k].isTime() ? last[k] : headerWord(stacked[k]));
    }
    return words;
  }
};

/// Takes the unit of lengths from a line of keys and values, as Motive has one.
void takeLengthUnit(const std::vector<std::string_view>& fields, TextTable& table) {
  for (std::size_t k = 0; k + 1 < fields.size(); ++k) {
    if (headerWord(fields[k]).name == "length units") {
      table.length_unit = headerWord(fields[k + 1]).name;
    }
  }
}

}  // namespace

TextTable findTable(std::string_view text, bool (*takes)(const std::vector<HeaderWord>&)) {
  constexpr int kMostRows = 8;  // that have words and are part of a header: numbers of markers
  TextTable table;
  HeaderLines lines;
  int rows = 0;
  std::uint64_t number = 0;
  while (!text.empty()) {
    const std::string_view from = text;
    const std::string_view raw = withoutBlanks(takeLine(text));
    const std::string_view line = trimmed(raw);
    ++number;
    if (line.empty()) continue;
    const bool comment = isComment(line);
    const std::string_view content = comment ? trimmed(line.substr(1)) : line;
    const std::string_view tabbed = comment ? content : raw;
    const char separator = separatorOf(content);
    const std::vector<std::string_view> fields = splitAt(content, separator);
    const std::size_t count = table.names.size();
    bool row = !comment && isRow(fields);
    if (count > 0) {  // below a header: units, a comment, another header, or a row
      const std::vector<std::string_view> by_tabs = splitAt(raw, '\t');
      if (!row && takeUnits(by_tabs.size() == count ? by_tabs : fields, table.names)) continue;
      if (comment) continue;
      row = row || !takes(namesIn(fields, separator));
    }
    if (row) {
      if (table.rows.empty()) {
        table.rows = from;
        table.lines_before = number - 1;
        table.separator = separator;
        if (count > 1 && splitAt(raw, '\t').size() == count) table.separator = '\t';
      }
      if (count > 0 || ++rows > kMostRows || std::all_of(fields.begin(), fields.end(), isNumber)) {
        break;
      }
      lines.add(fields);
      continue;
    }
    if (!comment) lines.add(fields);
    takeLengthUnit(fields, table);
    std::vector<HeaderWord> names = namesIn(fields, separator);
    const bool other = table.names.empty() && table.rows.empty() && fields.size() >= 3 && !comment;
    if (other) table.other_names = names;
    for (std::vector<HeaderWord> better :
         {namesIn(splitAt(tabbed, '\t'), '\t'), comment ? names : lines.names()}) {
      if (takes(better)) names = std::move(better);
    }
    const bool is_header = takes(names);
    if (!is_header && !other) continue;
    table.header = line;
    table.header_line = number;
    if (!is_header) continue;
    table.names = std::move(names);
    table.rows = {};
  }
  if (table.rows.empty()) table.lines_before = table.names.empty() ? 0 : table.header_line;
  table.decorated = table.rows.find('"') != table.rows.npos ||
                    (table.separator != ',' && table.rows.find(',') != table.rows.npos);
  return table;
}

std::vector<std::string_view> TextTable::fieldsOf(std::string_view line) const {
  const std::string_view content = withoutBlanks(line.substr(0, line.find('#')));
  if (trimmed(content).empty()) return {};
  std::vector<std::string_view> fields = splitAt(content, separator);
  // An empty field at the end counts as the header has it.
  const bool longer = fields.size() == names.size() + 1 || names.empty();
  if (fields.size() + 1 == names.size() && names.back().name.empty()) fields.emplace_back();
  if (longer && separator != ' ' && fields.back().empty()) fields.pop_back();
  return fields;
}

void TextTable::makePlain(char* begin, char* end) const {
  if (!decorated) return;
  bool quoted = false;
  for (char* c = begin; c != end; ++c) {
    const bool decimal = c + 1 != end && std::isdigit(static_cast<unsigned char>(c[1])) != 0;
    if (*c == '\n') quoted = false;
    if (*c == '"') {
      quoted = !quoted;
      *c = ' ';
    } else if (*c == ',' && (quoted || separator != ',')) {
      *c = decimal ? '.' : quoted ? '_' : separator == ' ' ? ' ' : ',';
    } else if (quoted && (*c == separator || *c == ' ')) {
      *c = '_';
    }
  }
}

std::string TextTable::awk() const {
  return separator == ' ' ? "awk" : std::string("awk -F'") + separator + "'";
}

bool HeaderWord::isTime() const {
  constexpr std::string_view kNames[] = {"t",          "ts",         "time",  "times",
                                         "timestamp",  "timestamps", "stamp", "time_stamp",
                                         "time stamp", "event_time"};
  const std::string last = name.substr(name.find_last_of("./") + 1);
  if (last.size() > 6 && last.compare(last.size() - 6, 6, "_stamp") == 0) return true;
  const std::size_t begin = std::min(last.find_first_not_of('_'), last.size());
  return std::find(std::begin(kNames), std::end(kNames), last.substr(begin)) != std::end(kNames);
}

std::vector<std::string_view> HeaderWord::parts() const {
  std::vector<std::string_view> found;
  for (std::size_t begin = 0; begin < name.size();) {
    std::size_t end = begin;
    while (end < name.size() && isLetterOrDigit(name[end])) ++end;
    if (end > begin) found.emplace_back(name.data() + begin, end - begin);
    begin = end + 1;
  }
  return found;
}

std::optional<TimeColumns> timeColumnsOf(const std::vector<HeaderWord>& names,
                                         const std::string& beside) {
  std::optional<TimeColumns> best;
  std::pair<bool, std::ptrdiff_t> best_rank;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (!names[k].isTime()) continue;
    const std::string& name = names[k].name;
    const auto common = std::mismatch(name.begin(), name.end(), beside.begin(), beside.end()).first;
    const bool of_message = name.find("header") != std::string::npos ||
                            name.substr(name.find_last_of("./") + 1) == "stamp";
    const std::pair rank(of_message, common - name.begin());
    if (best && rank <= best_rank) continue;
    best = TimeColumns{k, names[k].time_exponent, {}};
    best_rank = rank;
  }
  for (std::size_t k = 0; best && best->exponent == 0 && k < names.size(); ++k) {
    if (names[k].name != names[best->column].name || names[k].time_exponent.value_or(0) == 0)
      continue;
    best->parts = k;
    best->parts_exponent = *names[k].time_exponent;
  }
  return best;
}

std::optional<std::int64_t> nanosecondsIn(std::string_view seconds, std::string_view parts,
                                          int exponent) {
  const auto count = parseNumber<std::int64_t>(parts);
  const std::int64_t unit_ns = nanosecondsPer(exponent);
  const bool is_part = count && *count >= 0 && *count < kNanosecondsPerSecond / unit_ns;
  if (!is_part || !parseNumber<std::int64_t>(seconds)) return std::nullopt;
  return *count * unit_ns;
}

std::optional<double> metresOf(std::string_view unit) {
  constexpr struct {
    double metres;
    std::string_view names;  // each between blanks
  } kUnits[] = {{1, " m meter meters metre metres "},
                {0.01, " cm centimeter centimeters centimetre centimetres "},
                {0.001, " mm millimeter millimeters millimetre millimetres "}};
  if (unit.empty() || unit.find(' ') != unit.npos) return std::nullopt;
  for (const auto& [metres, names] : kUnits) {
    if (names.find(" " + std::string(unit) + " ") != names.npos) return metres;
  }
  return std::nullopt;
}

HeaderWord headerWord(std::string_view text) {
  std::string lower;
  for (const char c : text) {
    if (std::string_view("\"'#%").find(c) == std::string_view::npos) {
      lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  HeaderWord word;
  const std::string_view content = trimmed(lower);
  const std::size_t bracket = content.find_first_of("[(");
  word.name = std::string(trimmed(content.substr(0, bracket)));
  if (word.name == "field.header.stamp") return {word.name, "ns", -9};  // rostopic echo -p
  if (bracket != std::string_view::npos) {
    const std::size_t end = content.find_first_of("])", bracket);
    const std::size_t length = std::min(end, content.size()) - bracket - 1;
    word.unit = std::string(trimmed(content.substr(bracket + 1, length)));
    word.time_exponent = timeExponentOf(word.unit);
    return word;
  }
  // "us" alone is a unit. "s" alone may mean something else.
  const std::size_t last = word.name.find_last_of("./") + 1;
  const std::string part = word.name.substr(last);
  if (const auto exponent = part.size() > 1 ? timeExponentOf(part) : std::nullopt) {
    return {word.name.substr(0, last) + "t", part, exponent};
  }
  const std::size_t underscore = word.name.rfind('_');
  if (underscore != std::string::npos) {
    const std::string unit = word.name.substr(underscore + 1);
    word.time_exponent = timeExponentOf(unit);
    if (word.time_exponent || metresOf(unit)) {
      word.unit = unit;
      word.name.resize(underscore);
    }
  }
  return word;
}

}  // namespace efm
