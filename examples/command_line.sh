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
cat > model.obj << 'OBJ'
v 0 0 0
v 4 0 0
v 0 4 0
v 0 0 4
v 1 1 -1
v 2.5 1 -1
v 1 2.5 -1
v 1 1 0.5
f 1 3 2
f 1 2 4
f 2 3 4
f 3 1 4
f 5 7 6
f 5 6 8
f 6 7 8
f 7 5 8
OBJ
cp model.obj other.obj
# snippet-begin: mesh_self
throng mesh model.obj
# snippet-end: mesh_self
for line in 'pairs     3  (4 of 8 triangles)' 'kinds     3 crossing, 0 touching, 0 coplanar' \
  'tested    18 candidates, 0 of them by exact arithmetic'; do
  throng mesh model.obj | grep -qxF "$line"  # as in docs/how-to/mesh-intersections.md
done
# snippet-begin: mesh
throng mesh model.obj -o crossing.npy  # pairs: (m, 2) uint32
throng mesh model.obj --picture crossing.png --view 2,1,-1  # seen from this direction
throng mesh model.obj --weld           # equal positions become one vertex first
throng mesh model.obj --exit-code || echo "intersects"        # for scripts: status 1
throng mesh model.obj --json           # for programs: "pairs" is 0 if clean
throng mesh model.obj other.obj        # two meshes
throng mesh model.obj --within 0.5     # triangles at most 0.5 apart
# snippet-end: mesh
[ -s crossing.npy ]
[ -s crossing.png ]
# snippet-begin: capture
mkdir captures
THRONG_CAPTURE=captures throng pairs pile.npy
for file in captures/*.capture; do throng replay "$file"; done
# snippet-end: capture
# snippet-begin: demo
throng demo --objects 2000 --frames 200 -o column.png --animate column.svg
# snippet-end: demo
[ -s column.png ]
[ -s column.svg ]
