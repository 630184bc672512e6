// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <string>

namespace efm {

/// One line on stderr with the progress of a command: on a terminal only, five times a second.
class Progress {
 public:
  Progress();
  /// Removes the line.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Whether it is time for a new line.
  bool due() const;
  void show(const std::string& line);
  /// Shows "activity: 42 %" if a line is due. @param fraction 0 to 1.
  void showFraction(const std::string& activity, double fraction);

 private:
  bool terminal_;
  bool shown_ = false;
  std::chrono::steady_clock::time_point next_;
};

}  // namespace efm
