//! What the kinds of handles share: creation, results and lists.

use std::ffi::c_int;

use crate::error::{Error, OK};
use crate::options::Options;
use crate::sys;

/// Declares a type that owns a handle of the library, with its creation and destruction.
macro_rules! owned_handle {
    ($name:ident, $handle:ident, $create:ident, $destroy:ident, $result:ident) => {
        impl $name {
            /// With the default options.
            pub fn new() -> Result<Self, $crate::Error> {
                Self::with_options(&$crate::Options::default())
            }

            /// With these options, which stay. Invalid values are reported by the first call.
            pub fn with_options(options: &$crate::Options) -> Result<Self, $crate::Error> {
                let create = |raw: *const _| {
                    // SAFETY: `raw` points to initialized options.
                    unsafe { $crate::sys::$create(raw) }
                };
                Ok(Self { handle: $crate::handle::create(options, create)? })
            }

            /// What the last call did.
            pub fn report(&self) -> $crate::Report {
                // SAFETY: the handle is alive.
                unsafe { $crate::Report::of($crate::sys::$result(self.handle.as_ptr())) }
            }

            fn check(&self, status: std::ffi::c_int) -> Result<(), $crate::Error> {
                // SAFETY: the handle is alive.
                let result = unsafe { $crate::sys::$result(self.handle.as_ptr()) };
                // SAFETY: it is the result of this handle.
                unsafe { $crate::handle::check(status, result) }
            }
        }

        impl Drop for $name {
            fn drop(&mut self) {
                // SAFETY: the handle is alive, and this is its owner.
                unsafe { $crate::sys::$destroy(self.handle.as_ptr()) };
            }
        }

        // SAFETY: a handle is not bound to a thread.
        unsafe impl Send for $name {}
        // SAFETY: functions of `&self` only read, and those of `&mut self` exclude them.
        unsafe impl Sync for $name {}

        impl std::fmt::Debug for $name {
            fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                formatter.debug_struct(stringify!($name)).finish_non_exhaustive()
            }
        }
    };
}
pub(crate) use owned_handle;

pub(crate) fn create<T>(
    options: &Options,
    create: impl Fn(*const sys::throng_options) -> *mut T,
) -> Result<std::ptr::NonNull<T>, Error> {
    let raw = options.raw()?;
    std::ptr::NonNull::new(create(&raw)).ok_or_else(Error::no_handle)
}

/// # Safety
/// `result` is that of a live handle, whose last call returned `status`.
pub(crate) unsafe fn check(status: c_int, result: *const sys::throng_result) -> Result<(), Error> {
    if status == OK {
        return Ok(());
    }
    // SAFETY: as above.
    Err(unsafe { Error::of(status, result) })
}

/// The list that `get(count)` returns.
///
/// # Safety
/// `get` returns null, or `count` values that live for 'a.
pub(crate) unsafe fn list<'a, T>(get: impl FnOnce(*mut usize) -> *const T) -> &'a [T] {
    let mut count = 0;
    let data = get(&mut count);
    if data.is_null() || count == 0 {
        return &[];
    }
    // SAFETY: as above.
    unsafe { std::slice::from_raw_parts(data, count) }
}
