// SPDX-License-Identifier: BSD-3-Clause
// What the program loads of this library: see mrpt_library.h.
#include "plugin/mrpt/CEventFusionMap.h"
#include "plugin/mrpt/rawlog.h"
#include "plugin/mrpt/window/map_scene.h"
#include "plugin/recordings/open/mrpt_library.h"

namespace efm {
namespace {

std::unique_ptr<MapWatcher> recordFrames(const std::filesystem::path& folder, bool force) {
  return std::make_unique<MapFrames>(folder, force);
}

}  // namespace
}  // namespace efm

extern "C" const efm::MrptLibrary efmMrptLibrary = {efm::openRawlog, efm::writeRawlog,
                                                    efm::writeSimpleMap, efm::recordFrames};
