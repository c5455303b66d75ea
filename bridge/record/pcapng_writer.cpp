#include "bridge/record/pcapng_writer.hpp"

#include <unistd.h>

#include "pcaps/pcapng_blocks.hpp"

namespace trestle::record {
namespace {

/// Frames are written together from so many bytes on.
constexpr std::size_t written_from = std::size_t{1} << 20U;

std::vector<std::byte> head(pcaps::LinkType link) {
  std::vector<std::byte> out;
  pcaps::put_pcapng_section(out);
  pcaps::put_pcapng_interface(out, link);
  return out;
}

}  // namespace

PcapngWriter::PcapngWriter(const std::string& path, pcaps::LinkType link) : file_{path} {
  if (const std::error_code error = file_.append(head(link))) {
    ::unlink(path.c_str());  // so that it can be tried again
    throw std::system_error{error, "cannot write " + path};
  }
}

std::error_code PcapngWriter::write(const pcaps::Frame& frame) {
  pcaps::put_pcapng_packet(waiting_, frame.time, frame.bytes, frame.wire_bytes);
  ++waiting_frames_;
  return waiting_.size() >= written_from ? flush() : std::error_code{};
}

std::error_code PcapngWriter::flush() {
  const std::error_code error = file_.append(waiting_);
  (error ? lost_ : frames_) += waiting_frames_;
  waiting_.clear();
  waiting_frames_ = 0;
  return error;
}

}  // namespace trestle::record
