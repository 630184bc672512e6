// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "mapping/base/text.h"
#include "plugin/recordings/open/open_recording.h"

namespace efm {

/// What a host calls: names of the program's options in texts become those of its arguments.
enum class HostFace { kRecording, kMapper };

/// True in Python: texts name the package's arguments. Otherwise they name those of engine.h.
bool& hostIsPython();

/// Returns a text for a host: `--set map.voxel_size_m=0.1` becomes
/// `Options::set("map.voxel_size_m", "0.1")`, and `--poses` the argument or the call that it is.
std::string hostText(const std::string& text, HostFace face);
/// Returns warnings with such texts.
std::vector<Warning> hostTexts(std::vector<Warning> warnings, HostFace face);

struct Overrides;  // event_fusion/engine.h

/// Returns the recording of a program that gives files and overrides.
RecordingSource sourceOf(const std::vector<std::filesystem::path>& files,
                         const Overrides& overrides);

template <typename Error>
[[noreturn]] void rethrowForHost(const Error& error, HostFace face) {
  const std::string text = hostText(error.what(), face);
  if (text == error.what()) throw;  // it may be the host's own exception
  throw Error(text);
}

/// Calls a function; its errors have texts for a host.
template <typename Call>
auto forHost(HostFace face, const Call& call) {
  try {
    return call();
  } catch (const std::runtime_error& error) {
    rethrowForHost(std::runtime_error(error), face);
  } catch (const std::invalid_argument& error) {
    rethrowForHost(std::invalid_argument(error), face);
  } catch (const std::logic_error& error) {
    rethrowForHost(std::logic_error(error), face);
  }
}

}  // namespace efm
