//! Pairs, events, queries and meshes against double loops.

use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use throng::mesh::{Mesh, intersections, self_intersections, self_within, within};
use throng::*;

/// A small generator of random numbers (xorshift).
struct Random(u64);

impl Random {
    fn below(&mut self, limit: u32) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 33) as u32 % limit
    }

    /// Corners on a grid of halves, so that boxes touch.
    fn half(&mut self, limit: u32) -> f32 {
        self.below(2 * limit) as f32 / 2.0
    }

    fn bounds(&mut self) -> Box3 {
        let lower = [self.half(12), self.half(12), self.half(12)];
        Box3::new(lower, lower.map(|x| x + self.half(3)))
    }

    fn boxes(&mut self, count: usize) -> Vec<Box3> {
        (0..count).map(|_| self.bounds()).collect()
    }
}

fn of_one_set(boxes: &[Box3], allowed: impl Fn(usize, usize) -> bool) -> Vec<Pair> {
    let mut pairs = vec![];
    for i in 0..boxes.len() {
        for j in i + 1..boxes.len() {
            if boxes[i].overlaps(&boxes[j]) && allowed(i, j) {
                pairs.push(Pair { first: i as u32, second: j as u32 });
            }
        }
    }
    pairs
}

fn of_two_sets(a: &[Box3], b: &[Box3]) -> Vec<Pair> {
    let mut pairs = vec![];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            if x.overlaps(y) {
                pairs.push(Pair { first: i as u32, second: j as u32 });
            }
        }
    }
    pairs
}

fn sorted(mut pairs: Vec<Pair>) -> Vec<Pair> {
    pairs.sort();
    pairs
}

fn canonical() -> Options {
    Options { order: Order::Canonical, ..Options::default() }
}

#[test]
fn find_pairs_of_one_and_two_sets() {
    let mut random = Random(1);
    for count in [0, 1, 2, 17, 700] {
        let (a, b) = (random.boxes(count), random.boxes(300));
        let want = of_one_set(&a, |_, _| true);
        assert_eq!(sorted(find_pairs(&a).unwrap()), want);
        assert_eq!(want.is_empty(), count < 17);
        assert_eq!(sorted(find_pairs_between(&a, &b).unwrap()), of_two_sets(&a, &b));
        let mut finder = Finder::with_options(&canonical()).unwrap();
        assert_eq!(finder.find(&a).unwrap(), want);
        assert_eq!(finder.report().found, want.len() as u64);
        assert!(!finder.report().plan.is_empty());
        assert_eq!(finder.find_between(&a, &b).unwrap(), of_two_sets(&a, &b));
    }
}

#[test]
fn every_layout() {
    struct Entity {
        _id: u64,
        bounds: Box3,
        _mass: f32,
    }
    let boxes = Random(2).boxes(300);
    let want = of_one_set(&boxes, |_, _| true);
    let mut finder = Finder::with_options(&canonical()).unwrap();
    let (lower, upper): (Vec<_>, Vec<_>) = boxes.iter().map(|b| (b.lower, b.upper)).unzip();
    assert_eq!(finder.find(Boxes::from_corners(&lower, &upper).unwrap()).unwrap(), want);
    let entities: Vec<Entity> =
        boxes.iter().map(|b| Entity { _id: 9, bounds: *b, _mass: 1.0 }).collect();
    let view = Boxes::from_fields(&entities, |entity| &entity.bounds).unwrap();
    assert_eq!(finder.find(view).unwrap(), want);
    assert_eq!(view.len(), 300);
    let none: [Entity; 0] = [];
    assert_eq!(finder.find(Boxes::from_fields(&none, |e| &e.bounds).unwrap()).unwrap(), []);

    // A box that is somewhere else, and a field at another place in some items.
    static ELSEWHERE: Box3 = Box3::new([0.0; 3], [1.0; 3]);
    assert!(Boxes::from_fields(&entities, |_| &ELSEWHERE).is_err());
    struct Two(Box3, Box3, bool);
    let two = [Two(boxes[0], boxes[1], false), Two(boxes[2], boxes[3], true)];
    assert!(Boxes::from_fields(&two, |t| if t.2 { &t.0 } else { &t.1 }).is_err());
}

