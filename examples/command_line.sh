#!/usr/bin/env bash
# The commands that the docs show. A test runs them in a folder of their own.
set -euo pipefail
rm -rf captures
# snippet-begin: tour
throng scene pile --objects 2000 -o pile.npy   # boxes: (n, 6) float32
throng pairs pile.npy -o pairs.npy             # pairs: (m, 2) uint32; prints times per stage
throng check pile.npy                          # compares every algorithm with a double loop
throng explain pile.npy --html explained.html  # why the search costs what it does
# snippet-end: tour
[ -s pairs.npy ]
grep -q 'What would make it faster' explained.html
# snippet-begin: worlds
throng scene worlds --objects 6400 -o worlds.npy     # also writes worlds-world.npy
throng pairs worlds.npy --world worlds-world.npy
# snippet-end: worlds
# snippet-begin: two_sets
throng scene uniform --objects 500 -o robots.npy
throng pairs robots.npy pile.npy --margin 0.01 -o contacts.npy   # first: robot, second: box of the pile
# snippet-end: two_sets
[ -s contacts.npy ]
# snippet-begin: memory
throng pairs pile.npy --memory 4M -o streamed.npy
# snippet-end: memory
cmp -s <(wc -c < pairs.npy) <(wc -c < streamed.npy)
# snippet-begin: capture
mkdir captures
THRONG_CAPTURE=captures throng pairs pile.npy
for file in captures/*.capture; do throng replay "$file"; done
# snippet-end: capture
# snippet-begin: demo
throng demo --objects 2000 --frames 60 -o column.png
# snippet-end: demo
[ -s column.png ]
