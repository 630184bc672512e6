// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace efm {

/// The file that is replaced when one is written to `path`: the path itself, or where it leads as a
/// symbolic link. It need not exist.
/// @throws std::runtime_error naming `path` where it names no file or is there and is something
/// else, a folder or a device: replacing that would destroy it.
std::filesystem::path replaceableFile(const std::filesystem::path& path);

/// The name of a file while it is being written: beside it, with the same extension
/// ("map.partial.pcd" for "map.pcd").
std::filesystem::path temporaryName(const std::filesystem::path& path);

/// Writes a file under its temporary name and renames it once it is complete: whoever looks sees
/// the whole file, the one before, or none. Replaces `replaceableFile(path)`.
/// @param write creates the file at the path it is given.
/// @throws std::runtime_error naming `path` where it cannot be replaced, written or renamed; what
/// `write` throws becomes part of the message, and no temporary file stays.
void writeAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write);

/// All bytes of a file.
/// @throws std::runtime_error saying why it cannot be read (there is none, it is no regular file,
/// it ends before its end), without its name.
std::string readBytes(const std::filesystem::path& path);

}  // namespace efm