#[test]
fn every_filter() {
    let mut random = Random(3);
    let boxes = random.boxes(500);
    let numbers: Vec<u32> = (0..500).map(|_| random.below(4)).collect();
    let owner: Vec<i32> = numbers.iter().map(|n| *n as i32 - 1).collect();
    let bits: Vec<u32> = numbers.iter().map(|n| 1 << n).collect();
    let mask: Vec<u32> = (0..500).map(|_| random.below(16)).collect();
    let fixed: Vec<bool> = numbers.iter().map(|n| *n < 2).collect();
    let mut finder = Finder::with_options(&canonical()).unwrap();
    let all = of_one_set(&boxes, |_, _| true).len();
    let mut check = |view: Boxes<'_>, allowed: &dyn Fn(usize, usize) -> bool| {
        let want = of_one_set(&boxes, allowed);
        assert!(!want.is_empty() && want.len() < all);
        assert_eq!(finder.find(view).unwrap(), want);
    };
    let view = Boxes::from(&boxes);
    check(view.owner(&owner), &|i, j| owner[i] != owner[j] || owner[i] == -1);
    check(view.world(&owner), &|i, j| owner[i] == owner[j] || owner[i].min(owner[j]) == -1);
    check(view.is_static(&fixed), &|i, j| !(fixed[i] && fixed[j]));
    check(view.group(&bits).mask(&mask), &|i, j| bits[i] & mask[j] != 0 && bits[j] & mask[i] != 0);
    check(view.filters(Filters { owner: Some(&owner), ..Filters::default() }), &|i, j| {
        owner[i] != owner[j] || owner[i] == -1
    });
}

#[test]
fn a_margin_and_policies() {
    let mut boxes = vec![Box3::new([0.0; 3], [1.0; 3]), Box3::new([1.5; 3], [2.0; 3])];
    let wide = Options { margin: 0.25, ..canonical() };
    assert_eq!(Finder::with_options(&wide).unwrap().find(&boxes).unwrap().len(), 1);
    assert_eq!(Finder::new().unwrap().find(&boxes).unwrap().len(), 0);

    boxes[1].upper[0] = f32::NAN;
    let tolerant = Options { nan: NanPolicy::Inactive, ..Options::default() };
    let mut finder = Finder::with_options(&tolerant).unwrap();
    assert_eq!(finder.find(&boxes).unwrap().len(), 0);
    assert_eq!(finder.report().inactive, 1);
}

#[test]
fn consumers() {
    let boxes = vec![Box3::new([0.0; 3], [1.0; 3]); 2000];
    let mut finder = Finder::with_options(&canonical()).unwrap();
    let mut seen = vec![];
    let ended = finder.consume(&boxes, |pairs| {
        seen.extend_from_slice(pairs);
        ControlFlow::<()>::Continue(())
    });
    assert_eq!(ended.unwrap(), ControlFlow::Continue(()));
    assert_eq!(seen.len(), 2000 * 1999 / 2);
    assert_eq!(seen, of_one_set(&boxes, |_, _| true));

    let mut calls = 0;
    let ended = finder.consume(&boxes, |pairs| {
        calls += 1;
        ControlFlow::Break(pairs[0])
    });
    assert_eq!(ended.unwrap(), ControlFlow::Break(Pair { first: 0, second: 1 }));
    assert_eq!(calls, 1);

    let mut count = 0;
    let one = boxes[..1].to_vec();
    let ended = finder.consume_between(&boxes, &one, |pairs| {
        count += pairs.len();
        ControlFlow::<()>::Continue(())
    });
    assert_eq!((ended.unwrap(), count), (ControlFlow::Continue(()), 2000));
}

#[test]
fn a_panic_in_a_consumer_comes_through_and_leaves_the_finder_usable() {
    let boxes = vec![Box3::new([0.0; 3], [1.0; 3]); 2000];
    for threads in [1, 0] {
        let mut finder = Finder::with_options(&Options { threads, ..canonical() }).unwrap();
        let panic = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let _ = finder.consume(&boxes, |_| -> ControlFlow<()> { panic!("from the consumer") });
        }))
        .unwrap_err();
        assert_eq!(panic.downcast_ref::<&str>(), Some(&"from the consumer"));
        assert_eq!(finder.find(&boxes[..3]).unwrap().len(), 3);
    }
}

