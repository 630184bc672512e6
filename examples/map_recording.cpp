// SPDX-License-Identifier: BSD-3-Clause
// A recording in, map.pcd out: map_recording RECORDING…
#include <event_fusion/engine.h>

int main(int argc, char** argv) {
  const auto recording = efm::openRecording({argv + 1, argv + argc});
  efm::Mapper mapper;
  while (auto sample = recording->next()) mapper.add(std::move(*sample));
  mapper.finish();
  efm::writePcd("map.pcd", *mapper.points());
}
