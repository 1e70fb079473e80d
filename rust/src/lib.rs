//! Every pair of overlapping axis-aligned boxes among very many moving objects (the broad phase of
//! collision detection), and exact intersections of triangle meshes.
//!
//! The pairs are those of a double loop, on every instruction set and number of threads. Touching
//! counts. This crate calls the C++ library Throng. `build.rs` links it: an installed one from the
//! folder `THRONG_DIR`, else the one that pkg-config knows, else the C++ sources around this crate,
//! which it builds by CMake.
//!
//! | you want | use |
//! |---|---|
//! | the pairs of one frame | [`find_pairs`], [`find_pairs_between`] |
//! | the same each frame, with options | [`Finder`] |
//! | more pairs than memory | [`Finder::consume`] |
//! | begin and end events of objects with ids | [`BroadPhase`] |
//! | ray casts, shape casts, overlap queries | [`BroadPhase`]; from several threads [`Query`] |
//! | layers, bodies, many worlds, static objects | [`Filters`] |
//! | triangle meshes | [`mesh`] |
//!
//! An [`Error`] has the library's message, which names the value and the fix. Options that take the
//! caller's threads and memory, and searches across ranks, have no Rust form.

#![deny(missing_docs)]
#![deny(unsafe_op_in_unsafe_fn)]

mod boxes;
mod broad_phase;
mod error;
mod finder;
mod handle;
pub mod mesh;
mod options;
mod sys;

pub use boxes::{Box3, Boxes, Filters, Pair};
pub use broad_phase::{
    BroadPhase, Events, Filter, Hits, LivePair, ObjectId, Query, RayHit, Sweep, SweepHit,
};
pub use error::{Error, ErrorKind};
pub use finder::{Finder, find_pairs, find_pairs_between};
pub use mesh::MeshFinder;
pub use options::{Algorithm, Backend, InvertedPolicy, Isa, NanPolicy, Options, Order, Report};