fn pair_set(pairs: &[LivePair]) -> BTreeSet<(u32, u32)> {
    pairs.iter().map(|p| (p.first, p.second)).collect()
}

/// Objects are added, moved and removed at random; each update is the difference of two double
/// loops, and queries are loops over the objects.
#[test]
fn persistent_objects() {
    let mut random = Random(4);
    let mut objects = BroadPhase::new().unwrap();
    let mut model: Vec<Option<Box3>> = vec![];
    let mut before = BTreeSet::new();
    let (mut begun, mut ended) = (0, 0);
    for frame in 0..40 {
        let new = random.boxes(random.0 as usize % 20 + usize::from(frame == 0) * 300);
        for (id, bounds) in objects.add(&new).unwrap().into_iter().zip(&new) {
            model.resize(model.len().max(id as usize + 1), None);
            model[id as usize] = Some(*bounds);
        }
        let alive: Vec<u32> =
            (0..model.len() as u32).filter(|id| model[*id as usize].is_some()).collect();
        let (mut moved, mut removed) = (vec![], vec![]);
        for id in alive {
            match random.below(10) {
                0 => removed.push(id),
                1 | 2 => moved.push(id),
                _ => {}
            }
        }
        let boxes = random.boxes(moved.len());
        objects.move_objects(&moved, &boxes).unwrap();
        objects.remove(&removed).unwrap();
        for (id, bounds) in moved.iter().zip(&boxes) {
            model[*id as usize] = Some(*bounds);
        }
        for id in &removed {
            model[*id as usize] = None;
        }
        assert_eq!(objects.len(), model.iter().flatten().count());
        assert!(removed.iter().all(|id| !objects.contains(*id) && objects.box_of(*id).is_none()));
        assert!(moved.iter().all(|id| objects.box_of(*id) == model[*id as usize]));

        // An absent object is a box that overlaps nothing.
        let nothing = Box3::new([1.0; 3], [0.0; 3]);
        let all: Vec<Box3> = model.iter().map(|b| b.unwrap_or(nothing)).collect();
        let after: BTreeSet<(u32, u32)> =
            of_one_set(&all, |i, j| model[i].is_some() && model[j].is_some())
                .iter()
                .map(|p| (p.first, p.second))
                .collect();
        let events = objects.update().unwrap();
        assert_eq!(pair_set(events.begun), after.difference(&before).copied().collect());
        assert_eq!(pair_set(events.ended), before.difference(&after).copied().collect());
        begun += events.begun.len();
        ended += events.ended.len();
        assert_eq!(pair_set(objects.pairs()), after);
        assert_eq!(objects.pair_count(), after.len());
        let slots: BTreeSet<u32> = objects.pairs().iter().map(|p| p.slot).collect();
        assert_eq!(slots.len(), after.len());
        let id = random.below(all.len() as u32);
        let of_one: BTreeSet<_> =
            after.iter().filter(|p| p.0 == id || p.1 == id).copied().collect();
        assert_eq!(pair_set(&objects.pairs_of(id)), of_one);

        let probes = random.boxes(5);
        assert_eq!(objects.overlaps(&probes).unwrap(), of_two_sets(&probes, &all));
        let mut query = Query::new().unwrap();
        assert_eq!(query.overlaps(&objects, &probes).unwrap(), of_two_sets(&probes, &all));
        let copy = objects.try_clone().unwrap();
        assert_eq!(copy.events(), objects.events());
        before = after;
    }
    assert!(begun > 1000 && ended > 500, "{begun} {ended}");

    let shifted: Vec<Box3> = model.iter().flatten().copied().collect();
    objects.shift_origin([1.0, 0.0, 0.0]).unwrap();
    let id = (0..).find(|id| objects.contains(*id)).unwrap();
    assert_eq!(objects.box_of(id).unwrap().lower[0], shifted[0].lower[0] + 1.0);
    let all = vec![Box3::new([0.0; 3], [1.0; 3]); objects.id_limit()];
    objects.move_all(&all).unwrap();
    objects.update().unwrap();
    let n = objects.len();
    assert_eq!(objects.pair_count(), n * (n - 1) / 2);
    assert!(objects.slot_limit() >= objects.pair_count());
    assert!(objects.memory_bytes() > 0);
}

