//! The first steps: which boxes overlap?

// snippet-begin: whole
use throng::{Box3, find_pairs};

fn main() -> Result<(), throng::Error> {
    let boxes = [
        Box3::new([0.0, 0.0, 0.0], [2.0, 2.0, 2.0]), // lower and upper corner
        Box3::new([1.0, 1.0, 1.0], [3.0, 3.0, 3.0]), // overlaps box 0
        Box3::new([3.0, 1.0, 1.0], [4.0, 2.0, 2.0]), // touches box 1: that counts
        Box3::new([9.0, 9.0, 9.0], [9.0, 9.0, 9.0]), // a point, far away
    ];
    for pair in find_pairs(&boxes)? {
        println!("{} touches {}", pair.first, pair.second);
    }
    Ok(())
}
// snippet-end: whole
