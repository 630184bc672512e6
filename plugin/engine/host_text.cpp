// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/engine/host_text.h"

#include <array>
#include <cstddef>
#include <cstring>
#include <regex>
#include <utility>

namespace efm {
namespace {

/// Words for recordings in C++ and in Python, then for a Mapper in C++ and in Python.
using Words = std::array<const char*, 4>;

/// A word that ends with `=` takes a value: `--poses FILE` becomes `poses=FILE`.
struct OptionWords {
  const char* option;
  Words words;
};
constexpr OptionWords kOptions[] = {
    {"poses", {"Overrides::poses=", "poses=", "addPose", "add_poses"}},
    {"calibration", {"Overrides::calibration=", "calibration=", "addCamera", "add_camera"}},
    {"hand-eye", {"Overrides::hand_eye=", "hand_eye=", "rig.hand_eye=", "rig.hand_eye="}},
    {"pose-time-unit", {"Overrides::pose_time_unit=", "pose_time_unit=", "addPose", "time_unit="}},
    {"truth-time-unit", {"truth_time_unit", "truth_time_unit=", "addPose", "time_unit="}},
    {"time-unit", {"Overrides::time_unit=", "time_unit=", "addEvents", "time_unit="}},
    {"event-columns", {"Overrides::event_columns=", "event_columns=", "addEvents", "add_events"}},
    {"resume", {"resume", "resume=True", "resume", "resume"}},
    {"topics", {"Overrides::topics=", "topics=", "topics", "topics"}},
    {"format", {"Overrides::format=", "format=", "format", "format"}},
    {"skip-bad-events",
     {"Overrides::skip_bad_events=", "skip_bad_events=", "addEvents", "add_events"}},
    {"duration", {"Overrides::limits", "t1=", "the input", "the input"}},
    {"t0", {"Overrides::limits.t0", "t0=", "the input", "the input"}},
    {"t1", {"Overrides::limits.t1", "t1=", "the input", "the input"}},
};

}  // namespace

bool& hostIsPython() {
  static bool is_python = false;
  return is_python;
}

std::string hostText(const std::string& text, HostFace face) {
  if (text.find("--") == std::string::npos && text.find("signal") == std::string::npos) return text;
  const bool python = hostIsPython();
  const auto replaced = [](const std::string& in, const std::string& pattern,
                           const std::string& by) {
    return std::regex_replace(in, std::regex(pattern), by);
  };
  std::string named = replaced(  // a command whose option is the choice of cameras
      text, "`map --calibration \\S+ --set rig\\.cameras=([0-9,]+)` \\(Python: [^)]*\\)",
      python ? "cameras=[$1]" : "Overrides::cameras={$1}");
  if (face == HostFace::kMapper) {  // which knows no unit of a file
    named = replaced(named,
                     "they fit if the (?:events'|poses') times are in .*--time-unit\\)|"
                     "they fit if the (?:events'|poses') times are in \\S+: --time-unit \\S+",
                     python ? "they fit with another unit of time: is time_unit= right for both?"
                            : "they fit with another unit of time: are both in nanoseconds?");
  }
  named = replaced(named, "--set ([a-z_]+\\.[a-z_]+)=((?:[^\\s);,`]|,(?=[-0-9]))*)",
                   python ? "options={'$1': '$2'}" : "Options::set(\"$1\", \"$2\")");
  named = replaced(named, "--sensor-size (-?[0-9A-Z]+)x(-?[0-9A-Z]+)",
                   python ? "sensor_size=($1, $2)" : "Overrides::sensor_size={$1, $2}");
  if (!python) named = replaced(named, ", (one of an earlier \\w+), or --force", ", or $1");
  named = replaced(named, ", or --force(?: to replace it)?", python ? ", or force=True" : "");
  named = replaced(named, "stopped by a signal", "stopped");
  for (const OptionWords& row : kOptions) {
    const char* const word = row.words[(face == HostFace::kMapper ? 2U : 0U) + (python ? 1U : 0U)];
    const bool takes_value = std::string(word).back() == '=';
    const std::string option = std::string("--") + row.option;
    named =
        replaced(named, option + (takes_value ? " (?=[A-Z0-9\"'/]|[mun]?s\\b)" : " FILE\\b"), word);
    const bool is_member = takes_value && !python;
    named = replaced(named, option + "(?![a-z-])",
                     is_member ? std::string(word).substr(0, std::strlen(word) - 1) : word);
  }
  if (!python) return named;
  named = replaced(named, "--align ([a-z0-9]+)", "alignment='$1'");
  named = replaced(named, "--(align|config)\\b", "$1=");
  named = replaced(named, "event-fusion info", "Recording.info()");
  return replaced(named, "time_unit=([mun]?s)\\b", "time_unit='$1'");
}

std::vector<Warning> hostTexts(std::vector<Warning> warnings, HostFace face) {
  for (Warning& warning : warnings) warning.text = hostText(warning.text, face);
  return warnings;
}

}  // namespace efm
