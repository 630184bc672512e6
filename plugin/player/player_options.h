// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/config/CConfigFileBase.h>

#include <string>

#include "plugin/recordings/open/open_recording.h"

namespace efm {

/// What becomes of the times in the observations that are played.
enum class Restamp {
  kNone,  ///< They stay the recording's own.
  kNow,   ///< All are moved by one difference, so that the first packet begins now.
};

/// What CEventPlayer plays, and how.
struct PlayerOptions {
  RecordingSource source;
  std::string recording;  ///< As it was given, for messages.
  double speed = 1;       ///< Seconds of the recording per second, 0.001 to 1000.
  Restamp restamp = Restamp::kNone;
};

/// Reads the options from a sensor's section of a host's .ini; paths are relative to the file, or
/// to the working folder where the host hides it, as rawlog-grabber does. Checks MRPT's own keys,
/// too, which CGenericSensor reads as 0 where they are wrong.
PlayerOptions readPlayerOptions(const mrpt::config::CConfigFileBase& source,
                                const std::string& section);

}  // namespace efm
