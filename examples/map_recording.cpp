// SPDX-License-Identifier: BSD-3-Clause
// A recording in, a folder with map.pcd out: map_recording OUT RECORDING…
#include <event_fusion/engine.h>

#include <iostream>
#include <stdexcept>

int main(int argc, char** argv) try {
  if (argc < 3) throw std::runtime_error("usage: map_recording OUT RECORDING...");
  const efm::Report report = efm::mapRecording({argv + 2, argv + argc}, argv[1]);
  for (const efm::Warning& warning : report.warnings) std::cerr << warning.text << '\n';
  std::cout << report.points << " points in " << argv[1] << "/map.pcd\n";
} catch (const std::exception& error) {
  std::cerr << "error: " << error.what() << '\n';
  return 1;
}
