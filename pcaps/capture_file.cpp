#include "pcaps/capture_file.hpp"

#include <pcap/pcap.h>

#include <array>
#include <stdexcept>

namespace trestle::pcaps {
namespace {

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
    default:
      return LinkType::unsupported;
  }
}

}  // namespace

void CaptureFile::Close::operator()(pcap* file) const noexcept {
  pcap_close(file);
}

CaptureFile::CaptureFile(const std::string& path) {
  std::array<char, PCAP_ERRBUF_SIZE> reason{};
  file_.reset(
      pcap_open_offline_with_tstamp_precision(path.c_str(), PCAP_TSTAMP_PRECISION_NANO, reason.data()));
  const std::string name = path == "-" ? "standard input" : path;
  if (!file_) {
    std::string why = reason.data();
    // libpcap itself names the file in some of its messages.
    if (const std::string prefix = path + ": "; why.starts_with(prefix)) {
      why.erase(0, prefix.size());
    }
    throw std::runtime_error{"cannot read a capture from " + name + ": " + why};
  }
  const int data_link = pcap_datalink(file_.get());
  link_ = link_type(data_link);
  if (link_ == LinkType::unsupported) {
    const char* known = pcap_datalink_val_to_name(data_link);
    throw std::runtime_error{"cannot read frames from " + name + ": link type " +
                             (known != nullptr ? std::string{known} : std::to_string(data_link)) +
                             " is none of Ethernet, Linux cooked (1 and 2), raw IP and null/loopback"};
  }
}

std::optional<Frame> CaptureFile::next() {
  pcap_pkthdr* header = nullptr;
  const unsigned char* bytes = nullptr;
  const int status = error_.empty() ? pcap_next_ex(file_.get(), &header, &bytes) : PCAP_ERROR_BREAK;
  if (status == PCAP_ERROR) {
    error_ = pcap_geterr(file_.get());
  }
  if (status != 1) {
    return std::nullopt;
  }
  // Asked for nanoseconds, libpcap puts them where microseconds usually are.
  const Timestamp time{std::chrono::seconds{header->ts.tv_sec} +
                       std::chrono::nanoseconds{header->ts.tv_usec}};
  return Frame{++frames_, time, link_, std::as_bytes(std::span{bytes, header->caplen}), header->len};
}

}  // namespace trestle::pcaps
