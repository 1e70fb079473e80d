//! The part of the C API (`throng.h`) that this crate calls. A test compares it with the header.

#![allow(non_camel_case_types)]

use std::ffi::{c_char, c_double, c_float, c_int, c_uint, c_void};

use crate::{Box3, LivePair, Pair, RayHit, Sweep, SweepHit};

/// The version of the header that these declarations follow.
pub const THRONG_C_VERSION: c_uint = 10;

/// Declares a struct with the fields of the C struct. The list of fields serves the test, too.
macro_rules! structs {
    ($($(#[$attribute:meta])* $name:ident { $($field:ident: $kind:ty),+ $(,)? })+) => {
        $($(#[$attribute])* #[repr(C)] pub struct $name { $(pub $field: $kind),+ })+

        /// Name, size and fields with their offsets, of each struct.
        #[cfg(test)]
        pub fn layouts() -> Vec<(&'static str, usize, Vec<(&'static str, usize)>)> {
            vec![$((
                stringify!($name),
                size_of::<$name>(),
                vec![$((stringify!($field), std::mem::offset_of!($name, $field))),+],
            )),+]
        }
    };
}

structs! {
    #[derive(Clone, Copy)]
    throng_strided { data: *const c_void, stride_bytes: usize }
    #[derive(Clone, Copy)]
    throng_boxes {
        count: usize,
        corner: [*const c_float; 6],
        stride_bytes: usize,
        group: throng_strided,
        mask: throng_strided,
        owner: throng_strided,
        world: throng_strided,
        is_static: throng_strided,
    }
    throng_options {
        struct_bytes: usize,
        algorithm: c_int,
        order: c_int,
        backend: c_int,
        nan: c_int,
        margin: c_float,
        threads: c_uint,
        memory_cap_bytes: usize,
        concurrency: c_uint,
        run: *mut c_void,
        run_self: *mut c_void,
        allocate: *mut c_void,
        deallocate: *mut c_void,
        memory_self: *mut c_void,
        isa: c_int,
        stoppable: c_int,
        inverted: c_int,
    }
    throng_result {
        struct_bytes: usize,
        status: c_int,
        found: u64,
        written: u64,
        inactive: u64,
        comparisons: u64,
        first_invalid: u64,
        invalid_count: u64,
        bytes_needed: u64,
        total_ms: c_double,
        plan_ms: c_double,
        bin_ms: c_double,
        find_ms: c_double,
        order_ms: c_double,
        plan: *const c_char,
        message: *const c_char,
        backend: c_int,
        algorithm: c_int,
        isa: c_int,
        threads: c_uint,
        visited: u64,
        candidates: u64,
        exact_tests: u64,
    }
    throng_filter { group: u32, mask: u32, owner: i32, world: i32, is_static: u8 }
    throng_vertices {
        count: usize,
        floats: *const c_float,
        doubles: *const c_double,
        stride_bytes: usize,
    }
    throng_elements { count: usize, indices: *const u32, stride_bytes: usize }
    throng_mesh {
        vertices: throng_vertices,
        triangles: throng_elements,
        transform: *const c_double,
        group: throng_strided,
        mask: throng_strided,
        owner: throng_strided,
        world: throng_strided,
        is_static: throng_strided,
    }
}

/// Opaque handles of the library.
macro_rules! handles {
    ($($name:ident)+) => { $(#[repr(C)] pub struct $name { _private: [u8; 0] })+ };
}
handles! { throng_finder throng_broad_phase throng_query throng_mesh_finder }

pub type throng_status = c_int;
pub type throng_consumer =
    unsafe extern "C" fn(context: *mut c_void, pairs: *const Pair, count: usize) -> c_int;

pub type throng_object_filter = unsafe extern "C" fn(context: *mut c_void, object: u32) -> c_int;

pub const THRONG_NO_OBJECT: u32 = u32::MAX;

unsafe extern "C" {
    pub fn throng_options_init_sized(options: *mut throng_options, struct_bytes: usize);
    pub fn throng_c_version() -> c_uint;
    pub fn throng_box_from_center(center: *const c_float, half_size: *const c_float) -> Box3;
    pub fn throng_round_outward(lower: *const c_double, upper: *const c_double) -> Box3;

    pub fn throng_finder_create(options: *const throng_options) -> *mut throng_finder;
    pub fn throng_finder_destroy(finder: *mut throng_finder);
    pub fn throng_find(
        finder: *mut throng_finder,
        a: *const throng_boxes,
        b: *const throng_boxes,
    ) -> throng_status;
    pub fn throng_finder_pairs(finder: *const throng_finder, count: *mut usize) -> *const Pair;
    pub fn throng_consume(
        finder: *mut throng_finder,
        a: *const throng_boxes,
        b: *const throng_boxes,
        consumer: throng_consumer,
        context: *mut c_void,
    ) -> throng_status;
    pub fn throng_finder_result(finder: *const throng_finder) -> *const throng_result;
    pub fn throng_finder_memory_bytes(finder: *const throng_finder) -> usize;

    pub fn throng_broad_phase_create(options: *const throng_options) -> *mut throng_broad_phase;
    pub fn throng_broad_phase_destroy(broad_phase: *mut throng_broad_phase);
    pub fn throng_broad_phase_copy(
        to: *mut throng_broad_phase,
        from: *const throng_broad_phase,
    ) -> throng_status;
    pub fn throng_broad_phase_add(
        broad_phase: *mut throng_broad_phase,
        boxes: *const throng_boxes,
        ids: *mut u32,
    ) -> throng_status;
    pub fn throng_broad_phase_remove(
        broad_phase: *mut throng_broad_phase,
        ids: *const u32,
        count: usize,
    ) -> throng_status;
    pub fn throng_broad_phase_move(
        broad_phase: *mut throng_broad_phase,
        ids: *const u32,
        boxes: *const throng_boxes,
    ) -> throng_status;
    pub fn throng_broad_phase_move_all(
        broad_phase: *mut throng_broad_phase,
        boxes: *const throng_boxes,
    ) -> throng_status;
    pub fn throng_broad_phase_set_filters(
        broad_phase: *mut throng_broad_phase,
        ids: *const u32,
        filters: *const throng_boxes,
    ) -> throng_status;
    pub fn throng_broad_phase_shift_origin(
        broad_phase: *mut throng_broad_phase,
        by: *const c_float,
    ) -> throng_status;
    pub fn throng_broad_phase_update(broad_phase: *mut throng_broad_phase) -> throng_status;
    pub fn throng_broad_phase_begun(
        broad_phase: *const throng_broad_phase,
        count: *mut usize,
    ) -> *const LivePair;
    pub fn throng_broad_phase_ended(
        broad_phase: *const throng_broad_phase,
        count: *mut usize,
    ) -> *const LivePair;
    pub fn throng_broad_phase_pairs(
        broad_phase: *mut throng_broad_phase,
        count: *mut usize,
    ) -> *const LivePair;
    pub fn throng_broad_phase_pairs_of(
        broad_phase: *const throng_broad_phase,
        id: u32,
        out: *mut LivePair,
        capacity: usize,
    ) -> usize;
    pub fn throng_broad_phase_find_overlaps(
        broad_phase: *mut throng_broad_phase,
        boxes: *const throng_boxes,
    ) -> throng_status;
    pub fn throng_broad_phase_overlaps(
        broad_phase: *const throng_broad_phase,
        count: *mut usize,
    ) -> *const Pair;
    pub fn throng_broad_phase_find_hits(
        broad_phase: *mut throng_broad_phase,
        sweeps: *const Sweep,
        count: usize,
        which: c_int,
        filters: *const throng_boxes,
    ) -> throng_status;
    pub fn throng_broad_phase_hits(
        broad_phase: *const throng_broad_phase,
        count: *mut usize,
    ) -> *const SweepHit;
    pub fn throng_broad_phase_raycast(
        broad_phase: *mut throng_broad_phase,
        origin: *const c_float,
        direction: *const c_float,
        max_distance: c_double,
        layer_mask: u32,
        hit: *mut RayHit,
    ) -> throng_status;
    pub fn throng_broad_phase_is_alive(broad_phase: *const throng_broad_phase, id: u32) -> c_int;
    pub fn throng_broad_phase_box(
        broad_phase: *const throng_broad_phase,
        id: u32,
        to: *mut Box3,
    ) -> throng_status;
    pub fn throng_broad_phase_filter(
        broad_phase: *const throng_broad_phase,
        id: u32,
        filter: *mut throng_filter,
    ) -> throng_status;
    pub fn throng_broad_phase_object_count(broad_phase: *const throng_broad_phase) -> u64;
    pub fn throng_broad_phase_pair_count(broad_phase: *const throng_broad_phase) -> u64;
    pub fn throng_broad_phase_id_limit(broad_phase: *const throng_broad_phase) -> u64;
    pub fn throng_broad_phase_slot_limit(broad_phase: *const throng_broad_phase) -> u64;
    pub fn throng_broad_phase_result(
        broad_phase: *const throng_broad_phase,
    ) -> *const throng_result;
    pub fn throng_broad_phase_memory_bytes(broad_phase: *const throng_broad_phase) -> usize;

    pub fn throng_query_create(options: *const throng_options) -> *mut throng_query;
    pub fn throng_query_destroy(query: *mut throng_query);
    pub fn throng_query_find_overlaps(
        query: *mut throng_query,
        broad_phase: *const throng_broad_phase,
        boxes: *const throng_boxes,
    ) -> throng_status;
    pub fn throng_query_overlaps(query: *const throng_query, count: *mut usize) -> *const Pair;
    pub fn throng_query_find_hits(
        query: *mut throng_query,
        broad_phase: *const throng_broad_phase,
        sweeps: *const Sweep,
        count: usize,
        which: c_int,
        filters: *const throng_boxes,
        test: *mut c_void,
        context: *mut c_void,
    ) -> throng_status;
    pub fn throng_query_hits(query: *const throng_query, count: *mut usize) -> *const SweepHit;
    pub fn throng_query_raycast(
        query: *mut throng_query,
        broad_phase: *const throng_broad_phase,
        origin: *const c_float,
        direction: *const c_float,
        max_distance: c_double,
        of_ray: *const throng_filter,
        filter: throng_object_filter,
        context: *mut c_void,
        hit: *mut RayHit,
    ) -> throng_status;
    pub fn throng_query_result(query: *const throng_query) -> *const throng_result;

    pub fn throng_mesh_finder_create(options: *const throng_options) -> *mut throng_mesh_finder;
    pub fn throng_mesh_finder_destroy(finder: *mut throng_mesh_finder);
    pub fn throng_mesh_finder_find(
        finder: *mut throng_mesh_finder,
        a: *const throng_mesh,
        b: *const throng_mesh,
    ) -> throng_status;
    pub fn throng_mesh_finder_find_within(
        finder: *mut throng_mesh_finder,
        a: *const throng_mesh,
        b: *const throng_mesh,
        distance: c_double,
    ) -> throng_status;
    pub fn throng_mesh_finder_pairs(
        finder: *const throng_mesh_finder,
        count: *mut usize,
    ) -> *const Pair;
    pub fn throng_mesh_finder_result(finder: *const throng_mesh_finder) -> *const throng_result;
    pub fn throng_mesh_finder_memory_bytes(finder: *const throng_mesh_finder) -> usize;
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;
    use std::mem::offset_of;
    use std::process::Command;

    use super::*;

    /// A C program prints the layouts of the header. Skipped without a C compiler.
    #[test]
    fn layouts_are_those_of_the_header() {
        let mut structs = layouts();
        // Those that the safe API has as its own types.
        structs.push((
            "throng_box",
            size_of::<Box3>(),
            vec![("lower", offset_of!(Box3, lower)), ("upper", offset_of!(Box3, upper))],
        ));
        structs.push((
            "throng_pair",
            size_of::<Pair>(),
            vec![("first", offset_of!(Pair, first)), ("second", offset_of!(Pair, second))],
        ));
        structs.push((
            "throng_live_pair",
            size_of::<LivePair>(),
            vec![
                ("first", offset_of!(LivePair, first)),
                ("second", offset_of!(LivePair, second)),
                ("slot", offset_of!(LivePair, slot)),
            ],
        ));
        structs.push((
            "throng_sweep",
            size_of::<Sweep>(),
            vec![("box", offset_of!(Sweep, start)), ("by", offset_of!(Sweep, by))],
        ));
        structs.push((
            "throng_sweep_hit",
            size_of::<SweepHit>(),
            vec![
                ("sweep", offset_of!(SweepHit, sweep)),
                ("object", offset_of!(SweepHit, object)),
                ("time", offset_of!(SweepHit, time)),
            ],
        ));

        structs.push((
            "throng_ray_hit",
            size_of::<RayHit>(),
            vec![
                ("object", offset_of!(RayHit, object)),
                ("distance", offset_of!(RayHit, distance)),
                ("point", offset_of!(RayHit, point)),
                ("normal", offset_of!(RayHit, normal)),
            ],
        ));

        let mut program =
            String::from("#include <stdio.h>\n#include <throng/throng.h>\nint main(void) {\n");
        let mut want = String::new();
        let mut line = |expression: &str, value: usize| {
            writeln!(program, "  printf(\"{expression} %zu\\n\", (size_t)({expression}));")
                .unwrap();
            writeln!(want, "{expression} {value}").unwrap();
        };
        for (name, size, fields) in &structs {
            line(&format!("sizeof({name})"), *size);
            for (field, offset) in fields {
                line(&format!("offsetof({name}, {field})"), *offset);
            }
        }
        line("sizeof(throng_status)", size_of::<throng_status>());
        line("THRONG_C_VERSION", THRONG_C_VERSION as usize);
        line("THRONG_NO_OBJECT", THRONG_NO_OBJECT as usize);
        for (name, value) in
            crate::options::constants().into_iter().chain(crate::error::constants())
        {
            line(name, value as usize);
        }
        program.push_str("  return 0;\n}\n");

        let folder = std::env::temp_dir().join(format!("throng_layout_{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let (source, binary) = (folder.join("layout.c"), folder.join("layout"));
        std::fs::write(&source, program).unwrap();
        let compiled = Command::new("cc")
            .arg("-I")
            .arg(env!("THRONG_INCLUDE"))
            .arg(&source)
            .arg("-o")
            .arg(&binary)
            .output();
        let Ok(compiled) = compiled else {
            eprintln!("skipped: there is no C compiler `cc`");
            return;
        };
        assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
        let printed = Command::new(&binary).output().unwrap();
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(String::from_utf8_lossy(&printed.stdout), want);
    }

    #[test]
    fn the_library_is_of_this_version() {
        // SAFETY: a function without arguments.
        assert!(unsafe { throng_c_version() } >= THRONG_C_VERSION);
    }
}
