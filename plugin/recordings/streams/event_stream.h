// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mapping/base/text.h"
#include "mapping/events/event.h"
#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/streams/bad_events.h"

namespace efm {

/// The events of one camera as a file stores them, read block by block. `EventPackets` checks and
/// sorts them: a stream only decodes.
class EventStream {
 public:
  virtual ~EventStream() = default;

  /// Replaces `events` by the next events, in the order of the file. Memory is that of a block:
  /// some ten or hundred thousand events, whatever the size of the file.
  /// @return false at the end; `events` is empty then.
  /// @throws std::runtime_error at damaged data, naming file, position, value and what was
  /// expected. `events` has the events before it. The stream is not read again.
  virtual bool read(std::vector<Event>& events) = 0;

  /// From now on a damaged event is given to `bad`, and left out, where the rest of the data can be
  /// read without it. Others do as before. `bad` outlives the stream.
  virtual void skipBadEvents(BadEvents& bad) { static_cast<void>(bad); }

  /// Continues near a time: the next block may begin with any event, but none of this time or later
  /// is left out. Called before `read`. Without an index, a stream stays at its beginning.
  virtual void seek(std::int64_t t_ns) { static_cast<void>(t_ns); }

  /// The position of an event of the last block, for errors: "cam0/events.txt:17".
  virtual std::string positionOf(std::size_t index) const = 0;
  /// The name of the file, for errors.
  virtual std::string name() const = 0;
  /// The fraction of the stream that has been read, 0 to 1.
  virtual double progress() const = 0;
  /// The sensor's pixels, if the file knows them.
  virtual std::optional<CameraSize> size() const { return std::nullopt; }
  /// The gaps in the numbers of the file's packets: how many are missing, as far as known.
  virtual std::uint64_t lostPackets() const { return 0; }
  /// Events that were left out because their time or row is not known: those before the sensor's
  /// first words of time, and those after a gap. Not those before the time of `seek`.
  virtual std::uint64_t undatedEvents() const { return 0; }
  /// What the reader concluded from the values, where the file does not say it: `time-unit`,
  /// `event-columns`.
  virtual std::vector<Warning> warnings() const { return {}; }
};

}  // namespace efm
