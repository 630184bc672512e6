// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace efm {

/// Makes the project's MRPT classes known, so that they can be read from rawlogs and made by name.
/// Loading the library does it too; a program that is linked to it calls this once, so that the
/// linker does not leave the library out. May be called again.
void registerClasses();

}  // namespace efm
