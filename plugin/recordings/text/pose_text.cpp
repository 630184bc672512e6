// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/text/pose_text.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/files/file_content.h"
#include "plugin/recordings/streams/pose_conflict.h"
#include "plugin/recordings/streams/time_unit.h"
#include "plugin/recordings/text/text_table.h"

namespace efm {
namespace {

constexpr std::array<const char*, 8> kFields = {"t", "tx", "ty", "tz", "qx", "qy", "qz", "qw"};
constexpr std::size_t kPositions = 1;
constexpr std::size_t kRotations = 4;
constexpr std::size_t kEnd = kFields.size();

bool startsWithAny(std::string_view text, std::initializer_list<std::string_view> starts) {
  return std::any_of(starts.begin(), starts.end(),
                     [&](std::string_view start) { return text.substr(0, start.size()) == start; });
}

/// Returns the field of x that a word stands for: that of positions or of rotations; 0: none.
std::size_t groupOf(std::string_view word) {
  if (word == "q" || startsWithAny(word, {"quat", "orient", "rot"})) return kRotations;
  const bool position = word == "p" || word == "t" || startsWithAny(word, {"pos", "trans", "loc"});
  return position ? kPositions : 0;
}

/// The field that a column's name means, the word for its group, and the rest of the name, which
/// tells the body.
struct PoseName {
  std::size_t field = 0;
  std::string group;
  std::string body;
  bool certain = true;  ///< False for "cam x", which is a position if "cam qx" is beside it.
};

std::optional<PoseName> poseNameOf(const HeaderWord& word) {
  std::vector<std::string_view> parts = word.parts();
  if (parts.empty()) return std::nullopt;
  if (parts.front().size() == 1 && parts.size() == 2 && groupOf(parts.back()) > 0) {
    std::swap(parts.front(), parts.back());  // "x position"
  }
  const std::size_t axis = std::string_view("xyzw").find(parts.back().back());
  const std::string_view stem = parts.back().substr(0, parts.back().size() - 1);
  parts.pop_back();
  std::size_t group = groupOf(stem);
  std::string group_word = stem.empty() ? "" : std::string(stem) + "x";  // px is not p_x
  if (axis == std::string_view::npos || (group == 0 && !stem.empty())) return std::nullopt;
  for (std::size_t k = parts.size(); group == 0 && k-- > 0;) {
    group = groupOf(parts[k]);
    if (group == 0) continue;
    group_word = parts[k];
    parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(k));
  }
  PoseName name{0, group_word, fmt::format("{}", fmt::join(parts, " ")),
                group > 0 || parts.empty()};
  if (group == 0) group = kPositions;
  if (group == kPositions && axis == 3) return std::nullopt;
  name.field = group + axis;
  return name;
}

/// The columns of a pose in a table; those of the TUM benchmark if it has no header.
struct PoseColumns {
  std::array<std::size_t, kEnd> column = {0, 1, 2, 3, 4, 5, 6, 7};
  TimeColumns time;
  std::optional<std::size_t> body;                   // the column with the name of the row's body
  Eigen::Vector3d metres = Eigen::Vector3d::Ones();  // in one unit of tx, ty and tz
};

/// The columns of a body's poses, by field.
struct Body {
  std::array<std::optional<std::size_t>, kEnd> column;
  bool certain = true;  ///< False if only rotations beside them show that these are positions.
  std::optional<std::size_t> other;  ///< A column of a second position or rotation.

