// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <iosfwd>
#include <optional>
#include <string>

namespace efm {

/// Amount of a command's output.
enum class Verbosity {
  kQuiet,    ///< Warnings and errors.
  kNormal,   ///< Also progress and a summary.
  kVerbose,  ///< Also a line per keyframe.
};

/// Output of the progress.
struct ProgressOutput {
  std::ostream& stream;
  /// Returns the width of the terminal in characters; std::nullopt if the stream is no terminal.
  std::function<std::optional<int>()> columns;
  /// Returns seconds of real time since an arbitrary start.
  std::function<double()> clock;

  static ProgressOutput standardError();
};

/// The progress of a command:
///
///     mapping [=========            ]  43 %, 12 s left, 31 keyframes
///
/// A terminal has one line of its width, renewed five times a second and removed at the end.
/// Elsewhere, plain lines are printed after 10, 30, 70 and 130 seconds, then every minute.
class Progress {
 public:
  explicit Progress(std::string activity, Verbosity verbosity = Verbosity::kNormal,
                    ProgressOutput output = ProgressOutput::standardError());
  /// Removes the line.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Begins another activity without a known fraction. A terminal shows it at once.
  void begin(std::string activity);
  /// Returns whether a line is due.
  bool due() const;
  /// Shows a line if it is due.
  /// @param fraction of the work, 0 to 1.
  /// @param details text after the fraction; may be empty.
  void show(double fraction, const std::string& details = {});
  /// Returns the real time since the construction, or since `begin`.
  double seconds() const;
  /// Prints a line that stays, if verbosity is kVerbose.
  void print(const std::string& line);

 private:
  std::string text(double fraction, const std::string& details) const;
  std::string withBar(const std::string& text, double fraction, int columns) const;
  void replaceLine(const std::string& line);
  void removeLine();

  std::string activity_;
  Verbosity verbosity_;
  ProgressOutput output_;
  double start_s_;
  double next_s_;
  double plain_period_s_;
  bool shown_ = false;
};

}  // namespace efm
