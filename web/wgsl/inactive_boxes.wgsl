// Requires in the step's file: report.

fn report_inactive(index: u32, has_nan: bool) {
  atomicAdd(&report.inactive, 1u);
  if has_nan {
    atomicAdd(&report.nan_count, 1u);
    atomicMax(&report.nan_mark, ~index);
  } else {
    atomicAdd(&report.inverted_count, 1u);
    atomicMax(&report.inverted_mark, ~index);
  }
}