  bool has(std::size_t begin, std::size_t end) const { return countIn(begin, end) == end - begin; }
  std::size_t countIn(std::size_t begin, std::size_t end) const {
    std::size_t count = 0;
    for (std::size_t k = begin; k < end; ++k) count += column[k] ? 1 : 0;
    return count;
  }
};

/// Returns the bodies in a header, by the rest of their columns' names; the one with most columns
/// is `most`. Of positions and of rotations with other words (x and px), a complete one counts.
std::map<std::string, Body> bodiesIn(const std::vector<HeaderWord>& words, Body& most) {
  std::map<std::string, Body> bodies;
  std::vector<std::pair<PoseName, Body>> groups;  // in the order of the columns
  for (std::size_t k = 0; k < words.size(); ++k) {
    const auto name = poseNameOf(words[k]);
    if (!name || words[k].isTime()) continue;
    auto group = std::find_if(groups.begin(), groups.end(), [&](const auto& other) {
      return other.first.group == name->group && other.first.body == name->body &&
             (other.first.field < kRotations) == (name->field < kRotations);
    });
    if (group == groups.end()) group = groups.insert(group, {*name, {}});
    if (!group->second.column[name->field]) group->second.column[name->field] = k;
    group->second.certain = group->second.certain && name->certain;
  }
  for (const bool complete : {true, false}) {
    for (const auto& [name, group] : groups) {
      const bool rotation = name.field >= kRotations;
      const std::size_t begin = rotation ? kRotations : kPositions;
      const std::size_t end = rotation ? kEnd : kRotations;
      Body& body = bodies[name.body];
      if (group.has(begin, end) != complete) continue;
      if (body.countIn(begin, end) > 0) {
        if (complete) body.other = group.column[begin];
        continue;
      }
      std::copy(group.column.begin() + begin, group.column.begin() + end,
                body.column.begin() + begin);
      body.certain = body.certain && group.certain;
    }
  }
  for (auto body = bodies.begin(); body != bodies.end();) {
    const bool is_pose = body->second.certain || body->second.has(kRotations, kEnd);
    if (is_pose && body->second.countIn(0, kEnd) > most.countIn(0, kEnd)) most = body->second;
    body = is_pose ? std::next(body) : bodies.erase(body);
  }
  return bodies;
}

bool namesPoses(const std::vector<HeaderWord>& words) {
  const bool time =
      std::any_of(words.begin(), words.end(), [](const HeaderWord& word) { return word.isTime(); });
  Body most;
  bodiesIn(words, most);
  return most.countIn(0, kEnd) >= (time ? 3U : 6U);
}

/// Returns the command that writes one body's poses as a table of their own.
std::string commandOfBody(const TextTable& table, const Body& body, const TimeColumns& time) {
  const std::string separator(1, table.separator == '\t' ? ' ' : table.separator);
  const auto unit_of = [&](std::size_t column) {
    const std::string& unit = table.names[column].unit;
    return (unit.empty()
                ? table.length_unit.empty() || column == time.column ? "" : "_" + table.length_unit
                : "_" + unit);
  };
  std::string names = "t" + unit_of(time.column);
  if (time.parts) names = "sec" + separator + timeUnitOf(time.parts_exponent) + "ec";
  std::string columns = fmt::format("${}", time.column + 1);
  if (time.parts) columns += fmt::format(", ${}", *time.parts + 1);
  for (std::size_t k = kPositions; k < kEnd; ++k) {
    names += separator + kFields[k] + (k < kRotations ? unit_of(*body.column[k]) : "");
    columns += fmt::format(", ${}", *body.column[k] + 1);
  }
  return fmt::format("(echo '{}'; {} -v OFS='{}' 'NR > {} {{print {}}}' FILE) >NEW", names,
                     table.awk(), separator, table.lines_before, columns);
}

/// Takes the units of positions.
/// @throws std::runtime_error for an unknown unit, and for a unit of some axes alone.
void takeUnits(const TextTable& table, PoseColumns& columns) {
  std::array<std::string, 3> units;
  for (std::size_t k = 0; k < 3; ++k) {
    units[k] = table.names[columns.column[kPositions + k]].unit;
    if (units[k].empty()) units[k] = table.length_unit;
    const std::optional<double> unit_m = units[k].empty() ? 1 : metresOf(units[k]);
    if (!unit_m) {
      throw std::runtime_error(fmt::format("the unit {} of {}: expected m, cm or mm",
                                           inQuotes(units[k]), kFields[kPositions + k]));
    }
    columns.metres[static_cast<Eigen::Index>(k)] = *unit_m;
  }
  if (std::count(units.begin(), units.end(), "") % 3 == 0) return;
  throw std::runtime_error(
      fmt::format("the units of tx, ty and tz are '{}', '{}' and '{}': expected one at each of the "
                  "three, as in tx [mm] ty [mm] tz [mm], or at none (metres)",
                  units[0], units[1], units[2]));
}

/// Finds the columns of the header's names. @throws std::runtime_error without the place.
PoseColumns poseColumnsOf(const TextTable& table) {
  const std::vector<HeaderWord>& words = table.names;
  Body most;
  std::map<std::string, Body> bodies = bodiesIn(words, most);
  std::vector<std::pair<std::string, Body>> found;
  std::vector<Body> positions, rotations;
  for (const auto& [name, body] : bodies) {
    const bool position = body.has(kPositions, kRotations);
    const bool rotation = body.has(kRotations, kEnd);
    if (position && rotation) found.emplace_back(name, body);
    if (position) positions.push_back(body);
    if (rotation) rotations.push_back(body);
  }
  if (found.empty() && positions.size() == 1 && rotations.size() == 1) {  // p_RS_R_x and q_RS_w
    for (std::size_t k = kRotations; k < kEnd; ++k) positions[0].column[k] = rotations[0].column[k];
    found.emplace_back("", positions[0]);
  }
  const auto time =
      timeColumnsOf(words, found.empty() ? "" : words[*found[0].second.column[kPositions]].name);
  const std::string header = inQuotes(table.header);
  const bool angles = std::any_of(words.begin(), words.end(), [](const HeaderWord& word) {
    return word.name.find("roll") != word.name.npos || word.name.find("yaw") != word.name.npos ||
           word.name.find("euler") != word.name.npos;
  });
  if (angles && rotations.empty()) {
    throw std::runtime_error(
        header +
        ": angles are not read, because their order and axes differ between tools: expected a "
        "quaternion, qx qy qz qw");
  }
  if (found.empty() || !time) {
    std::size_t missing = time ? kPositions : 0;
    while (missing > 0 && most.column[missing]) ++missing;
    throw std::runtime_error(fmt::format(
        "{}: there is no column {}: expected t tx ty tz qx qy qz qw", header, kFields[missing]));
  }
  if (found.size() > 1) {
    std::string names;
    for (const auto& [name, body] : found) {
      const auto [first, last] =
          std::minmax_element(body.column.begin() + kPositions, body.column.end());
      names += fmt::format(", {} (columns {} to {})", inQuotes(name), **first + 1, **last + 1);
    }
    throw std::runtime_error(fmt::format("poses of {} bodies{}: expected one body; {} alone: {}",
                                         found.size(), names, inQuotes(found[0].first),
                                         commandOfBody(table, found[0].second, *time)));
  }
  if (const auto other = found[0].second.other) {
    throw std::runtime_error(fmt::format(
        "{}: column {}, {}, is of a second position or rotation of this body: expected one (rename "
        "the columns to ignore)",
        header, *other + 1, inQuotes(words[*other].name)));
  }
  if (!words[time->column].unit.empty() && !time->exponent) {
    throw std::runtime_error(fmt::format("the unit {} of t: expected s, ms, us or ns",
                                         inQuotes(words[time->column].unit)));
  }
  PoseColumns columns;
  columns.time = *time;
  columns.column[0] = time->column;
  for (std::size_t k = kPositions; k < kEnd; ++k) columns.column[k] = *found[0].second.column[k];
  for (std::size_t k = 0; k < words.size(); ++k) {
    const std::string last = " " + words[k].name.substr(words[k].name.find_last_of("./") + 1) + " ";
    constexpr std::string_view kBodies =
        " child_frame_id child_frame body body_id body_name rigid_body serial object object_id ";
    if (kBodies.find(last) != std::string_view::npos) columns.body = k;
  }
  takeUnits(table, columns);
  return columns;
}

double numberIn(std::string_view text, std::size_t field) {
  if (const std::optional<double> value = parseFinite(text)) return *value;
  throw std::runtime_error(
      fmt::format("{} = {}: expected a finite number", kFields[field], inQuotes(text)));
}

/// Parses the pose of a row. @param fields t tx ty tz qx qy qz qw.
StampedPose parsePose(const std::array<std::string_view, kEnd>& fields, int time_exponent,
                      const Eigen::Vector3d& metres) {
  const std::optional<std::int64_t> t_ns = parseTimeIn(fields[0], time_exponent);
  if (!t_ns || *t_ns >= kEndOfTimeNs || *t_ns <= -kEndOfTimeNs) {
    throw std::runtime_error(fmt::format("t = {}: expected a {}", inQuotes(fields[0]),
                                         t_ns ? "time within 4.6e9 s of 0" : "decimal time"));
  }
  std::array<double, kEnd> v{};
  for (std::size_t k = kPositions; k < kEnd; ++k) v[k] = numberIn(fields[k], k);
  const Eigen::Quaterniond numbers(v[7], v[4], v[5], v[6]);
  if (const auto rotation = rotationNear(numbers)) {
    return {*t_ns, {*rotation, metres.cwiseProduct(Eigen::Vector3d(v[1], v[2], v[3]))}};
  }
  const double squares = v[1] * v[1] + v[2] * v[2] + v[3] * v[3] + v[4] * v[4];
  throw std::runtime_error(fmt::format(
      "qx qy qz qw = '{} {} {} {}', of length {:.6g}: expected a rotation, of length 1 within 1 "
      "%; {} A header names other ones",
      printable(fields[4]), printable(fields[5]), printable(fields[6]), printable(fields[7]),
      numbers.coeffs().stableNorm(),
      std::abs(squares - 1) < 0.01
          ? "tx ty tz qx has length 1: is the order t qx qy qz qw tx ty tz?"
          : "are the columns t tx ty tz qx qy qz qw?"));
}

/// A row of the table.
struct PoseRow {
  std::uint64_t line;
  std::string_view text;
};

/// The poses of a text, and their rows.
struct PoseText {
  TextTable table;
  PoseColumns columns;
  std::vector<PoseRow> rows;
  std::vector<StampedPose> poses;
  std::uint64_t without_pose = 0;  ///< Rows whose pose is empty or NaN.

