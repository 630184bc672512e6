// SPDX-License-Identifier: BSD-3-Clause
// Decodes any bytes as the events of a rawlog's observation. The first two bytes say how many
// events the observation claims. Decoded events are the same after they are encoded again.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <vector>

#include "plugin/mrpt/event_encoding.h"

namespace {

bool areSame(const std::vector<efm::Event>& a, const std::vector<efm::Event>& b) {
  bool same = a.size() == b.size();
  for (std::size_t i = 0; same && i < a.size(); ++i) {
    same = a[i].t_ns == b[i].t_ns && a[i].x == b[i].x && a[i].y == b[i].y &&
           a[i].polarity == b[i].polarity;
  }
  return same;
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kHeaderBytes = 2;
  if (size < kHeaderBytes) return 0;
  const std::size_t count = data[0] + data[1] * std::size_t{256};
  std::vector<efm::Event> events;
  try {
    events = efm::decodeEvents({data + kHeaderBytes, data + size}, count);
  } catch (const std::runtime_error&) {
    return 0;
  }
  if (events.size() != count) std::abort();
  for (const auto compression : {efm::EventCompression::kNone, efm::EventCompression::kZstd}) {
    const auto bytes = efm::encodeEvents(events, compression);
    if (!areSame(efm::decodeEvents(bytes, count), events)) std::abort();
  }
  return 0;
}
