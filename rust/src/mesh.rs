//! Triangle meshes: intersections, decided by exact arithmetic, and triangles within a distance.
//!
//! In one mesh, two triangles form a pair if they have a common point outside of the convex hull of
//! the vertices that they share by index. Neighbors that only share a vertex or an edge are none.

use std::ptr::{self, NonNull};

use crate::boxes::{Filters, Pair};
use crate::error::Error;
use crate::handle::{list, owned_handle};
use crate::sys;

/// A triangle mesh: vertices, and three indices of vertices per triangle, from 0.
#[derive(Clone, Copy, Debug)]
pub struct Mesh<'a> {
    vertices: Vertices<'a>,
    triangles: &'a [[u32; 3]],
    transform: Option<&'a [[f64; 4]; 3]>,
    filters: Filters<'a>,
}

#[derive(Clone, Copy, Debug)]
enum Vertices<'a> {
    Floats(&'a [[f32; 3]]),
    Doubles(&'a [[f64; 3]]),
}

impl<'a> Mesh<'a> {
    /// With vertices of floats.
    pub fn new(vertices: &'a [[f32; 3]], triangles: &'a [[u32; 3]]) -> Self {
        Self::of(Vertices::Floats(vertices), triangles)
    }

    /// With vertices of doubles.
    pub fn from_doubles(vertices: &'a [[f64; 3]], triangles: &'a [[u32; 3]]) -> Self {
        Self::of(Vertices::Doubles(vertices), triangles)
    }

    fn of(vertices: Vertices<'a>, triangles: &'a [[u32; 3]]) -> Self {
        Self { vertices, triangles, transform: None, filters: Filters::default() }
    }

    /// Moves each vertex p to (row . (p, 1)) of the three rows before the search, in doubles. The
    /// result is exact for the rounded vertices.
    #[must_use]
    pub fn transform(mut self, rows: &'a [[f64; 4]; 3]) -> Self {
        self.transform = Some(rows);
        self
    }

    /// Filters, one value per triangle.
    #[must_use]
    pub fn filters(mut self, filters: Filters<'a>) -> Self {
        self.filters = filters;
        self
    }

    fn raw(&self) -> Result<sys::throng_mesh, Error> {
        let mut filters = sys::throng_boxes::EMPTY;
        self.filters.write(self.triangles.len(), &mut filters)?;
        let mut vertices = sys::throng_vertices {
            count: 0,
            floats: ptr::null(),
            doubles: ptr::null(),
            stride_bytes: 0,
        };
        match self.vertices {
            Vertices::Floats(list) => {
                vertices.count = list.len();
                vertices.floats = list.as_ptr().cast();
            }
            Vertices::Doubles(list) => {
                vertices.count = list.len();
                vertices.doubles = list.as_ptr().cast();
            }
        }
        Ok(sys::throng_mesh {
            vertices,
            triangles: sys::throng_elements {
                count: self.triangles.len(),
                indices: self.triangles.as_ptr().cast(),
                stride_bytes: 0,
            },
            transform: self.transform.map_or(ptr::null(), |rows| rows.as_ptr().cast()),
            group: filters.group,
            mask: filters.mask,
            owner: filters.owner,
            world: filters.world,
            is_static: filters.is_static,
        })
    }
}

/// The pairs of triangles of the mesh that intersect, in any order.
///
/// ```
/// use throng::mesh::{Mesh, self_intersections};
/// let vertices = [
///     [0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], // in the plane z = 0
///     [1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [2.0, 1.0, 1.0], // through it
/// ];
/// let pairs = self_intersections(&Mesh::new(&vertices, &[[0, 1, 2], [3, 4, 5]]))?;
/// assert_eq!((pairs[0].first, pairs[0].second), (0, 1));
/// # Ok::<(), throng::Error>(())
/// ```
pub fn self_intersections(mesh: &Mesh<'_>) -> Result<Vec<Pair>, Error> {
    Ok(MeshFinder::new()?.self_intersections(mesh)?.to_vec())
}

/// The pairs of a triangle of `a` and one of `b` that have a common point.
pub fn intersections(a: &Mesh<'_>, b: &Mesh<'_>) -> Result<Vec<Pair>, Error> {
    Ok(MeshFinder::new()?.intersections(a, b)?.to_vec())
}

/// The pairs of triangles of the mesh without a shared vertex that are at most `distance` apart.
/// Every such pair is found; one that is farther apart by less than one part in 10^12 may be.
pub fn self_within(mesh: &Mesh<'_>, distance: f64) -> Result<Vec<Pair>, Error> {
    Ok(MeshFinder::new()?.self_within(mesh, distance)?.to_vec())
}

/// The pairs of a triangle of `a` and one of `b` that are at most `distance` apart.
///
/// ```
/// use throng::mesh::{Mesh, within};
/// let triangles = [[0, 1, 2]];
/// let floor = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
/// let lid = [[0.0, 0.0, 2.0], [4.0, 0.0, 2.0], [0.0, 4.0, 2.0]];
/// let (floor, lid) = (Mesh::from_doubles(&floor, &triangles), Mesh::new(&lid, &triangles));
/// assert_eq!(within(&floor, &lid, 2.0)?.len(), 1);
/// assert_eq!(within(&floor, &lid, 1.9)?.len(), 0);
/// # Ok::<(), throng::Error>(())
/// ```
pub fn within(a: &Mesh<'_>, b: &Mesh<'_>, distance: f64) -> Result<Vec<Pair>, Error> {
    Ok(MeshFinder::new()?.within(a, b, distance)?.to_vec())
}

/// The same calls with options and with memory that is kept from call to call. The options `nan`
/// and `inverted` are not used; the margin must be 0. As [`Finder`](crate::Finder), it is [`Send`]
/// and [`Sync`].
pub struct MeshFinder {
    handle: NonNull<sys::throng_mesh_finder>,
}

owned_handle!(
    MeshFinder,
    throng_mesh_finder,
    throng_mesh_finder_create,
    throng_mesh_finder_destroy,
    throng_mesh_finder_result
);

impl MeshFinder {
    /// As [`self_intersections`].
    pub fn self_intersections(&mut self, mesh: &Mesh<'_>) -> Result<&[Pair], Error> {
        self.find(mesh, None, None)
    }

    /// As [`intersections`].
    pub fn intersections(&mut self, a: &Mesh<'_>, b: &Mesh<'_>) -> Result<&[Pair], Error> {
        self.find(a, Some(b), None)
    }

    /// As [`self_within`].
    pub fn self_within(&mut self, mesh: &Mesh<'_>, distance: f64) -> Result<&[Pair], Error> {
        self.find(mesh, None, Some(distance))
    }

    /// As [`within`].
    pub fn within(&mut self, a: &Mesh<'_>, b: &Mesh<'_>, distance: f64) -> Result<&[Pair], Error> {
        self.find(a, Some(b), Some(distance))
    }

    /// Bytes held now.
    pub fn memory_bytes(&self) -> usize {
        // SAFETY: the handle is alive.
        unsafe { sys::throng_mesh_finder_memory_bytes(self.handle.as_ptr()) }
    }

    fn find(
        &mut self,
        a: &Mesh<'_>,
        b: Option<&Mesh<'_>>,
        distance: Option<f64>,
    ) -> Result<&[Pair], Error> {
        let a = a.raw()?;
        let b = b.map(Mesh::raw).transpose()?;
        let b: *const sys::throng_mesh = b.as_ref().map_or(ptr::null(), ptr::from_ref);
        let handle = self.handle.as_ptr();
        // SAFETY: the handle is alive; the meshes are views of borrowed arrays, or null.
        self.check(unsafe {
            match distance {
                None => sys::throng_mesh_finder_find(handle, &a, b),
                Some(distance) => sys::throng_mesh_finder_find_within(handle, &a, b, distance),
            }
        })?;
        // SAFETY: the pairs stay until the next call, which needs `&mut self`.
        Ok(unsafe { list(|count| sys::throng_mesh_finder_pairs(handle, count)) })
    }
}
