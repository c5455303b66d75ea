// A participant that is polled: who calls receive() gets the samples, on that thread.
#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <fstream>
#include <memory>
#include <thread>

#include "dds_adapter/participant.hpp"
#include "test/dds_adapter/participants.hpp"

namespace trestle::dds::polled_test {
namespace {

using namespace std::chrono_literals;
using test::eventually;
using test::Inbox;
using test::into;
using test::make_sample;
using test::matched;
using Bytes = std::vector<std::byte>;

constexpr const char* topic = test::points_topic;
constexpr const char* type = test::points_type;

bool is_readable(const Participant& participant, std::chrono::milliseconds limit = 0ms) {
  pollfd one{.fd = participant.incoming(), .events = POLLIN, .revents = 0};
  return poll(&one, 1, static_cast<int>(limit.count())) == 1;
}

// Calls receive() for a participant, as a program's loop does, until it is destroyed.
class Loop {
 public:
  explicit Loop(Participant& participant)
      : thread_{[this, &participant] {
          while (!is_over_) {
            if (is_readable(participant, 10ms)) {
              participant.receive();
            }
          }
        }} {}
  ~Loop() {
    is_over_ = true;
    thread_.join();
  }
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

 private:
  std::atomic<bool> is_over_ = false;
  std::thread thread_;
};

class PolledParticipant : public test::Participants {
 protected:
  [[nodiscard]] ParticipantConfig polled() const {
    ParticipantConfig result = config();
    result.polled = true;
    return result;
  }

