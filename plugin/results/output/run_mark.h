// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace efm {

/// A run that has begun to write a folder and has no report.json yet.
struct UnfinishedRun {
  std::vector<std::string> recording;  ///< Its files.
  pid_t process = 0;
};

/// The mark of an unfinished run in its folder: the file report.partial.json, with the content of
/// UnfinishedRun. The run holds a lock on it, which ends with the process: so a run that was killed
/// differs from one that is at work.
class RunMark {
 public:
  static constexpr const char* kName = "report.partial.json";

  /// Makes the mark of this process, instead of that of a killed one.
  /// @throws std::runtime_error naming the folder where another run is at work in it, or the mark
  /// cannot be made.
  RunMark(const std::filesystem::path& folder, const std::vector<std::string>& recording);
  /// Leaves the mark.
  ~RunMark();
  RunMark(const RunMark&) = delete;
  RunMark& operator=(const RunMark&) = delete;

  /// The mark of a killed run, if the folder has one.
  /// @throws std::runtime_error naming the folder where another run is at work in it.
  static std::optional<UnfinishedRun> ofKilledRun(const std::filesystem::path& folder);

 private:
  int file_ = -1;
};

}  // namespace efm
