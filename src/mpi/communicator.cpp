#include "mpi/communicator.hpp"

#include <algorithm>
#include <cstring>
#include <string>
#include <thread>

#include "mpi/regions.hpp"

namespace throng::mpi {

// Buffers that MPI may access during a wait.
struct Communicator::Pending {
  std::vector<std::uint64_t> words, words_out;
  std::vector<Parcel> parcels;
  std::vector<MPI_Request> requests;
  Bytes data;
  std::uint64_t most = 0, most_out = 0;
  MPI_Request request = MPI_REQUEST_NULL, second = MPI_REQUEST_NULL;
};

namespace {

// MPI message lengths are int; longer messages are not faster.
constexpr std::size_t piece = std::size_t{1} << 28;
constexpr int swap_tag = 2, slice_tag = 3;  // parcels use 0 and 1

}  // namespace

bool mpi_is_initialized() noexcept {
  int begun = 0, over = 0;
  return MPI_Initialized(&begun) == MPI_SUCCESS && begun && MPI_Finalized(&over) == MPI_SUCCESS &&
         !over;
}

Communicator::Communicator(MPI_Comm comm, double timeout_seconds)
    : timeout_seconds_(timeout_seconds), pending_(std::make_unique<Pending>()) {
  check(MPI_Comm_dup(comm, &comm_), "MPI_Comm_dup");
  check(MPI_Comm_set_errhandler(comm_, MPI_ERRORS_RETURN), "MPI_Comm_set_errhandler");
  check(MPI_Comm_rank(comm_, &rank_), "MPI_Comm_rank");
  check(MPI_Comm_size(comm_, &size_), "MPI_Comm_size");
}

Communicator::~Communicator() {
  if (broken_) {
    static_cast<void>(pending_.release());  // MPI may still write there
    return;
  }
  if (!mpi_is_initialized()) return;
  for (std::size_t i = 1; i < nodes_.size(); ++i) MPI_Comm_free(&nodes_[i].comm);
  if (comm_ != MPI_COMM_NULL) MPI_Comm_free(&comm_);
}

void Communicator::check(int code, const char* what) {
  if (code == MPI_SUCCESS) return;
  broken_ = true;
  char text[MPI_MAX_ERROR_STRING] = "";
  int length = 0;
  MPI_Error_string(code, text, &length);
  throw CommunicationError(std::string(what) + " failed: " + text);
}

template <class Done>
void Communicator::wait(Done&& done) {
  if (broken_) throw CommunicationError("an earlier call failed");
  const Clock::time_point start = Clock::now();
  for (unsigned turn = 0;; ++turn) {
    if (done()) return;
    if (turn < 64) continue;
    // Ranks may share a core: yield, and after a millisecond sleep between polls.
    const double waited = std::chrono::duration<double>(Clock::now() - start).count();
    if (waited < 1e-3) {
      std::this_thread::yield();
    } else {
      std::this_thread::sleep_for(std::chrono::microseconds(waited < 0.1 ? 20 : 200));
    }
    if (timeout_seconds_ > 0 && waited > timeout_seconds_) {
      broken_ = true;
      throw CommunicationError("a rank did not make the call within " +
                               std::to_string(timeout_seconds_) + " s");
    }
  }
}

void Communicator::wait_for(MPI_Request& request) {
  wait([&] {
    int done = 0;
    check(MPI_Test(&request, &done, MPI_STATUS_IGNORE), "MPI_Test");
    return done != 0;
  });
}

// Both word types have eight bytes and share the buffer.
void Communicator::reduce(void* values, int count, MPI_Datatype type, MPI_Op op, int level) {
  if (broken_) throw CommunicationError("an earlier call failed");
  const std::size_t bytes = static_cast<std::size_t>(count) * sizeof(std::uint64_t);
  Pending& p = *pending_;
  p.words.resize(static_cast<std::size_t>(count));
  p.words_out.resize(static_cast<std::size_t>(count));
  std::memcpy(p.words.data(), values, bytes);
  const MPI_Comm comm = level == 0 ? comm_ : node(level).comm;
  check(MPI_Iallreduce(p.words.data(), p.words_out.data(), count, type, op, comm, &p.request),
        "MPI_Iallreduce");
  wait_for(p.request);
  std::memcpy(values, p.words_out.data(), bytes);
  ++counts_.collectives;
  counts_.collective_bytes += bytes;
}

void Communicator::all_reduce_sum_and_max(std::uint64_t* sums, int count, std::uint64_t& most) {
  Pending& p = *pending_;
  p.most = most;
  check(MPI_Iallreduce(&p.most, &p.most_out, 1, MPI_UINT64_T, MPI_MAX, comm_, &p.second),
        "MPI_Iallreduce");
  all_reduce_sum(sums, count);
  wait_for(p.second);
  most = p.most_out;
  ++counts_.collectives;
  counts_.collective_bytes += sizeof most;
}

std::uint64_t Communicator::exclusive_sum(std::uint64_t mine) {
  if (broken_) throw CommunicationError("an earlier call failed");
  Pending& p = *pending_;
  p.words.assign(1, mine);
  p.words_out.assign(1, 0);
  check(
      MPI_Iexscan(p.words.data(), p.words_out.data(), 1, MPI_UINT64_T, MPI_SUM, comm_, &p.request),
      "MPI_Iexscan");
  wait_for(p.request);
  ++counts_.collectives;
  counts_.collective_bytes += sizeof mine;
  return rank_ == 0 ? 0 : p.words_out[0];
}

void Communicator::broadcast(int root, void* data, int bytes) {
  if (broken_) throw CommunicationError("an earlier call failed");
  Pending& p = *pending_;
  p.data.resize(static_cast<std::size_t>(bytes));
  std::memcpy(p.data.data(), data, p.data.size());
  check(MPI_Ibcast(p.data.data(), bytes, MPI_BYTE, root, comm_, &p.request), "MPI_Ibcast");
  wait_for(p.request);
  std::memcpy(data, p.data.data(), p.data.size());
  ++counts_.collectives;
  counts_.collective_bytes += p.data.size();
}

void Communicator::all_gather(const void* mine, int bytes, void* out) {
  if (broken_) throw CommunicationError("an earlier call failed");
  Pending& p = *pending_;
  const std::size_t one = static_cast<std::size_t>(bytes);
  p.data.resize(one * (static_cast<std::size_t>(size_) + 1));
  std::memcpy(p.data.data(), mine, one);
  check(MPI_Iallgather(p.data.data(), bytes, MPI_BYTE, p.data.data() + one, bytes, MPI_BYTE, comm_,
                       &p.request),
        "MPI_Iallgather");
  wait_for(p.request);
  std::memcpy(out, p.data.data() + one, one * static_cast<std::size_t>(size_));
  ++counts_.collectives;
  counts_.collective_bytes += one * static_cast<std::size_t>(size_);
}

// Sends in pieces. The data must stay valid until the sends complete.
void Communicator::send(int rank, int tag, const std::byte* data, std::size_t all,
                        bool synchronous) {
  for (std::size_t at = 0; at < all || (at == 0 && !synchronous); at += piece) {
    const int bytes = static_cast<int>(std::min(piece, all - at));
    MPI_Request& request = pending_->requests.emplace_back(MPI_REQUEST_NULL);
    const auto start = synchronous ? MPI_Issend : MPI_Isend;
    check(start(data + at, bytes, MPI_BYTE, rank, tag, comm_, &request), "MPI_Isend");
    ++counts_.messages;
    counts_.bytes += static_cast<std::uint64_t>(bytes);
  }
}

void Communicator::wait_for_all() {
  Pending& p = *pending_;
  wait([&] {
    int done = 0;
    check(MPI_Testall(static_cast<int>(p.requests.size()), p.requests.data(), &done,
                      MPI_STATUSES_IGNORE),
          "MPI_Testall");
    return done != 0;
  });
}

// Receives one pending message, if any.
bool Communicator::receive(int rank, int tag, Parcel& parcel) {
  int pending = 0, bytes = 0;
  MPI_Message message = MPI_MESSAGE_NULL;
  MPI_Status status;
  check(MPI_Improbe(rank, tag, comm_, &pending, &message, &status), "MPI_Improbe");
  if (!pending) return false;
  check(MPI_Get_count(&status, MPI_BYTE, &bytes), "MPI_Get_count");
  parcel.rank = status.MPI_SOURCE;
  parcel.data.resize(static_cast<std::size_t>(bytes));
  check(MPI_Mrecv(parcel.data.data(), bytes, MPI_BYTE, &message, MPI_STATUS_IGNORE), "MPI_Mrecv");
  return true;
}

// A rank may be one exchange ahead of another, never two, so two tags suffice.
std::vector<Parcel> Communicator::exchange(std::vector<Parcel> parcels) {
  if (broken_) throw CommunicationError("an earlier call failed");
  tag_ ^= 1;
  Pending& p = *pending_;
  p.requests.clear();
  p.parcels = std::move(parcels);
  std::vector<Parcel> got;
  for (Parcel& parcel : p.parcels) {
    if (parcel.rank == rank_) {
      if (!parcel.data.empty()) got.push_back(std::move(parcel));
    } else {
      send(parcel.rank, tag_, parcel.data.data(), parcel.data.size(), true);
    }
  }
  bool all_sent = false;
  wait([&] {
    Parcel parcel;
    while (receive(MPI_ANY_SOURCE, tag_, parcel)) got.push_back(std::move(parcel));
    int done = 0;
    if (!all_sent) {
      check(MPI_Testall(static_cast<int>(p.requests.size()), p.requests.data(), &done,
                        MPI_STATUSES_IGNORE),
            "MPI_Testall");
      if (!done) return false;
      all_sent = true;
      check(MPI_Ibarrier(comm_, &p.request), "MPI_Ibarrier");
    }
    check(MPI_Test(&p.request, &done, MPI_STATUS_IGNORE), "MPI_Test");
    return done != 0;
  });
  p.parcels.clear();
  ++counts_.collectives;
  // Messages of one rank arrive in order, but ranks in any order; sort to make the result
  // deterministic.
  std::stable_sort(got.begin(), got.end(),
                   [](const Parcel& a, const Parcel& b) { return a.rank < b.rank; });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < got.size(); ++i) {
    if (kept != 0 && got[kept - 1].rank == got[i].rank) {
      got[kept - 1].data.insert(got[kept - 1].data.end(), got[i].data.begin(), got[i].data.end());
    } else {
      if (kept != i) got[kept] = std::move(got[i]);
      ++kept;
    }
  }
  got.resize(kept);
  return got;
}

