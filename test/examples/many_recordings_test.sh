#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Maps a list of recordings with GNU parallel. One is broken, and one program is killed on its first try.
#   many_recordings_test.sh PROGRAM WORK_FOLDER
set -uo pipefail
program=$(realpath "${1:?usage: many_recordings_test.sh PROGRAM WORK_FOLDER}")
work=${2:?usage: many_recordings_test.sh PROGRAM WORK_FOLDER}
many=$(cd "$(dirname "$0")/../../examples/many" && pwd)
rm -rf "$work" && mkdir -p "$work" && cd "$work" || exit 1
failures=0

expect() { # expect WHAT FOUND EXPECTED: the whole text matches the pattern
    # shellcheck disable=SC2053
    [[ $2 == $3 ]] || { printf '%s:\n  found     %s\n  expected  %s\n' "$1" "$2" "$3"; failures=$((failures + 1)); }
}
map() { # map EXPECTED_STATUS LIST [OPTION]...
    local list=$2
    "$many/map_many_parallel.sh" "$list" out "${@:3}" >printed 2>errors
    expect "exit status for $list" $? "$1"
}
row() { grep "^$1 " out/table.txt | tr -s ' '; }
tries() { grep -c "/$1 " calls; }

"$program" simulate -q --preset slider --duration 0.1 --out "one slider" || exit 1
mkdir other && cp -r "one slider" other/broken && cp -r "one slider" broken && rm broken/camchain.yaml || exit 1
cat >fake <<END
#!/bin/bash
echo "\$*" >>"$PWD/calls"
case "\$*" in *out/killed*) [ \$(grep -c out/killed "$PWD/calls") -gt 1 ] || kill -9 \$\$ ;; esac
exec "$program" "\$@"
END
chmod +x fake
export EVENT_FUSION=$PWD/fake JOBS=2

printf '%s\n' "'one slider'" broken other/broken >same_names
map 2 same_names
expect "error of equal names" "$(cat errors)" "error: same_names:3: the name 'broken' is used by line 2*"

printf '%s\n' '# three recordings' "'one slider'" broken 'killed: other/broken' >list
map 1 list
for name in "one slider" killed; do
    expect "row of $name" "$(row "$name")" "$name mapped [a-z]* 1 [1-9]* [0-9]*.[0-9] [0-9]*"
    expect "report of $name" "$(ls "out/$name/report.json" "out/$name/map.pcd")" "*report.json"
done
expect "row of broken" "$(row broken)" "broken failed - - - - - broken: no calibration: *"
expect "printed table" "$(tail -n 4 printed)" "$(cat out/table.txt)"
expect "page" "$(cat out/index.html)" "*2 of 3 recordings*one slider*one%20slider/map.html*one%20slider/overview.png*broken: no calibration*"
expect "tries" "$(tries 'one slider') $(tries broken) $(tries killed)" "1 1 2"

map 1 list # finished recordings are not mapped again, not even without GNU parallel's log
rm out/joblog
map 1 list
expect "calls after two more runs" "$(wc -l <calls)" 4

sed -i "s/^broken/broken --calibration 'one slider\/camchain.yaml'/" list # the list is repaired
map 0 list
expect "repaired row" "$(row broken)" "broken mapped *"
expect "calls after the repair" "$(wc -l <calls)" 5

rm -r "out/one slider" # a removed result is made again, and so is one whose status file is damaged
expect "removed row" "$("$many/recordings.py" table list out | grep '^one slider' | tr -s ' ')" "one slider not run - - - - - its result was removed*"
echo '{}' >out/log/killed.status
map 0 list
expect "calls after the removal" "$(wc -l <calls)" 7
map 0 list
expect "calls after one more run" "$(wc -l <calls)" 7

mv broken $'br\303\266ken one' # as `printf %q` writes names in a C locale
(LC_ALL=C printf '%q\n' br*) | sed "s/$/ --calibration 'one slider\/camchain.yaml'/" >names
expect "escaped name" "$(cat names)" '$*303*266*'
sed -i 's/"quality"/"of before"/; s/^{/{ "quality": {"word": "doubtful", "reasons": ["few events"]},/' "out/one slider/report.json"
map 0 names
expect "row of the name" "$(row $'br\303\266ken')" $'br\303\266ken one mapped *'
expect "doubtful row" "$("$many/recordings.py" table list out | grep '^one slider' | tr -s ' ')" "one slider mapped doubtful *few events*"

[ $failures = 0 ] && echo "passed"
exit $((failures > 0))
