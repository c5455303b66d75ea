#include "pcaps/capture_file.hpp"

#include <array>

#include "pcaps/link_type.hpp"

namespace trestle::pcaps {
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
    // Some messages of libpcap already contain the file name.
    if (const std::string prefix = path + ": "; why.starts_with(prefix)) {
      why.erase(0, prefix.size());
    }
    throw std::runtime_error{"cannot read a capture from " + name + ": " + why};
  }
  link_ = link_type_of(file_.get(), name);
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
  return to_frame(++frames_, link_, *header, bytes);
}

}  // namespace trestle::pcaps