#[test]
fn filters_of_objects() {
    let mut objects = BroadPhase::new().unwrap();
    let bounds = Box3::new([0.0; 3], [1.0; 3]);
    let fixed = Filter { is_static: true, owner: 5, ..Filter::default() };
    let ids = [
        objects.add_one(bounds, fixed).unwrap(),
        objects.add_one(bounds, Filter { owner: 6, ..fixed }).unwrap(),
        objects.add_one(bounds, Filter::default()).unwrap(),
    ];
    assert_eq!(objects.filter_of(ids[1]), Some(Filter { owner: 6, ..fixed }));
    assert_eq!(objects.filter_of(77), None);
    assert_eq!(objects.update().unwrap().begun.len(), 2);
    let now = Filters { is_static: Some(&[false]), ..Filters::default() };
    objects.set_filters(&ids[1..2], now).unwrap();
    assert_eq!(objects.update().unwrap().begun.len(), 1);
    assert_eq!(objects.filter_of(ids[1]).unwrap().owner, 6);
}

#[test]
fn sweeps() {
    let mut objects = BroadPhase::new().unwrap();
    let boxes: Vec<Box3> =
        (0..10).map(|i| Box3::from_center([i as f32, 0.0, 0.0], [0.25; 3])).collect();
    objects.add(&boxes).unwrap();
    let rays = [Sweep::ray([-1.0, 0.0, 0.0], [16.0, 0.0, 0.0]), Sweep::ray([0.0; 3], [0.0; 3])];
    let hits = objects.sweep(&rays, Hits::All).unwrap();
    assert_eq!(hits.len(), 11);
    for (i, hit) in hits[..10].iter().enumerate() {
        let time = (i as f64 + 0.75) / 16.0;
        assert_eq!(*hit, SweepHit { sweep: 0, object: i as u32, time });
    }
    assert_eq!(hits[10], SweepHit { sweep: 1, object: 0, time: 0.0 });
    let first = objects.sweep(&rays, Hits::First).unwrap().to_vec();
    assert_eq!(first.iter().map(|hit| hit.object).collect::<Vec<_>>(), [0, 0]);
    let owners: Vec<i32> = (0..10).map(|i| i32::from(i > 3)).collect();
    let ids: Vec<u32> = (0..10).collect();
    objects.set_filters(&ids, Filters { owner: Some(&owners), ..Filters::default() }).unwrap();
    let of_owner_0 = Filters { owner: Some(&[0, -1]), ..Filters::default() };
    let hits = objects.sweep_filtered(&rays, Hits::First, of_owner_0).unwrap().to_vec();
    assert_eq!(hits.iter().map(|hit| hit.object).collect::<Vec<_>>(), [4, 0]);
    let mut query = Query::new().unwrap();
    assert_eq!(query.sweep(&objects, &rays, Hits::First, of_owner_0).unwrap(), hits);
    assert_eq!(query.report().found, 2);
}

/// Along the axes, where the distance is a difference.
#[test]
fn rays() {
    let mut random = Random(5);
    let boxes = random.boxes(200);
    let mut objects = BroadPhase::new().unwrap();
    let groups: Vec<u32> = (0..200).map(|i| 1 << (i % 2)).collect();
    objects.add(Boxes::from(&boxes).group(&groups)).unwrap();
    let mut query = Query::new().unwrap();
    let mut counts = [0; 2];
    for k in (0..3).cycle().take(300) {
        let mut origin = [random.half(12), random.half(12), random.half(12)];
        origin[k] = -2.0;
        let mut direction = [0.0; 3];
        direction[k] = 3.0;
        let (limit, layers) = (f64::from(random.below(20)), 1 + random.below(3));
        let closest = (0..boxes.len())
            .filter(|i| groups[*i] & layers != 0)
            .filter(|i| {
                let b = &boxes[*i];
                (0..3).all(|a| a == k || (b.lower[a] <= origin[a] && origin[a] <= b.upper[a]))
            })
            .map(|i| (f64::from(boxes[i].lower[k]) + 2.0, i as u32))
            .min_by(|a, b| a.partial_cmp(b).unwrap())
            .filter(|(distance, _)| *distance <= limit);
        let got = objects.raycast(origin, direction, limit, layers).unwrap();
        assert_eq!(got.map(|hit| (hit.distance, hit.object)), closest);
        counts[usize::from(got.is_some())] += 1;
        if let Some(hit) = got {
            assert_eq!((hit.normal[k], hit.point[k]), (-1.0, (hit.distance - 2.0) as f32));
        }
        let of_ray = Filter { mask: layers, ..Filter::default() };
        let accept = |_| true;
        let same = query.raycast(&objects, origin, direction, limit, of_ray, accept).unwrap();
        assert_eq!(same, got);
        let other = |id| got.is_none_or(|hit| hit.object != id);
        let next = query.raycast(&objects, origin, direction, limit, of_ray, other).unwrap();
        assert!(next.is_none_or(|next| {
            let hit = got.unwrap();
            next.object != hit.object && next.distance >= hit.distance
        }));
    }
    assert!(counts[0] > 20 && counts[1] > 20, "{counts:?}");
}

