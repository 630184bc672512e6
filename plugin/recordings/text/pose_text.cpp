// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/text/pose_text.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/streams/file_content.h"
#include "plugin/recordings/streams/pose_conflict.h"
#include "plugin/recordings/streams/time_unit.h"

namespace efm {
namespace {

constexpr std::size_t kPoseFields = 8;  // t tx ty tz qx qy qz qw
constexpr std::array<const char*, kPoseFields> kPoseFieldNames = {"t",  "tx", "ty", "tz",
                                                                  "qx", "qy", "qz", "qw"};

/// Splits a line into fields: at commas or semicolons if it has any, else at blanks.
std::vector<std::string_view> poseFields(std::string_view line) {
  if (line.find_first_of(",;") == std::string_view::npos) return splitWords(line);
  return splitFields(line, ",;");
}

bool startsWithAny(std::string_view text, std::initializer_list<std::string_view> starts) {
  return std::any_of(starts.begin(), starts.end(),
                     [&](std::string_view start) { return text.substr(0, start.size()) == start; });
}

/// Returns the index in t tx ty tz qx qy qz qw of the field that a header's word names.
std::optional<std::size_t> poseFieldOf(const HeaderWord& word) {
  if (word.isTime()) return 0;
  if (word.name.empty()) return std::nullopt;
  const std::size_t axis = std::string_view("xyzw").find(word.name.back());
  if (axis == std::string_view::npos) return std::nullopt;
  std::string_view stem = std::string_view(word.name).substr(0, word.name.size() - 1);
  while (!stem.empty() && (stem.back() == '_' || stem.back() == '.')) stem.remove_suffix(1);
  if (stem == "q" || startsWithAny(stem, {"q_", "quat", "orient", "rot"})) return 4 + axis;
  const bool position = stem.empty() || stem == "p" || stem == "t" ||
                        startsWithAny(stem, {"p_", "t_", "pos", "trans"});
  return position && axis < 3 ? std::optional(1 + axis) : std::nullopt;
}

/// The positions of a pose's fields in a line.
struct PoseColumns {
  std::array<std::size_t, kPoseFields> column = {0, 1, 2, 3, 4, 5, 6, 7};
  std::size_t count = kPoseFields;  // number of fields in a line
  bool named = false;
  std::optional<int> time_exponent;
  Eigen::Vector3d metres = Eigen::Vector3d::Ones();  // in one unit of tx, ty and tz

