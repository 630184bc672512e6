// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

namespace efm {

/// The HDF5 library crashes on some damaged files, or never returns. While a note exists, both
/// cases end the process with exit status 1 and a sentence on stderr that names the file.
///
/// Only a program enables notes: a host of this library keeps its own signal handlers. A note
/// belongs to the thread that made it. A crash of another thread is not blamed on the file, and
/// ends the process as without a note. Only one thread at a time makes notes, as for calls of the
/// HDF5 library. A note inside another note has no effect.
class Hdf5CrashNote {
 public:
  /// Enables the notes of this process.
  static void enable();

  /// @param limit_s real time in seconds after which a call counts as endless; 0: no limit.
  explicit Hdf5CrashNote(const std::filesystem::path& file, unsigned limit_s = 0);
  ~Hdf5CrashNote();
  Hdf5CrashNote(const Hdf5CrashNote&) = delete;
  Hdf5CrashNote& operator=(const Hdf5CrashNote&) = delete;

 private:
  bool active_;
};

}  // namespace efm
