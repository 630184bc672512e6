// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <iosfwd>
#include <optional>
#include <string>

namespace efm {

/// How much a command says.
enum class Verbosity {
  kQuiet,    ///< Warnings and errors.
  kNormal,   ///< Progress and a summary, too.
  kVerbose,  ///< A line per keyframe, too.
};

/// Where progress is shown.
struct ProgressOutput {
  std::ostream& stream;
  /// The width of the terminal in characters; nothing if the stream is no terminal.
  std::function<std::optional<int>()> columns;
  /// Seconds of real time since any start.
  std::function<double()> clock;

  static ProgressOutput standardError();
};

/// The progress of a command:
///
///     mapping [=========            ]  43 %, 12 s left, 31 keyframes
///
/// On a terminal one line as wide as the terminal, five times a second; it is removed at the end.
/// Elsewhere a plain line after 10, 30, 70 and 130 seconds, and then every minute.
class Progress {
 public:
  explicit Progress(std::string activity, Verbosity verbosity = Verbosity::kNormal,
                    ProgressOutput output = ProgressOutput::standardError());
  /// Removes the line.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Begins another activity, whose fraction is not known. On a terminal it is shown at once.
  void begin(std::string activity);
  /// Whether it is time for a line.
  bool due() const;
  /// Shows a line if it is due.
  /// @param fraction of the work, 0 to 1.
  /// @param details follow the fraction; may be empty.
  void show(double fraction, const std::string& details = {});
  /// Real time since the construction, or since `begin`.
  double seconds() const;
  /// With Verbosity::kVerbose, prints a line that stays.
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
