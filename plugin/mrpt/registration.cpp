// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/registration.h"

#include <mrpt/rtti/CObject.h>

#include "plugin/mrpt/CEventFusionMap.h"
#include "plugin/mrpt/CEventFusionMapBuilder.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/rawlog.h"
#include "plugin/mrpt/window/map_scene.h"
#include "plugin/recordings/open/mrpt_library.h"

namespace efm {

void registerClasses() {
  // One line per class.
  for (const mrpt::rtti::TRuntimeClassId* id : {
           CLASS_ID(CObservationEvents),
           CLASS_ID(CEventFusionMap),
           CLASS_ID(CEventFusionMapBuilder),
       }) {
    if (!mrpt::rtti::findRegisteredClass(id->className, false)) mrpt::rtti::registerClass(id);
  }
}

namespace {

/// Registers at load. Class ids are constants, so the order of static initialisation has no effect.
const struct AtLoad {
  AtLoad() { registerClasses(); }
} kAtLoad;

}  // namespace
}  // namespace efm

/// The functions that the program loads from this library.
extern "C" const efm::MrptLibrary efmMrptLibrary = {efm::openRawlog, efm::writeRawlog,
                                                    efm::recordFrames, efm::readSimpleMap};
