#include "dds_adapter/fastdds_compat.hpp"

#if TRESTLE_REFUSES_READERS
#include <dlfcn.h>
#if TRESTLE_FASTDDS_3
#include <fastdds/rtps/attributes/WriterAttributes.hpp>
#include <fastdds/rtps/builtin/data/PublicationBuiltinTopicData.hpp>
#include <fastdds/rtps/builtin/data/SubscriptionBuiltinTopicData.hpp>
#include <fastdds/rtps/participant/RTPSParticipant.hpp>
#else
#include <fastdds/rtps/builtin/data/ReaderProxyData.h>
#include <fastdds/rtps/builtin/data/WriterProxyData.h>
#include <fastdds/rtps/builtin/discovery/endpoint/EDP.h>
#endif

#include <atomic>
#include <bitset>
#include <mutex>
#include <set>
#include <type_traits>

#include "dds_adapter/ros_names.hpp"

#if TRESTLE_FASTDDS_3
// The library has these but no headers for them.
namespace eprosima::fastdds::rtps {

class ReaderProxyData;
class RTPSWriter;
class WriterHistory;
class WriterListener;
class WriterProxyData;
void from_proxy_to_builtin(const ReaderProxyData& proxy, SubscriptionBuiltinTopicData& data);
void from_proxy_to_builtin(const WriterProxyData& proxy, PublicationBuiltinTopicData& data);

class EDP {
 public:
  class MatchingFailureMask;
  bool valid_matching(const WriterProxyData* writer, const ReaderProxyData* reader,
                      MatchingFailureMask& reason, dds::PolicyMask& incompatible_qos);
  bool valid_matching(const ReaderProxyData* reader, const WriterProxyData* writer,
                      MatchingFailureMask& reason, dds::PolicyMask& incompatible_qos);
};

class RTPSDomainImpl {
 public:
  static RTPSWriter* create_rtps_writer(RTPSParticipant* participant, const EntityId_t& entity,
                                        WriterAttributes& attributes, WriterHistory* history,
                                        WriterListener* listener);
};

}  // namespace eprosima::fastdds::rtps
#endif

namespace trestle::dds::fast {

namespace {

/// The participants of this process that refuse readers of other types.
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

/// What is to be known of either end of a match.
struct End {
  rtps::GuidPrefix_t participant;
  std::string user_data;
};

#if TRESTLE_FASTDDS_3
template <typename Data, typename Proxy>
End end_by(const Proxy& endpoint) {
  Data data;
  rtps::from_proxy_to_builtin(endpoint, data);
  return {data.guid.guidPrefix, user_data_text(data.user_data)};
}
End end_of(const rtps::WriterProxyData& writer) {
  return end_by<rtps::PublicationBuiltinTopicData>(writer);
}
End end_of(const rtps::ReaderProxyData& reader) {
  return end_by<rtps::SubscriptionBuiltinTopicData>(reader);
}
#else
template <typename Proxy>
End end_of(const Proxy& endpoint) {
  return {endpoint.guid().guidPrefix, user_data_text(endpoint.m_qos.m_userData)};
}
#endif

bool are_refused(const rtps::WriterProxyData& writer, const rtps::ReaderProxyData& reader) {
  if (!refusing().any) {
    return false;
  }
  const End ours = end_of(writer);
  if (!refuses(ours.participant)) {
    return false;
  }
  const End peer = end_of(reader);
  return ours.participant != peer.participant && have_other_type_hashes(ours.user_data, peer.user_data);
}

/// The library's own function.
template <typename Function>
Function* library(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));  // NOLINT(*-reinterpret-cast)
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

// Fast DDS offers no way to keep a writer from a reader. These definitions take the place of the library's,
// as in type_object_guard.cpp, and call them.
#if TRESTLE_FASTDDS_3
#define TRESTLE_FASTDDS_MANGLED "_ZN8eprosima7fastdds4rtps"
namespace eprosima::fastdds::rtps {
#else
#define TRESTLE_FASTDDS_MANGLED "_ZN8eprosima8fastrtps4rtps"
namespace eprosima::fastrtps::rtps {
#endif

static_assert(std::is_same_v<fastdds::dds::PolicyMask, std::bitset<37>>, "as in the name below");

namespace {

bool library_valid_matching(EDP* self, const WriterProxyData* writer, const ReaderProxyData* reader,
                            EDP::MatchingFailureMask& reason, fastdds::dds::PolicyMask& incompatible_qos) {
  static auto* const library = trestle::dds::fast::library<decltype(library_valid_matching)>(
      TRESTLE_FASTDDS_MANGLED
      "3EDP14valid_matchingEPKNS1_15WriterProxyDataEPKNS1_15ReaderProxyDataERNS2_19MatchingFailureMaskERSt6"
      "bitsetILm37EE");
  return library(self, writer, reader, reason, incompatible_qos);
}

}  // namespace

/// The writer is ours.
bool EDP::valid_matching(const WriterProxyData* writer, const ReaderProxyData* reader,
                         MatchingFailureMask& reason, fastdds::dds::PolicyMask& incompatible_qos) {
  return library_valid_matching(this, writer, reader, reason, incompatible_qos) &&
         !trestle::dds::fast::are_refused(*writer, *reader);
}

#if TRESTLE_FASTDDS_3
/// The reader is ours. The library's calls the one above, which is not for it.
bool EDP::valid_matching(const ReaderProxyData* reader, const WriterProxyData* writer,
                         MatchingFailureMask& reason, fastdds::dds::PolicyMask& incompatible_qos) {
  return library_valid_matching(this, writer, reader, reason, incompatible_qos);
}

/// What goes to several readers names none of them, and one that is refused would accept it if it shares a
/// participant with one of them. 3.x takes it from its maker alone whether a writer sends to each by itself.
RTPSWriter* RTPSDomainImpl::create_rtps_writer(RTPSParticipant* participant, const EntityId_t& entity,
                                               WriterAttributes& attributes, WriterHistory* history,
                                               WriterListener* listener) {
  using Self = decltype(create_rtps_writer);
  static auto* const library = trestle::dds::fast::library<Self>(
      TRESTLE_FASTDDS_MANGLED
      "14RTPSDomainImpl18create_rtps_writerEPNS1_15RTPSParticipantERKNS1_10EntityId_tERNS1_16WriterAttributes"
      "EPNS1_13WriterHistoryEPNS1_14WriterListenerE");
  attributes.separate_sending =
      attributes.separate_sending || trestle::dds::fast::refuses(participant->getGuid().guidPrefix);
  return library(participant, entity, attributes, history, listener);
}
#endif

}  // namespace eprosima
#undef TRESTLE_FASTDDS_MANGLED
#endif
