# SPDX-License-Identifier: BSD-3-Clause
# Joins the page's files into one and writes it as a C++ source.
#   cmake -DPAGE=FOLDER -DOUT=FILE.cpp -P embed_page.cmake
file(READ "${PAGE}/page.html" html)
# Each line "<!-- FILE -->" is replaced by the file.
foreach(name page.css data.js camera.js draw.js keyframes.js panel.js)
  file(READ "${PAGE}/${name}" content)
  string(REPLACE "<!-- ${name} -->" "${content}" html "${html}")
endforeach()
# One raw string: compilers must take 65536 characters, the page has some 50,000.
file(WRITE "${OUT}" "#include \"plugin/results/viewer/map_page.h\"\n
const std::string_view efm::kPageSource =
    R\"page(${html})page\";\n")
