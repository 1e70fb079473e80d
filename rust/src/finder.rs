//! All pairs at once.

use std::any::Any;
use std::ffi::{c_int, c_void};
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::ptr::{self, NonNull};

use crate::boxes::{Boxes, Pair};
use crate::error::{Error, STOPPED};
use crate::handle::{list, owned_handle};
use crate::options::{InvertedPolicy, Options};
use crate::sys;

/// Finds the pairs of overlapping boxes, each once, in any order. A box with lower > upper is an
/// error.
///
/// ```
/// use throng::Box3;
/// let boxes = [Box3::new([0.0; 3], [1.0; 3]), Box3::new([1.0, 0.0, 0.0], [2.0, 1.0, 1.0])];
/// let pairs = throng::find_pairs(&boxes)?;
/// assert_eq!((pairs[0].first, pairs[0].second), (0, 1)); // touching counts
/// # Ok::<(), throng::Error>(())
/// ```
pub fn find_pairs<'a>(boxes: impl Into<Boxes<'a>>) -> Result<Vec<Pair>, Error> {
    Ok(short_form()?.find(boxes)?.to_vec())
}

/// Finds the pairs of a box of `a` and one of `b` that overlap, as [`find_pairs`].
///
/// ```
/// use throng::Box3;
/// let zones = [Box3::new([0.0; 3], [4.0; 3]), Box3::new([5.0; 3], [9.0; 3])];
/// let people = [Box3::new([6.0; 3], [7.0; 3])];
/// let pairs = throng::find_pairs_between(&zones, &people)?;
/// assert_eq!((pairs[0].first, pairs[0].second), (1, 0));
/// # Ok::<(), throng::Error>(())
/// ```
pub fn find_pairs_between<'a, 'b>(
    a: impl Into<Boxes<'a>>,
    b: impl Into<Boxes<'b>>,
) -> Result<Vec<Pair>, Error> {
    Ok(short_form()?.find_between(a, b)?.to_vec())
}

fn short_form() -> Result<Finder, Error> {
    Finder::with_options(&Options { inverted: InvertedPolicy::Refuse, ..Options::default() })
}

/// Finds pairs and keeps its memory from call to call: a call allocates nothing if an earlier one
/// handled a scene of the same size.
///
/// It is [`Send`] and [`Sync`]: any thread may use it, one at a time, as `&mut` ensures. The
/// library takes threads of its own for a call ([`Options::threads`]).
///
/// ```
/// use throng::{Box3, Finder, Options, Order};
/// let mut finder = Finder::with_options(&Options { order: Order::Canonical, ..Options::default() })?;
/// let mut boxes = vec![Box3::new([0.0; 3], [1.0; 3]), Box3::new([3.0; 3], [4.0; 3])];
/// for frame in 0..4 {
///     let pairs = finder.find(&boxes)?;
///     assert_eq!(pairs.len(), usize::from(frame >= 2));
///     for k in 0..3 {
///         boxes[0].lower[k] += 1.0;
///         boxes[0].upper[k] += 1.0;
///     }
/// }
/// # Ok::<(), throng::Error>(())
/// ```
pub struct Finder {
    handle: NonNull<sys::throng_finder>,
}

owned_handle!(
    Finder,
    throng_finder,
    throng_finder_create,
    throng_finder_destroy,
    throng_finder_result
);