  std::string_view timeOf(const PoseRow& row) const {
    const auto fields = table.fieldsOf(row.text);
    return columns.column[0] < fields.size() ? fields[columns.column[0]] : std::string_view();
  }
};

/// Finds the exponent of the unit of times.
int exponentOf(const PoseText& text, const std::string& file, const ReaderOptions& options) {
  const PoseColumns& columns = text.columns;
  if (columns.time.exponent) return *columns.time.exponent;
  constexpr std::size_t kSample = 100;
  TimeSample sample;
  for (std::size_t i = 0; i < std::min(text.rows.size(), kSample); ++i) {
    const std::string_view t = text.timeOf(text.rows[i]);
    if (const auto value = parseFinite(t)) sample.add(*value, t);
  }
  if (options.pose_time_unit.empty() && !text.rows.empty()) {
    const std::string awk = text.table.awk();
    const std::size_t t = columns.column[0] + 1;
    requireTimesOfPoses(
        sample, file, options,
        fmt::format(
            "with a file of the frames' times: {}{} 'NR==FNR {{if ($1 ~ /^[0-9]/) t[n++]=$1; "
            "next}} FNR>={} {{${}=t[${}-{}]}} 1' TIMES FILE >NEW",
            awk, awk.size() > 3 ? fmt::format(" -v OFS={}", awk.substr(6)) : "",
            text.rows.front().line, t, t, sample.earliest));
  }
  if (!sample.whole && options.pose_time_unit.empty()) {  // `time_unit` is for whole numbers
    requireSecondsOfPoses(sample, file, options);
    return 0;
  }
  const std::string name = std::filesystem::path(file).filename().string();
  const bool tum_vie = name.find("mocap_data") != std::string::npos;
  if (!text.table.names.empty() && tum_vie) return -6;
  return poseTimeExponent(options, sample, file);
}

/// Returns the fields of a row, which are as many as the columns.
std::vector<std::string_view> fieldsOf(const TextTable& table, std::string_view row) {
  const bool named = !table.names.empty();
  const std::size_t count = named ? table.names.size() : kEnd;
  std::vector<std::string_view> fields = table.fieldsOf(row);
  if (!named && fields.size() == 12) throw std::runtime_error(kPosesWithoutTimes);
  if (!named && table.separator == ',') {
    throw std::runtime_error("commas without a header: expected a header with the columns' names");
  }
  if (fields.size() == count) return fields;
  const bool commas = table.separator == ',' && fields.size() >= 2 * count - 1;
  throw std::runtime_error(
      fmt::format("{} fields: expected {}{}", fields.size(), count,
                  commas  ? "; decimal commas? Then semicolons or quotes between the fields"
                  : named ? ", as in the header"
                  : fields.size() == 7    ? ", t tx ty tz qx qy qz qw (angles are not read)"
                  : fields.size() > count ? ", t tx ty tz qx qy qz qw; name them in a header line"
                                          : ", t tx ty tz qx qy qz qw"));
}

/// Returns whether a field is that of a pose that a tracker lost.
bool isLost(std::string_view field) {
  const auto number = parseNumber<double>(field);
  return field.empty() || field == "NaN" || (number && std::isnan(*number));
}

/// Finds the table, its columns, and the rows.
void findRows(std::string& content, const std::string& file, PoseText& parsed) {
  requireTextLines(content, file);
  TextTable& table = parsed.table;
  table = findTable(withoutByteOrderMark(content), namesPoses);
  try {
    if (!table.names.empty()) parsed.columns = poseColumnsOf(table);
    if (table.names.empty() && table.header_line > 0) {
      throw std::runtime_error(inQuotes(table.header) +
                               ": expected t tx ty tz qx qy qz qw, or columns with these names "
                               "(pose.position.x, quaternion_w and the like)");
    }
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{}:{}: {}", file, table.header_line, error.what()));
  }
  char* const end = content.data() + content.size();
  table.makePlain(end - table.rows.size(), end);
  std::string_view text = table.rows;
  for (std::uint64_t number = table.lines_before + 1; !text.empty(); ++number) {
    const std::string_view line = takeLine(text);
    const std::string_view row = line.substr(0, line.find('#'));
    if (!trimmed(row).empty()) parsed.rows.push_back({number, row});
  }
}

/// @param content is made plain.
PoseText parsePoses(std::string& content, const std::string& file, const ReaderOptions& options) {
  PoseText parsed;
  findRows(content, file, parsed);
  const PoseColumns& columns = parsed.columns;
  const auto at_row = [&](const PoseRow& row, const auto& use) {
    try {
      return use(row);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("{}:{}: {}", file, row.line, error.what()));
    }
  };
  const auto fields_of = [&](const PoseRow& row) { return fieldsOf(parsed.table, row.text); };
  if (!parsed.rows.empty()) at_row(parsed.rows.front(), fields_of);
  const int exponent = exponentOf(parsed, file, options);
  bool in_parts = columns.time.parts.has_value();
  const auto body_of = [&](const auto& fields) {
    return columns.body ? trimmed(fields[*columns.body]) : std::string_view();
  };
  std::optional<std::string_view> body;
  const auto take = [&](const PoseRow& row) {
    const std::vector<std::string_view> fields = fields_of(row);
    std::array<std::string_view, kEnd> ordered;
    for (std::size_t k = 0; k < kEnd; ++k) ordered[k] = fields[columns.column[k]];
    const bool lost = std::all_of(ordered.begin() + kPositions, ordered.end(), isLost);
    if (lost && parseFinite(ordered[0])) return false;
    if (!body) body = body_of(fields);
    if (body_of(fields) != *body) {
      throw std::runtime_error(fmt::format(
          "{} = {}, after {}: poses of several bodies: expected one ({} 'NR <= {} || index(${}, "
          "\"{}\")' FILE >NEW)",
          parsed.table.names[*columns.body].name, inQuotes(body_of(fields)), inQuotes(*body),
          parsed.table.awk(), parsed.table.lines_before, *columns.body + 1, printable(*body)));
    }
    parsed.poses.push_back(parsePose(ordered, exponent, columns.metres));
    if (!in_parts) return true;
    const std::string_view part = fields[*columns.time.parts];
    const auto ns = nanosecondsIn(ordered[0], part, columns.time.parts_exponent);
    if (ns) parsed.poses.back().t_ns += *ns;
    in_parts = ns.has_value();
    if (!ns && parsed.poses.size() > 1) {
      throw std::runtime_error(
          fmt::format("part of a second = {}: expected less than a second, after whole seconds",
                      inQuotes(part)));
    }
    return true;
  };
  parsed.poses.reserve(parsed.rows.size());
  for (const PoseRow& row : std::exchange(parsed.rows, {})) {
    if (at_row(row, take)) {
      parsed.rows.push_back(row);
    } else {
      ++parsed.without_pose;
    }
  }
  return parsed;
}

