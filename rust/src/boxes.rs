//! Boxes, and views of them with filters.

use std::ffi::c_void;

use crate::error::Error;
use crate::sys;

/// An axis-aligned box in world units. It is closed: touching boxes overlap. A box with
/// lower > upper on some axis overlaps nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Box3 {
    /// The corner with the smallest coordinates x, y, z.
    pub lower: [f32; 3],
    /// The corner with the largest coordinates.
    pub upper: [f32; 3],
}

impl Box3 {
    /// From minimum and maximum corner.
    pub const fn new(lower: [f32; 3], upper: [f32; 3]) -> Self {
        Self { lower, upper }
    }

    /// The smallest box that contains `center - half_size` to `center + half_size`.
    ///
    /// ```
    /// let b = throng::Box3::from_center([1.0, 2.0, 3.0], [0.5, 1.0, 0.0]);
    /// assert_eq!(b, throng::Box3::new([0.5, 1.0, 3.0], [1.5, 3.0, 3.0]));
    /// ```
    pub fn from_center(center: [f32; 3], half_size: [f32; 3]) -> Self {
        // SAFETY: both arrays have three floats.
        unsafe { sys::throng_box_from_center(center.as_ptr(), half_size.as_ptr()) }
    }

    /// The smallest box that contains the box of doubles.
    pub fn round_outward(lower: [f64; 3], upper: [f64; 3]) -> Self {
        // SAFETY: both arrays have three doubles.
        unsafe { sys::throng_round_outward(lower.as_ptr(), upper.as_ptr()) }
    }

    /// Whether the boxes have a common point.
    pub fn overlaps(&self, other: &Self) -> bool {
        (0..3).all(|k| self.lower[k] <= other.upper[k] && other.lower[k] <= self.upper[k])
    }
}

impl From<([f32; 3], [f32; 3])> for Box3 {
    fn from((lower, upper): ([f32; 3], [f32; 3])) -> Self {
        Self { lower, upper }
    }
}

/// Two indices. Within one set `first < second`. In two sets `first` is an index of the first set,
/// `second` of the second set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(C)]
pub struct Pair {
    /// The smaller index, or that of the first set.
    pub first: u32,
    /// The larger index, or that of the second set.
    pub second: u32,
}

/// Filters, one value per box each, all optional. A pair is reported if each given filter allows it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Filters<'a> {
    /// With `mask`: a pair needs (group of a & mask of b) and (group of b & mask of a) nonzero. An
    /// absent one of the two counts as all ones.
    pub group: Option<&'a [u32]>,
    /// See `group`.
    pub mask: Option<&'a [u32]>,
    /// Equal owners never pair; -1: no owner.
    pub owner: Option<&'a [i32]>,
    /// Different worlds (environments) never pair; -1 pairs with every world.
    pub world: Option<&'a [i32]>,
    /// Two static boxes never pair.
    pub is_static: Option<&'a [bool]>,
}

impl Filters<'_> {
    /// Writes the filters to a struct for C, which borrows them, if all have `count` values.
    pub(crate) fn write(&self, count: usize, to: &mut sys::throng_boxes) -> Result<(), Error> {
        to.group = strided("group", self.group, count)?;
        to.mask = strided("mask", self.mask, count)?;
        to.owner = strided("owner", self.owner, count)?;
        to.world = strided("world", self.world, count)?;
        // A bool is a byte of 0 or 1.
        to.is_static = strided("is_static", self.is_static, count)?;
        Ok(())
    }
}

fn strided<T>(
    name: &str,
    values: Option<&[T]>,
    count: usize,
) -> Result<sys::throng_strided, Error> {
    let Some(values) = values else { return Ok(sys::throng_strided::ABSENT) };
    if values.len() != count {
        return Err(Error::bad_filter(name, values.len(), count));
    }
    Ok(sys::throng_strided { data: values.as_ptr().cast::<c_void>(), stride_bytes: size_of::<T>() })
}

impl sys::throng_strided {
    pub(crate) const ABSENT: Self = Self { data: std::ptr::null(), stride_bytes: 0 };
}

impl sys::throng_boxes {
    pub(crate) const EMPTY: Self = Self {
        count: 0,
        corner: [std::ptr::null(); 6],
        stride_bytes: 0,
        group: sys::throng_strided::ABSENT,
        mask: sys::throng_strided::ABSENT,
        owner: sys::throng_strided::ABSENT,
        world: sys::throng_strided::ABSENT,
        is_static: sys::throng_strided::ABSENT,
    };
}

/// A view of boxes, with filters. Slices, arrays and vectors of [`Box3`] convert to it.
///
/// ```
/// use throng::{Box3, Boxes, find_pairs};
/// let boxes = [Box3::new([0.0; 3], [2.0; 3]), Box3::new([1.0; 3], [3.0; 3])];
/// assert_eq!(find_pairs(&boxes)?.len(), 1);
/// // Two parts of one body never pair.
/// assert_eq!(find_pairs(Boxes::from(&boxes).owner(&[7, 7]))?.len(), 0);
/// # Ok::<(), throng::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Boxes<'a> {
    lower: *const f32,
    upper: *const f32,
    count: usize,
    stride_bytes: usize,
    filters: Filters<'a>,
}

// SAFETY: a view is a shared borrow of plain numbers.
unsafe impl Send for Boxes<'_> {}
// SAFETY: as above.
unsafe impl Sync for Boxes<'_> {}

