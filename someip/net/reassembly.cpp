#include "someip/net/reassembly.hpp"

#include <sys/mman.h>
#include <unistd.h>

namespace trestle::someip {
namespace {

std::size_t in_pages(std::size_t bytes) {
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  return (bytes + page - 1) / page * page;
}

}  // namespace

Reassembly::Reassembly(std::size_t max_messages, const TpReassemblyLimits& limits)
    : max_messages_{max_messages},
      max_message_bytes_{limits.max_message_bytes},
      place_bytes_{in_pages(tp_map_words(max_message_bytes_) * sizeof(std::uint32_t)) +
                   in_pages(max_message_bytes_)},
      machine_{{}, limits} {
  places_.reserve(max_messages);
  slots_.reserve(max_messages);
}

Reassembly::~Reassembly() {
  while (!places_.empty()) {
    remove_place();
  }
}

void Reassembly::add_place() {
  void* const place = ::mmap(nullptr, place_bytes_, PROT_READ | PROT_WRITE,
                             MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (place == MAP_FAILED) {
    return;  // those that are there go on
  }
  const std::size_t words = tp_map_words(max_message_bytes_);
  auto* const buffer = static_cast<std::byte*>(place) + in_pages(words * sizeof(std::uint32_t));
  places_.push_back(place);
  slots_.emplace_back(ByteSpan{buffer, max_message_bytes_},
                      std::span{static_cast<std::uint32_t*>(place), words});
  machine_.use(slots_);
}

void Reassembly::remove_place() {
  ::munmap(places_.back(), place_bytes_);
  places_.pop_back();
  slots_.pop_back();
  machine_.use(slots_);
}

void Reassembly::on_time(TimePoint now) {
  machine_.on_time(now);
  while (const auto slot = machine_.forget(now)) {
    ::madvise(places_[*slot], place_bytes_, MADV_DONTNEED);
  }
  // One stays for the next message. Those in the middle cost nothing but addresses.
  while (slots_.size() > 1 && !machine_.used(slots_.size() - 1) && !machine_.used(slots_.size() - 2)) {
    remove_place();
  }
}

std::optional<TimePoint> Reassembly::deadline() const {
  const auto under_way = machine_.deadline();
  const auto remembered = machine_.forget_deadline();
  return under_way && remembered ? earlier(*under_way, *remembered) : under_way ? under_way : remembered;
}

}  // namespace trestle::someip
