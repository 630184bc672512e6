// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace efm {

/// The HDF5 library crashes on some damaged files, or does not return from them. So the program
/// starts itself a second time, for the beginning of each HDF5 file of its command line, before it
/// reads them. That is the program's own: a library cannot start its host again, and a copy of a
/// process with threads (`fork`) may stop at a lock.

/// The command line of the second program is this and a file or folder.
inline constexpr std::string_view kHdf5Trial = "--try-hdf5";

/// Reads the beginning of a file or folder. Errors are left to the first program.
/// @return the exit status: 0.
int runHdf5Trial(const std::string& source);

/// Starts the second program for each argument that is an HDF5 file, or a folder with one.
/// @throws std::runtime_error naming the argument on which it crashes, or takes over a minute.
void tryHdf5(const std::vector<std::string>& arguments);

/// Runs a program without input and output.
/// @param command its file and its arguments.
/// @return how it failed: "crashes", "does not end within 60 s"; nothing if it ended with status
/// 0, or cannot be started.
std::optional<std::string> failureOf(const std::vector<std::string>& command,
                                     std::chrono::milliseconds limit);

}  // namespace efm
