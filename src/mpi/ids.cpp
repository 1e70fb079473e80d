#include "mpi/ids.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "mpi/agree.hpp"

namespace throng::mpi {

using ull = unsigned long long;

std::vector<Parcel> to_judges(Link& link, const std::uint64_t* ids, std::size_t count) {
  std::vector<Parcel> parcels;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> by_judge;
  const auto ranks = static_cast<std::uint64_t>(link.size());
  by_judge.reserve(count);
  for (std::size_t i = 0; i < count; ++i) by_judge.emplace_back(mixed(ids[i]) % ranks, ids[i]);
  std::sort(by_judge.begin(), by_judge.end());
  for (const auto& [rank, id] : by_judge) {
    if (parcels.empty() || parcels.back().rank != static_cast<int>(rank)) {
      parcels.push_back({static_cast<int>(rank), {}});
    }
    Bytes& data = parcels.back().data;
    data.resize(data.size() + sizeof id);
    std::memcpy(data.data() + data.size() - sizeof id, &id, sizeof id);
  }
  return link.exchange(std::move(parcels));
}

void judge(const std::vector<Parcel>& parcels, const std::unordered_set<std::uint64_t>& taken,
           Result& r) {
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
      say(r, Status::ranks_disagree,
          "id %llu, given by rank %d, is that of another object; give each object its own", ull{id},
          rank);
      return;
    }
    if (i + 1 < given.size() && given[i + 1].first == id) {
      say(r, Status::ranks_disagree,
          "id %llu was given twice, by ranks %d and %d; give each object its own", ull{id}, rank,
          given[i + 1].second);
      return;
    }
  }
}

}  // namespace throng::mpi
