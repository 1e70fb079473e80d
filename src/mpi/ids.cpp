#include "mpi/ids.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include <throng/checksum.hpp>

#include "mpi/consensus.hpp"

namespace throng::mpi {

using ull = unsigned long long;

std::vector<Parcel> send_to_directory(Communicator& communicator, const std::uint64_t* ids,
                                      std::size_t count) {
  const auto ranks = static_cast<std::size_t>(communicator.size());
  const auto directory_rank = [&](std::uint64_t id) { return mix64(id) % ranks; };
  std::vector<std::size_t> bytes(ranks);
  for (std::size_t i = 0; i < count; ++i) bytes[directory_rank(ids[i])] += sizeof *ids;
  std::vector<Parcel> parcels;
  std::vector<std::byte*> next(ranks);
  for (std::size_t rank = 0; rank < ranks; ++rank)
    if (bytes[rank] != 0) {
      parcels.push_back({static_cast<int>(rank), Bytes(bytes[rank])});
      next[rank] = parcels.back().data.data();
    }
  for (std::size_t i = 0; i < count; ++i) {
    std::byte*& to = next[directory_rank(ids[i])];
    std::memcpy(to, ids + i, sizeof *ids);
    to += sizeof *ids;
  }
  return communicator.exchange(std::move(parcels));
}

void check_unique(const std::vector<Parcel>& parcels,
                  const std::unordered_set<std::uint64_t>& taken, Result& r) {
  std::vector<std::pair<std::uint64_t, int>> given;
  for (const Parcel& parcel : parcels) {
    for (std::size_t at = 0; at < parcel.data.size(); at += sizeof(std::uint64_t)) {
      std::uint64_t id;
      std::memcpy(&id, parcel.data.data() + at, sizeof id);
      given.emplace_back(id, parcel.rank);
    }
  }
  std::sort(given.begin(), given.end());
  for (std::size_t i = 0; i < given.size(); ++i) {
    const auto [id, rank] = given[i];
    if (taken.count(id)) {
      set_error(r, Status::ranks_disagree,
                "id %llu, given by rank %d, is in use by another object; give each object its own",
                ull{id}, rank);
      return;
    }
    if (i + 1 < given.size() && given[i + 1].first == id) {
      set_error(r, Status::ranks_disagree,
                "id %llu was given twice, by ranks %d and %d; give each object its own", ull{id},
                rank, given[i + 1].second);
      return;
    }
  }
}

}  // namespace throng::mpi
