// Uniqueness of ids over all ranks, by a distributed directory: each id is checked by the rank that
// its hash selects.
#pragma once

#include <cstdint>
#include <unordered_set>
#include <vector>

#include <throng/options.hpp>

#include "mpi/communicator.hpp"

namespace throng::mpi {

// Collective. Sends the ids to their directory ranks; returns those received, by sender.
std::vector<Parcel> send_to_directory(Communicator& communicator, const std::uint64_t* ids,
                                      std::size_t count);

// Sets an error in r for a received id that occurs twice or is in `taken`; the message names the
// senders.
void check_unique(const std::vector<Parcel>& parcels,
                  const std::unordered_set<std::uint64_t>& taken, Result& r);

}  // namespace throng::mpi
