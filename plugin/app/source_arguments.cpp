// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/source_arguments.h"

#include <CLI/CLI.hpp>
#include <stdexcept>
#include <vector>

#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/app/argument_checks.h"
#include "plugin/options/tracker_fault_keys.h"
#include "plugin/recordings/streams/time_unit.h"

namespace efm {
namespace {

void setFaults(const std::vector<std::string>& assignments, TrackerFaults& faults) {
  try {
    for (const std::string& assignment : assignments) setTrackerFault(assignment, faults);
  } catch (const std::invalid_argument& error) {
    throw CLI::ValidationError("--perturb", error.what());
  }
}

}  // namespace

void addSource(CLI::App& command, RecordingSource& source) {
  command
      .add_option("SOURCE", source.files,
                  "The recording: a rawlog, a folder, or the files of one recording (text, HDF5, "
                  "ROS bags, MCAP, Prophesee RAW, AEDAT4, NumPy): see docs/recordings.md")
      ->required();
  command.add_option("--format", source.format, "The format of the recording (auto: detected)")
      ->check(oneOf(recordingFormats()))
      ->capture_default_str();
  command
      .add_option(
          "--poses", source.poses,
          "Poses that replace the recording's, of the rig in the world: text (t tx ty tz qx qy qz "
          "qw, or columns with a header), NumPy arrays, or a recording with poses")
      ->type_name("FILE");
  command
      .add_option("--calibration", source.calibration,
                  std::string("Calibration that replaces the recording's: ") + kCalibrationFiles)
      ->type_name("FILE");
  command
      .add_option("--hand-eye", source.hand_eye,
                  "Pose of the rig on the tracked body; the poses are then those of the body: YAML "
                  "with T_body_rig, 4x4; a Kalibr camera chain with T_cam_imu; with --calibration, "
                  "DSEC's cam_to_lidar.yaml or TUM-VIE's mocap-imu-calibration*.json")
      ->type_name("FILE");
  command
      .add_option("--topics", source.reader.topics,
                  "Topics of a bag, or streams of a file, to read: events, one for each camera, "
                  "and poses (default: found by their type)")
      ->type_name("TOPIC[,TOPIC...]")
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      .add_option(
          "--event-columns", source.reader.columns,
          "The columns of text events and N x 4 arrays: t, x, y, p, and - for one to ignore, e.g. "
          "\"x y p t\" (default: those of the header, else t x y p); or the names of arrays, "
          "fields "
          "or data sets in NumPy and HDF5: \"t=NAME x=NAME y=NAME p=NAME\"")
      ->type_name("COLUMNS");
  command
      .add_option("--time-unit", source.reader.time_unit,
                  "The unit of times in text events, NumPy arrays and real times of HDF5 (default: "
                  "found, else s)")
      ->check(oneOf({"s", "ms", "us", "ns"}));
  command
      .add_option_function<std::string>(
          "--sensor-size",
          [&source](const std::string& text) {
            source.reader.sensor_size = cameraSizeOf(text);
            if (!source.reader.sensor_size) {
              throw CLI::ValidationError("--sensor-size",
                                         inQuotes(text) + ": expected columns x rows, as 346x260");
            }
          },
          "The pixels of the sensors, where neither the recording nor the calibration says them")
      ->type_name("WIDTHxHEIGHT");
  command
      .add_option("--skip-bad-events", source.skip_bad_events,
                  "Leave out up to N bad events of the recording: lines that are none (text), "
                  "pixels outside the sensor, times over 10 ms late (default 0: an error)")
      ->type_name("N")
      ->check(zeroOrMore());
  command
      .add_option_function<std::vector<std::string>>(
          "--perturb",
          [&source](const std::vector<std::string>& assignments) {
            setFaults(assignments, source.faults);
          },
          "Simulated faults of the tracker: " + knownTrackerFaults() + "; may be repeated")
      ->type_name("KEY=VALUE[,KEY=VALUE...]")
      ->delimiter(',')
      ->allow_extra_args(false);
}

CLI::Option* addTime(CLI::App& command, const std::string& name, std::optional<TimeArgument>& time,
                     const std::string& help) {
  return command
      .add_option_function<std::string>(
          name,
          [&time, name](const std::string& text) {
            const bool from_start = text[0] == '+';
            time =
                TimeArgument{nanosecondsOf(from_start ? text.substr(1) : text, name), from_start};
          },
          help + "; +S: S seconds after the first event")
      ->type_name("[+]SECONDS");
}

CLI::Option* addTimeLimits(CLI::App& command, TimeArguments& times) {
  CLI::Option* const t0 = addTime(command, "--t0", times.t0, "Leave out events before this time");
  CLI::Option* const t1 = addTime(command, "--t1", times.t1, "Leave out events from this time on");
  command
      .add_option_function<std::string>(
          "--duration",
          [&times](const std::string& text) {
            const std::int64_t duration_ns = nanosecondsOf(text, "--duration");
            if (duration_ns <= 0) {
              throw CLI::ValidationError("--duration",
                                         inQuotes(text) + ": expected a time above 0");
            }
            times.duration_ns = duration_ns;
          },
          "Instead of --t1: the time from --t0, or from the first event")
      ->type_name("SECONDS")
      ->excludes(t1);
  return t0;
}

void addStrict(CLI::App& command, bool& strict) {
  command.add_flag("--strict", strict,
                   "A warning is an error: exit status 1, after the results are written");
}

std::int64_t nanosecondsOf(const std::string& text, const std::string& name) {
  const std::optional<std::int64_t> parsed = parseSeconds(text);
  if (!parsed) {
    throw CLI::ValidationError(name, inQuotes(text) + ": expected a time in seconds");
  }
  if (*parsed >= kEndOfTimeNs || *parsed <= -kEndOfTimeNs) {
    throw CLI::ValidationError(name, inQuotes(text) + ": expected a time within 4.6e9 s of 0");
  }
  return *parsed;
}

void requireKeyframeLengthOf(const TrackerFaults& faults) {
  try {
    requireKeyframeLength(faults);
  } catch (const std::invalid_argument& error) {
    throw CLI::ValidationError("--perturb", error.what());
  }
}

}  // namespace efm
