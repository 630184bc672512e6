// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

namespace efm {

/// The HDF5 library crashes on some damaged files, or does not return from them. While a note
/// lives, this ends the process with exit status 1 and one sentence on stderr that names the file.
///
/// Only a program enables notes: a host of this library keeps its own handlers of signals. The note
/// belongs to the thread that made it: a crash of another thread is not blamed on the file, and
/// ends the process as it does without a note. One thread at a time makes notes, as it calls the
/// HDF5 library. A note within another one has no effect.
class Hdf5CrashNote {
 public:
  /// Enables the notes of this process.
  static void enable();

  /// @param limit_s real time after which a call does not return any more; 0: no limit.
  explicit Hdf5CrashNote(const std::filesystem::path& file, unsigned limit_s = 0);
  ~Hdf5CrashNote();
  Hdf5CrashNote(const Hdf5CrashNote&) = delete;
  Hdf5CrashNote& operator=(const Hdf5CrashNote&) = delete;

 private:
  bool active_;
};

}  // namespace efm
