// Table 5 with Figure 3, and Figure 4: the cost of brute force, with output in bytes and bits.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "apps/paper/evaluation/experiments.hpp"
#include "apps/paper/matrix.hpp"
#include "apps/report/format.hpp"
#include "base/pair_index.hpp"

namespace throng::paper {
namespace {

// The paper's Table 5: kernel in ms, output in us.
struct PaperRow {
  std::uint64_t n;
  double byte_kernel, byte_output, bit_kernel, bit_output;
};
constexpr PaperRow paper_rows[] = {{100, 0.03, 14.35, 0.03, 7.75},
                                   {1000, 2.70, 842.75, 2.72, 111.18},
                                   {5000, 73.95, 21428, 74.14, 2612.42},
                                   {7500, 163.60, 45865.94, 162.03, 5687.20}};
const PaperRow* paper_row_for(std::uint64_t n) {
  for (const PaperRow& g : paper_rows) {
    if (g.n == n) return &g;
  }
  return nullptr;
}

Variant matrix(Output output, Write write = Write::ballot) {
  Variant variant;
  variant.output = output;
  variant.write = write;
  return variant;
}

// The host transfers nothing; a copy of the same number of bytes replaces it.
double copy_ms(std::uint64_t bytes, int repeat) {
  const std::vector<char> from(bytes, 1);
  std::vector<char> to(bytes, 2);
  return median_ms([&] { std::memcpy(to.data(), from.data(), bytes); }, repeat, 1000);
}

struct Form {
  const char* name;
  Variant variant;
};
std::vector<Form> forms() {
  return {{"one byte", matrix(Output::byte)},
          {"one bit, racy as printed", matrix(Output::bit, Write::racy)},
          {"one bit, atomic", matrix(Output::bit, Write::atomic)},
          {"one bit, ballot", matrix(Output::bit, Write::ballot)},
          {"one bit, word per thread", matrix(Output::bit, Write::owned)}};
}

}  // namespace

Section table5(const Lab& lab) {
  Section section("table5", "Table 5 and Figure 3: one byte and one bit per pair");
  for (const DeviceKind device : lab.devices()) {
    std::map<std::string, report::Series> kernels, outputs;
    std::uint64_t lost = 0, found = 0, largest = 0;
    double share = 0;
    for (const std::uint64_t n : lab.sizes({100, 250, 500, 1000, 2500, 5000, 7500}, 5000)) {
      const PaperRow* const g = paper_row_for(n);
      const Boxes boxes = make_scene("pile", n, 1, 1);
      std::uint64_t all = 0;
      double byte_output = 0;
      for (const Form& form : forms()) {
        lab.say(fmt::format("Table 5: {}, {} objects, {}", form.name, n, lab.name(device)));
        const Lab::Measurement measurement = lab.run(form.variant, boxes.frame(0), n, device);
        Row kernel = lab.row(form.name, n, "kernel", device, measurement, &Times::search);
        if (!measurement.measured) {
          section.rows.push_back(std::move(kernel));
          continue;
        }
        const bool byte = form.variant.output == Output::byte;
        const bool racy = !byte && form.variant.write == Write::racy;
        const std::uint64_t pairs = measurement.measured->step.pairs.size();
        if (byte) all = pairs;
        const double x = static_cast<double>(n);
        const double output_ms =
            device == DeviceKind::cpu
                ? copy_ms(measurement.measured->step.output_bytes, lab.repeat())
                : measurement.measured->step.times.download;
        kernels[form.name].x.push_back(x);
        kernels[form.name].y.push_back(*kernel.measured);
        outputs[form.name].x.push_back(x);
        outputs[form.name].y.push_back(output_ms);
        if (g && byte) kernel.paper = g->byte_kernel;
        if (g && racy) kernel.paper = g->bit_kernel;
        kernel.found = speed_sentence(kernel);
        if (racy) {
          if (n >= largest) largest = n, lost = all - pairs, found = all;
          kernel.found += fmt::format(
              "{}{}", kernel.found.empty() ? "" : "; ",
              pairs == all ? fmt::format("all {} pairs are found", report::format_count(all))
                           : fmt::format("loses {} of {} pairs", report::format_count(all - pairs),
                                         report::format_count(all)));
        } else if (pairs != all) {
          kernel.found = fmt::format("wrong: {} pairs, not {}", pairs, all);
        }
        Row output = lab.row(form.name, n, "output", "us", device);
        output.measured = output_ms * 1000;
        if (g && byte) output.paper = g->byte_output;
        if (g && racy) output.paper = g->bit_output;
        output.found = speed_sentence(output);
        if (byte) byte_output = output_ms;
        if (!byte && output_ms > 0) share = byte_output / output_ms;
        section.rows.push_back(std::move(kernel));
        section.rows.push_back(std::move(output));
      }
    }
    report::Plot plot{"Figure 3, " + lab.name(device), "objects", "ms", true, true, {}};
    for (const Form& form : forms()) {
      if (kernels.count(form.name) == 0) continue;
      kernels[form.name].name = std::string(form.name) + ": kernel";
      plot.series.push_back(kernels[form.name]);
    }
    for (const Form& form : {forms()[0], forms()[3]}) {
      if (outputs.count(form.name) == 0) continue;
      outputs[form.name].name = std::string(form.name) + ": output";
      plot.series.push_back(outputs[form.name]);
    }
    report::Series paper[3] = {{"paper: kernel, one bit", {}, {}, false, true},
                               {"paper: output, one byte", {}, {}, false, true},
                               {"paper: output, one bit", {}, {}, false, true}};
    for (const PaperRow& g : paper_rows) {
      const double y[3] = {g.bit_kernel, g.byte_output / 1000, g.bit_output / 1000};
      for (int k = 0; k < 3; ++k) {
        paper[k].x.push_back(static_cast<double>(g.n));
        paper[k].y.push_back(y[k]);
      }
    }
    for (report::Series& line : paper) plot.series.push_back(std::move(line));
    section.plots.push_back(std::move(plot));
    section.finding += fmt::format(
        "On {} bits are transferred {} faster than bytes at the largest size (paper: 8.06x), and "
        "the "
        "printed read-OR-write {} at {} objects. ",
        lab.name(device), report::format_ratio(share),
        lost == 0 ? fmt::format("happens to lose none of {} pairs", report::format_count(found))
                  : fmt::format("loses {} of {} pairs", report::format_count(lost),
                                report::format_count(found)),
        report::format_count(largest));
  }
  section.words = {
      "The scene is the pile, which has overlaps enough for several to fall into one byte. The "
      "printed form reads a byte, ORs a bit in and writes it back, with eight threads on a byte "
      "and "
      "nothing that orders them; on the host the threads of a warp are run in step, a schedule "
      "that "
      "this form allows. The three other forms of bits are exact.",
      "Without a GPU nothing is transferred; the output's time is then that of a copy of as many "
      "bytes from memory to memory."};
  return section;
}

Section figure4(const Lab& lab) {
  Section section("figure4", "Figure 4: brute force over the number of objects");
  report::Plot bytes{"Figure 4, bytes", "objects", "bytes", true, true, {}};
  report::Series input{"input, 24 n", {}, {}, false, false};
  report::Series output{"output, n(n-1)/16", {}, {}, false, false};
  for (const DeviceKind device : lab.devices()) {
    report::Plot plot{"Figure 4, " + lab.name(device), "objects", "ms", true, true, {}};
    report::Series kernel{"kernel", {}, {}, true, false};
    double first = 0, last = 0;
    std::uint64_t least = 0, most = 0;
    for (const std::uint64_t n :
         lab.sizes({100, 500, 1000, 1500, 2000, 2500, 3000, 4000, 5000}, 5000)) {
      lab.say(fmt::format("Figure 4: {} objects, {}", n, lab.name(device)));
      const Boxes boxes = make_scene("uniform", n, 1, 1);
      const Lab::Measurement measurement = lab.run(matrix(Output::bit), boxes.frame(0), n, device);
      Row row =
          lab.row("brute force, one bit, ballot", n, "kernel", device, measurement, &Times::search);
      if (measurement.measured) {
        const double x = static_cast<double>(n), in = 24 * x;
        const double out = static_cast<double>(measurement.measured->step.output_bytes);
        if (least == 0) least = n, first = *row.measured;
        most = n, last = *row.measured;
        kernel.x.push_back(x);
        kernel.y.push_back(*row.measured);
        if (device == lab.devices().front()) {
          input.x.push_back(x);
          input.y.push_back(in);
          output.x.push_back(x);
          output.y.push_back(out);
        }
        row.found =
            fmt::format("{} bytes in, {} out, {:.3g} G pairs/s", report::format_count(24 * n),
                        report::format_count(measurement.measured->step.output_bytes),
                        static_cast<double>(base::pair_count(n)) / (*row.measured * 1e6));
      }
      section.rows.push_back(std::move(row));
    }
    if (most > least && first > 0) {
      section.finding += fmt::format(
          "On {} the kernel takes {} the time for {} the pairs, from {} objects to {}. ",
          lab.name(device), report::format_ratio(last / first),
          report::format_ratio(static_cast<double>(base::pair_count(most)) /
                               static_cast<double>(base::pair_count(least))),
          least, most);
    }
    plot.series.push_back(std::move(kernel));
    section.plots.push_back(std::move(plot));

    // 3.2: the boxes of 10K objects are 234 KB, transferred in less than 50 us.
    Row bound = lab.row("input of 10,000 objects", 10000, "size", "KB of 1,024 bytes", device);
    bound.paper = 234;
    bound.measured = std::floor(24 * 10000 / 1024.0);
    bound.found = *bound.measured == *bound.paper ? "agrees" : "differs";
    section.rows.push_back(bound);
    Row upload = lab.row("input of 10,000 objects", 10000, "hand-over", "us", device);
    upload.paper = 50;
    if (device == DeviceKind::cpu) {
      upload.measured = copy_ms(240000, lab.repeat()) * 1000;
    } else {
      Variant grid;
      grid.per_cell = 4;
      const Boxes boxes = make_scene("uniform", 10000, 1, 1);
      const Lab::Measurement measurement = lab.run(grid, boxes.frame(0), 10000, device);
      if (measurement.measured) upload.measured = measurement.measured->step.times.upload * 1000;
    }
    if (upload.measured) {
      upload.found = fmt::format("{} the 50 us that the paper stays under{}",
                                 *upload.measured < 50 ? "under" : "over",
                                 device == DeviceKind::cpu ? "; a copy from memory to memory" : "");
    }
    section.rows.push_back(std::move(upload));
  }
  bytes.series = {std::move(input), std::move(output)};
  section.plots.push_back(std::move(bytes));
  section.words = {"The paper's figure has no numbers in its text, so its column is empty."};
  return section;
}

}  // namespace throng::paper
