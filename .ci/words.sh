#!/usr/bin/env bash
# Finds private words in identifiers and docs: bash .ci/words.sh
# Code between the quotes of a string, and what a general library calls so, does not count.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
words="$(grep -v '^#' .ci/words.txt | paste -sd '|')"
found="$(git grep -nwE "($words)" -- 'drt-*/src/*.rs' 'drt-*/README.md' 'docs/*.md' README.md |
    # Channels of the standard library; sentences that begin with the word.
    grep -vE 'sync::mpsc|: *//[/!]? .*[.!?:] (Looks?|Needs?|Stop|Rate|Met|Told|Views|Worth)\b|: *//[/!]? (Looks|Needs|Stop|Met|Views|Worth)\b' || true)"
[ -z "$found" ] || { echo "$found" && exit 1; }
