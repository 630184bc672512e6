// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/config/CConfigFileBase.h>

#include <string>

#include "plugin/options/option_file.h"

namespace efm {

/// Our options in the configuration of an MRPT program, which holds other sections too.
///
/// With the prefix "mapper" our sections are [mapper_dsi], [mapper_map] and so on, and every
/// section that begins with "mapper_" is ours: one that is not known is an error. With an empty
/// prefix they are [dsi], [map], ..., and other sections are the host's. Inside our sections all is
/// as strict as in a file of our own; that a key is given twice cannot be seen through MRPT.
/// @throws std::invalid_argument naming the file where there is one, the section, the key and
/// value, or the prefix where no section has it; std::runtime_error where the source's file is
/// missing, which MRPT takes for an empty one.
void readHostOptions(const mrpt::config::CConfigFileBase& source, const std::string& prefix,
                     OptionReader& reader);

/// Writes all options to the sections that are read with the same prefix.
void writeHostOptions(const EventFusionOptions& options, const std::string& prefix,
                      mrpt::config::CConfigFileBase& target);

/// One section of the host's, which holds the keys of our `section`.
void readHostSection(const mrpt::config::CConfigFileBase& source, const std::string& host_section,
                     std::string_view section, OptionReader& reader);

/// The sections of the host's that begin with "<prefix>_".
std::vector<std::string> sectionsBelow(const mrpt::config::CConfigFileBase& source,
                                       const std::string& prefix);

/// What errors begin with: "host.ini, section mapper_dsi:", or "options, section ..." where there
/// is no file. Without brackets: MRPT takes them for marks of its own and reorders the message.
std::string placeIn(const mrpt::config::CConfigFileBase& source, const std::string& section);

}  // namespace efm
