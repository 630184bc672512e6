#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Draws which folders include which, from the sources' #include lines. Arrows that follow from others are left out.
# Needs Graphviz (Debian: graphviz).
#   draw_folders.sh [OUT.svg]      default: docs/pictures/folders.svg
set -euo pipefail
out=$(realpath -m "${1:-$(dirname "$0")/../docs/pictures/folders.svg}")
cd "$(dirname "$0")/.."

graph() {
  grep -rnE --include='*.h' --include='*.cpp' '^#include "(mapping|maps|tracking_stub|plugin)/' \
    mapping maps tracking_stub plugin |
    awk -v "$1" '
      function folder_of(path) { sub(/\/[^\/]*$/, "", path); return path }
      {
        split($0, place, ":"); from = folder_of(place[1])
        match($0, /"[^"]+"/); to = folder_of(substr($0, RSTART + 1, RLENGTH - 2))
        if (index(from, top "/") != 1) next
        name[from] = 1
        if (index(to, top "/") != 1) next
        name[to] = 1
        if (to != from) arrow["\"" from "\" -> \"" to "\""] = 1
      }
      END {
        print "digraph {"
        for (folder in name) print "\"" folder "\" [label=\"" substr(folder, length(top) + 2) "\"];"
        for (a in arrow) print a ";"
        print "}"
      }' | tred
}

{
  echo 'digraph folders {'
  echo '  rankdir=TB; compound=true; fontname="sans-serif"; nodesep=0.2; ranksep=0.35'
  echo '  node [shape=box, style="rounded,filled", fillcolor=white, fontname="sans-serif", fontsize=11]'
  echo '  edge [color="#555555", arrowsize=0.6]'
  for top in mapping maps tracking_stub plugin; do
    echo "  subgraph cluster_$top { label=\"$top\"; style=\"rounded,filled\"; color=\"#e8eef5\";"
    graph "top=$top" | grep -E '^[[:space:]]*("|[a-z])' | grep -v digraph | sort
    echo '  }'
  done
  # A top folder below another one is drawn below it: one invisible arrow each.
  echo '  "maps/refinement" -> "mapping/keyframes" [lhead=cluster_mapping, ltail=cluster_maps, style=dashed];'
  echo '  "tracking_stub/presets" -> "mapping/keyframes" [lhead=cluster_mapping, ltail=cluster_tracking_stub, style=dashed];'
  echo '  "plugin/recordings/calibration" -> "maps/refinement" [lhead=cluster_maps, ltail=cluster_plugin, style=dashed];'
  echo '  "plugin/recordings/calibration" -> "tracking_stub/presets" [lhead=cluster_tracking_stub, ltail=cluster_plugin, style=dashed];'
  echo '}'
} | dot -Tsvg -o "$out"
echo "written to $out"