/// Returns a command that takes one trajectory out of a text, for an error.
std::string remedyFor(const PoseConflict& conflict, const PoseText& text) {
  const auto column = [&](std::size_t field) { return text.columns.column[field] + 1; };
  const std::string_view t = text.timeOf(text.rows[conflict.first]);
  const std::string_view digits = t.substr(0, t.find_first_of("eE"));
  const auto count = std::count_if(digits.begin(), digits.end(), [](char c) { return c != '.'; });
  const bool is_late = std::abs(text.poses[conflict.first].t_ns) > 100 * kNanosecondsPerSecond;
  if (conflict.equal_times && !conflict.back && count <= 6 && is_late) {
    return "the times have six digits: write them with all, for example by numpy.savetxt(FILE, "
           "poses, fmt='%.9f')";
  }
  std::string command = fmt::format("head -n {}", text.rows[conflict.back.value_or(0)].line - 1);
  const std::string awk = text.table.awk();
  const std::uint64_t first = text.rows.front().line;
  if (conflict.equal_times && !conflict.back) {
    command = fmt::format("{} '!seen[${}]++'", awk, column(0));
  } else if (!conflict.back && conflict.distance_m > conflict.angle_rad) {
    const double half = conflict.distance_m / 2 / text.columns.metres[0];
    command = fmt::format(
        "{} 'NR <= {} || (${x}-x)^2 + (${y}-y)^2 + (${z}-z)^2 < {:.3g} {{print; x=${x}; y=${y}; "
        "z=${z}}}'",
        awk, first, half * half, fmt::arg("x", column(1)), fmt::arg("y", column(2)),
        fmt::arg("z", column(3)));
  } else if (!conflict.back) {
    const double cosine = std::cos(conflict.angle_rad / 4);  // of half of the middle angle
    command = fmt::format(
        "{} 'NR <= {} || (${a}*a + ${b}*b + ${c}*c + ${d}*d)^2 > {:.6f} {{print; a=${a}; b=${b}; "
        "c=${c}; d=${d}}}'",
        awk, first, cosine * cosine, fmt::arg("a", column(4)), fmt::arg("b", column(5)),
        fmt::arg("c", column(6)), fmt::arg("d", column(7)));
  }
  return "the poses of the first one: " + command + " FILE >NEW";
}

