#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Draws which rooms include which, from the sources' #include lines. Arrows that follow from others are left out.
# Needs Graphviz (Debian: graphviz).
#   draw_rooms.sh [OUT.svg]      default: docs/pictures/rooms.svg
set -euo pipefail
out=$(realpath -m "${1:-$(dirname "$0")/../docs/pictures/rooms.svg}")
cd "$(dirname "$0")/.."

graph() {
  grep -rnE --include='*.h' --include='*.cpp' '^#include "(mapping|maps|tracking_stub|plugin)/' \
    mapping maps tracking_stub plugin |
    awk -v "$1" '
      {
        split($0, place, ":"); split(place[1], from, "/")
        match($0, /"[^"]+"/); split(substr($0, RSTART + 1, RLENGTH - 2), to, "/")
        if (folder == "") { if (from[1] != to[1]) arrow[from[1] " -> " to[1]] = 1 }
        else if (from[1] == folder) {
          name[from[2]] = 1
          if (to[1] == folder) name[to[2]] = 1
          if (to[1] == folder && to[2] != from[2])
            arrow["\"" folder "/" from[2] "\" -> \"" folder "/" to[2] "\""] = 1
        }
      }
      END {
        print "digraph {"
        for (room in name) print "\"" folder "/" room "\" [label=\"" room "\"];"
        for (a in arrow) print a ";"
        print "}"
      }' | tred
}

{
  echo 'digraph rooms {'
  echo '  rankdir=TB; compound=true; fontname="sans-serif"; nodesep=0.2; ranksep=0.35'
  echo '  node [shape=box, style="rounded,filled", fillcolor=white, fontname="sans-serif", fontsize=11]'
  echo '  edge [color="#555555", arrowsize=0.6]'
  for folder in mapping maps tracking_stub plugin; do
    echo "  subgraph cluster_$folder { label=\"$folder\"; style=\"rounded,filled\"; color=\"#e8eef5\";"
    graph "folder=$folder" | grep -E '^[[:space:]]*("|[a-z])' | grep -v digraph | sort
    echo '  }'
  done
  # A folder below another one is drawn below it: one invisible arrow each.
  echo '  "maps/refinement" -> "mapping/keyframes" [lhead=cluster_mapping, ltail=cluster_maps, style=dashed];'
  echo '  "tracking_stub/presets" -> "mapping/keyframes" [lhead=cluster_mapping, ltail=cluster_tracking_stub, style=dashed];'
  echo '  "plugin/calibration" -> "maps/refinement" [lhead=cluster_maps, ltail=cluster_plugin, style=dashed];'
  echo '  "plugin/calibration" -> "tracking_stub/presets" [lhead=cluster_tracking_stub, ltail=cluster_plugin, style=dashed];'
  echo '}'
} | dot -Tsvg -o "$out"
echo "written to $out"