#[test]
fn a_panic_in_a_filter_of_a_ray_comes_through() {
    let mut objects = BroadPhase::new().unwrap();
    for _ in 0..3 {
        objects.add(&Box3::from_center([4.0, 0.0, 0.0], [1.0; 3])).unwrap();
    }
    let calls = AtomicUsize::new(0);
    let mut query = Query::new().unwrap();
    let (x, ray) = ([1.0, 0.0, 0.0], Filter::default());
    let panic = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        query.raycast(&objects, [0.0; 3], x, 9.0, ray, |_| {
            calls.fetch_add(1, Ordering::Relaxed);
            panic!("from the filter")
        })
    }))
    .unwrap_err();
    assert_eq!(panic.downcast_ref::<&str>(), Some(&"from the filter"));
    assert_eq!(calls.load(Ordering::Relaxed), 1, "not called again after a panic");
    let hit = query.raycast(&objects, [0.0; 3], x, 9.0, ray, |_| true).unwrap();
    assert_eq!(hit.unwrap().distance, 3.0);
}

#[test]
fn types_are_send_and_sync() {
    fn check<T: Send + Sync>() {}
    check::<Finder>();
    check::<BroadPhase>();
    check::<Query>();
    check::<MeshFinder>();
    check::<Boxes<'_>>();
    check::<Error>();
}

/// Flat squares of two triangles at heights 0, 1, 2, ..., and a wall through all of them.
#[test]
fn meshes() {
    let (mut vertices, mut triangles) = (vec![], vec![]);
    for floor in 0..6u32 {
        let z = floor as f32;
        vertices.extend([[0.0, 0.0, z], [8.0, 0.0, z], [0.0, 8.0, z], [8.0, 8.0, z]]);
        triangles.extend([[0, 1, 2], [1, 2, 3]].map(|t: [u32; 3]| t.map(|v| v + 4 * floor)));
    }
    // In the half of the first triangle of each floor.
    let wall = [[1.0, 1.0, -1.0], [2.0, 1.0, -1.0], [1.0, 1.0, 9.0]];
    let floors = Mesh::new(&vertices, &triangles);
    let wall = Mesh::new(&wall, &[[0, 1, 2]]);
    assert_eq!(self_intersections(&floors).unwrap(), []);
    let want: Vec<Pair> = (0..6).map(|floor| Pair { first: 2 * floor, second: 0 }).collect();
    assert_eq!(sorted(intersections(&floors, &wall).unwrap()), want);
    // Each of two triangles to each of two, of 5 pairs of neighbors.
    assert_eq!(self_within(&floors, 1.0).unwrap().len(), 5 * 4);
    assert_eq!(self_within(&floors, 0.5).unwrap(), []);
    let mut finder = MeshFinder::with_options(&canonical()).unwrap();
    assert_eq!(finder.intersections(&floors, &wall).unwrap(), want);
    // The wall moved away, and in doubles.
    let away = [[1.0, 0.0, 0.0, 100.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    assert_eq!(finder.intersections(&floors, &wall.transform(&away)).unwrap(), []);
    let doubles: Vec<[f64; 3]> = vertices.iter().map(|v| v.map(f64::from)).collect();
    let exact = Mesh::from_doubles(&doubles, &triangles);
    assert_eq!(within(&exact, &wall, 0.0).unwrap().len(), 6);
    let fixed = Filters { is_static: Some(&[true; 12]), ..Filters::default() };
    assert_eq!(finder.self_within(&exact.filters(fixed), 1.0).unwrap(), []);
    assert!(finder.memory_bytes() > 0);
}