  /// Takes the unit that a header gives to a field; rotations have no unit.
  /// @throws std::runtime_error for an unknown unit of a position.
  void setUnit(std::size_t field, const HeaderWord& word) {
    if (field == 0) time_exponent = word.time_exponent;
    if (field == 0 || field > 3 || word.unit.empty()) return;
    const std::optional<double> unit_m = metresOf(word.unit);
    if (!unit_m) {
      throw std::runtime_error(fmt::format("the unit {} of {}: expected m, cm or mm",
                                           inQuotes(word.unit), kPoseFieldNames[field]));
    }
    metres[static_cast<Eigen::Index>(field) - 1] = *unit_m;
  }
};

/// Returns the beginning of an awk command for lines like this one.
std::string awkFor(std::string_view line) {
  const char* const separator = line.find(',') != line.npos ? " -F," : "";
  return std::string("awk") + (line.find(';') != line.npos ? " -F';'" : separator);
}

/// Returns the columns that a header names; std::nullopt if the line is no header.
std::optional<PoseColumns> poseColumnsOf(std::string_view line) {
  std::vector<std::string_view> words = poseFields(line);
  // "# timestamp …": the # is no column. "t [us]" with a blank: the unit is no column, either.
  if (!words.empty() && words.front() == "#") words.erase(words.begin());
  PoseColumns columns;
  columns.named = true;
  columns.count = 0;
  std::array<bool, kPoseFields> found{};
  bool angles = false;
  std::optional<std::size_t> field;
  for (const std::string_view text : words) {
    const HeaderWord word = headerWord(text);
    if (word.name.empty()) {
      if (text.empty()) ++columns.count;  // the index of pandas has no name
      if (field && !text.empty()) columns.setUnit(*field, word);
      continue;
    }
    const bool in_ns = word.isTime() && word.time_exponent == -9 && columns.time_exponent == 0;
    if (found[0] && (in_ns || word.name.rfind("nanosec", 0) == 0)) {
      throw std::runtime_error(fmt::format(
          "{}: seconds and nanoseconds in two columns: expected one time ({} -v OFS=, 'NR == 1 "
          "{{${ns} = \"unused\"}} NR > 1 {{${s} = sprintf(\"%d.%09d\", ${s}, ${ns})}} 1' FILE "
          ">NEW)",
          inQuotes(line), awkFor(line), fmt::arg("s", columns.column[0] + 1),
          fmt::arg("ns", columns.count + 1)));
    }
    field = poseFieldOf(word);
    angles = angles || startsWithAny(word.name, {"roll", "pitch", "yaw", "euler"});
    if (field && !found[*field]) {
      found[*field] = true;
      columns.column[*field] = columns.count;
      columns.setUnit(*field, word);
    }
    ++columns.count;
  }
  if (!found[0] || std::count(found.begin(), found.end(), true) < 4) return std::nullopt;
  if (angles && !found[4]) {
    throw std::runtime_error(
        inQuotes(line) +
        ": angles are not read, because their order and axes differ between tools: expected a "
        "quaternion, qx qy qz qw");
  }
  for (std::size_t expected = 0; expected < kPoseFields; ++expected) {
    if (found[expected]) continue;
    throw std::runtime_error(
        fmt::format("{}: there is no column {}: expected t tx ty tz qx qy qz qw", inQuotes(line),
                    kPoseFieldNames[expected]));
  }
  return columns;
}

struct PoseLine {
  std::size_t number;
  std::string_view text;
};

/// Splits the text into lines with a pose, and finds its columns.
std::vector<PoseLine> poseLines(std::string_view text, PoseColumns& columns,
                                const std::string& file) {
  std::vector<PoseLine> lines;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view line = trimmed(takeLine(text));
    if (line.empty()) continue;
    const bool comment = line.front() == '#';
    const bool number_first = !comment && parseNumber<double>(poseFields(line).front());
    if (number_first || (comment && !lines.empty())) {
      const std::string_view content = trimmed(line.substr(0, line.find('#')));
      if (!content.empty()) lines.push_back({number, content});
      continue;
    }
    try {
      const auto named = lines.empty() ? poseColumnsOf(line) : std::nullopt;
      if (named) {
        columns = *named;
      } else if (!comment) {
        throw std::runtime_error(
            inQuotes(line) +
            ": expected t tx ty tz qx qy qz qw, or a header with the columns' names");
      }
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("{}:{}: {}", file, number, error.what()));
    }
  }
  return lines;
}

/// Finds the exponent of the unit of times. @param columns may have the unit of the header.
int exponentOf(const std::vector<PoseLine>& lines, const PoseColumns& columns,
               const std::filesystem::path& file, const ReaderOptions& options) {
  if (columns.time_exponent) return *columns.time_exponent;
  constexpr std::size_t kSample = 100;
  TimeSample sample;
  for (std::size_t i = 0; i < std::min(lines.size(), kSample); ++i) {
    const std::vector<std::string_view> fields = poseFields(lines[i].text);
    if (!columns.named && fields.size() == 12) {
      throw std::runtime_error(
          fmt::format("{}:{}: {}", file.string(), lines[i].number, kPosesWithoutTimes));
    }
    if (!columns.named && fields.size() > kPoseFields) {
      throw std::runtime_error(fmt::format(
          "{}:{}: {} fields: expected 8, t tx ty tz qx qy qz qw; name them in a header line",
          file.string(), lines[i].number, fields.size()));
    }
    if (fields.size() <= columns.column[0]) continue;
    const std::string_view t = fields[columns.column[0]];
    if (const auto value = parseFinite(t)) sample.add(*value, t);
  }
  if (options.pose_time_unit.empty() && !lines.empty()) {
    const std::string awk = awkFor(lines.front().text);
    const std::size_t t = columns.column[0] + 1;
    requireTimesOfPoses(
        sample, file.string(),
        fmt::format("with a file of the frames' times: {}{} 'NR==FNR {{t[FNR{}]=$1; next}} FNR>={} "
                    "{{${}=t[${}+0]}} 1' TIMES FILE >NEW",
                    awk, awk.size() > 3 ? fmt::format(" -v OFS={}", awk.substr(6)) : "",
                    sample.earliest == 0 ? "-1" : "", lines.front().number, t, t));
  }
  if (!sample.whole && options.pose_time_unit.empty()) {  // `time_unit` is for whole numbers
    requireSecondsOfPoses(sample, file.string());
    return 0;
  }
  if (columns.named && file.filename().string().find("mocap_data") != std::string::npos) return -6;
  return poseTimeExponent(options, sample, file.string());
}

