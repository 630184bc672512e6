// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

namespace efm {

/// The page without data: `page/page.html` with its style and scripts inside. Made by
/// `embed_page.cmake`.
extern const std::string_view kPageSource;

}  // namespace efm
