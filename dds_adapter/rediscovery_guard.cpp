#include "dds_adapter/fastdds_compat.hpp"

#if TRESTLE_FASTDDS_VERSION < 21000
#include <dlfcn.h>
#include <fastdds/rtps/builtin/data/WriterProxyData.h>
#include <fastdds/rtps/reader/StatefulReader.h>

// When only one side of two gives the other up, as after a stall that is longer than its lease, and finds it
// again, it asks the other's discovery for everything anew: by an empty acknowledgement, which goes out after
// 70 ms, but never when a heartbeat came before. What it then asks for has been acknowledged long ago, and
// the other ignores it: the one does not see the other's readers and writers until one of them ends. These
// definitions take the place of the library's, as in type_object_guard.cpp, and call them.
namespace eprosima::fastrtps::rtps {

namespace {

template <typename Function>
Function* of_library(const char* symbol) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, symbol));  // NOLINT(*-reinterpret-cast)
}

}  // namespace

/// We are the one: the question goes out at once.
bool StatefulReader::matched_writer_add(const WriterProxyData& writer) {
  static auto* const add = of_library<bool(StatefulReader*, const WriterProxyData&)>(
      "_ZN8eprosima8fastrtps4rtps14StatefulReader18matched_writer_addERKNS1_15WriterProxyDataE");
  if (!add(this, writer)) {
    return false;
  }
  if (getGuid().is_builtin() && !getGuid().is_on_same_process_as(writer.guid())) {
    const std::lock_guard lock{getMutex()};
    WriterProxy* proxy = nullptr;
    if (matched_writer_lookup(writer.guid(), &proxy)) {
      // Its first and only base; its header is not installed.
      auto* sender = reinterpret_cast<RTPSMessageSenderInterface*>(proxy);  // NOLINT(*-reinterpret-cast)
      send_acknack(proxy, SequenceNumberSet_t{SequenceNumber_t{}}, sender, false);
    }
  }
  return true;
}

/// We are the other: who asks for what it had has lost all.
bool ReaderProxy::requested_changes_set(const SequenceNumberSet_t& wanted, RTPSGapBuilder& gaps,
                                        const SequenceNumber_t& first) {
  static auto* const request =
      of_library<bool(ReaderProxy*, const SequenceNumberSet_t&, RTPSGapBuilder&, const SequenceNumber_t&)>(
          "_ZN8eprosima8fastrtps4rtps11ReaderProxy21requested_changes_setERKNS0_11BitmapRangeINS1_16"
          "SequenceNumber_tENS1_18SequenceNumberDiffELj256EEERNS1_14RTPSGapBuilderERKS4_");
  if (!wanted.empty() && wanted.base() <= changes_low_mark()) {
    acked_changes_set(SequenceNumber_t{});
  }
  return request(this, wanted, gaps, first);
}

}  // namespace eprosima::fastrtps::rtps
#endif

namespace trestle::dds::fast {

void link_rediscovery_guard() noexcept {}

}  // namespace trestle::dds::fast
