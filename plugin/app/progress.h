// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <string>

namespace efm {

/// One line on stderr that says how far a command is: on a terminal only, a few times a second.
class Progress {
 public:
  Progress();
  /// Takes the line away.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Whether a line would be shown now.
  bool due() const;
  void show(const std::string& line);
  /// "doing: 42 %", where a line is due. @param share 0 to 1.
  void showShare(const std::string& doing, double share);

 private:
  bool terminal_;
  bool shown_ = false;
  std::chrono::steady_clock::time_point next_;
};

}  // namespace efm
