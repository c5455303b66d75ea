#include "bridge/record/pcapng_writer.hpp"

#include <unistd.h>

#include "bridge/record/mcap_fields.hpp"

namespace trestle::record {
namespace {

/// Frames are written together from so many bytes on.
constexpr std::size_t written_from = std::size_t{1} << 20U;

/// The numbers that the format has for link layers, as libpcap calls them LINKTYPE_...
std::uint16_t number_of(pcaps::LinkType link) {
  switch (link) {
    case pcaps::LinkType::linux_sll:
      return 113;
    case pcaps::LinkType::linux_sll2:
      return 276;
    case pcaps::LinkType::raw_ip:
      return 101;
    case pcaps::LinkType::null_loopback:
      return 0;
    case pcaps::LinkType::wlan:
      return 105;
    case pcaps::LinkType::ppi:
      return 192;
    case pcaps::LinkType::ethernet:
    case pcaps::LinkType::unsupported:
      break;
  }
  return 1;
}

/// A block has its length at both ends, and is padded to whole words.
template <typename PutBody>
void put_block(std::vector<std::byte>& out, std::uint32_t type, const PutBody& put_body) {
  const std::size_t begin = out.size();
  FieldWriter fields{out};
  fields.number(type);
  fields.number(std::uint32_t{0});
  put_body(fields);
  out.resize(begin + ((out.size() - begin + 3U) & ~std::size_t{3U}));
  const auto length = static_cast<std::uint32_t>(out.size() - begin + 4);
  someip::store(out.data() + begin + 4, length, std::endian::little);
  fields.number(length);
}

std::vector<std::byte> head(pcaps::LinkType link) {
  std::vector<std::byte> out;
  put_block(out, 0x0a0d'0d0a, [](FieldWriter& fields) {
    fields.number(std::uint32_t{0x1a2b'3c4d});  // by which readers know the byte order
    fields.number(std::uint16_t{1});            // version 1.0
    fields.number(std::uint16_t{0});
    fields.number(~std::uint64_t{0});  // the length of the section is not told
  });
  put_block(out, 1, [link](FieldWriter& fields) {
    fields.number(number_of(link));
    fields.number(std::uint16_t{0});
    fields.number(std::uint32_t{0});  // frames are not cut
    fields.number(std::uint16_t{9});  // if_tsresol, one byte: 10 to the power of -9
    fields.number(std::uint16_t{1});
    fields.number(std::uint32_t{9});
    fields.number(std::uint32_t{0});  // the end of the options
  });
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
  const auto time = static_cast<std::uint64_t>(frame.time.time_since_epoch().count());
  put_block(waiting_, 6, [&](FieldWriter& fields) {
    fields.number(std::uint32_t{0});  // the interface
    fields.number(static_cast<std::uint32_t>(time >> 32U));
    fields.number(static_cast<std::uint32_t>(time));
    fields.number(static_cast<std::uint32_t>(frame.bytes.size()));
    fields.number(static_cast<std::uint32_t>(frame.wire_bytes));
    fields.bytes_of(frame.bytes);
  });
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