void Communicator::exchange(const std::vector<Slice>& to, const std::vector<Slice>& from) {
  if (broken_) throw CommunicationError("an earlier call failed");
  Pending& p = *pending_;
  p.requests.clear();
  for (const Slice& slice : from) {
    for (std::size_t at = 0; at < slice.bytes; at += piece) {
      const int bytes = static_cast<int>(std::min(piece, slice.bytes - at));
      MPI_Request& request = p.requests.emplace_back(MPI_REQUEST_NULL);
      check(MPI_Irecv(slice.data + at, bytes, MPI_BYTE, slice.rank, slice_tag, comm_, &request),
            "MPI_Irecv");
    }
  }
  for (const Slice& slice : to) {
    if (slice.bytes) send(slice.rank, slice_tag, slice.data, slice.bytes, false);
  }
  wait_for_all();
}

// MPI_Comm_split has no timeout; all ranks have just synchronized when this is called.
void Communicator::make_nodes() {
  if (!nodes_.empty()) return;
  nodes_.push_back({0, size_, comm_});
  while (nodes_.back().end - nodes_.back().begin > 1) {
    const Node above = nodes_.back();
    const int m = Regions::middle(above.begin, above.end);
    const bool left = rank_ < m;
    Node node = {left ? above.begin : m, left ? m : above.end, MPI_COMM_NULL};
    check(MPI_Comm_split(above.comm, left ? 0 : 1, rank_, &node.comm), "MPI_Comm_split");
    check(MPI_Comm_set_errhandler(node.comm, MPI_ERRORS_RETURN), "MPI_Comm_set_errhandler");
    nodes_.push_back(node);
  }
}

