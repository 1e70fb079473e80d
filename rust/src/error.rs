//! Errors with the message of the library.

use std::ffi::{CStr, c_int};
use std::fmt;

use crate::sys;

/// Declares the kinds of errors with the values of the C constants.
macro_rules! kinds {
    ($($(#[$attribute:meta])* $kind:ident = $value:literal $name:literal;)+) => {
        /// What went wrong. The message of the [`Error`] has the numbers and the fix.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum ErrorKind {
            $($(#[$attribute])* $kind,)+
            /// A status of a newer library.
            Other(i32),
        }

        impl ErrorKind {
            fn of(status: c_int) -> Self {
                match status {
                    $($value => Self::$kind,)+
                    other => Self::Other(other),
                }
            }
        }

        #[cfg(test)]
        pub fn constants() -> Vec<(&'static str, c_int)> {
            vec![("THRONG_OK", OK), ("THRONG_STOPPED", STOPPED), $(($name, $value)),+]
        }
    };
}

pub(crate) const OK: c_int = 0;
pub(crate) const STOPPED: c_int = 2;
const BAD_BOXES: c_int = 4;
const OUT_OF_MEMORY: c_int = 8;

kinds! {
    /// A box has a NaN; or a sweep has one, or does not have a finite direction. See
    /// [`Error::first_invalid`].
    NanBox = 3 "THRONG_NAN_BOX";
    /// A view is not as the call needs it.
    BadBoxes = 4 "THRONG_BAD_BOXES";
    /// A filter has another number of values than there are boxes, or a world is below -1.
    BadFilter = 5 "THRONG_BAD_FILTER";
    /// An option has an invalid value, such as a negative margin.
    BadOption = 6 "THRONG_BAD_OPTION";
    /// More than 2^32 - 2^16 boxes in one set.
    TooManyBoxes = 7 "THRONG_TOO_MANY_BOXES";
    /// See [`Error::bytes_needed`].
    OutOfMemory = 8 "THRONG_OUT_OF_MEMORY";
    /// See [`Error::bytes_needed`].
    MemoryCapTooSmall = 9 "THRONG_MEMORY_CAP_TOO_SMALL";
    /// This processor or build lacks the instruction set.
    UnsupportedIsa = 10 "THRONG_UNSUPPORTED_ISA";
    /// No GPU, no driver, or a build without the GPU backend.
    NoDevice = 11 "THRONG_NO_DEVICE";
    /// The message has CUDA's text.
    DeviceError = 12 "THRONG_DEVICE_ERROR";
    /// An id is not alive, or occurs twice in one list. See [`Error::first_invalid`].
    BadId = 16 "THRONG_BAD_ID";
    /// Another call on the same object is running.
    Busy = 17 "THRONG_BUSY";
    /// A box has lower > upper on some axis where that is refused. See [`Error::first_invalid`].
    InvertedBox = 20 "THRONG_INVERTED_BOX";
    /// An index is out of range, or a vertex of a triangle is not finite. See
    /// [`Error::first_invalid`], the index of a triangle.
    BadMesh = 21 "THRONG_BAD_MESH";
}

/// A failed call. It changed nothing. `Display` writes the library's message: what was wrong, with
/// the number, and the fix.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    kind: ErrorKind,
    message: String,
    first_invalid: u64,
    invalid_count: u64,
    bytes_needed: u64,
}

impl Error {
    /// What went wrong.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// The first invalid element (box, id, sweep or triangle), if the call found some.
    pub fn first_invalid(&self) -> Option<u64> {
        (self.invalid_count != 0).then_some(self.first_invalid)
    }

    /// The number of invalid elements.
    pub fn invalid_count(&self) -> u64 {
        self.invalid_count
    }

    /// The bytes that a call needs which found too little memory, where known; else 0.
    pub fn bytes_needed(&self) -> u64 {
        self.bytes_needed
    }

    fn without_numbers(kind: ErrorKind, message: String) -> Self {
        Self { kind, message, first_invalid: 0, invalid_count: 0, bytes_needed: 0 }
    }

    pub(crate) fn bad_boxes(message: String) -> Self {
        Self::without_numbers(ErrorKind::of(BAD_BOXES), message)
    }

    pub(crate) fn bad_filter(name: &str, values: usize, boxes: usize) -> Self {
        Self::without_numbers(
            ErrorKind::BadFilter,
            format!("the filter '{name}' has {values} values for {boxes} boxes; give one per box"),
        )
    }

    pub(crate) fn no_handle() -> Self {
        Self::without_numbers(
            ErrorKind::of(OUT_OF_MEMORY),
            "there was no memory to create the object".into(),
        )
    }

    pub(crate) fn older_library(version: u32) -> Self {
        Self::without_numbers(
            ErrorKind::BadOption,
            format!(
                "the library has version {version} of the C API, this crate needs {}; install a \
                 newer library",
                sys::THRONG_C_VERSION
            ),
        )
    }

    /// # Safety
    /// `result` is that of a live handle, whose last call failed with `status`.
    pub(crate) unsafe fn of(status: c_int, result: *const sys::throng_result) -> Self {
        // SAFETY: the library returns a valid result for each handle.
        let result = unsafe { &*result };
        // SAFETY: the message is a C string that lives as long as the result.
        let message = unsafe { CStr::from_ptr(result.message) };
        Self {
            kind: ErrorKind::of(status),
            message: message.to_string_lossy().into_owned(),
            first_invalid: result.first_invalid,
            invalid_count: result.invalid_count,
            bytes_needed: result.bytes_needed,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.message)
    }
}

impl std::error::Error for Error {}
