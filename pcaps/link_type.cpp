#include "pcaps/link_type.hpp"

namespace trestle::pcaps {

LinkType link_type(int data_link) noexcept {
  switch (data_link) {
    case DLT_EN10MB:
      return LinkType::ethernet;
    case DLT_LINUX_SLL:
      return LinkType::linux_sll;
    case DLT_LINUX_SLL2:
      return LinkType::linux_sll2;
    case DLT_RAW:
    case DLT_IPV4:
    case DLT_IPV6:
      return LinkType::raw_ip;
    case DLT_NULL:
    case DLT_LOOP:
      return LinkType::null_loopback;
    case DLT_IEEE802_11:
      return LinkType::wlan;
    case DLT_PPI:
      return LinkType::ppi;
    default:
      return LinkType::unsupported;
  }
}

LinkType link_type_of(pcap* handle, const std::string& name) {
  const int data_link = pcap_datalink(handle);
  const LinkType link = link_type(data_link);
  if (link == LinkType::unsupported) {
    const char* known = pcap_datalink_val_to_name(data_link);
    throw std::runtime_error{"cannot read frames from " + name + ": link type " +
                             (known != nullptr ? std::string{known} : std::to_string(data_link)) +
                             " is none of Ethernet, Linux cooked (1 and 2), raw IP, null/loopback, 802.11 "
                             "and PPI"};
  }
  return link;
}

Frame to_frame(std::uint64_t number, LinkType link, const pcap_pkthdr& header,
               const unsigned char* bytes) noexcept {
  // When nanoseconds are requested, libpcap puts them into the field for microseconds.
  const Timestamp time{std::chrono::seconds{header.ts.tv_sec} + std::chrono::nanoseconds{header.ts.tv_usec}};
  return {number, time, link, std::as_bytes(std::span{bytes, header.caplen}), header.len};
}

}  // namespace trestle::pcaps
