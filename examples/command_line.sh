#!/usr/bin/env bash
# What docs/start.md shows of the command line; a test runs it in a folder of its own.
set -euo pipefail
# snippet-begin: scene
throng scene pile --objects 2000 -o pile.npy   # boxes as NumPy reads them: (n, 6) float32
throng pairs pile.npy -o pairs.npy              # pairs: (m, 2) uint32, and where the time went
# snippet-end: scene
[ -s pairs.npy ]
# snippet-begin: explain
throng explain pile.npy --html explained.html  # why it costs what it does, and what would help
throng check pile.npy                          # every algorithm against the double loop
# snippet-end: explain
grep -q 'What would make it faster' explained.html
# snippet-begin: demo
throng demo --objects 2000 --frames 60 -o column.png
# snippet-end: demo
[ -s column.png ]
