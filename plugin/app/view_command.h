// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

namespace efm {

struct ViewArguments {
  std::filesystem::path path;  ///< The folder of a map, or its map.html.
};

/// `event-fusion view`: opens map.html with the program that the system has for pages (`xdg-open`,
/// `open`), and prints its path. Where there is no screen or no such program, stderr says so; that
/// is no error: the page is there for any browser.
/// @return the process's exit status.
/// @throws std::runtime_error where there is no page.
int runView(const ViewArguments& arguments);

}  // namespace efm
