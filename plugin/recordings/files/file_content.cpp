// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/files/file_content.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#ifdef EFM_WITH_ARCHIVES
#include <archive.h>
#include <archive_entry.h>
#endif

namespace efm {
namespace {

#ifdef EFM_WITH_ARCHIVES
constexpr std::size_t kArchiveBlockBytes = std::size_t{1} << 18;

std::string messageOf(archive* opened) {
  const char* const text = archive_error_string(opened);
  return text != nullptr ? text : "it is damaged";
}

/// Advances to the next file in the archive and returns its name; null at the archive's end.
const char* nextMember(archive* opened, const std::filesystem::path& file) {
  for (;;) {
    archive_entry* entry = nullptr;
    const int result = archive_read_next_header(opened, &entry);
    if (result == ARCHIVE_EOF) return nullptr;
    if (result != ARCHIVE_OK && result != ARCHIVE_WARN) {
      throw std::runtime_error(
          fmt::format("{}: cannot be unpacked: {}", file.string(), messageOf(opened)));
    }
    if (archive_entry_filetype(entry) == AE_IFDIR) continue;
    const char* const name = archive_entry_pathname(entry);
    return name != nullptr ? name : "";
  }
}

archive* openArchive(const std::filesystem::path& file) {
  archive* const opened = archive_read_new();
  if (opened == nullptr) throw std::bad_alloc();
  archive_read_support_filter_all(opened);
  archive_read_support_format_zip(opened);
  archive_read_support_format_raw(opened);
  if (archive_read_open_filename(opened, file.c_str(), kArchiveBlockBytes) == ARCHIVE_OK) {
    return opened;
  }
  const std::string message = messageOf(opened);
  archive_read_free(opened);
  throw std::runtime_error(fmt::format("{}: cannot be unpacked: {}", file.string(), message));
}
#else
[[noreturn]] archive* openArchive(const std::filesystem::path& file) {
  throw std::runtime_error(file.string() +
                           ": this build does not read compressed files (EFM_READ_ARCHIVES)");
}
#endif

}  // namespace

bool isCompressed(const std::filesystem::path& file) {
  using namespace std::string_view_literals;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return false;
  std::ifstream stream(file, std::ios::binary);
  std::array<char, 6> bytes{};
  stream.read(bytes.data(), bytes.size());
  const std::string_view start(bytes.data(), static_cast<std::size_t>(stream.gcount()));
  for (const std::string_view magic : {"\x1f\x8b"sv, "BZh"sv,
                                       "\xfd"
                                       "7zXZ\0"sv,
                                       "\x28\xb5\x2f\xfd"sv, "PK\x03\x04"sv, "PK\x05\x06"sv}) {
    if (start.substr(0, magic.size()) == magic) return true;
  }
  return false;
}

FileContent::FileContent(std::filesystem::path file, [[maybe_unused]] const std::string& member)
    : file_(std::move(file)) {
  std::error_code error;
  if (isCompressed(file_)) {
    archive_.reset(openArchive(file_));
#ifdef EFM_WITH_ARCHIVES
    const char* name = nextMember(archive_.get(), file_);
    while (name != nullptr && !member.empty() && member != name) {
      name = nextMember(archive_.get(), file_);
    }
    const int format = archive_format(archive_.get()) & ARCHIVE_FORMAT_BASE_MASK;
    const bool zip = format == ARCHIVE_FORMAT_ZIP;
    if (!zip && archive_filter_count(archive_.get()) < 2) throw failure("cannot be unpacked");
    if (name == nullptr) {
      throw failure(member.empty() ? "it is empty: expected a file in it"
                                   : fmt::format("expected {} in it", member));
    }
    if (zip && member.empty() && membersOf(file_).size() > 1) {
      throw failure("several files in it: expected one");
    }
    member_ = member;
#endif
  } else {
    plain_.open(file_, std::ios::binary);
    if (!plain_ || std::filesystem::is_directory(file_, error)) {
      throw failure("cannot be opened for reading");
    }
  }
  bytes_ = std::filesystem::file_size(file_, error);
  if (error) bytes_ = 0;  // a pipe
}

void FileContent::CloseArchive::operator()([[maybe_unused]] archive* opened) const {
#ifdef EFM_WITH_ARCHIVES
  archive_read_free(opened);
#endif
}

std::size_t FileContent::read(char* to, std::size_t count) {
  if (!archive_) {
    plain_.read(to, static_cast<std::streamsize>(count));
    if (plain_.bad()) throw failure("cannot be read to its end");
    const auto got = static_cast<std::size_t>(plain_.gcount());
    position_ += got;
    return got;
  }
  std::size_t got = 0;
#ifdef EFM_WITH_ARCHIVES
  while (got < count) {
    const la_ssize_t part = archive_read_data(archive_.get(), to + got, count - got);
    if (part == 0) break;
    if (part == ARCHIVE_RETRY) continue;
    if (part < 0) throw failure("cannot be unpacked to its end: " + messageOf(archive_.get()));
    got += static_cast<std::size_t>(part);
  }
#endif
  return got;
}

std::string FileContent::readAll(std::size_t max_bytes) {
  constexpr std::size_t kStep = std::size_t{1} << 20;
  std::string content;
  for (;;) {
    const std::size_t size = content.size();
    content.resize(size + kStep);
    content.resize(size + read(content.data() + size, kStep));
    if (content.size() > max_bytes) {
      throw failure(fmt::format("expected at most {} MB", max_bytes / 1'000'000));
    }
    if (content.size() < size + kStep) return content;
  }
}

void FileContent::seek(std::uint64_t byte) {
  plain_.clear();
  plain_.seekg(static_cast<std::streamoff>(byte));
  position_ = byte;
}

double FileContent::progress() const {
  if (bytes_ == 0) return 0;
  std::uint64_t read = position_;
#ifdef EFM_WITH_ARCHIVES
  if (archive_) read = static_cast<std::uint64_t>(archive_filter_bytes(archive_.get(), -1));
#endif
  return std::min(1.0, static_cast<double>(read) / static_cast<double>(bytes_));
}

std::runtime_error FileContent::failure(const std::string& what) const {
  return std::runtime_error(
      fmt::format("{}{}{}: {}", file_.string(), member_.empty() ? "" : "/", member_, what));
}

std::string firstContentOf(const std::filesystem::path& file, std::size_t count,
                           const std::string& member) {
  FileContent content(file, member);
  std::string bytes(count, '\0');
  bytes.resize(content.read(bytes.data(), count));
  return bytes;
}

std::vector<std::string> membersOf(const std::filesystem::path& file) {
  std::vector<std::string> names;
#ifdef EFM_WITH_ARCHIVES
  const std::unique_ptr<archive, void (*)(archive*)> opened(
      openArchive(file), [](archive* a) { archive_read_free(a); });
  while (const char* const name = nextMember(opened.get(), file)) names.emplace_back(name);
#else
  openArchive(file);
#endif
  return names;
}

}  // namespace efm
