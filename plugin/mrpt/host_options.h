// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/config/CConfigFileBase.h>

#include <string>

#include "plugin/options/option_file.h"

namespace efm {

/// Reads our options from the configuration of an MRPT program, which also has other sections.
///
/// If the prefix is "mapper", our sections are [mapper_dsi], [mapper_map] and so on; any other
/// section that begins with "mapper_" is an error. If the prefix is empty, our sections are [dsi],
/// [map], ..., and all other sections belong to the host. A host that has its own [map] names our
/// sections [event_fusion_dsi], [event_fusion_map], ...: if there is such a section, an empty
/// prefix means "event_fusion". Our sections are checked as in our own files, with one exception:
/// MRPT hides a key that is given twice.
/// @throws std::invalid_argument naming the file (if there is one), the section, the key and the
/// value, or the prefix if no section has it; std::runtime_error if the source's file is missing
/// (MRPT treats a missing file as an empty file).
void readHostOptions(const mrpt::config::CConfigFileBase& source, const std::string& prefix,
                     OptionReader& reader);

/// Writes all options to the sections that `readHostOptions` reads with the same prefix.
void writeHostOptions(const EventFusionOptions& options, const std::string& prefix,
                      mrpt::config::CConfigFileBase& target);

/// Reads the keys of our `section` from one section of the host.
void readHostSection(const mrpt::config::CConfigFileBase& source, const std::string& host_section,
                     std::string_view section, OptionReader& reader);

/// Returns the host's sections that begin with "<prefix>_".
std::vector<std::string> sectionsBelow(const mrpt::config::CConfigFileBase& source,
                                       const std::string& prefix);

/// Returns the beginning of errors: "host.ini, section mapper_dsi:", or "options, section ..."
/// without a file. It has no brackets, because MRPT interprets brackets and reorders the message.
std::string placeIn(const mrpt::config::CConfigFileBase& source, const std::string& section);

}  // namespace efm
