#include "dds_adapter/match_guard.hpp"

#if TRESTLE_FASTDDS_VERSION < 21000
#include <dlfcn.h>
#include <fastdds/rtps/builtin/data/ReaderProxyData.h>
#include <fastdds/rtps/builtin/data/WriterProxyData.h>
#include <fastdds/rtps/builtin/discovery/endpoint/EDP.h>

#include <atomic>
#include <mutex>
#include <set>

#include "dds_adapter/ros_names.hpp"

namespace trestle::dds::fast {

namespace {

/// The participants of this process that refuse.
struct Refusing {
  std::mutex mutex;
  std::set<rtps::GuidPrefix_t> participants;
  std::atomic<bool> any = false;
};

Refusing& refusing() {
  static Refusing one;
  return one;
}

bool refuses(const rtps::GuidPrefix_t& participant) {
  Refusing& all = refusing();
  if (!all.any) {
    return false;
  }
  const std::lock_guard lock{all.mutex};
  return all.participants.contains(participant);
}

template <typename Proxy>
std::string user_data_of(const Proxy& endpoint) {
  return user_data_text(endpoint.m_qos.m_userData);
}

}  // namespace

void refuse_readers_of_other_types(const rtps::GuidPrefix_t& participant) {
  const std::lock_guard lock{refusing().mutex};
  refusing().participants.insert(participant);
  refusing().any = true;
}

void forget_refusals(const rtps::GuidPrefix_t& participant) noexcept {
  const std::lock_guard lock{refusing().mutex};
  refusing().participants.erase(participant);
  refusing().any = !refusing().participants.empty();
}

}  // namespace trestle::dds::fast

// Fast DDS 2.x offers no way to keep a writer from a reader. This definition takes the place of the
// library's, as in type_object_guard.cpp, and calls it.
namespace eprosima::fastrtps::rtps {

/// The writer is ours.
bool EDP::valid_matching(const WriterProxyData* writer, const ReaderProxyData* reader,
                         MatchingFailureMask& reason, fastdds::dds::PolicyMask& incompatible_qos) {
  using Self = bool(EDP*, const WriterProxyData*, const ReaderProxyData*, MatchingFailureMask&,
                    fastdds::dds::PolicyMask&);
  // NOLINTNEXTLINE(*-reinterpret-cast)
  static auto* const library = reinterpret_cast<Self*>(
      dlsym(RTLD_NEXT,
            "_ZN8eprosima8fastrtps4rtps3EDP14valid_matchingEPKNS1_15WriterProxyDataEPKNS1_15ReaderProxyDataER"
            "NS2_19MatchingFailureMaskERSt6bitsetILm37EE"));
  namespace ours = trestle::dds::fast;
  return library(this, writer, reader, reason, incompatible_qos) &&
         !(ours::refuses(writer->guid().guidPrefix) &&
           writer->guid().guidPrefix != reader->guid().guidPrefix &&
           trestle::dds::have_other_type_hashes(ours::user_data_of(*writer), ours::user_data_of(*reader)));
}

}  // namespace eprosima::fastrtps::rtps
#endif
