#include "bridge/conform/runner.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <deque>
#include <filesystem>
#include <fstream>
#include <thread>

#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/device.hpp"
#include "bridge/conform/trial.hpp"
#include "test/bridge/conform/small_device.hpp"

namespace trestle::conform::device_life_test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

using namespace small_device;

Profile profile() {
  return {.name = "D",
          .device = host(1),
          .tester = host(2),
          .multicast = group_of_test,
          .services = {{.service = someip::ServiceId{1}, .udp_port = std::uint16_t{30501}}}};
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

// --- What a right device may do ---------------------------------------------------------------------------

sd::Entry answer(sd::EntryType type, std::uint16_t group, std::uint32_t ttl_s) {
  return {.type = type,
          .service = SmallDevice::service,
          .major = 1,
          .ttl_s = ttl_s,
          .tail = sd::Entry::eventgroup_tail(someip::EventgroupId{group}, 0, false)};
}

Attempt attempt_of(const Case& one, Profile with = profile()) {
  const RunResult result = run_cases(with, {&one}, options());
  return result.cases.at(0).outcome;
}

Case subscribing() {
  Case one = waiting(2min);
  one.run = [](Trial& t) {
    t.acknowledged(t.subscribe(t.profile.service(), someip::EventgroupId{1}, {t.own_endpoint()}));
  };
  return one;
}

TEST(Trial, TakesALateAnswerToSomethingElseForNoAnswer) {
  using enum sd::EntryType;
  const sd::Entry offer = answer(offer_service, 0, 3);
  {
    const SmallDevice device{SdStimulus{
        .entries = {offer, answer(subscribe_eventgroup_ack, 9, 0), answer(subscribe_eventgroup_ack, 1, 30)}}
                                 .encode(someip::SessionId{1}, true)};
    Profile patient = profile();
    patient.timing.answer_within = 30s;
    EXPECT_EQ(attempt_of(subscribing(), patient).verdict, Verdict::pass);
  }
  {
    const SmallDevice device{SdStimulus{.entries = {offer, answer(subscribe_eventgroup_ack, 9, 30)}}.encode(
        someip::SessionId{1}, true)};
    EXPECT_THAT(attempt_of(subscribing()).reason, HasSubstr("another eventgroup"));
  }
  // It shows that a Find was answered even less.
  const SmallDevice device{
      SdStimulus{.entries = {answer(subscribe_eventgroup_ack, 1, 0)}}.encode(someip::SessionId{1}, true)};
  Profile quick = profile();
  quick.timing.answer_within = 50ms;
  quick.timing.ready_within = 10ms;
  EXPECT_FALSE(attempt_of(subscribing(), quick).alive_before);
}

TEST(Trial, CountsWhatHadToBeAskedAgain) {
  const SmallDevice device{SmallDevice::offer(), SmallDevice::Way::answers_each_third};
  Case finding = waiting(2min);
  finding.run = [](Trial& t) {
    t.answer_to_find(Trial::find_entry(t.profile.service()), false, t.profile.service());
  };
  Profile quick = profile();
  quick.timing.answer_within = 200ms;
  const Attempt attempt = attempt_of(finding, quick);
  EXPECT_EQ(attempt.retries, 2);
  EXPECT_EQ(attempt.retried, "answered the 3rd of 3 requests");
  // Where this machine stalls, nothing is said of the device.
  EXPECT_EQ(attempt.verdict, attempt.stalled ? Verdict::pass : Verdict::pass_nonstrict) << attempt.reason;
}

/// Answers each connection with some bytes, and ends it.
class BluntServer {
 public:
  explicit BluntServer(Bytes answer)
      : answer_{std::move(answer)}, fd_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)} {
    sockaddr_in own{.sin_family = AF_INET, .sin_port = 0, .sin_addr = {}, .sin_zero = {}};
    std::memcpy(&own.sin_addr, host(1).bytes.data(), 4);
    socklen_t size = sizeof own;
    EXPECT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&own), size), 0);
    EXPECT_EQ(::listen(fd_, 4), 0);
    EXPECT_EQ(::getsockname(fd_, reinterpret_cast<sockaddr*>(&own), &size), 0);
    port_ = ntohs(own.sin_port);
    thread_ = std::thread{[this] {
      for (int one = ::accept(fd_, nullptr, nullptr); one >= 0; one = ::accept(fd_, nullptr, nullptr)) {
        std::array<std::byte, 1500> room{};
        EXPECT_GT(::recv(one, room.data(), room.size(), 0), 0);
        EXPECT_EQ(::send(one, answer_.data(), answer_.size(), MSG_NOSIGNAL),
                  static_cast<ssize_t>(answer_.size()));
        ::close(one);
      }
    }};
  }
  ~BluntServer() {
    ::shutdown(fd_, SHUT_RDWR);
    thread_.join();
    ::close(fd_);
  }
  BluntServer(const BluntServer&) = delete;
  BluntServer& operator=(const BluntServer&) = delete;
  [[nodiscard]] std::uint16_t port() const { return port_; }

 private:
  Bytes answer_;
  int fd_;
  std::uint16_t port_ = 0;
  std::thread thread_;
};

