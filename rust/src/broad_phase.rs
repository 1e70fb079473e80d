//! Persistent objects: begin and end events, and queries.

use std::any::Any;
use std::ffi::{c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::ptr::{self, NonNull};
use std::sync::Mutex;

use crate::boxes::{Box3, Boxes, Filters, Pair};
use crate::error::Error;
use crate::handle::{list, owned_handle};
use crate::sys;

/// The number of an object: 0, 1, 2, ... if none was removed. The number of a removed object is
/// used again after an update has reported the pairs that its removal ended.
pub type ObjectId = u32;

/// A pair of objects, first < second. The slot belongs to the pair while it exists: a small number,
/// as an index for data per pair, such as contacts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(C)]
pub struct LivePair {
    /// The object with the smaller id.
    pub first: ObjectId,
    /// The object with the larger id.
    pub second: ObjectId,
    /// The slot of the pair.
    pub slot: u32,
}

/// A box that moves linearly by `by` in the time from 0 to 1. A point box is a ray.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Sweep {
    /// The box at time 0.
    pub start: Box3,
    /// The way, in world units; finite.
    pub by: [f32; 3],
}

impl Sweep {
    /// The ray from `origin` to `origin + by`.
    pub const fn ray(origin: [f32; 3], by: [f32; 3]) -> Self {
        Self { start: Box3::new(origin, origin), by }
    }
}

/// A hit of a sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct SweepHit {
    /// The index of the sweep.
    pub sweep: u32,
    /// The object.
    pub object: ObjectId,
    /// The time of first contact, 0 to 1; 0 if they touch at the start.
    pub time: f64,
}

/// The closest hit of a ray. A ray that starts in the box has distance 0, point its origin, normal
/// the opposite of its direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct RayHit {
    /// The object.
    pub object: ObjectId,
    /// World units.
    pub distance: f64,
    /// A point of the object's box.
    pub point: [f32; 3],
    /// Of length 1: of the face that the ray enters.
    pub normal: [f32; 3],
}

impl RayHit {
    fn if_any(self) -> Option<Self> {
        (self.object != sys::THRONG_NO_OBJECT).then_some(self)
    }
}

/// Which hits of a sweep are reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(i32)]
pub enum Hits {
    /// Every object hit, by id.
    All = 0,
    /// The first object hit; of simultaneous ones the lowest id.
    First = 1,
}

/// The filter values of one object. See [`Filters`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Filter {
    /// See [`Filters::group`].
    pub group: u32,
    /// See [`Filters::mask`].
    pub mask: u32,
    /// See [`Filters::owner`].
    pub owner: i32,
    /// See [`Filters::world`].
    pub world: i32,
    /// See [`Filters::is_static`].
    pub is_static: bool,
}

impl Default for Filter {
    /// Allows every pair.
    fn default() -> Self {
        Self { group: u32::MAX, mask: u32::MAX, owner: -1, world: -1, is_static: false }
    }
}

/// What an update changed; each list is sorted by first, then second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Events<'a> {
    /// The pairs that began to overlap.
    pub begun: &'a [LivePair],
    /// The pairs that ended. Their slots are free: the next update may use them again.
    pub ended: &'a [LivePair],
}

/// Keeps objects from frame to frame, and reports which pairs began and ended. The cost follows the
/// objects that changed. A call that fails changes nothing.
///
/// It is [`Send`] and [`Sync`]: calls that change it need `&mut`. Several threads may call functions
/// of `&BroadPhase` at once, and query it, each through its own [`Query`].
///
/// ```
/// use throng::{Box3, BroadPhase};
/// let mut objects = BroadPhase::new()?;
/// let ids = objects.add(&[Box3::new([0.0; 3], [1.0; 3]), Box3::new([5.0; 3], [6.0; 3])])?;
/// assert!(objects.update()?.begun.is_empty());
///
/// objects.move_objects(&ids[1..], &Box3::new([1.0; 3], [2.0; 3]))?;
/// let events = objects.update()?;
/// assert_eq!((events.begun[0].first, events.begun[0].second), (ids[0], ids[1]));
///
/// objects.remove(&ids[..1])?;
/// assert_eq!(objects.update()?.ended.len(), 1);
/// # Ok::<(), throng::Error>(())
/// ```
pub struct BroadPhase {
    handle: NonNull<sys::throng_broad_phase>,
}

owned_handle!(
    BroadPhase,
    throng_broad_phase,
    throng_broad_phase_create,
    throng_broad_phase_destroy,
    throng_broad_phase_result
);

