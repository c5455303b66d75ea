#include <fastdds/rtps/RTPSDomain.h>
#include <fastdds/rtps/attributes/HistoryAttributes.h>
#include <fastdds/rtps/attributes/RTPSParticipantAttributes.h>
#include <fastdds/rtps/attributes/ReaderAttributes.h>
#include <fastdds/rtps/attributes/WriterAttributes.h>
#include <fastdds/rtps/history/ReaderHistory.h>
#include <fastdds/rtps/history/WriterHistory.h>
#include <fastdds/rtps/participant/RTPSParticipant.h>
#include <fastdds/rtps/reader/RTPSReader.h>
#include <fastdds/rtps/reader/ReaderListener.h>
#include <fastdds/rtps/writer/RTPSWriter.h>
#include <fastrtps/attributes/TopicAttributes.h>
#include <fastrtps/qos/ReaderQos.h>
#include <fastrtps/qos/WriterQos.h>
#include <gtest/gtest.h>

#include <atomic>

#include "dds_adapter/fastdds_compat.hpp"
#include "test/dds_adapter/dds_test.hpp"

namespace trestle::dds::listener_test {
namespace {

namespace fast = eprosima::fastrtps;
namespace rtps = eprosima::fastrtps::rtps;

using Listeners = test::DdsTest;

/// Goes between the first and the last call that tell of one match, as when the reader is deleted at that
/// moment.
class Leaving : public rtps::ReaderListener {
 public:
  using rtps::ReaderListener::onReaderMatched;
  void onReaderMatched(rtps::RTPSReader* reader, rtps::MatchingInfo& /*info*/) override {
    reader->setListener(nullptr);
    gone = true;
  }
  std::atomic<bool> gone = false;
};

// Without listener_guard.cpp this ends the process, in Fast DDS 2.x.
TEST_F(Listeners, MayGoWhileTheirReaderIsMatched) {
  dds::fast::link_listener_guard();
  rtps::RTPSParticipant* const participant = rtps::RTPSDomain::createParticipant(domain_.id(), {});
  ASSERT_NE(participant, nullptr);
  rtps::ReaderHistory samples{{}};
  Leaving leaving;
  rtps::ReaderAttributes of_reader;
  rtps::RTPSReader* const reader =
      rtps::RTPSDomain::createRTPSReader(participant, of_reader, &samples, &leaving);
  ASSERT_NE(reader, nullptr);
  const fast::TopicAttributes topic{"rt/a", "pkg::msg::dds_::A_"};
  ASSERT_TRUE(participant->registerReader(reader, topic, fast::ReaderQos{}));
  rtps::WriterHistory written{{}};
  rtps::WriterAttributes of_writer;
  rtps::RTPSWriter* const writer = rtps::RTPSDomain::createRTPSWriter(participant, of_writer, &written);
  ASSERT_NE(writer, nullptr);
  ASSERT_TRUE(participant->registerWriter(writer, topic, fast::WriterQos{}));
  EXPECT_TRUE(test::eventually([&] { return leaving.gone.load(); }));
  rtps::RTPSDomain::removeRTPSParticipant(participant);
}

}  // namespace
}  // namespace trestle::dds::listener_test
