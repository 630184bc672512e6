// SPDX-License-Identifier: BSD-3-Clause
#include "maps/io/atomic_file.h"

#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>

namespace efm {
namespace {

/// The path itself, or the file at the end of its symbolic links.
std::filesystem::path replaceableFile(const std::filesystem::path& path) {
  constexpr int kMaxLinks = 40;  // as Linux has it
  const auto refuse = [&](const std::string& why) {
    return std::runtime_error("cannot write '" + path.string() + "': " + why);
  };
  if (path.empty()) throw refuse("expected the name of a file");
  std::error_code error;
  std::filesystem::path file = path;
  for (int links = 0; std::filesystem::is_symlink(file, error); ++links) {
    if (links == kMaxLinks) throw refuse("too many symbolic links");
    file = file.parent_path() / std::filesystem::read_symlink(file, error);
    if (error) throw refuse(error.message());
  }
  const std::filesystem::file_status status = std::filesystem::status(file, error);
  if (std::filesystem::is_directory(status) || !file.has_filename()) throw refuse("it is a folder");
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    throw refuse("it is there and not a regular file");
  }
  return file;
}

}  // namespace

std::string reasonNotWritten(int error_number) {
  switch (error_number) {
    case ENOSPC:
      return "the disk is full";
    case EDQUOT:
      return "the disk quota is used up";
    case EFBIG:
      return "the file would be larger than the system allows (ulimit -f)";
    default:
      return "";
  }
}

AtomicFile::AtomicFile(const std::filesystem::path& path)
    : path_(replaceableFile(path)), temporary_(temporaryOf(path_)) {}

std::filesystem::path AtomicFile::temporaryOf(const std::filesystem::path& path) {
  std::filesystem::path temporary = path;
  temporary.replace_filename(path.stem().string() + ".partial" + path.extension().string());
  return temporary;
}

AtomicFile::~AtomicFile() {
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void writeAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write) {
  const AtomicFile file(path);
  errno = 0;
  try {
    write(file.temporary());
    file.replace();
  } catch (const std::exception& error) {
    const std::string why = reasonNotWritten(errno);
    throw std::runtime_error("cannot write " + path.string() + ": " +
                             (why.empty() ? error.what() : why));
  }
}

std::string readBytes(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path)) throw std::runtime_error("there is no such file");
  if (!std::filesystem::is_regular_file(path)) throw std::runtime_error("it is not a regular file");
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const auto end = file.tellg();
  if (!file || end < 0) throw std::runtime_error("the file cannot be opened");
  std::string bytes(static_cast<std::size_t>(end), '\0');
  file.seekg(0);
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file) throw std::runtime_error("the file cannot be read to its end");
  return bytes;
}

}  // namespace efm