impl BroadPhase {
    /// Adds one object per box, with the filters of the view. Returns their ids.
    pub fn add<'a>(&mut self, boxes: impl Into<Boxes<'a>>) -> Result<Vec<ObjectId>, Error> {
        let raw = boxes.into().raw()?;
        let mut ids = vec![0; raw.count];
        // SAFETY: the handle is alive, `raw` a view of borrowed arrays, and there is space for the
        // ids.
        self.check(unsafe {
            sys::throng_broad_phase_add(self.handle.as_ptr(), &raw, ids.as_mut_ptr())
        })?;
        Ok(ids)
    }

    /// Adds one object.
    pub fn add_one(&mut self, bounds: Box3, filter: Filter) -> Result<ObjectId, Error> {
        let boxes = Boxes::from(&bounds)
            .group(std::slice::from_ref(&filter.group))
            .mask(std::slice::from_ref(&filter.mask))
            .owner(std::slice::from_ref(&filter.owner))
            .world(std::slice::from_ref(&filter.world))
            .is_static(std::slice::from_ref(&filter.is_static));
        Ok(self.add(boxes)?[0])
    }

    /// Removes objects. An id that is not alive, or occurs twice in the list, is an error.
    pub fn remove(&mut self, ids: &[ObjectId]) -> Result<(), Error> {
        // SAFETY: the handle is alive; the ids are borrowed.
        self.check(unsafe {
            sys::throng_broad_phase_remove(self.handle.as_ptr(), ids.as_ptr(), ids.len())
        })
    }

    /// Sets the boxes of objects, one per id. The last of several calls before an update wins.
    /// Filters of the view are ignored.
    pub fn move_objects<'a>(
        &mut self,
        ids: &[ObjectId],
        boxes: impl Into<Boxes<'a>>,
    ) -> Result<(), Error> {
        let raw = boxes.into().raw()?;
        if raw.count != ids.len() {
            return Err(Error::bad_boxes(format!(
                "there are {} boxes for {} ids; give one box per id",
                raw.count,
                ids.len()
            )));
        }
        // SAFETY: the handle is alive; there are as many ids as boxes.
        self.check(unsafe {
            sys::throng_broad_phase_move(self.handle.as_ptr(), ids.as_ptr(), &raw)
        })
    }

    /// Sets the boxes of all objects: the box at index `id`, for each id below
    /// [`id_limit`](Self::id_limit). Detects which changed.
    pub fn move_all<'a>(&mut self, boxes: impl Into<Boxes<'a>>) -> Result<(), Error> {
        let raw = boxes.into().raw()?;
        // SAFETY: the handle is alive; `raw` is a view of borrowed arrays.
        self.check(unsafe { sys::throng_broad_phase_move_all(self.handle.as_ptr(), &raw) })
    }

    /// Sets the filters of objects, one value per id. Absent filters stay unchanged.
    pub fn set_filters(&mut self, ids: &[ObjectId], filters: Filters<'_>) -> Result<(), Error> {
        let mut raw = sys::throng_boxes { count: ids.len(), ..sys::throng_boxes::EMPTY };
        filters.write(ids.len(), &mut raw)?;
        // SAFETY: the handle is alive; each filter has a value per id.
        self.check(unsafe {
            sys::throng_broad_phase_set_filters(self.handle.as_ptr(), ids.as_ptr(), &raw)
        })
    }

    /// Adds `by` to all corners, rounded to nearest.
    pub fn shift_origin(&mut self, by: [f32; 3]) -> Result<(), Error> {
        // SAFETY: the handle is alive; there are three floats.
        self.check(unsafe {
            sys::throng_broad_phase_shift_origin(self.handle.as_ptr(), by.as_ptr())
        })
    }

    /// Finds the pairs that began and ended since the last update.
    pub fn update(&mut self) -> Result<Events<'_>, Error> {
        // SAFETY: the handle is alive.
        self.check(unsafe { sys::throng_broad_phase_update(self.handle.as_ptr()) })?;
        Ok(self.events())
    }

    /// The events of the last update.
    pub fn events(&self) -> Events<'_> {
        let handle = self.handle.as_ptr();
        // SAFETY: the lists stay until the next update, which needs `&mut self`.
        unsafe {
            Events {
                begun: list(|count| sys::throng_broad_phase_begun(handle, count)),
                ended: list(|count| sys::throng_broad_phase_ended(handle, count)),
            }
        }
    }

    /// All pairs of the last update, sorted by first, then second. Sorts once after an update.
    pub fn pairs(&mut self) -> &[LivePair] {
        let handle = self.handle.as_ptr();
        // SAFETY: the pairs stay until the next update, which needs `&mut self`.
        unsafe { list(|count| sys::throng_broad_phase_pairs(handle, count)) }
    }

    /// The pairs of one object, sorted by the other one; none for an id without pairs.
    pub fn pairs_of(&self, id: ObjectId) -> Vec<LivePair> {
        let handle = self.handle.as_ptr();
        // SAFETY: the handle is alive; nothing is written at capacity 0.
        let count = unsafe { sys::throng_broad_phase_pairs_of(handle, id, ptr::null_mut(), 0) };
        let mut pairs = vec![LivePair::default(); count];
        // SAFETY: there is space for all pairs; none is added while `self` is borrowed.
        unsafe { sys::throng_broad_phase_pairs_of(handle, id, pairs.as_mut_ptr(), count) };
        pairs
    }

    /// The objects that each box overlaps: `first` is the index of the box, `second` the object;
    /// sorted. This and other queries see the current boxes, whether or not an update followed.
    pub fn overlaps<'a>(&mut self, boxes: impl Into<Boxes<'a>>) -> Result<&[Pair], Error> {
        let raw = boxes.into().raw()?;
        let handle = self.handle.as_ptr();
        // SAFETY: the handle is alive; `raw` is a view of borrowed arrays.
        self.check(unsafe { sys::throng_broad_phase_find_overlaps(handle, &raw) })?;
        // SAFETY: the list stays until the next query, which needs `&mut self`.
        Ok(unsafe { list(|count| sys::throng_broad_phase_overlaps(handle, count)) })
    }

    /// Casts one ray: the closest hit within `max_distance` (world units; `f64::INFINITY`: no limit),
    /// touching included. The direction has any length but 0. Objects are considered if their group
    /// has a bit of `layer_mask`; `u32::MAX` for all.
    ///
    /// ```
    /// use throng::{Box3, BroadPhase};
    /// let mut objects = BroadPhase::new()?;
    /// let ids = objects.add(&Box3::new([4.0, -1.0, -1.0], [5.0, 1.0, 1.0]))?;
    /// let hit = objects.raycast([0.0; 3], [1.0, 0.0, 0.0], 100.0, u32::MAX)?.unwrap();
    /// assert_eq!((hit.object, hit.distance, hit.normal), (ids[0], 4.0, [-1.0, 0.0, 0.0]));
    /// assert!(objects.raycast([0.0; 3], [1.0, 0.0, 0.0], 3.0, u32::MAX)?.is_none());
    /// # Ok::<(), throng::Error>(())
    /// ```
    pub fn raycast(
        &mut self,
        origin: [f32; 3],
        direction: [f32; 3],
        max_distance: f64,
        layer_mask: u32,
    ) -> Result<Option<RayHit>, Error> {
        let mut hit = RayHit::default();
        // SAFETY: the handle is alive; both arrays have three floats.
        self.check(unsafe {
            sys::throng_broad_phase_raycast(
                self.handle.as_ptr(),
                origin.as_ptr(),
                direction.as_ptr(),
                max_distance,
                layer_mask,
                &mut hit,
            )
        })?;
        Ok(hit.if_any())
    }

    /// Shape casts, ray casts for point boxes: the objects that each sweep hits, sorted by sweep.
    ///
    /// ```
    /// use throng::{Box3, BroadPhase, Hits, Sweep};
    /// let mut objects = BroadPhase::new()?;
    /// let ids = objects.add(&Box3::new([4.0, -1.0, -1.0], [5.0, 1.0, 1.0]))?;
    /// let ray = Sweep::ray([0.0; 3], [8.0, 0.0, 0.0]);
    /// let hits = objects.sweep(&[ray], Hits::First)?;
    /// assert_eq!((hits[0].object, hits[0].time), (ids[0], 0.5));
    /// # Ok::<(), throng::Error>(())
    /// ```
    pub fn sweep(&mut self, sweeps: &[Sweep], which: Hits) -> Result<&[SweepHit], Error> {
        self.sweep_filtered(sweeps, which, Filters::default())
    }

    /// The same with filters, one value per sweep.
    pub fn sweep_filtered(
        &mut self,
        sweeps: &[Sweep],
        which: Hits,
        filters: Filters<'_>,
    ) -> Result<&[SweepHit], Error> {
        let raw = raw_filters(sweeps, filters)?;
        let (handle, first) = (self.handle.as_ptr(), sweeps.as_ptr());
        // SAFETY: the handle is alive; each filter has a value per sweep.
        self.check(unsafe {
            sys::throng_broad_phase_find_hits(handle, first, sweeps.len(), which as c_int, &raw)
        })?;
        // SAFETY: the list stays until the next query, which needs `&mut self`.
        Ok(unsafe { list(|count| sys::throng_broad_phase_hits(handle, count)) })
    }

    /// Whether the id is that of an object.
    pub fn contains(&self, id: ObjectId) -> bool {
        // SAFETY: the handle is alive.
        unsafe { sys::throng_broad_phase_is_alive(self.handle.as_ptr(), id) != 0 }
    }

    /// The box given last; none for an id that is not alive.
    pub fn box_of(&self, id: ObjectId) -> Option<Box3> {
        let mut bounds = Box3::default();
        // SAFETY: the handle is alive.
        let status = unsafe { sys::throng_broad_phase_box(self.handle.as_ptr(), id, &mut bounds) };
        (status == crate::error::OK).then_some(bounds)
    }

    /// The filter values; none for an id that is not alive.
    pub fn filter_of(&self, id: ObjectId) -> Option<Filter> {
        let mut filter = sys::throng_filter { group: 0, mask: 0, owner: 0, world: 0, is_static: 0 };
        // SAFETY: the handle is alive.
        let status =
            unsafe { sys::throng_broad_phase_filter(self.handle.as_ptr(), id, &mut filter) };
        let sys::throng_filter { group, mask, owner, world, is_static } = filter;
        (status == crate::error::OK).then_some(Filter {
            group,
            mask,
            owner,
            world,
            is_static: is_static != 0,
        })
    }

    /// The number of objects.
    pub fn len(&self) -> usize {
        // SAFETY: the handle is alive.
        unsafe { sys::throng_broad_phase_object_count(self.handle.as_ptr()) as usize }
    }

    /// Whether there is no object.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The number of pairs of the last update.
    pub fn pair_count(&self) -> usize {
        // SAFETY: the handle is alive.
        unsafe { sys::throng_broad_phase_pair_count(self.handle.as_ptr()) as usize }
    }

    /// All ids are below this.
    pub fn id_limit(&self) -> usize {
        // SAFETY: the handle is alive.
        unsafe { sys::throng_broad_phase_id_limit(self.handle.as_ptr()) as usize }
    }

    /// All slots of current pairs, and of those that ended in the last update, are below this.
    pub fn slot_limit(&self) -> usize {
        // SAFETY: the handle is alive.
        unsafe { sys::throng_broad_phase_slot_limit(self.handle.as_ptr()) as usize }
    }

    /// A copy with the same ids, slots and events, and the default options except for the margin.
    /// Meanwhile calls of other threads, also of `&self`, return `Code::Busy`.
    pub fn try_clone(&self) -> Result<Self, Error> {
        let copy = Self::new()?;
        // SAFETY: both handles are alive.
        copy.check(unsafe {
            sys::throng_broad_phase_copy(copy.handle.as_ptr(), self.handle.as_ptr())
        })?;
        Ok(copy)
    }

    /// Bytes held now.
    pub fn memory_bytes(&self) -> usize {
        // SAFETY: the handle is alive.
        unsafe { sys::throng_broad_phase_memory_bytes(self.handle.as_ptr()) }
    }
}