TEST(Trial, ShowsWhatCameOnAConnectionInsteadOfAnAnswer) {
  const SmallDevice device{};
  Call broken{.service = someip::ServiceId{1}, .method = someip::MethodId{1}, .payload = bytes({0x2a})};
  broken.length = 3;
  const Bytes answer = broken.encode();
  ASSERT_EQ(answer.size(), 17U);
  const BluntServer server{answer};
  Case asking = waiting(2min);
  std::deque<Packet> packets;
  asking.run = [&](Trial& t) {
    Call call = t.call(someip::MethodId{1});
    call.transport = Transport::tcp;
    try {
      t.answer_to(call);
    } catch (const Ended&) {
      packets = t.tester.packets();
      throw;
    }
  };
  Profile patient = profile();
  patient.services.front().tcp_port = server.port();
  patient.timing.answer_within = 30s;
  const Attempt attempt = attempt_of(asking, patient);
  EXPECT_EQ(attempt.reason, "no answer to the request: the device has ended the connection");
  ASSERT_EQ(attempt.differences.size(), 1U);
  EXPECT_EQ(attempt.differences[0].expected, "a response");
  EXPECT_THAT(attempt.differences[0].actual,
              testing::StartsWith("17 bytes that are no message (00 01 00 01 00 00 00 03"));
  EXPECT_THAT(attempt.differences[0].actual, testing::EndsWith(", then the end of the connection"));
  std::erase_if(packets, [](const Packet& one) { return one.sent || one.transport != Transport::tcp; });
  ASSERT_EQ(packets.size(), 2U);
  EXPECT_EQ(packets[0].bytes, answer);
  EXPECT_TRUE(packets[1].ends);
  EXPECT_THAT(packets[1].comment, HasSubstr("OFFENDING"));
  EXPECT_EQ(packets[1].number, attempt.differences[0].packet);
}

/// An offer with a configuration option before the endpoint, from Client ID `client`.
Bytes odd_offer(std::uint16_t client) {
  SdStimulus message{.entries = {answer(sd::EntryType::offer_service, 0, 3)}};
  message.entries.front().tail = 0;
  message.options = {bytes({0, 6, 1, 0, 3, 'a', '=', 'b', 0}),
                     endpoint_option({host(1), 30501}, Transport::udp)};
  message.entries.front().first_run = {.index = 0, .count = 2};
  Bytes all = message.encode(someip::SessionId{1}, true);
  all[8] = static_cast<std::byte>(client >> 8U);
  all[9] = static_cast<std::byte>(client);
  return all;
}

std::vector<Verdict> verdicts_of(const std::vector<std::string>& ids) {
  Profile with = profile();
  with.timing.cyclic_offer_delay = 20ms;
  std::vector<Verdict> all;
  for (const CaseResult& one : run_cases(with, choose(all_cases(), ids, Level::tc8), options()).cases) {
    all.push_back(one.outcome.verdict);
  }
  return all;
}

TEST(Cases, LookForTheEndpointAmongOtherOptions) {
  const SmallDevice device{odd_offer(0)};
  EXPECT_THAT(
      verdicts_of({"sd.option.endpoint.length", "sd.option.endpoint.type", "sd.option.endpoint.reserved",
                   "sd.option.endpoint.address", "sd.option.endpoint.protocol"}),
      testing::AllOf(testing::SizeIs(5), testing::Each(Verdict::pass)));
}

TEST(Cases, KnowAPrefixOfClientIds) {
  {
    const SmallDevice device{odd_offer(0x0100)};
    EXPECT_THAT(verdicts_of({"sd.header.client-id"}), testing::ElementsAre(Verdict::pass_nonstrict));
  }
  const SmallDevice device{odd_offer(0x0101)};
  EXPECT_THAT(verdicts_of({"sd.header.client-id"}), testing::ElementsAre(Verdict::fail));
}

// --- A device that a command restarts
// -----------------------------------------------------------------------