const Communicator::Node& Communicator::node(int level) {
  make_nodes();
  return nodes_[static_cast<std::size_t>(level)];
}

// Left rank i and right rank i swap data. The right half may have one rank more, which sends to the
// last left rank and receives nothing.
void Communicator::swap_halves(int level, const Bytes& data, Bytes& got) {
  const Node& n = node(level);
  const int m = Regions::middle(n.begin, n.end), left = m - n.begin, right = n.end - m;
  int to, sources[2], source_count = 0;
  if (rank_ < m) {
    const int i = rank_ - n.begin;
    to = m + i;
    sources[source_count++] = m + i;
    if (i == left - 1 && right > left) sources[source_count++] = m + left;
  } else {
    const int i = rank_ - m;
    to = n.begin + std::min(i, left - 1);
    if (i < left) sources[source_count++] = n.begin + i;
  }
  Pending& p = *pending_;
  p.requests.clear();
  p.data = data;
  send(to, swap_tag, p.data.data(), p.data.size(), false);
  // A message shorter than `piece`, possibly empty, ends a partner's data.
  if (!data.empty() && data.size() % piece == 0) send(to, swap_tag, nullptr, 0, false);
  for (int s = 0; s < source_count; ++s) {
    Parcel parcel;
    do {
      wait([&] { return receive(sources[s], swap_tag, parcel); });
      got.insert(got.end(), parcel.data.begin(), parcel.data.end());
    } while (parcel.data.size() == piece);
  }
  wait_for_all();
}

}  // namespace throng::mpi
