#include "bridge/conform/runner.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <filesystem>
#include <set>
#include <thread>

#include "bridge/conform/trial.hpp"

namespace trestle::conform::runner_test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// Of this process alone, on loopback.
IpAddress host(std::uint8_t last) {
  const auto process = static_cast<unsigned>(getpid());
  return IpAddress::v4(127, static_cast<std::uint8_t>(1 + (process >> 8U) % 254),
                       static_cast<std::uint8_t>(process), last);
}

const IpAddress group = IpAddress::v4(239, 255, 77, 9);

/// Answers everything with the same offer: as much as it takes to be there.
class SmallDevice {
 public:
  enum class Way : std::uint8_t {
    answers,
    offers,  ///< answers nothing, but repeats its offer
  };
  explicit SmallDevice(Way way = Way::answers)
      : way_{way}, fd_{::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)} {
    sockaddr_in address{.sin_family = AF_INET, .sin_port = htons(port), .sin_addr = {}, .sin_zero = {}};
    const IpAddress own = host(1);
    std::memcpy(&address.sin_addr, own.bytes.data(), 4);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    const timeval wait{.tv_sec = 0, .tv_usec = 20'000};
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait);
    ::setsockopt(fd_, IPPROTO_IP, IP_MULTICAST_IF, &address.sin_addr, sizeof address.sin_addr);
    thread_ = std::thread{[this] { serve(); }};
  }
  ~SmallDevice() {
    ended_ = true;
    thread_.join();
    ::close(fd_);
  }
  SmallDevice(const SmallDevice&) = delete;
  SmallDevice& operator=(const SmallDevice&) = delete;

  static constexpr std::uint16_t port = 30490;

  /// Does nothing any more, until this file is there.
  void die(std::string until) {
    file_ = std::move(until);
    dead_ = true;
  }

 private:
  void serve() {
    const Bytes offer = SdStimulus{
        .entries = {
            {.type = sd::EntryType::offer_service,
             .service = someip::ServiceId{1},
             .instance = someip::InstanceId{1},
             .ttl_s = 3}}}.encode(someip::SessionId{1}, true);
    sockaddr_in everybody{.sin_family = AF_INET, .sin_port = htons(port), .sin_addr = {}, .sin_zero = {}};
    std::memcpy(&everybody.sin_addr, group.bytes.data(), 4);
    while (!ended_) {
      std::array<std::byte, 1500> room{};
      sockaddr_in from{};
      socklen_t size = sizeof from;
      const bool asked =
          ::recvfrom(fd_, room.data(), room.size(), 0, reinterpret_cast<sockaddr*>(&from), &size) > 0;
      if (dead_ && !std::filesystem::exists(file_)) {
        continue;
      }
      dead_ = false;
      if (way_ == Way::offers) {
        ::sendto(fd_, offer.data(), offer.size(), 0, reinterpret_cast<const sockaddr*>(&everybody),
                 sizeof everybody);
      } else if (asked) {
        ::sendto(fd_, offer.data(), offer.size(), 0, reinterpret_cast<const sockaddr*>(&from), size);
      }
    }
  }

  Way way_;
  int fd_;
  std::string file_;
  std::atomic<bool> dead_ = false;
  std::atomic<bool> ended_ = false;
  std::thread thread_;
};

Profile profile() {
  return {.name = "D",
          .device = host(1),
          .tester = host(2),
          .multicast = group,
          .services = {{.service = someip::ServiceId{1},
                        .instance = someip::InstanceId{1},
                        .udp_port = std::uint16_t{30501}}}};
}

Case waiting(std::chrono::milliseconds budget) {
  return {.id = "a.waits",
          .title = "waits",
          .requirements = {"feat_req_someip_45"},
          .budget = budget,
          .run = [](Trial& t) { t.tester.receive(1min, [] { return false; }); }};
}

RunOptions options() {
  return {.folder = testing::TempDir(), .keep_evidence = false};
}

TEST(Runner, EndsACaseThatIsOverItsBudget) {
  const SmallDevice device;
  const Case endless = waiting(50ms);
  const RunResult result = run_cases(profile(), {&endless}, options());
  ASSERT_EQ(result.cases.size(), 1U);
  // Where this machine stalls, that is no error of the case.
  EXPECT_THAT(result.cases[0].outcome.verdict, testing::AnyOf(Verdict::error, Verdict::inconclusive));
  EXPECT_THAT(result.cases[0].outcome.reason, HasSubstr("not over after 0.1 s"));
  EXPECT_LT(result.took, 50s);
}