impl<'a> Boxes<'a> {
    fn packed(boxes: &'a [Box3]) -> Self {
        let lower = boxes.as_ptr().cast::<f32>();
        // The upper corner follows the lower one; of an empty slice nothing is read.
        let upper = lower.wrapping_add(3);
        Self {
            lower,
            upper,
            count: boxes.len(),
            stride_bytes: size_of::<Box3>(),
            filters: Filters::default(),
        }
    }

    /// Minimum and maximum corners in two arrays of the same length.
    ///
    /// ```
    /// let (minima, maxima) = (vec![[0.0; 3], [1.0; 3]], vec![[1.0; 3], [2.0; 3]]);
    /// let boxes = throng::Boxes::from_corners(&minima, &maxima)?;
    /// assert_eq!(throng::find_pairs(boxes)?.len(), 1);
    /// # Ok::<(), throng::Error>(())
    /// ```
    pub fn from_corners(lower: &'a [[f32; 3]], upper: &'a [[f32; 3]]) -> Result<Self, Error> {
        if lower.len() != upper.len() {
            return Err(Error::bad_boxes(format!(
                "there are {} lower and {} upper corners; give one of each per box",
                lower.len(),
                upper.len()
            )));
        }
        Ok(Self {
            lower: lower.as_ptr().cast(),
            upper: upper.as_ptr().cast(),
            count: lower.len(),
            stride_bytes: size_of::<[f32; 3]>(),
            filters: Filters::default(),
        })
    }

    /// Boxes that are fields of larger structs, without a copy. `field` returns the same field of
    /// each item.
    ///
    /// ```
    /// struct Entity { id: u64, bounds: throng::Box3 }
    /// let entities = [
    ///     Entity { id: 5, bounds: throng::Box3::new([0.0; 3], [1.0; 3]) },
    ///     Entity { id: 6, bounds: throng::Box3::new([1.0; 3], [2.0; 3]) },
    /// ];
    /// for pair in throng::find_pairs(throng::Boxes::from_fields(&entities, |e| &e.bounds)?)? {
    ///     let ids = (entities[pair.first as usize].id, entities[pair.second as usize].id);
    ///     assert_eq!(ids, (5, 6));
    /// }
    /// # Ok::<(), throng::Error>(())
    /// ```
    pub fn from_fields<T>(items: &'a [T], field: impl Fn(&T) -> &Box3) -> Result<Self, Error> {
        let offset = |item: &T| {
            let field: *const Box3 = field(item);
            (field as usize).wrapping_sub(std::ptr::from_ref(item) as usize)
        };
        let first = items.first().map_or(0, offset);
        let inside = first.checked_add(size_of::<Box3>()).is_some_and(|end| end <= size_of::<T>());
        // Each one is looked at: the items may be variants of an enum.
        if !items.is_empty() && (!inside || items.iter().any(|item| offset(item) != first)) {
            return Err(Error::bad_boxes(
                "the boxes are not the same field of each item; collect them in a Vec<Box3>".into(),
            ));
        }
        let lower = items.as_ptr().cast::<u8>().wrapping_add(first).cast::<f32>();
        Ok(Self {
            lower,
            upper: lower.wrapping_add(3),
            count: items.len(),
            stride_bytes: size_of::<T>(),
            filters: Filters::default(),
        })
    }

    /// Replaces all filters.
    #[must_use]
    pub fn filters(mut self, filters: Filters<'a>) -> Self {
        self.filters = filters;
        self
    }

    /// Sets [`Filters::group`].
    #[must_use]
    pub fn group(mut self, group: &'a [u32]) -> Self {
        self.filters.group = Some(group);
        self
    }

    /// Sets [`Filters::mask`].
    #[must_use]
    pub fn mask(mut self, mask: &'a [u32]) -> Self {
        self.filters.mask = Some(mask);
        self
    }

    /// Sets [`Filters::owner`].
    #[must_use]
    pub fn owner(mut self, owner: &'a [i32]) -> Self {
        self.filters.owner = Some(owner);
        self
    }

    /// Sets [`Filters::world`].
    #[must_use]
    pub fn world(mut self, world: &'a [i32]) -> Self {
        self.filters.world = Some(world);
        self
    }

    /// Sets [`Filters::is_static`].
    #[must_use]
    pub fn is_static(mut self, is_static: &'a [bool]) -> Self {
        self.filters.is_static = Some(is_static);
        self
    }

    /// The number of boxes.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is no box.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The view for C. It borrows what this view borrows.
    pub(crate) fn raw(&self) -> Result<sys::throng_boxes, Error> {
        let mut raw = sys::throng_boxes {
            count: self.count,
            corner: [
                self.lower,
                self.lower.wrapping_add(1),
                self.lower.wrapping_add(2),
                self.upper,
                self.upper.wrapping_add(1),
                self.upper.wrapping_add(2),
            ],
            stride_bytes: self.stride_bytes,
            ..sys::throng_boxes::EMPTY
        };
        self.filters.write(self.count, &mut raw)?;
        Ok(raw)
    }
}

impl<'a> From<&'a [Box3]> for Boxes<'a> {
    fn from(boxes: &'a [Box3]) -> Self {
        Self::packed(boxes)
    }
}

impl<'a, const N: usize> From<&'a [Box3; N]> for Boxes<'a> {
    fn from(boxes: &'a [Box3; N]) -> Self {
        Self::packed(boxes)
    }
}

impl<'a> From<&'a Vec<Box3>> for Boxes<'a> {
    fn from(boxes: &'a Vec<Box3>) -> Self {
        Self::packed(boxes)
    }
}

impl<'a> From<&'a Box3> for Boxes<'a> {
    fn from(one: &'a Box3) -> Self {
        Self::packed(std::slice::from_ref(one))
    }
}
