// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/hdf5_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <system_error>

#include "mapping/base/atomic_file.h"

namespace efm {
namespace {

/// Texts of files are short: names of models and sizes.
constexpr std::size_t kMaxTextBytes = 4096;

herr_t keepCause(unsigned position, const H5E_error2_t* error, void* cause) {
  if (position == 0 && error->desc != nullptr) *static_cast<std::string*>(cause) = error->desc;
  return 0;
}

/// The text that `read` gives for a type in memory; nothing if it is not a text of one line.
template <typename Read>
std::optional<std::string> readText(hid_t type, hid_t space, const Read& read) {
  if (H5Tget_class(type) != H5T_STRING || H5Sget_simple_extent_npoints(space) != 1) {
    return std::nullopt;
  }
  if (H5Tis_variable_str(type) > 0) {
    char* text = nullptr;
    if (read(type, &text) < 0 || text == nullptr) return std::nullopt;
    std::string copy(text, strnlen(text, kMaxTextBytes));
    H5free_memory(text);
    return copy;
  }
  const std::size_t bytes = H5Tget_size(type);
  if (bytes > kMaxTextBytes) return std::nullopt;
  std::string text(bytes, '\0');
  if (read(type, text.data()) < 0) return std::nullopt;
  text.resize(std::min(text.size(), text.find_last_not_of(std::string_view("\0 ", 2)) + 1));
  return text;
}

}  // namespace

std::string hdf5Cause() {
  std::string cause;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keepCause, &cause);
  constexpr std::string_view kErrno = "errno = ";
  const std::size_t number = cause.find(kErrno);
  if (number != std::string::npos) {
    const std::string why = reasonNotWritten(std::atoi(cause.c_str() + number + kErrno.size()));
    if (!why.empty()) return " (" + why + ")";
  }
  return cause.empty() ? cause : " (" + cause + ")";
}

Hdf5File::Hdf5File(std::filesystem::path file) : path_(std::move(file)) {
  const Hdf5Quiet quiet;
  std::error_code error;
  bytes_ = std::filesystem::file_size(path_, error);
  if (error) throw std::runtime_error(path_.string() + ": cannot be opened for reading");
  const Hdf5Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  // File systems of networks may have no locks, and a file that is only read needs none.
  H5Pset_file_locking(access.get(), false, true);
  id_ = Hdf5Id(H5Fopen(path_.c_str(), H5F_ACC_RDONLY, access.get()), H5Fclose);
  if (!id_.valid()) {
    throw std::runtime_error(
        fmt::format("{}: cannot be opened as HDF5{}: expected a complete HDF5 file", path_.string(),
                    hdf5Cause()));
  }
}

bool Hdf5File::has(const std::string& path) const {
  const Hdf5Quiet quiet;
  return H5Oexists_by_name(id(), path.c_str(), H5P_DEFAULT) > 0;
}

Hdf5Id Hdf5File::dataset(const std::string& path) const {
  const Hdf5Quiet quiet;
  Hdf5Id dataset(H5Dopen2(id(), path.c_str(), H5P_DEFAULT), H5Dclose);
  if (!dataset.valid()) {
    throw fail(path, "cannot be opened" + hdf5Cause() + ": expected a data set");
  }
  return dataset;
}

std::vector<double> Hdf5File::numbers(const std::string& path, std::size_t count,
                                      std::string_view expected) const {
  const Hdf5Quiet quiet;
  const Hdf5Id set = dataset(path);
  const Hdf5Id space(H5Dget_space(set.get()), H5Sclose);
  std::vector<double> values(count);
  if (H5Sget_simple_extent_npoints(space.get()) != static_cast<hssize_t>(count) ||
      H5Dread(set.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    throw fail(path, fmt::format("expected {} numbers, {}", count, expected));
  }
  for (const double value : values) {
    if (!std::isfinite(value)) throw fail(path, fmt::format("{}: expected {}", value, expected));
  }
  return values;
}

std::int64_t Hdf5File::integer(const std::string& path) const {
  const Hdf5Quiet quiet;
  const Hdf5Id set = dataset(path);
  const Hdf5Id space(H5Dget_space(set.get()), H5Sclose);
  const Hdf5Id type(H5Dget_type(set.get()), H5Tclose);
  std::int64_t value = 0;
  if (H5Tget_class(type.get()) != H5T_INTEGER || H5Sget_simple_extent_npoints(space.get()) != 1 ||
      H5Dread(set.get(), H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, &value) < 0) {
    throw fail(path, "expected a whole number");
  }
  return value;
}

std::string Hdf5File::text(const std::string& path) const {
  const Hdf5Quiet quiet;
  const Hdf5Id set = dataset(path);
  const Hdf5Id type(H5Dget_type(set.get()), H5Tclose);
  const Hdf5Id space(H5Dget_space(set.get()), H5Sclose);
  std::optional<std::string> text =
      readText(type.get(), space.get(), [&](hid_t memory, void* value) {
        return H5Dread(set.get(), memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, value);
      });
  if (!text) throw fail(path, "expected a text");
  return *std::move(text);
}

std::optional<std::string> Hdf5File::attribute(const char* name) const {
  const Hdf5Quiet quiet;
  if (H5Aexists(id(), name) <= 0) return std::nullopt;
  const Hdf5Id attribute(H5Aopen(id(), name, H5P_DEFAULT), H5Aclose);
  const Hdf5Id type(H5Aget_type(attribute.get()), H5Tclose);
  const Hdf5Id space(H5Aget_space(attribute.get()), H5Sclose);
  return readText(type.get(), space.get(), [&](hid_t memory, void* value) {
    return H5Aread(attribute.get(), memory, value);
  });
}

std::runtime_error Hdf5File::fail(const std::string& path, std::string_view what) const {
  return std::runtime_error(fmt::format("{}:{}: {}", path_.string(), path, what));
}

}  // namespace efm