std::vector<StampedPose> readPoseTable(std::string content, const std::string& file,
                                       const ReaderOptions& options, RecordingParts& parts) {
  PoseText text = parsePoses(content, file, options);
  if (const std::vector<std::size_t> wrong = findWrongTimes(text.poses); !wrong.empty()) {
    const PoseRow& row = text.rows[wrong.front()];
    parts.warnings.push_back(skippedPoses(
        wrong.size(), fmt::format("{}:{}: t = {}", file, row.line, printable(text.timeOf(row)))));
    removeAt(wrong, text.rows);
    removeAt(wrong, text.poses);
  }
  if (const auto conflict = findPoseConflict(text.poses)) {
    throw std::runtime_error(fmt::format("{}: {} ({})", file, conflict->text([&](std::size_t i) {
      return fmt::format("line {}", text.rows[i].line);
    }),
                                         remedyFor(*conflict, text)));
  }
  if (text.poses.empty()) {
    throw std::runtime_error(fmt::format(
        "{}: no poses: expected at least one {}", file,
        text.table.names.empty() ? "line t tx ty tz qx qy qz qw" : "row after the header"));
  }
  if (text.without_pose > 0) {
    parts.notes.push_back(
        {"lost-poses", fmt::format("{}: {} rows have no pose, but empty fields or NaN: "
                                   "the tracker lost the body there",
                                   file, text.without_pose)});
  }
  return std::move(text.poses);
}

}  // namespace

