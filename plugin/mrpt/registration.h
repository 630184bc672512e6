// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace efm {

/// Registers the project's MRPT classes, so that MRPT reads them from rawlogs and makes them by
/// name. Loading the library also registers them. A program that links the library calls this
/// function once, so that the linker keeps the library. Further calls have no effect.
void registerClasses();

}  // namespace efm