TEST(Runner, KeepsAFailureThatWasNotedBeforeTheBudgetWasOver) {
  const SmallDevice device;
  Case endless = waiting(50ms);
  endless.run = [](Trial& t) {
    t.different("TTL", "3", "4", nullptr);
    t.tester.receive(1min, [] { return false; });
  };
  const RunResult result = run_cases(profile(), {&endless}, options());
  ASSERT_EQ(result.cases.size(), 1U);
  EXPECT_THAT(result.cases[0].outcome.reason, HasSubstr("TTL is 4, expected 3"));
}

TEST(Runner, ReturnsWhatItHasWhenItIsCancelled) {
  const SmallDevice device;
  Case quick = waiting(1s);
  quick.id = "a.quick";
  quick.run = [](Trial&) {};
  const Case slow = waiting(2min);
  bool cancelled = false;
  RunOptions with = options();
  with.on_begin = [&](const Case& one) { cancelled = &one == &slow; };
  with.cancelled = [&] { return cancelled; };
  const RunResult result = run_cases(profile(), {&quick, &slow, &quick}, with);
  EXPECT_TRUE(result.cancelled);
  ASSERT_EQ(result.cases.size(), 1U);
  EXPECT_EQ(result.cases[0].what, &quick);
  EXPECT_LT(result.took, 50s);
}

TEST(Runner, StartsADeviceAnewThatACaseHasKilled) {
  SmallDevice device;
  const std::string file = testing::TempDir() + "/revived." + std::to_string(getpid());
  Case deadly = waiting(30s);
  deadly.run = [&](Trial&) { device.die(file); };
  Case harmless = waiting(30s);
  harmless.run = [](Trial&) {};
  Profile with = profile();
  with.lifecycle.restart = "touch " + file;
  const RunResult result = run_cases(with, {&deadly, &harmless}, options());
  std::filesystem::remove(file);
  ASSERT_EQ(result.cases.size(), 2U);
  EXPECT_EQ(result.cases[0].outcome.verdict, Verdict::fail);
  EXPECT_THAT(result.cases[0].outcome.reason, HasSubstr("does not answer any more after this"));
  EXPECT_EQ(result.cases[1].outcome.verdict, Verdict::pass) << result.cases[1].outcome.reason;
  EXPECT_EQ(result.cases[1].attempts, 1);
}

TEST(Runner, KnowsADeviceThatDoesNothingButOfferByItsOffers) {
  const SmallDevice device{SmallDevice::Way::offers};
  Case quick = waiting(30s);
  quick.run = [](Trial& t) { t.pass(); };
  Profile with = profile();
  with.timing.cyclic_offer_delay = 20ms;
  with.timing.answer_within = 300ms;
  with.timing.ready_within = 100ms;
  EXPECT_EQ(run_cases(with, {&quick}, options()).cases.at(0).outcome.verdict, Verdict::pass);
  with.timing.cyclic_offer_delay.reset();
  EXPECT_EQ(run_cases(with, {&quick}, options()).cases.at(0).outcome.verdict, Verdict::inconclusive);
}

TEST(Runner, DrawsTheSameNumbersForTheSameSeed) {
  const SmallDevice device;
  std::vector<std::uint64_t> drawn;
  Case one = waiting(1s);
  one.run = [&](Trial& t) { drawn.push_back(t.random()); };
  Case other = one;
  other.id = "a.other";
  for (const std::uint64_t seed : {1U, 1U, 2U}) {
    RunOptions with = options();
    with.seed = seed;
    (void)run_cases(profile(), {&one, &other}, with);
  }
  ASSERT_EQ(drawn.size(), 6U);
  EXPECT_EQ(drawn[0], drawn[2]);
  EXPECT_EQ(drawn[1], drawn[3]);
  EXPECT_EQ((std::set<std::uint64_t>{drawn.begin(), drawn.end()}.size()), 4U);
}

}  // namespace
}  // namespace trestle::conform::runner_test
