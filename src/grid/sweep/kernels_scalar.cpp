// The scalar kernels: the reference implementation that the vector kernels must equal.
#include <algorithm>
#include <cstring>

#include "grid/sweep/kernel_table.hpp"

namespace throng::grid {
namespace {

void bin(const base::Quantizer& map, const BinInput& in, RecordOutput& out) {
  out.deferred_count = 0;
  for (std::uint32_t i = 0; i < in.count; ++i) {
    float box[6];
    std::memcpy(box, in.boxes + i * in.stride, sizeof box);
    out.first_column_record[i].id = in.ids ? in.ids[i] : in.first_id + i;
    if (!(box[0] <= box[3] && box[1] <= box[4] && box[2] <= box[5])) {
      out.deferred[out.deferred_count++] = i;
      continue;
    }
    Record& r = out.first_column_record[i];
    std::uint32_t column = 0;
    bool one_column = true;
    for (int k = 0; k < 3; ++k) {
      const std::int32_t lower = base::quantize(map, k, box[k]);
      const std::int32_t upper = base::quantize(map, k, box[3 + k]);
      r.lower[k] = base::quantized_of(lower);
      r.upper[k] = base::quantized_of(upper);
      one_column &= base::column_of(upper) == base::column_of(lower);
      column += static_cast<std::uint32_t>(base::column_of(lower)) * map.stride[k];
    }
    if (out.column_offset) column += out.column_offset[i] & (max_columns - 1);
    if (!one_column || (out.column_offset && out.column_offset[i] >= max_columns)) {
      out.deferred[out.deferred_count++] = i;
      continue;
    }
    const std::uintptr_t to = out.next_slot(column);
    std::memcpy(reinterpret_cast<void*>(to), &r, sizeof r);
    out.tail[column] = to + sizeof r;
  }
}

void quantized_range(const Record* records, std::uint32_t count, std::uint32_t axis,
                     std::uint32_t* least, std::uint32_t* most) {
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t word = records[i].lower[axis];
    *least = std::min(*least, word);
    *most = std::max(*most, word);
  }
}

void transpose(Strip& strip) {
  const Record* const* sorted = strip.record.data();
  const std::uint32_t axes[3] = {strip.axis, (strip.axis + 1) % 3, (strip.axis + 2) % 3};
  for (std::uint32_t i = 0; i < strip.count; ++i) {
    for (int k = 0; k < 3; ++k) {
      strip.lower[k][i] = static_cast<std::int16_t>(sorted[i]->lower[axes[k]]);
      strip.upper[k][i] = static_cast<std::int16_t>(sorted[i]->upper[axes[k]]);
    }
    strip.target_mask[i] = OwnerRule::mask(*sorted[i]);
    strip.id[i] = sorted[i]->id;
  }
}

void sweep(const SweepArgs& args, PairOutput& out) {
  const Strip& q = *args.queries;
  const Strip& t = *args.targets;
  std::uint64_t comparisons = 0;
  const std::uint32_t last = std::min(args.end, q.count);
  for (std::uint32_t i = args.begin; i < last; ++i) {
    const std::uint32_t first = args.start ? args.start[i] : i + 1;
    const QuantizedBox query = q.box(i);
    std::uint32_t j = first;
    for (; j < t.count && t.bucket_start(j) <= q.upper[0][i]; ++j) {
      const int least = query.least_difference(t.box(j));
      if (least < 0 || q.query_mask[i].rejects(t.target_mask[j])) continue;
      const Pair pair = make_pair(args.orientation, q.id[i], t.id[j], out.target_id_offset);
      if (least == 0) {
        *out.tie_cursor++ = pair;
        if (out.tie_cursor > out.tie_limit) out.flush_ties();
      } else {
        *out.cursor++ = pair;
        if (out.cursor > out.limit) out.flush();
      }
    }
    comparisons += j - first;
  }
  out.comparisons += comparisons;
}

bool match_filter_classes(const FilterTile& tile, const FilterCombination* known,
                          std::uint32_t known_count, std::uint8_t* filter_classes) {
  std::uint32_t filter_class[filter_tile], missed = 0;
  std::fill(filter_class, filter_class + filter_tile, std::uint32_t{unknown_class});
  for (std::uint32_t k = 0; k < known_count; ++k) {
    const FilterCombination one = known[k];
    for (std::uint32_t i = 0; i < filter_tile; ++i) {
      const std::uint32_t is_static = tile.is_static[i] != 0 ? 1 : 0;
      const std::uint32_t differ =
          (tile.group[i] ^ one.group) | (tile.mask[i] ^ one.mask) | (is_static ^ one.is_static);
      filter_class[i] = differ == 0 ? k : filter_class[i];
    }
  }
  for (std::uint32_t i = 0; i < filter_tile; ++i) {
    missed |= filter_class[i] == unknown_class;
    filter_classes[i] = static_cast<std::uint8_t>(filter_class[i]);
  }
  return missed == 0;
}

void read_worlds(const std::int32_t* worlds, std::uint32_t count, WorldRange& range) {
  for (std::uint32_t i = 0; i < count; ++i)
    range.add({static_cast<std::uint32_t>(worlds[i]), worlds[i], worlds[i] == -1 ? 1u : 0u});
}

void all_pairs(const Tile& q, const Tile& t, bool same, Orientation orientation, PairOutput& out) {
  for (std::uint32_t i = 0; i < q.count; ++i) {
    const std::uint32_t first = same ? i + 1 : 0;
    float query[6];
    for (int k = 0; k < 6; ++k) query[k] = q.corner[k][i];
    for (std::uint32_t j = first; j < t.count; ++j) {
      bool overlap = true;
      for (int k = 0; k < 3; ++k) {
        const float *const lower = t.corner[k].data(), *const upper = t.corner[k + 3].data();
        overlap &= (query[k] <= upper[j]) & (lower[j] <= query[k + 3]);
      }
      if (!overlap) continue;
      *out.cursor++ = make_pair(orientation, q.id[i], t.id[j]);
      if (out.cursor > out.limit) out.flush();
    }
    if (t.count > first) out.comparisons += t.count - first;
  }
}

}  // namespace

const Kernels scalar_kernels{
    Isa::scalar, &base::cost.sweep_scalar, bin,         quantized_range, transpose,
    sweep,       match_filter_classes,     read_worlds, all_pairs,       nullptr,
    nullptr};

}  // namespace throng::grid