std::vector<StampedPose> readPoseText(const std::filesystem::path& file,
                                      const ReaderOptions& options, RecordingParts& parts) {
  constexpr std::size_t kMaxBytes = 2'000'000'000;
  return readPoseTable(FileContent(file).readAll(kMaxBytes), file.string(), options, parts);
}

std::vector<StampedPose> readPoseFrames(const std::filesystem::path& file,
                                        const ReaderOptions& options, RecordingParts& parts) {
  using Json = nlohmann::json;
  std::ifstream stream(file);
  const Json root = Json::parse(stream, nullptr, false);
  const auto frames = root.is_object() ? root.find("frames") : root.end();
  if (root.is_discarded() || frames == root.end() || !frames->is_array()) {
    throw std::runtime_error(file.string() +
                             ": JSON: expected frames with transform_matrix and a time");
  }
  std::string table;
  std::string unit;
  for (const Json& frame : *frames) {
    std::vector<double> matrix;
    std::string time;
    if (frame.is_object() && frame.contains("transform_matrix")) {
      for (const Json& row : frame["transform_matrix"]) {
        for (const Json& number : row) {
          matrix.push_back(number.is_number() ? number.get<double>() : std::nan(""));
        }
      }
    }
    for (const auto& [key, value] : frame.items()) {
      const HeaderWord word = headerWord(key);
      if (!word.isTime() || !(value.is_number() || value.is_string())) continue;
      time = value.is_string() ? value.get<std::string>() : value.dump();
      unit = word.time_exponent ? "_" + timeUnitOf(*word.time_exponent) : "";
    }
    try {
      if (matrix.size() != 16) throw std::runtime_error("expected transform_matrix, 4 x 4");
      if (!parseFinite(time)) throw std::runtime_error("expected a time: timestamp, time or t_ns");
      const Rigid3 T_cv_gl = {Eigen::Quaterniond(0, 1, 0, 0), Eigen::Vector3d::Zero()};
      const Rigid3 T_world_cam = transformOf(matrix) * T_cv_gl.inverse();
      const Eigen::Vector3d& p = T_world_cam.translation;
      const Eigen::Quaterniond& q = T_world_cam.rotation;
      table += fmt::format("{} {} {} {} {} {} {} {}\n", time, p.x(), p.y(), p.z(), q.x(), q.y(),
                           q.z(), q.w());
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("{}: frames[{}]: {}", file.string(),
                                           std::count(table.begin(), table.end(), '\n'),
                                           error.what()));
    }
  }
  return readPoseTable("t" + unit + " tx ty tz qx qy qz qw\n" + table, file.string(), options,
                       parts);
}

bool looksLikePoseLines(std::string_view beginning) {
  ReaderOptions options;
  options.pose_time_unit = "ns";  // any unit: it does not matter here
  std::string content(beginning);
  try {
    return !parsePoses(content, {}, options).poses.empty();
  } catch (const std::runtime_error&) {
    return false;
  }
}

}  // namespace efm