TEST(DeviceLife, TakesAnOfferAfterASilenceForARestart) {
  // Its first messages are lost: what comes has another session than 1, and it never goes back.
  SmallDevice device{
      SdStimulus{.entries = {answer(sd::EntryType::offer_service, 0, 3)}}.encode(someip::SessionId{5}, true)};
  const std::string file = testing::TempDir() + "/restarted." + std::to_string(getpid());
  Profile with = profile();
  with.timing.cyclic_offer_delay = 20ms;
  with.timing.ready_within = 5min;  // of which the budget leaves no room for all
  with.lifecycle.restart = "sleep 0.3; touch " + file;
  Case one = waiting(30s);
  Duration silence{};
  one.run = [&](Trial& t) {
    device.die(file);
    const std::size_t since = t.restart();
    const auto& packets = t.tester.packets();
    std::size_t before = since - 1;
    while (packets[before].from.address !=
           host(1)) {  // the tester's own, or another test's in the same group
      --before;
    }
    silence = packets[since].time - packets[before].time;
  };
  const Attempt attempt = attempt_of(one, with);
  std::filesystem::remove(file);
  EXPECT_EQ(attempt.verdict, Verdict::pass) << attempt.reason;
  EXPECT_GT(silence, 3 * 20ms);
}

// --- What becomes of a device that the tester starts ----------------------------------------------------

Case nothing_to_do(std::string id) {
  Case one = waiting(2min);
  one.id = std::move(id);
  one.run = [](Trial&) {};
  return one;
}

/// A folder of its own for device.log.
RunOptions with_log(const char* name) {
  RunOptions with = options();
  with.folder = testing::TempDir() + name + std::to_string(getpid());
  std::filesystem::create_directories(with.folder);
  std::filesystem::remove(with.folder + "/device.log");
  return with;
}

std::string log_of(const RunOptions& with) {
  std::ifstream file{with.folder + "/device.log"};
  return {std::istreambuf_iterator<char>{file}, {}};
}

TEST(DeviceLife, StartsADeviceByAnyCommandOfAShell) {
  const SmallDevice device;
  Profile with_command = profile();
  for (const char* command :
       {"cd / && sh -c 'echo here; sleep 600'", "WORD=here sh -c 'echo $WORD; sleep 600'",
        "exec sh -c 'echo here; sleep 600'", "sh -c 'echo here; sleep 600' & wait"}) {
    with_command.lifecycle.start = command;
    const RunOptions with = with_log("any_command");
    Case one = nothing_to_do("a.one");
    one.run = [&](Trial& t) { t.tester.receive(1min, [&] { return log_of(with) == "here\n"; }); };
    const RunResult result = run_cases(with_command, {&one}, with);
    ASSERT_EQ(result.cases.size(), 1U);
    EXPECT_TRUE(result.cases[0].outcome.alive_before) << command << result.cases[0].outcome.reason;
    EXPECT_EQ(log_of(with), "here\n") << command;
  }
}

TEST(DeviceLife, WaitsForAllThatTheCommandStarted) {
  const SmallDevice device;
  Profile with_command = profile();
  // The shell ends first; what it began takes its time.
  with_command.lifecycle.start =
      "sh -c 'trap \"sleep 0.2; echo over; exit\" TERM; echo on; while :; do sleep 0.01; done' & wait";
  const RunOptions with = with_log("all_ended");
  Case one = nothing_to_do("a.one");
  one.run = [&](Trial& t) { t.tester.receive(1min, [&] { return log_of(with) == "on\n"; }); };
  (void)run_cases(with_command, {&one}, with);
  // The shell may say something of its own in between.
  EXPECT_THAT(log_of(with), testing::EndsWith("over\n"));
}

TEST(DeviceLife, SaysThatTheDeviceHasEndedAndStartsItAgain) {
  const SmallDevice device;
  Profile with_command = profile();
  const RunOptions with = with_log("ended");
  const std::string go = with.folder + "/go";
  std::filesystem::remove(go);
  with_command.lifecycle.start =
      "echo start; while [ ! -e " + go + " ]; do sleep 0.01; done; rm " + go + "; exit 3";
  Case dies = nothing_to_do("a.dies");
  dies.run = [&](Trial& t) {
    std::ofstream{go} << "now";
    t.tester.receive(1min, [] { return false; });  // until the device has ended
  };
  Case next = nothing_to_do("a.next");
  next.run = [&](Trial& t) { t.tester.receive(1min, [&] { return log_of(with) == "start\nstart\n"; }); };
  const RunResult result = run_cases(with_command, {&dies, &next}, with);
  ASSERT_EQ(result.cases.size(), 2U);
  EXPECT_EQ(result.cases[0].outcome.verdict, Verdict::fail);
  EXPECT_EQ(result.cases[0].outcome.reason, "the device exited with status 3; see device.log");
  EXPECT_TRUE(result.cases[1].outcome.alive_before) << result.cases[1].outcome.reason;
  EXPECT_EQ(log_of(with), "start\nstart\n");
}

