//! Options of a search, and the report of a call.

use std::ffi::{CStr, c_int};

use crate::error::Error;
use crate::sys;

/// Declares an option with the values of the C constants.
macro_rules! choices {
    ($($(#[$attribute:meta])* $name:ident {
        $($(#[$of_choice:meta])* $choice:ident = $value:literal $constant:literal,)+
    })+) => {
        $($(#[$attribute])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        #[repr(i32)]
        pub enum $name { $($(#[$of_choice])* $choice = $value,)+ })+

        #[cfg(test)]
        pub fn constants() -> Vec<(&'static str, c_int)> {
            vec![$($(($constant, $name::$choice as c_int)),+),+]
        }
    };
}

choices! {
    /// The order of the pairs.
    Order {
        /// Fastest. With several threads the order differs from run to run.
        #[default]
        Any = 0 "THRONG_ORDER_ANY",
        /// Sorted by first, then second: the same bytes everywhere.
        Canonical = 1 "THRONG_ORDER_CANONICAL",
    }
    /// How pairs are found. The result is the same.
    Algorithm {
        /// A planner chooses.
        #[default]
        Automatic = 0 "THRONG_ALGORITHM_AUTOMATIC",
        /// Tiled brute force.
        AllPairs = 1 "THRONG_ALGORITHM_ALL_PAIRS",
        /// A grid of swept columns.
        Grid = 2 "THRONG_ALGORITHM_GRID",
    }
    /// Where pairs are found. The result is the same.
    Backend {
        /// A GPU for large searches if the library was built with CUDA and it pays, else the CPU.
        #[default]
        Automatic = 0 "THRONG_BACKEND_AUTOMATIC",
        /// The CPU.
        Cpu = 1 "THRONG_BACKEND_CPU",
        /// A GPU.
        Cuda = 2 "THRONG_BACKEND_CUDA",
        /// The GPU's algorithm on the CPU: slow, for tests.
        Emulated = 3 "THRONG_BACKEND_EMULATED",
    }
    /// What to do with a box that has a NaN.
    NanPolicy {
        /// An error.
        #[default]
        Refuse = 0 "THRONG_NAN_REFUSE",
        /// The box overlaps nothing.
        Inactive = 1 "THRONG_NAN_INACTIVE",
    }
    /// What to do with a box that has lower > upper on some axis.
    InvertedPolicy {
        /// [`find_pairs`](crate::find_pairs) refuses it; [`Finder`](crate::Finder) and
        /// [`BroadPhase`](crate::BroadPhase) treat it as inactive.
        #[default]
        Automatic = 0 "THRONG_INVERTED_AUTOMATIC",
        /// An error, which names the likely mistake.
        Refuse = 1 "THRONG_INVERTED_REFUSE",
        /// An empty slot: the box overlaps nothing.
        Inactive = 2 "THRONG_INVERTED_INACTIVE",
    }
    /// The instruction set of the CPU. The result is the same.
    Isa {
        /// The widest available.
        #[default]
        Automatic = 0 "THRONG_ISA_AUTOMATIC",
        /// No SIMD.
        Scalar = 1 "THRONG_ISA_SCALAR",
        /// x86 SSE4.
        Sse4 = 2 "THRONG_ISA_SSE4",
        /// x86 AVX2.
        Avx2 = 3 "THRONG_ISA_AVX2",
        /// x86 AVX-512, the subset of Ice Lake and Zen 4.
        Avx512 = 4 "THRONG_ISA_AVX512",
        /// Arm NEON.
        Neon = 5 "THRONG_ISA_NEON",
        /// WebAssembly, 128 bits.
        Wasm = 6 "THRONG_ISA_WASM",
    }
}

/// Options of a search.
///
/// ```
/// use throng::{Options, Order};
/// let options = Options { order: Order::Canonical, margin: 0.1, ..Options::default() };
/// # let _ = options;
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// The order of the pairs.
    pub order: Order,
    /// How pairs are found.
    pub algorithm: Algorithm,
    /// Where pairs are found.
    pub backend: Backend,
    /// What to do with NaN.
    pub nan: NanPolicy,
    /// What to do with lower > upper.
    pub inverted: InvertedPolicy,
    /// The instruction set.
    pub isa: Isa,
    /// Boxes are compared as lower - margin and upper + margin, rounded outward. World units, >= 0.
    pub margin: f32,
    /// The largest number of threads; 0: all.
    pub threads: u32,
    /// [`Finder::consume`](crate::Finder::consume): a limit in bytes of all memory taken; 0: none.
    pub memory_cap_bytes: usize,
}

impl Options {
    /// The options for C. An error if the library is older than this crate.
    pub(crate) fn raw(&self) -> Result<sys::throng_options, Error> {
        // SAFETY: a function without arguments.
        let version = unsafe { sys::throng_c_version() };
        if version < sys::THRONG_C_VERSION {
            return Err(Error::older_library(version));
        }
        // SAFETY: zeros are valid numbers and null pointers.
        let mut raw: sys::throng_options = unsafe { std::mem::zeroed() };
        // SAFETY: the struct has the size that is passed.
        unsafe { sys::throng_options_init_sized(&mut raw, size_of::<sys::throng_options>()) };
        raw.order = self.order as c_int;
        raw.algorithm = self.algorithm as c_int;
        raw.backend = self.backend as c_int;
        raw.nan = self.nan as c_int;
        raw.inverted = self.inverted as c_int;
        raw.isa = self.isa as c_int;
        raw.margin = self.margin;
        raw.threads = self.threads;
        raw.memory_cap_bytes = self.memory_cap_bytes;
        Ok(raw)
    }
}

/// What the last call did.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Report {
    /// Pairs, hits or objects that the call found.
    pub found: u64,
    /// Boxes that overlap nothing: lower > upper, or a NaN where that is allowed.
    pub inactive: u64,
    /// Candidate pairs that were compared.
    pub comparisons: u64,
    /// Milliseconds.
    pub total_ms: f64,
    /// Why the planner chose this search.
    pub plan: String,
    /// The number of threads used.
    pub threads: u32,
}

impl Report {
    /// # Safety
    /// `result` is that of a live handle.
    pub(crate) unsafe fn of(result: *const sys::throng_result) -> Self {
        // SAFETY: the library returns a valid result for each handle.
        let result = unsafe { &*result };
        // SAFETY: a C string that lives as long as the result.
        let plan = unsafe { CStr::from_ptr(result.plan) };
        Self {
            found: result.found,
            inactive: result.inactive,
            comparisons: result.comparisons,
            total_ms: result.total_ms,
            plan: plan.to_string_lossy().into_owned(),
            threads: result.threads,
        }
    }
}
