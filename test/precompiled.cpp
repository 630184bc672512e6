// SPDX-License-Identifier: BSD-3-Clause
// What CMake needs to compile the headers of tests once.