fn raw_filters(sweeps: &[Sweep], filters: Filters<'_>) -> Result<sys::throng_boxes, Error> {
    let mut raw = sys::throng_boxes { count: sweeps.len(), ..sys::throng_boxes::EMPTY };
    filters.write(sweeps.len(), &mut raw)?;
    Ok(raw)
}

/// Queries of one thread, while others query the same [`BroadPhase`].
///
/// ```
/// use throng::{Box3, BroadPhase, Query};
/// let mut objects = BroadPhase::new()?;
/// objects.add(&[Box3::new([0.0; 3], [1.0; 3]), Box3::new([2.0; 3], [3.0; 3])])?;
/// std::thread::scope(|scope| {
///     for x in [0.5, 2.5] {
///         let objects = &objects;
///         scope.spawn(move || {
///             let mut query = Query::new().unwrap();
///             let found = query.overlaps(objects, &Box3::new([x; 3], [x; 3])).unwrap();
///             assert_eq!(found.len(), 1);
///         });
///     }
/// });
/// # Ok::<(), throng::Error>(())
/// ```
pub struct Query {
    handle: NonNull<sys::throng_query>,
}

owned_handle!(Query, throng_query, throng_query_create, throng_query_destroy, throng_query_result);

impl Query {
    /// As [`BroadPhase::overlaps`].
    pub fn overlaps<'a>(
        &mut self,
        objects: &BroadPhase,
        boxes: impl Into<Boxes<'a>>,
    ) -> Result<&[Pair], Error> {
        let raw = boxes.into().raw()?;
        let handle = self.handle.as_ptr();
        // SAFETY: both handles are alive; `raw` is a view of borrowed arrays.
        self.check(unsafe {
            sys::throng_query_find_overlaps(handle, objects.handle.as_ptr(), &raw)
        })?;
        // SAFETY: the list stays until the next query, which needs `&mut self`.
        Ok(unsafe { list(|count| sys::throng_query_overlaps(handle, count)) })
    }

    /// As [`BroadPhase::sweep_filtered`].
    pub fn sweep(
        &mut self,
        objects: &BroadPhase,
        sweeps: &[Sweep],
        which: Hits,
        filters: Filters<'_>,
    ) -> Result<&[SweepHit], Error> {
        let raw = raw_filters(sweeps, filters)?;
        let handle = self.handle.as_ptr();
        // SAFETY: both handles are alive; each filter has a value per sweep; no exact test.
        self.check(unsafe {
            sys::throng_query_find_hits(
                handle,
                objects.handle.as_ptr(),
                sweeps.as_ptr(),
                sweeps.len(),
                which as c_int,
                &raw,
                ptr::null_mut(),
                ptr::null_mut(),
            )
        })?;
        // SAFETY: the list stays until the next query, which needs `&mut self`.
        Ok(unsafe { list(|count| sys::throng_query_hits(handle, count)) })
    }

    /// As [`BroadPhase::raycast`], with the filter values of the ray (its mask is the layer mask),
    /// and past objects that `accept` refuses. `accept` returns the same for an object each time,
    /// and may be called by threads of the library. If it panics, the panic continues here.
    ///
    /// ```
    /// use throng::{Box3, BroadPhase, Filter, Query};
    /// let mut objects = BroadPhase::new()?;
    /// let muzzle = objects.add_one(Box3::from_center([0.0; 3], [1.0; 3]), Filter::default())?;
    /// let target = objects.add_one(Box3::from_center([9.0; 3], [1.0; 3]), Filter::default())?;
    /// let (ray, mut query) = (Filter::default(), Query::new()?);
    /// let hit = query.raycast(&objects, [0.0; 3], [1.0; 3], f64::INFINITY, ray, |id| id != muzzle)?;
    /// assert_eq!(hit.unwrap().object, target);
    /// # Ok::<(), throng::Error>(())
    /// ```
    pub fn raycast<F: Fn(ObjectId) -> bool + Sync>(
        &mut self,
        objects: &BroadPhase,
        origin: [f32; 3],
        direction: [f32; 3],
        max_distance: f64,
        of_ray: Filter,
        accept: F,
    ) -> Result<Option<RayHit>, Error> {
        let Filter { group, mask, owner, world, is_static } = of_ray;
        let filter =
            sys::throng_filter { group, mask, owner, world, is_static: u8::from(is_static) };
        let acceptor = Acceptor { accept, panic: Mutex::new(None) };
        let context: *const Acceptor<F> = &acceptor;
        let mut hit = RayHit::default();
        // SAFETY: both handles are alive; both arrays have three floats; the context outlives the
        // call and has the type that the function expects.
        let status = unsafe {
            sys::throng_query_raycast(
                self.handle.as_ptr(),
                objects.handle.as_ptr(),
                origin.as_ptr(),
                direction.as_ptr(),
                max_distance,
                &filter,
                accepts::<F>,
                context.cast_mut().cast(),
                &mut hit,
            )
        };
        if let Some(panic) = acceptor.panic.into_inner().unwrap_or_else(|held| held.into_inner()) {
            resume_unwind(panic);
        }
        self.check(status)?;
        Ok(hit.if_any())
    }
}

struct Acceptor<F> {
    accept: F,
    panic: Mutex<Option<Box<dyn Any + Send>>>,
}

/// A panic must not reach the C++ code that called this: it counts as a refusal.
///
/// # Safety
/// `context` points to an `Acceptor<F>`.
unsafe extern "C" fn accepts<F: Fn(ObjectId) -> bool + Sync>(
    context: *mut c_void,
    object: ObjectId,
) -> c_int {
    // SAFETY: as above; several threads may share it.
    let acceptor = unsafe { &*context.cast::<Acceptor<F>>() };
    let ended = acceptor.panic.lock().unwrap_or_else(|held| held.into_inner()).is_some();
    if ended {
        return 0;
    }
    catch_unwind(AssertUnwindSafe(|| (acceptor.accept)(object))).map_or_else(
        |panic| {
            let mut first = acceptor.panic.lock().unwrap_or_else(|held| held.into_inner());
            first.get_or_insert(panic);
            0
        },
        c_int::from,
    )
}
