#include "apps/paper/pairs_report.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/paper/cuda.hpp"
#include "apps/report/format.hpp"

namespace throng::paper {

using Json = nlohmann::ordered_json;

std::string to_json(const Report& a, const Boxes& boxes, const Outcome& o) {
  Json json;
  json["n"] = boxes.n;
  json["frames"] = boxes.frames;
  json["variant"] = describe(a.variant);
  json["device"] = a.device == DeviceKind::cuda ? cuda_device_name() : "cpu";
  json["pairs"] = o.pairs;
  json["checksum"] = hex(o.checksum);
  json["total_ms"] = o.times.total();
  json["stages_ms"] = {{"upload", o.times.upload},     {"boxes", o.times.boxes},
                       {"grid", o.times.grid},         {"search", o.times.search},
                       {"download", o.times.download}, {"decode", o.times.decode}};
  json["output_bytes"] = o.output_bytes;
  if (a.variant.per_cell > 0) json["grid"] = {{"cells", o.cells}, {"entries", o.entries}};
  if (a.variant.per_cell == 0) json["wrong_rows"] = o.errors.rows;
  if (a.check) json["check"] = {{"missing", o.missing}, {"extra", o.extra}};
  return json.dump(2) + "\n";
}

std::string to_text(const Report& a, const Boxes& boxes, const Outcome& o) {
  using report::format_count;
  using report::format_ms;
  std::string text = fmt::format("{}: {} boxes", boxes.name, format_count(boxes.n));
  if (boxes.frames > 1) text += fmt::format("; {} frames", boxes.frames);
  text += fmt::format("\nvariant   {}, {}\npairs     {}\nchecksum  {}\n", describe(a.variant),
                      a.device == DeviceKind::cuda ? cuda_device_name() : "cpu",
                      format_count(o.pairs), hex(o.checksum));
  text +=
      fmt::format("time      {} ms  (median of {} warmed)\n", format_ms(o.times.total()), a.repeat);
  const auto stage = [&](const char* what, double ms) {
    if (ms > 0) text += fmt::format("  {:<9}{} ms\n", what, format_ms(ms));
  };
  stage("upload", o.times.upload);
  stage("boxes", o.times.boxes);
  stage("grid", o.times.grid);
  stage("search", o.times.search);
  stage("download", o.times.download);
  if (o.times.decode > 0) text += fmt::format("decode    {} ms\n", format_ms(o.times.decode));
  text += fmt::format("output    {} bytes\n", format_count(o.output_bytes));
  if (a.variant.per_cell > 0) {
    text += fmt::format("grid      {} cells, {} entries\n", format_count(o.cells),
                        format_count(o.entries));
  } else if (o.errors.indices > 0) {
    text += fmt::format("mapping   wrong at an end of {} rows, first at index {}\n",
                        format_count(o.errors.rows), format_count(o.errors.first_index));
  }
  if (a.check) {
    text += fmt::format("check     {} missing, {} too many\n", format_count(o.missing),
                        format_count(o.extra));
  }
  return text;
}

}  // namespace throng::paper