TEST(DeviceLife, GivesUpWhenTheDeviceIsNotThere) {
  Profile without = profile();
  without.timing.answer_within = 10ms;
  without.timing.ready_within = 10ms;
  const Case one = nothing_to_do("a.one");
  std::vector<std::string> problems;
  RunOptions with = with_log("absent");
  with.on_problem = [&](const std::string& text) { problems.push_back(text); };
  const Case last = nothing_to_do("a.last");
  const std::vector<const Case*> all{&one, &one, &one, &one, &last};
  RunResult result = run_cases(without, all, with);
  EXPECT_EQ(result.cases.size(), most_absences);
  EXPECT_TRUE(result.cancelled);
  EXPECT_THAT(result.gave_up, testing::AllOf(HasSubstr("3 cases in a row"), HasSubstr("service 0x0001")));
  EXPECT_THAT(problems, testing::ElementsAre(HasSubstr("the device does not answer after its start")));
  // Nor is one there that ends as soon as it is started.
  without.lifecycle.start = "exit 3";
  without.timing.answer_within = 5s;
  result = run_cases(without, all, with);
  EXPECT_EQ(result.cases.size(), most_absences);
  EXPECT_EQ(result.cases[0].outcome.verdict, Verdict::inconclusive);
  EXPECT_EQ(result.cases[0].outcome.reason,
            "the device exited with status 3 before the case began; see device.log");
  EXPECT_THAT(result.gave_up, HasSubstr("its command is 'exit 3'"));
}

// --- What a person is asked to do -------------------------------------------------------------------------

/// A person who presses Enter so often, and then is gone: standard input, which is at its end after that.
class Person {
 public:
  explicit Person(std::size_t presses) {
    std::array<int, 2> pipe{};
    EXPECT_EQ(::pipe2(pipe.data(), O_CLOEXEC), 0);
    const std::string keys(presses, '\n');
    EXPECT_EQ(::write(pipe[1], keys.data(), keys.size()), static_cast<ssize_t>(keys.size()));
    ::close(pipe[1]);
    ::dup2(pipe[0], STDIN_FILENO);
    ::close(pipe[0]);
  }
  ~Person() {
    ::dup2(before_, STDIN_FILENO);
    ::close(before_);
  }
  Person(const Person&) = delete;
  Person& operator=(const Person&) = delete;

  /// Whether all was pressed that was to be.
  [[nodiscard]] static bool is_done() {
    char c = 0;
    return ::read(STDIN_FILENO, &c, 1) == 0;
  }

 private:
  int before_ = ::fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 3);
};

TEST(DeviceLife, TakesTheEndOfTheInputForNoAnswer) {
  const SmallDevice device;
  Profile asking = profile();
  asking.lifecycle.ask_operator = true;
  Case restarts = nothing_to_do("a.restarts");
  restarts.run = [](Trial& t) { t.restart(); };
  const Case next = nothing_to_do("a.next");
  {
    const Person nobody{0};
    EXPECT_THROW((void)run_cases(asking, {&next}, options()), std::runtime_error);
  }
  // Whoever goes away later takes no results along.
  const Person leaves{1};
  std::vector<std::string> problems;
  RunOptions with = options();
  with.on_problem = [&](const std::string& text) { problems.push_back(text); };
  const RunResult result = run_cases(asking, {&restarts, &next}, with);
  ASSERT_EQ(result.cases.size(), 2U);
  EXPECT_EQ(result.cases[0].outcome.verdict, Verdict::error);
  EXPECT_THAT(result.cases[0].outcome.reason,
              testing::AllOf(HasSubstr("'Restart the device'"), HasSubstr("standard input is at its end")));
  EXPECT_EQ(result.cases[1].outcome.verdict, Verdict::pass) << result.cases[1].outcome.reason;
  EXPECT_FALSE(result.cancelled);
  EXPECT_THAT(problems,
              testing::ElementsAre(HasSubstr("the device may run on: nobody said that this is done: "
                                             "'Stop the device'")));
}

TEST(DeviceLife, AsksOnceForEachThing) {
  const SmallDevice device;
  Profile asking = profile();
  asking.lifecycle.ask_operator = true;
  const Case one = nothing_to_do("a.one");
  const Person person{2};  // it is started, and it is stopped
  EXPECT_EQ(run_cases(asking, {&one}, options()).count(Verdict::pass), 1U);
  EXPECT_TRUE(Person::is_done());
}

}  // namespace
}  // namespace trestle::conform::device_life_test
