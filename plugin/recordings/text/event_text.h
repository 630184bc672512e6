// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "plugin/recordings/files/file_content.h"
#include "plugin/recordings/streams/recording_parts.h"
#include "plugin/recordings/text/event_columns.h"

namespace efm {

/// Reads events from text, also compressed, with a line per event: t x y p, or other columns
/// (`findEventColumns`). Times are exact, pixels may be written as 96.0, polarities as in
/// `polarityOf`. Blank lines, text after a `#`, repeated blanks, tabs, CRLF and a byte order mark
/// are ignored.
class EventTextStream : public EventStream {
 public:
  /// @param cameras the texts in the camera's column; empty: takes the lines of all cameras.
  /// @param camera takes the lines of this one of `cameras`. The first one has the bad lines, too.
  explicit EventTextStream(std::filesystem::path file, const ReaderOptions& options = {},
                           std::vector<std::string> cameras = {}, std::size_t camera = 0);

  bool decode(std::vector<Event>& events) override;
  void skipBadEvents(BadEvents& bad) override { bad_ = &bad; }
  /// Finds the time by bisection, to 64 KiB. A compressed file stays at its beginning.
  void seek(std::int64_t t_ns) override;
  std::string positionOf(std::size_t index) const override;
  std::string name() const override { return content_.file().string(); }
  double progress() const override { return started_ ? content_.progress() : 0; }
  /// The size in a first line `width height`, or of `setSize`.
  std::optional<CameraSize> size() const override { return columns_.size; }
  std::vector<Warning> warnings() const override { return columns_.warnings; }
  void setSize(const CameraSize& size) { columns_.size = size; }
  std::string label() const override {
    return cameras_.empty() ? "" : "camera " + cameras_[camera_];
  }
  std::string commandInOrder() const override;
  /// A command that takes the events of this stream's camera out of the file, for errors.
  std::string commandOfCamera() const;
  const EventColumns& columns() const { return columns_; }

 private:
  void takeLines(const char* begin, const char* end, std::vector<Event>& events);
  void takeLine(std::string_view line, bool unterminated, std::vector<Event>& events);
  const char* parsePlainLine(const char* text, Event& event, bool& of_camera) const;
  std::optional<Event> parseLine(std::string_view line, bool unterminated) const;
  std::optional<std::pair<std::uint64_t, std::int64_t>> firstEventAfter(std::uint64_t byte);
  std::string place(std::uint64_t line) const;

  bool isOfCamera(std::string_view camera) const {
    return cameras_.empty() || camera == cameras_[camera_];
  }
  /// Returns whether a line of another camera is left to the stream of that camera.
  bool isLeft(std::string_view camera) const {
    return camera_ > 0 || std::find(cameras_.begin(), cameras_.end(), camera) != cameras_.end();
  }

  FileContent content_;
  std::vector<std::string> cameras_;
  std::size_t camera_ = 0;  // index in cameras_
  EventColumns columns_;
  BadEvents* bad_ = nullptr;
  bool usual_ = true;  // columns_.isUsual()
  bool started_ = false;
  bool ended_ = false;

  std::vector<char> block_;       // text
  std::size_t carried_ = 0;       // bytes of an incomplete line at block_'s beginning
  std::uint64_t first_byte_ = 0;  // position of line 1
  std::uint64_t line_ = 0;        // number of the current line
  /// The index and line of each event of the last block that is not on the line after the event
  /// before it.
  std::vector<std::pair<std::size_t, std::uint64_t>> lines_;
};

/// Returns whether a file, also a compressed one, has lines of events in the columns that the
/// option names. Never throws.
bool looksLikeEventText(const std::filesystem::path& file, const ReaderOptions& options = {});

/// Returns the complete lines at the beginning of a text, also of a compressed one.
std::string beginningOfText(const std::filesystem::path& file);

/// Opens a text file: one camera, or a camera for each value of a column with the camera, in the
/// natural order of these values.
std::vector<std::unique_ptr<EventTextStream>> openEventText(const std::filesystem::path& file,
                                                            const ReaderOptions& options);

/// Opens text files one after the other.
RecordingParts openEventText(const std::vector<std::filesystem::path>& files,
                             const ReaderOptions& options);

/// Returns the file of events in a folder: the first existing one of events.txt, .csv, .txt.gz,
/// .csv.gz and .zip, else events.txt.
std::filesystem::path eventFileIn(const std::filesystem::path& folder);

}  // namespace efm
