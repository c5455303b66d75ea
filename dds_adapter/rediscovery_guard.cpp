#include "dds_adapter/fastdds_compat.hpp"

#if TRESTLE_FASTDDS_VERSION < 21000
#include <dlfcn.h>
#include <fastdds/rtps/builtin/data/WriterProxyData.h>
#include <fastdds/rtps/reader/StatefulReader.h>

// Only one of two participants, A, may give the other, B, up and find it again, for example after a stall
// that is longer than the lease. A then asks the discovery of B for everything anew, by an empty
// acknowledgement. That is sent after 70 ms, but never if a heartbeat comes first. What A asks for then has
// been acknowledged long ago, so B ignores it, and A does not see the readers and writers of B until one of
// the two ends. These definitions replace the library's, as in type_object_guard.cpp, and call them.
namespace eprosima::fastrtps::rtps {

namespace {

template <typename Function>
Function* of_library(const char* symbol) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, symbol));  // NOLINT(*-reinterpret-cast)
}

}  // namespace

/// We are A: the question is sent at once.
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

/// We are B: a participant that asks for what it has acknowledged has lost everything.
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
