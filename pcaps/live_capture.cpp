#include "pcaps/live_capture.hpp"

#include <array>

#include "pcaps/link_type.hpp"

namespace trestle::pcaps {
namespace {

/// More than offloading ever hands over in one piece.
constexpr int longest_frame = 256 << 10;
constexpr int buffer_bytes = 16 << 20;
/// How long the system may gather frames before it hands them over.
constexpr int gathering_ms = 10;

}  // namespace

void LiveCapture::Close::operator()(pcap* handle) const noexcept {
  pcap_close(handle);
}

LiveCapture::LiveCapture(const std::string& interface) {
  std::array<char, PCAP_ERRBUF_SIZE> reason{};
  handle_.reset(pcap_create(interface.c_str(), reason.data()));
  const auto fail = [&](const std::string& why) {
    throw std::runtime_error{"cannot capture from " + interface + ": " + why};
  };
  if (!handle_) {
    fail(reason.data());
  }
  pcap* const handle = handle_.get();
  pcap_set_snaplen(handle, longest_frame);
  pcap_set_promisc(handle, interface == "any" ? 0 : 1);  // frames from a mirror port are addressed to others
  // Not pcap_set_immediate_mode, which delivers frames one by one: then each frame would take the room of the
  // longest one, and 64 frames would fill the buffer.
  pcap_set_timeout(handle, gathering_ms);
  pcap_set_buffer_size(handle, buffer_bytes);
  // Otherwise to_frame() would take microseconds for nanoseconds. Every Linux device has nanoseconds.
  if (pcap_set_tstamp_precision(handle, PCAP_TSTAMP_PRECISION_NANO) != 0) {
    fail("it has no time stamps in nanoseconds");
  }
  const int status = pcap_activate(handle);
  if (status == PCAP_ERROR_PERM_DENIED || status == PCAP_ERROR_PROMISC_PERM_DENIED) {
    throw CaptureDenied{"this process may not capture from " + interface};
  }
  if (status < 0) {
    const std::string detail = pcap_geterr(handle);
    fail(detail.empty() ? pcap_statustostr(status) : detail);
  }
  if (pcap_setnonblock(handle, 1, reason.data()) != 0) {
    fail(reason.data());
  }
  link_ = link_type_of(handle, interface);
  fd_ = pcap_get_selectable_fd(handle);
  if (fd_ < 0) {
    fail("it has no descriptor to wait for");
  }
}

std::optional<Frame> LiveCapture::next() {
  pcap_pkthdr* header = nullptr;
  const unsigned char* bytes = nullptr;
  const int status = error_.empty() ? pcap_next_ex(handle_.get(), &header, &bytes) : 0;
  if (status < 0) {
    error_ = pcap_geterr(handle_.get());
  }
  if (status != 1) {
    return std::nullopt;
  }
  return to_frame(++frames_, link_, *header, bytes);
}

std::uint64_t LiveCapture::dropped() const noexcept {
  pcap_stat counts{};
  return pcap_stats(handle_.get(), &counts) == 0 ? counts.ps_drop : 0;
}

}  // namespace trestle::pcaps