/// The poses of a text, and their lines.
struct PoseText {
  PoseColumns columns;
  std::vector<PoseLine> lines;
  std::vector<StampedPose> poses;
};

PoseText parsePoses(std::string_view text, const std::filesystem::path& file,
                    const ReaderOptions& options) {
  requireTextLines(text, file.string());
  PoseText parsed;
  PoseColumns& columns = parsed.columns;
  parsed.lines = poseLines(withoutByteOrderMark(text), columns, file.string());
  const int exponent = exponentOf(parsed.lines, columns, file, options);
  parsed.poses.reserve(parsed.lines.size());
  for (const PoseLine& line : parsed.lines) {
    try {
      std::vector<std::string_view> fields = poseFields(line.text);
      if (columns.named) {
        if (fields.size() != columns.count) {
          throw std::runtime_error(fmt::format("{} fields: expected {}, as in the header",
                                               fields.size(), columns.count));
        }
        std::vector<std::string_view> ordered;
        for (const std::size_t column : columns.column) ordered.push_back(fields[column]);
        fields = std::move(ordered);
      } else if (line.text.find(',') != std::string_view::npos) {
        throw std::runtime_error(
            "commas without a header: expected a header with the columns' names");
      }
      parsed.poses.push_back(parseTumPose(fields, exponent));
      parsed.poses.back().T_world_rig.translation.array() *= columns.metres.array();
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("{}:{}: {}", file.string(), line.number, error.what()));
    }
  }
  return parsed;
}

/// Returns a command that takes one trajectory out of a text, for an error.
std::string remedyFor(const PoseConflict& conflict, const PoseText& text) {
  const auto column = [&](std::size_t field) { return text.columns.column[field] + 1; };
  const PoseLine& line = text.lines[conflict.first];
  const std::string_view t = poseFields(line.text)[text.columns.column[0]];
  const std::string_view digits = t.substr(0, t.find_first_of("eE"));
  const auto count = std::count_if(digits.begin(), digits.end(), [](char c) { return c != '.'; });
  const bool is_late = std::abs(text.poses[conflict.first].t_ns) > 100 * kNanosecondsPerSecond;
  if (conflict.equal_times && !conflict.back && count <= 6 && is_late) {
    return "the times have six digits: write them with all, for example by numpy.savetxt(FILE, "
           "poses, fmt='%.9f')";
  }
  std::string command = fmt::format("head -n {}", text.lines[conflict.back.value_or(0)].number - 1);
  const std::string awk = awkFor(line.text);
  const std::size_t first = text.lines.front().number;
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

}  // namespace

std::vector<StampedPose> readPoseText(const std::filesystem::path& file,
                                      const ReaderOptions& options) {
  constexpr std::size_t kMaxBytes = 2'000'000'000;
  const std::string content = FileContent(file).readAll(kMaxBytes);
  PoseText text = parsePoses(content, file, options);
  if (const auto conflict = findPoseConflict(text.poses)) {
    throw std::runtime_error(fmt::format(
        "{}: {} ({})", file.string(),
        conflict->text([&](std::size_t i) { return fmt::format("line {}", text.lines[i].number); }),
        remedyFor(*conflict, text)));
  }
  return std::move(text.poses);
}

bool looksLikePoseLines(std::string_view beginning) {
  ReaderOptions options;
  options.pose_time_unit = "ns";  // any unit: it does not matter here
  try {
    return !parsePoses(beginning, {}, options).poses.empty();
  } catch (const std::runtime_error&) {
    return false;
  }
}

std::vector<StampedPose> requirePoses(std::vector<StampedPose> poses,
                                      const std::filesystem::path& file) {
  if (!poses.empty()) return poses;
  throw std::runtime_error(file.string() +
                           ": no poses: expected at least one line t tx ty tz qx qy qz qw");
}

}  // namespace efm
