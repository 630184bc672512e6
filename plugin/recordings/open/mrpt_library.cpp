// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/mrpt_library.h"

#include <dlfcn.h>

#include <stdexcept>

namespace efm {
namespace {

/// Returns the folder of the library, or of the program, that has this code.
std::filesystem::path ownFolder() {
  Dl_info info{};
  if (dladdr(reinterpret_cast<void*>(&ownFolder), &info) == 0) return {};
  return std::filesystem::path(info.dli_fname).parent_path();
}

}  // namespace

void* symbolOf(const std::string& library, const std::string& symbol, const std::string& for_what) {
  const std::filesystem::path beside = ownFolder() / library;
  std::error_code ignored;
  const bool is_beside = std::filesystem::exists(beside, ignored);
  void* const handle =
      dlopen((is_beside ? beside.string() : library).c_str(), RTLD_NOW | RTLD_LOCAL);
  void* const found = handle != nullptr ? dlsym(handle, symbol.c_str()) : nullptr;
  if (found != nullptr) return found;
  const char* const why = dlerror();
  throw std::runtime_error(for_what + " needs MRPT: " + library +
                           " cannot be loaded: " + (why ? why : "no reason given"));
}

const MrptLibrary& mrptLibrary(const std::string& for_what) {
  return *static_cast<const MrptLibrary*>(
      symbolOf("libmrpt-event-fusion.so." EFM_SOVERSION, "efmMrptLibrary", for_what));
}

}  // namespace efm
