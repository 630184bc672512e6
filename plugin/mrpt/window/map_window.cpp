// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/window/map_window.h"

#include <dlfcn.h>

#include <cstdlib>
#include <stdexcept>

namespace efm {

std::unique_ptr<MapWindow> MapWindow::open() {
  const char* const display = std::getenv("DISPLAY");
  if (!display || *display == '\0') {
    throw std::runtime_error(
        "--view needs a display: DISPLAY is not set; --record-frames DIR renders without a screen");
  }
  // Never closed: threads of its libraries run until the program ends.
  void* const library = dlopen("libevent-fusion-window.so", RTLD_NOW | RTLD_LOCAL);
  void* const symbol = library ? dlsym(library, "efmOpenMapWindow") : nullptr;
  if (!symbol) {
    const char* const why = dlerror();
    throw std::runtime_error(std::string("--view: the window's library cannot be loaded: ") +
                             (why ? why : "no reason given") + "; --record-frames DIR needs none");
  }
  using Open = MapWindow* (*)();
  std::unique_ptr<MapWindow> window(reinterpret_cast<Open>(symbol)());
  if (!window) {
    throw std::runtime_error(std::string("--view: no window appears on the display ") + display +
                             "; --record-frames DIR renders without a screen");
  }
  return window;
}

}  // namespace efm