  /// To one that somebody receives for, or DDS does.
  void expect_a_sample_at(Participant& to) const {
    Participant from{config()};
    Inbox<Bytes> inbox;
    Writer writer = from.create_writer(topic, type, {});
    const Reader reader = to.create_reader(topic, type, {}, into(inbox));
    ASSERT_TRUE(matched(writer, reader));
    ASSERT_TRUE(writer.write(make_sample(1000, 1)));
    EXPECT_TRUE(inbox.wait_for_count(1));
  }
};

TEST_F(PolledParticipant, ReceivesWhenAskedOnly) {
  Participant from{config()};
  Participant to{polled()};
  Inbox<std::thread::id> threads;
  Writer writer = from.create_writer(topic, type, {});
  const Reader reader =
      to.create_reader(topic, type, {}, [&](const Sample&) { threads.put(std::this_thread::get_id()); });
  ASSERT_TRUE(matched(writer, reader)) << "discovery has threads of its own";
  ASSERT_TRUE(writer.write(make_sample(1000, 1)));
  ASSERT_TRUE(is_readable(to, test::patience));
  usleep(100'000);
  EXPECT_EQ(threads.size(), 0U);
  EXPECT_TRUE(eventually([&] {
    to.receive();
    return threads.size() == 1;
  }));
  EXPECT_EQ(threads.take()[0], std::this_thread::get_id());
}

TEST_F(PolledParticipant, TellsThatThereIsSomething) {
  Participant from{config()};
  Participant to{polled()};
  Inbox<Bytes> inbox;
  const Qos qos{.reliable = false};  // nothing else is sent then
  Writer writer = from.create_writer(topic, type, qos);
  const Reader reader = to.create_reader(topic, type, qos, into(inbox));
  ASSERT_TRUE(matched(writer, reader));
  while (is_readable(to, 50ms)) {
    to.receive();
  }
  ASSERT_TRUE(writer.write(make_sample(1000, 1)));
  EXPECT_TRUE(is_readable(to, test::patience));
  EXPECT_TRUE(is_readable(to)) << "until it has been received";
  to.receive();
  EXPECT_EQ(inbox.size(), 1U);
  EXPECT_FALSE(is_readable(to));
}

TEST_F(PolledParticipant, HasNothingToAskForUnlessItIsPolled) {
  Participant participant{config()};
  EXPECT_EQ(participant.incoming(), -1);
  participant.receive();
}

TEST_F(PolledParticipant, CarriesSamplesOfAllSizesBothWays) {
  Participant one{polled()};
  Participant other{polled()};
  const Loop loop_of_one{one};
  const Loop loop_of_other{other};
  Inbox<Bytes> there;
  Inbox<Bytes> back;
  Writer writer = one.create_writer(topic, type, {});
  const Reader reader = other.create_reader(topic, type, {}, into(there));
  Writer answers = other.create_writer("rt/back", type, {});
  const Reader answered = one.create_reader("rt/back", type, {}, into(back));
  ASSERT_TRUE(matched(writer, reader));
  ASSERT_TRUE(matched(answers, answered));
  for (const std::size_t size : {4U, 64U, 1024U, 65'000U, 65'536U, 300'000U, 4'000'000U}) {
    const Bytes sample = make_sample(size, static_cast<std::uint32_t>(size));
    ASSERT_TRUE(writer.write(sample));
    ASSERT_TRUE(there.wait_for_count(1)) << size;
    ASSERT_TRUE(answers.write(there.take()[0]));
    ASSERT_TRUE(back.wait_for_count(1)) << size;
    EXPECT_TRUE(back.take()[0] == sample) << size;
  }
}

// Acknowledgements come the same way.
TEST_F(PolledParticipant, HearsWhatReadersHaveReceived) {
  Participant from{polled()};
  Participant to{config()};
  Inbox<Bytes> inbox;
  Writer writer = from.create_writer(topic, type, {});
  const Reader reader = to.create_reader(topic, type, {}, into(inbox));
  ASSERT_TRUE(matched(writer, reader));
  ASSERT_TRUE(writer.write(make_sample(1000, 1)));
  ASSERT_TRUE(inbox.wait_for_count(1));
  EXPECT_FALSE(writer.wait_until_received(200ms));
  const Loop loop{from};
  EXPECT_TRUE(writer.wait_until_received(test::patience));
}

// More than is received in one go, of several writers.
TEST_F(PolledParticipant, ReceivesBurstsCompletely) {
  Participant from{config()};
  Participant to{polled()};
  Inbox<Bytes> inbox;
  const Qos deep{.reliable = true, .depth = 500};
  std::vector<Writer> writers;
  std::vector<Reader> readers;
  constexpr std::size_t topics = 3;
  constexpr std::size_t samples = 100;
  for (std::size_t i = 0; i < topics; ++i) {
    const std::string name = topic + std::to_string(i);
    writers.push_back(from.create_writer(name, type, deep));
    readers.push_back(to.create_reader(name, type, deep, into(inbox)));
    ASSERT_TRUE(matched(writers.back(), readers.back()));
  }
  for (std::size_t i = 0; i < samples; ++i) {
    for (Writer& writer : writers) {
      ASSERT_TRUE(writer.write(make_sample(2000, static_cast<std::uint32_t>(i))));
    }
  }
  const Loop loop{to};
  EXPECT_TRUE(inbox.wait_for_count(topics * samples));
}

// The first ports that participants try for their readers and writers, of which others come to have them.
class TakenPorts {
 public:
  explicit TakenPorts(std::uint32_t domain) {
    for (std::uint32_t number = 0; number < 40; ++number) {
      const int descriptor = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
      sockaddr_in at{};
      at.sin_family = AF_INET;
      at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      at.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * domain + 11 + 2 * number));
      // Some other program may have it already.
      EXPECT_TRUE(bind(descriptor, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0 ||
                  errno == EADDRINUSE);
      descriptors_.push_back(descriptor);
    }
  }
  ~TakenPorts() { std::ranges::for_each(descriptors_, close); }
  TakenPorts(const TakenPorts&) = delete;
  TakenPorts& operator=(const TakenPorts&) = delete;

 private:
  std::vector<int> descriptors_;
};

TEST_F(PolledParticipant, TakesALaterPortWhereTheFirstIsTaken) {
  const TakenPorts taken{domain_.id()};
  Participant to{polled()};
  const Loop loop{to};
  expect_a_sample_at(to);
}

TEST_F(PolledParticipant, EndsWhileSomebodyReceives) {
  Participant from{config()};
  Writer writer = from.create_writer(topic, type, {});
  std::atomic<bool> is_over = false;
  std::thread busy{[&] {
    while (!is_over) {
      static_cast<void>(writer.write(make_sample(1000, 1)));
      usleep(100);
    }
  }};
  for (int i = 0; i < 5; ++i) {
    std::atomic<int> received = 0;
    auto to = std::make_unique<Participant>(polled());
    auto loop = std::make_unique<Loop>(*to);
    auto reader =
        std::make_unique<Reader>(to->create_reader(topic, type, {}, [&](const Sample&) { ++received; }));
    EXPECT_TRUE(eventually([&] { return received > 10; }));
    reader.reset();  // while the loop runs
    loop.reset();
    to.reset();
  }
  is_over = true;
  busy.join();
}

// As many as wait are not lost while nobody receives.
TEST_F(PolledParticipant, HasWhatFitsIntoTheBufferWait) {
  constexpr std::uint32_t sample_bytes = 60'000;
  const std::uint32_t samples = std::min(polled_buffer_bytes() / sample_bytes, 60U);
  Participant from{config()};
  Participant to{polled()};
  Inbox<Bytes> inbox;
  const Qos qos{.reliable = false, .depth = 100};  // nothing is sent again
  Writer writer = from.create_writer(topic, type, qos);
  const Reader reader = to.create_reader(topic, type, qos, into(inbox));
  ASSERT_TRUE(matched(writer, reader));
  for (std::uint32_t i = 0; i < samples; ++i) {
    ASSERT_TRUE(writer.write(make_sample(sample_bytes, i)));
  }
  const Loop loop{to};
  EXPECT_TRUE(inbox.wait_for_count(samples));
}

TEST_F(PolledParticipant, HasNoWarningWhereTheBufferIsGranted) {
  const auto warns = [](const Participant& participant) {
    return std::ranges::any_of(participant.buffers_not_granted(), [](const std::string& line) {
      return line.find("receive") != std::string::npos;
    });
  };
  EXPECT_EQ(warns(Participant{polled()}), polled_buffer_bytes() < 16U << 20U);
}

// A profile that says where readers and writers are is left to the threads of DDS.
TEST_F(PolledParticipant, LeavesLocatorsOfAProfileToThreadsOfDds) {
  ParticipantConfig configured = polled();
  configured.profiles_file = testing::TempDir() + "own_locators_" + std::to_string(getpid()) + ".xml";
  configured.profile = "own_locators";
  std::ofstream{configured.profiles_file} << R"(<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles"><profiles>
  <participant profile_name="own_locators"><rtps><defaultUnicastLocatorList>
    <locator><udpv4><port>)" << 7400 + 250 * domain_.id() + 201
                                          << R"(</port><address>127.0.0.1</address></udpv4></locator>
  </defaultUnicastLocatorList></rtps></participant>
</profiles></dds>)";
  Participant to{configured};
  expect_a_sample_at(to);
}

}  // namespace
}  // namespace trestle::dds::polled_test
