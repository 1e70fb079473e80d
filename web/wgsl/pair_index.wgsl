// The paper's mapping: how a workgroup turns its number into the two tiles of boxes to compare, in
// exact integers.
//
// The tiles (row, column), row <= column, are numbered by columns: k = S(column) + row, where S(j)
// = j (j + 1) / 2 tiles lie before column j. Equation (1) of the paper numbers pairs by rows and
// takes the column (there: the row) from a square root. Counted backwards, its numbering is this
// one, which does not depend on the number of tiles.

// At most 92681, whose S is 4,294,930,221: the greatest below 2^32.
const max_column = 92681u;

// Halving the even factor first means that only the result must fit.
fn tiles_before(column: u32) -> u32 {
  if column % 2u == 0u { return column / 2u * (column + 1u); }
  return (column + 1u) / 2u * column;
}

// The greatest column with S(column) <= k, by its bits from the highest: S increases, so a bit
// belongs to the result exactly if S of the bits so far, with it, is no more than k. A root in
// floats would be one multiplication, but WGSL does not say how exact it is.
fn column_of(k: u32) -> u32 {
  var column = 0u;
  for (var bit = 65536u; bit > 0u; bit /= 2u) {
    let next = column | bit;
    if next <= max_column && tiles_before(next) <= k { column = next; }
  }
  return column;
}
