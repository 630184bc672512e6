#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Makes the wrong changes of mutations.txt, one at a time, in a copy of the tree, and tells which
# tests notice them: a table in Markdown. See README.md beside it.
#   run.sh [--list] [--at-least N] [--timeout SECONDS] [NAME…]
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
tree="$root/build/mutation"
build="$tree/build/release"
log="$tree/build/mutation.log"
at_least=""
seconds=600
list=false
chosen=()
while (($# > 0)); do
  case $1 in
    --at-least) at_least=$2; shift 2 ;;
    --timeout) seconds=$2; shift 2 ;;
    --list) list=true; shift ;;
    -*) echo "run.sh: unknown option $1" >&2; exit 2 ;;
    *) chosen+=("$1"); shift ;;
  esac
done

# Reads mutations.txt into arrays, by index.
names=() files=() whats=() tests=() olds=() news=()
read_mutations() {
  local line part="" old="" new=""
  while IFS= read -r line; do
    case $part:$line in
      :'name: '*) names+=("${line#name: }") ;;
      :'file: '*) files+=("${line#file: }") ;;
      :'what: '*) whats+=("${line#what: }") ;;
      :'tests: '*) tests+=("${line#tests: }") ;;
      :'<<<<') part=old old="" ;;
      old:'====') part=new new="" ;;
      new:'>>>>') part="" olds+=("${old%$'\n'}") news+=("${new%$'\n'}") ;;
      old:*) old+=$line$'\n' ;;
      new:*) new+=$line$'\n' ;;
      : | :'#'*) ;;
      *) echo "mutations.txt: unexpected line: $line" >&2; exit 2 ;;
    esac
  done <"$here/mutations.txt"
  if ((${#names[@]} != ${#files[@]} || ${#names[@]} != ${#whats[@]} ||
    ${#names[@]} != ${#tests[@]} || ${#names[@]} != ${#news[@]})); then
    echo "mutations.txt: a mutation lacks a line" >&2
    exit 2
  fi
}

is_chosen() {
  ((${#chosen[@]} == 0)) && return 0
  local name
  for name in "${chosen[@]}"; do [[ $name == "$1" ]] && return 0; done
  return 1
}

# Only what differs is copied: the build stays warm, and a mutation that was left is undone.
copy_tree() {
  local file
  mkdir -p "$tree/build"
  while IFS= read -r -d '' file; do
    [[ -e $root/$file ]] || continue
    cmp -s "$root/$file" "$tree/$file" && continue
    mkdir -p "$(dirname "$tree/$file")"
    cp "$root/$file" "$tree/$file"
  done < <(git -C "$root" ls-files -z)
}

build_tests() {
  # shellcheck disable=SC2086
  cmake --build "$build" --target $1 >"$log" 2>&1
}

# Prints the name of the first test that fails in some programs; nothing where all pass.
first_failure() {
  local program status failed
  for program in $1; do
    status=0
    (cd "$build" && timeout "$seconds" "bin/$program" --gtest_fail_fast --gtest_brief=1) \
      >"$log" 2>&1 || status=$?
    ((status == 0)) && continue
    failed=$(grep -a -m1 -o '^\[  FAILED  \] [^ ,]*' "$log" | cut -d' ' -f6 || true)
    ((status == 124)) && failed="no end within $seconds s"
    echo "${failed:-a crash of $program}"
    return
  done
}

# Replaces the text of a mutation in the copy, where it is there exactly once.
mutate() {
  local file="$tree/${files[$1]}" old=${olds[$1]} content rest
  [[ -e $file && -e $root/${files[$1]} ]] || return 1
  content=$(<"$file")
  rest=${content#*"$old"}
  [[ $rest == "$content" || $rest == *"$old"* ]] && return 1
  cp "$file" "$tree/build/original"
  printf '%s\n' "${content%%"$old"*}${news[$1]}$rest" >"$file"
}

restore() {
  [[ -e $tree/build/original ]] || return 0
  mv "$tree/build/original" "$tree/${files[$1]}"
  touch "$tree/${files[$1]}"
}

read_mutations
if $list; then
  for i in "${!names[@]}"; do printf '%s\t%s\t%s\n' "${names[$i]}" "${files[$i]}" "${whats[$i]}"; done
  exit 0
fi
copy_tree
cmake --preset release -S "$tree" \
  -DEFM_SHARED_DATA="${EFM_SHARED_DATA:-$root/../shared/data}" >"$log" 2>&1 ||
  { cat "$log" >&2; exit 2; }

# A test that fails anyway notices nothing.
programs=""
for i in "${!names[@]}"; do
  is_chosen "${names[$i]}" && programs+=" ${tests[$i]}"
done
programs=$(tr ' ' '\n' <<<"$programs" | sort -u | xargs)
[[ -n $programs ]] || { echo "run.sh: no such mutation" >&2; exit 2; }
build_tests "$programs -- -k 0" || true
failing=" "
for program in $programs; do
  if ! build_tests "$program"; then
    cat "$log" >&2
    failing+="$program "
  elif [[ -n $(first_failure "$program") ]]; then
    failing+="$program "
  fi
done

# Whether one of some programs fails without a mutation.
any_fails() {
  local program
  for program in $1; do [[ $failing == *" $program "* ]] && return 0; done
  return 1
}

echo "| mutation | room | wrong change | noticed by |"
echo "|---|---|---|---|"
count=0 caught=0 broken=0
for i in "${!names[@]}"; do
  is_chosen "${names[$i]}" || continue
  count=$((count + 1))
  if any_fails "${tests[$i]}"; then
    noticed="**${tests[$i]} fails without it**"
    broken=$((broken + 1))
  elif ! mutate "$i"; then
    noticed="**STALE: the text is not there once**"
    broken=$((broken + 1))
  elif ! build_tests "${tests[$i]}"; then
    noticed="**does not build**"
    broken=$((broken + 1))
  else
    noticed=$(first_failure "${tests[$i]}")
    if [[ -n $noticed ]]; then
      caught=$((caught + 1)) noticed="\`$noticed\`"
    else
      noticed="**SURVIVED**"
    fi
  fi
  restore "$i"
  echo "| ${names[$i]} | $(dirname "${files[$i]}") | ${whats[$i]} | $noticed |"
done
echo
echo "$caught of $count caught"
((broken == 0 && caught >= ${at_least:-$((count < 60 ? count : 55))}))
