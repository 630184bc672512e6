// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <variant>
#include <vector>

#include "mapping/events/event.h"

namespace efm {

/// Prophesee's encodings of events in little-endian words. EVT 2.0: words of 32 bits, one event
/// each. EVT 2.1: words of 64 bits, up to 32 events of a row each; the legacy order (IMX636) stores
/// the upper 32 bits first. EVT 3.0: words of 16 bits, each changes time, row or column. DAT: words
/// of 64 bits, one event each with its whole time.
enum class EvtEncoding { kEvt2, kEvt21, kEvt21Legacy, kEvt3, kDat };

/// The state of EVT 2.0 and 2.1 between two words.
struct Evt2State {
  std::uint64_t high = 0;  ///< The last TIME_HIGH without wraps, unit 64 µs.
  bool begun = false;      ///< True after the first TIME_HIGH.
  bool has_high = false;   ///< True from a TIME_HIGH to the next gap.
};

/// The state of EVT 3.0 between two words.
struct Evt3State {
  std::uint64_t high = 0;      ///< The last TIME_HIGH without wraps, unit 4096 µs.
  std::uint64_t low_time = 0;  ///< The time (µs) at the last TIME_LOW.
  std::uint64_t t_ns = 0;      ///< Time of the next event.
  std::uint16_t low = 0;       ///< The last TIME_LOW (µs).
  std::uint16_t y = 0;
  std::uint16_t x = 0;    ///< Value for the next vector.
  bool polarity = false;  ///< Value for the next vector.
  bool begun = false;     ///< True after the first TIME_HIGH.
  bool has_high = false;  ///< True from a TIME_HIGH to the next gap.
  bool has_low = false;
  bool has_y = false;
  std::uint64_t high_before_jump = 0;
  int words_of_jump = 0;  ///< TIME_HIGHs since a jump ahead; 0: no jump.
};

/// The state of DAT between two words.
struct DatState {
  std::uint64_t high = 0;  ///< Time of the last event without wraps, µs.
  bool begun = false;      ///< True after the first event.
  bool has_high = true;
};

/// Decodes a stream of EVT words. The stream may be divided anywhere, also within a word.
///
/// Times are those of the sensor's clock, which has its own zero, in ns and without wraps. The
/// encodings store the upper bits in TIME_HIGH words:
/// - EVT 2.0 and 2.1: 28 upper bits (unit 64 µs, wraps after 4.8 h), 6 lower bits with each event.
///   A TIME_HIGH is unwrapped to the value nearest to the last one, so the time may also step back.
/// - EVT 3.0: 12 upper bits (unit 4096 µs, wraps after 16.8 s), 12 lower bits in TIME_LOW. The two
///   words are registers: a TIME_HIGH keeps the lower bits, and a repeated TIME_HIGH changes
///   nothing. A TIME_HIGH that is 1 below the last one steps back and is valid from the next
///   TIME_LOW. Every other TIME_HIGH steps forward. So the wraps are right if no TIME_HIGH is
///   missing for 16.7 s. If TIME_LOW falls by more than half of its range, and TIME_HIGH has not
///   changed since the last TIME_LOW, then TIME_HIGH is late: the time goes on in the next 4096 µs.
///   The late TIME_HIGH then has the value that is already set, and does not step again.
///
/// - DAT: 32 bits (µs, wraps after 71 minutes) with each event, unwrapped as those of EVT 2.0.
///
/// Words of other types (triggers, vendor data) are skipped. Until time and row are known, events
/// are not delivered, but counted.
class EvtDecoder {
 public:
  explicit EvtDecoder(EvtEncoding encoding);

  /// Appends the events of the next bytes of the stream to `events`, in the order of the stream.
  void decode(const std::uint8_t* data, std::size_t size, std::vector<Event>& events);
  /// Skips the next bytes and follows only the TIME_HIGH words, which is several times faster. A
  /// later `decode` does not deliver, but counts, the events before the next TIME_LOW and row. Not
  /// for DAT.
  void scanTime(const std::uint8_t* data, std::size_t size);
  /// Reports that bytes are missing before the next call. The gap must be shorter than a wrap.
  void skipGap();
  /// Begins a new stream.
  void reset();

  /// The time of the last TIME_HIGH, with lower bits 0; 0 before the first TIME_HIGH.
  std::int64_t timeHighNs() const;
  /// Returns whether there was a TIME_HIGH.
  bool hasTime() const;
  /// The size of a word, 2, 4 or 8 bytes.
  std::size_t wordBytes() const;
  /// The number of bytes of an incomplete word at the end of the data.
  std::size_t incompleteBytes() const { return carried_; }
  /// The number of events that came before their time and row were known.
  std::uint64_t undatedEvents() const { return undated_events_; }

 private:
  template <typename Use>
  void takeCarried(std::size_t word_size, const std::uint8_t*& data, std::size_t& size,
                   const Use& use);
  void carry(const std::uint8_t* data, std::size_t size);

  EvtEncoding encoding_;
  std::variant<Evt2State, Evt3State, DatState> state_;
  std::array<std::uint8_t, 8> carry_{};  // the beginning of an incomplete word
  std::size_t carried_ = 0;
  std::uint64_t undated_events_ = 0;
  std::vector<Event> scratch_;  // buffer of decoded events
};

}  // namespace efm
