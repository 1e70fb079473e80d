// Ids over all ranks: each rank judges its share of them, by their mixed bits.
#pragma once

#include <cstdint>
#include <unordered_set>
#include <vector>

#include <throng/options.hpp>

#include "mpi/link.hpp"

namespace throng::mpi {

// The splitmix64 finaliser: 64 well mixed bits.
constexpr std::uint64_t mixed(std::uint64_t x) noexcept {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

// Collective: the ids go to their judges, in parcels by rank.
std::vector<Parcel> to_judges(Link& link, const std::uint64_t* ids, std::size_t count);

// Of what came: an id that stands there twice, or in `taken`, makes r bad and names who gave it.
void judge(const std::vector<Parcel>& parcels, const std::unordered_set<std::uint64_t>& taken,
           Result& r);

}  // namespace throng::mpi
