// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/recording_interval.h"

#include <fmt/format.h>

#include <iostream>
#include <utility>

#include "plugin/recordings/time_cut.h"

namespace efm {

std::unique_ptr<Recording> openInterval(RecordingSource source, std::optional<std::int64_t> t0_ns,
                                        std::optional<std::int64_t> t1_ns) {
  source.start_ns = t0_ns;
  source.end_ns = t1_ns;
  return cutTime(openRecording(source), t0_ns, t1_ns);
}

std::optional<std::string> lostPacketsWarning(const RecordingCounts& counts) {
  if (counts.lost_packets == 0) return std::nullopt;
  return fmt::format("the recording lacks {} packets of events: their numbers have gaps",
                     counts.lost_packets);
}

void warnOfLostPackets(const RecordingCounts& counts) {
  if (const auto text = lostPacketsWarning(counts)) {
    std::cerr << "event-fusion: warning: " << *text << "\n";
  }
}

}  // namespace efm
