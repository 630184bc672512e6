// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/config/CConfigFileBase.h>

#include <string>

#include "plugin/options/option_file.h"

namespace efm {

/// Reads our options from the configuration of an MRPT program, which has other sections, too.
///
/// With the prefix "mapper" our sections are [mapper_dsi], [mapper_map] and so on; any other
/// section that begins with "mapper_" is an error. With an empty prefix they are [dsi], [map], ...,
/// and all other sections belong to the host. A host with a [map] of its own calls ours
/// [event_fusion_dsi], [event_fusion_map], ...: where there is such a section, an empty prefix
/// means "event_fusion". Our sections are checked as in our own files, but MRPT hides a key that is
/// given twice.
/// @throws std::invalid_argument naming the file (if there is one), the section, the key and the
/// value, or the prefix if no section has it; std::runtime_error if the source's file is missing,
/// which MRPT treats as an empty file.
void readHostOptions(const mrpt::config::CConfigFileBase& source, const std::string& prefix,
                     OptionReader& reader);

/// Writes all options to the sections of `readHostOptions` with the same prefix.
void writeHostOptions(const EventFusionOptions& options, const std::string& prefix,
                      mrpt::config::CConfigFileBase& target);

/// Reads the keys of our `section` from one section of the host.
void readHostSection(const mrpt::config::CConfigFileBase& source, const std::string& host_section,
                     std::string_view section, OptionReader& reader);

/// The host's sections that begin with "<prefix>_".
std::vector<std::string> sectionsBelow(const mrpt::config::CConfigFileBase& source,
                                       const std::string& prefix);

/// The beginning of errors: "host.ini, section mapper_dsi:", or "options, section ..." without a
/// file. Without brackets: MRPT interprets brackets and reorders the message.
std::string placeIn(const mrpt::config::CConfigFileBase& source, const std::string& section);

}  // namespace efm
