//! Bad input is an error that names the value and the fix; nothing panics, and objects stay usable.

use throng::mesh::{Mesh, self_intersections, self_within};
use throng::*;

fn cube() -> Box3 {
    Box3::new([0.0; 3], [1.0; 3])
}

#[track_caller]
fn expect<T: std::fmt::Debug>(got: Result<T, Error>, kind: ErrorKind, parts: &[&str]) -> Error {
    let error = got.unwrap_err();
    assert_eq!(error.kind(), kind, "{error}");
    for part in parts {
        assert!(error.to_string().contains(part), "'{error}' lacks '{part}'");
    }
    error
}

#[test]
fn not_a_number() {
    let mut boxes = vec![cube(); 40];
    boxes[17].upper[1] = f32::NAN;
    boxes[30].lower[2] = f32::NAN;
    let error = expect(find_pairs(&boxes), ErrorKind::NanBox, &["17", "2"]);
    assert_eq!((error.first_invalid(), error.invalid_count()), (Some(17), 2));
    let mut finder = Finder::new().unwrap();
    expect(finder.find(&boxes).map(<[Pair]>::len), ErrorKind::NanBox, &["17"]);
    assert_eq!(finder.find(&boxes[..2]).unwrap().len(), 1);

    let mut objects = BroadPhase::new().unwrap();
    expect(objects.add(&boxes), ErrorKind::NanBox, &["17"]);
    assert!(objects.is_empty());
    let ray = Sweep::ray([0.0; 3], [f32::INFINITY, 0.0, 0.0]);
    expect(objects.sweep(&[ray], Hits::All).map(<[SweepHit]>::len), ErrorKind::NanBox, &[]);
    expect(objects.raycast([f32::NAN; 3], [1.0; 3], 1.0, 1), ErrorKind::NanBox, &[]);
    expect(objects.shift_origin([f32::NAN; 3]), ErrorKind::BadOption, &[]);
}

#[test]
fn inverted() {
    let boxes = [cube(), Box3::new([2.0, 0.0, 0.0], [1.0, 1.0, 1.0])];
    let error = expect(find_pairs(&boxes), ErrorKind::InvertedBox, &["1"]);
    assert_eq!(error.first_invalid(), Some(1));
    assert!(Finder::new().unwrap().find(&boxes).unwrap().is_empty());
}

#[test]
fn lengths_that_differ() {
    let boxes = vec![cube(); 5];
    let view = Boxes::from(&boxes).owner(&[1, 2, 3]);
    expect(find_pairs(view), ErrorKind::BadFilter, &["'owner'", "3 values", "5 boxes"]);
    let corners = [[0.0; 3]; 2];
    expect(
        Boxes::from_corners(&corners, &corners[..1]),
        ErrorKind::BadBoxes,
        &["2 lower", "1 upper"],
    );
    let mut objects = BroadPhase::new().unwrap();
    let ids = objects.add(&boxes).unwrap();
    expect(objects.move_objects(&ids[..3], &boxes), ErrorKind::BadBoxes, &["5 boxes", "3 ids"]);
    expect(objects.move_all(&boxes[..4]), ErrorKind::BadBoxes, &["4", "5"]);
    let one = Filters { world: Some(&[0]), ..Filters::default() };
    expect(objects.set_filters(&ids, one), ErrorKind::BadFilter, &["'world'", "1 values"]);
    expect(
        objects.sweep_filtered(&[Sweep::default(); 2], Hits::All, one).map(<[SweepHit]>::len),
        ErrorKind::BadFilter,
        &["'world'"],
    );
    let triangles = [[0, 1, 2]; 2];
    let vertices = [[0.0; 3], [1.0; 3], [2.0; 3]];
    let mesh = Mesh::new(&vertices, &triangles).filters(one);
    expect(self_intersections(&mesh), ErrorKind::BadFilter, &["'world'"]);
}

#[test]
fn ids() {
    let mut objects = BroadPhase::new().unwrap();
    let ids = objects.add(&[cube(), cube()]).unwrap();
    expect(objects.remove(&[9]), ErrorKind::BadId, &["9"]);
    expect(objects.remove(&[ids[0], ids[0]]), ErrorKind::BadId, &[]);
    let error =
        expect(objects.move_objects(&[ids[1], u32::MAX], &[cube(), cube()]), ErrorKind::BadId, &[]);
    assert_eq!(error.first_invalid(), Some(1));
    assert_eq!(objects.len(), 2);
    assert!(objects.pairs_of(u32::MAX).is_empty());
    assert!(!objects.contains(u32::MAX));
}

#[test]
fn options() {
    let negative = Options { margin: -1.0, ..Options::default() };
    let mut finder = Finder::with_options(&negative).unwrap();
    expect(finder.find(&cube()).map(<[Pair]>::len), ErrorKind::BadOption, &["margin", "-1"]);
    let small = Options { memory_cap_bytes: 1, ..Options::default() };
    let mut finder = Finder::with_options(&small).unwrap();
    let boxes = vec![cube(); 100];
    let ended = finder.consume(&boxes, |_| std::ops::ControlFlow::<()>::Continue(()));
    let error = expect(ended, ErrorKind::MemoryCapTooSmall, &[]);
    assert!(error.bytes_needed() > 1);
    expect(find_pairs(Boxes::from(&cube()).world(&[-2])), ErrorKind::BadFilter, &["-2"]);
}

#[test]
fn meshes() {
    let vertices = [[0.0; 3], [1.0, 0.0, 0.0], [f32::NAN, 0.0, 0.0]];
    let error = expect(
        self_intersections(&Mesh::new(&vertices, &[[0, 1, 1], [0, 1, 3]])),
        ErrorKind::BadMesh,
        &["3"],
    );
    assert_eq!(error.first_invalid(), Some(1));
    expect(self_intersections(&Mesh::new(&vertices, &[[0, 1, 2]])), ErrorKind::BadMesh, &[]);
    // A vertex that no triangle uses may have any value; no triangle is no error.
    assert_eq!(self_intersections(&Mesh::new(&vertices, &[[0, 1, 1]])).unwrap(), []);
    assert_eq!(self_intersections(&Mesh::new(&[], &[])).unwrap(), []);
    expect(self_within(&Mesh::new(&vertices[..2], &[[0, 1, 1]]), -1.0), ErrorKind::BadOption, &[]);
}