impl Finder {
    /// Finds the pairs of overlapping boxes. The finder stores them until the next call.
    pub fn find<'a>(&mut self, boxes: impl Into<Boxes<'a>>) -> Result<&[Pair], Error> {
        let a = boxes.into().raw()?;
        self.find_raw(&a, ptr::null())
    }

    /// Finds the pairs of a box of `a` and one of `b`.
    pub fn find_between<'a, 'b>(
        &mut self,
        a: impl Into<Boxes<'a>>,
        b: impl Into<Boxes<'b>>,
    ) -> Result<&[Pair], Error> {
        let (a, b) = (a.into().raw()?, b.into().raw()?);
        self.find_raw(&a, &b)
    }

    /// Passes blocks of pairs to `consumer` and stores none: for more pairs than memory. See
    /// [`Options::memory_cap_bytes`]. Returns what the consumer returned: `Break` ends the search.
    /// Threads of the library may call it, one at a time. If it panics, the search ends and the
    /// panic continues here.
    ///
    /// ```
    /// use std::ops::ControlFlow;
    /// let boxes = vec![throng::Box3::new([0.0; 3], [1.0; 3]); 100];
    /// let mut count = 0;
    /// let stopped = throng::Finder::new()?.consume(&boxes, |pairs| {
    ///     count += pairs.len();
    ///     ControlFlow::<()>::Continue(())
    /// })?;
    /// assert_eq!((stopped, count), (ControlFlow::Continue(()), 4950));
    /// # Ok::<(), throng::Error>(())
    /// ```
    pub fn consume<'a, B: Send>(
        &mut self,
        boxes: impl Into<Boxes<'a>>,
        consumer: impl FnMut(&[Pair]) -> ControlFlow<B> + Send,
    ) -> Result<ControlFlow<B>, Error> {
        let a = boxes.into().raw()?;
        self.consume_raw(&a, ptr::null(), consumer)
    }

    /// The same for pairs of a box of `a` and one of `b`.
    pub fn consume_between<'a, 'b, B: Send>(
        &mut self,
        a: impl Into<Boxes<'a>>,
        b: impl Into<Boxes<'b>>,
        consumer: impl FnMut(&[Pair]) -> ControlFlow<B> + Send,
    ) -> Result<ControlFlow<B>, Error> {
        let (a, b) = (a.into().raw()?, b.into().raw()?);
        self.consume_raw(&a, &b, consumer)
    }

    /// Bytes that the finder holds now.
    pub fn memory_bytes(&self) -> usize {
        // SAFETY: the handle is alive.
        unsafe { sys::throng_finder_memory_bytes(self.handle.as_ptr()) }
    }

    fn find_raw(
        &mut self,
        a: &sys::throng_boxes,
        b: *const sys::throng_boxes,
    ) -> Result<&[Pair], Error> {
        let handle = self.handle.as_ptr();
        // SAFETY: the handle is alive; `a` and `b` are views of borrowed arrays, or null.
        self.check(unsafe { sys::throng_find(handle, a, b) })?;
        // SAFETY: the pairs stay until the next call, which needs `&mut self`.
        Ok(unsafe { list(|count| sys::throng_finder_pairs(handle, count)) })
    }

    fn consume_raw<B: Send, F: FnMut(&[Pair]) -> ControlFlow<B> + Send>(
        &mut self,
        a: &sys::throng_boxes,
        b: *const sys::throng_boxes,
        consumer: F,
    ) -> Result<ControlFlow<B>, Error> {
        let mut state = Consumer { consumer, ended: None };
        let context: *mut Consumer<B, F> = &mut state;
        // SAFETY: the handle is alive; `a` and `b` are views of borrowed arrays, or null; the
        // context outlives the call and has the type that the function expects.
        let status = unsafe {
            sys::throng_consume(self.handle.as_ptr(), a, b, pass_block::<B, F>, context.cast())
        };
        match state.ended {
            Some(Ended::Panicked(panic)) => resume_unwind(panic),
            Some(Ended::Stopped(value)) if status == STOPPED => Ok(ControlFlow::Break(value)),
            _ => self.check(status).map(|()| ControlFlow::Continue(())),
        }
    }
}

enum Ended<B> {
    Stopped(B),
    Panicked(Box<dyn Any + Send>),
}

struct Consumer<B, F> {
    consumer: F,
    ended: Option<Ended<B>>,
}

/// Calls the consumer; returns 0 to stop. A panic must not reach the C++ code that called this.
///
/// # Safety
/// `context` points to a `Consumer<B, F>` that no other thread uses now; `pairs` has `count` pairs.
unsafe extern "C" fn pass_block<B, F: FnMut(&[Pair]) -> ControlFlow<B>>(
    context: *mut c_void,
    pairs: *const Pair,
    count: usize,
) -> c_int {
    // SAFETY: as above; the library calls it once at a time.
    let state = unsafe { &mut *context.cast::<Consumer<B, F>>() };
    if state.ended.is_some() {
        return 0;
    }
    // SAFETY: as above.
    let block = unsafe {
        list(|to| {
            *to = count;
            pairs
        })
    };
    match catch_unwind(AssertUnwindSafe(|| (state.consumer)(block))) {
        Ok(ControlFlow::Continue(())) => return 1,
        Ok(ControlFlow::Break(value)) => state.ended = Some(Ended::Stopped(value)),
        Err(panic) => state.ended = Some(Ended::Panicked(panic)),
    }
    0
}
