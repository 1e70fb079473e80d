// Ids over all ranks: each rank judges its share of them, by their mixed bits.
#pragma once

#include <cstdint>
#include <unordered_set>
#include <vector>

#include <throng/options.hpp>

#include "mpi/link.hpp"
#include "mpi/mixed.hpp"

namespace throng::mpi {

// Collective: the ids go to their judges, in parcels by rank.
std::vector<Parcel> to_judges(Link& link, const std::uint64_t* ids, std::size_t count);

// Of what came: an id that stands there twice, or in `taken`, makes r bad and names who gave it.
void judge(const std::vector<Parcel>& parcels, const std::unordered_set<std::uint64_t>& taken,
           Result& r);

}  // namespace throng::mpi
