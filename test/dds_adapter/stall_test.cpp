#include <gmock/gmock.h>
#include <sys/types.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "test/dds_adapter/dds_test.hpp"
#include "test/dds_adapter/peer_process.hpp"

namespace trestle::dds::stall_test {
namespace {

using namespace std::chrono_literals;
using test::eventually;
using test::PeerProcess;

constexpr auto short_lease = 400ms;
constexpr auto long_lease = 20s;
// Discovery's heartbeats come once in a second. One that was due in the stall follows the announcement that
// was: before what is to go out 70 ms later.
constexpr auto stall = 1200ms;
constexpr auto until_acknowledged = 2s;
constexpr int rounds = 2;

/// One side is stopped for longer than its lease, which only the other one notices. The peer is without our
/// guards: each time it is ours that has to heal it.
class Stalls : public test::DdsTest {
 protected:
  ~Stalls() override { std::remove(output_.c_str()); }

  [[nodiscard]] std::string command(std::chrono::milliseconds lease) const {
    return "exec " STALLING_PEER " " + std::to_string(domain_.id()) + " " + std::to_string(lease.count()) +
           " >" + output_;
  }
  [[nodiscard]] std::vector<std::string> said() const {
    std::ifstream file{output_};
    std::vector<std::string> lines;
    for (std::string line; std::getline(file, line);) {
      lines.push_back(line);
    }
    return lines;
  }
  [[nodiscard]] bool says(std::size_t lines) const {
    return eventually([&] { return said().size() >= lines; });
  }

  std::string output_ = testing::TempDir() + "trestle_stalling_peer_" + std::to_string(getpid());
};

TEST_F(Stalls, OfOthersLeaveThemWholeToUs) {
  const Participant participant{config()};
  const auto sees_theirs = [&] {
    return std::ranges::any_of(participant.writers(),
                               [](const FoundWriter& writer) { return writer.topic == "rt/theirs"; });
  };
  const PeerProcess peer{command(short_lease)};
  ASSERT_TRUE(says(1));
  const auto process = static_cast<pid_t>(std::stol(said().front()));
  for (int round = 0; round < rounds; ++round) {
    ASSERT_TRUE(eventually(sees_theirs)) << "in round " << round;
    std::this_thread::sleep_for(until_acknowledged);
    kill(process, SIGSTOP);
    std::this_thread::sleep_for(stall);
    const bool lost = eventually([&] { return !sees_theirs(); });
    kill(process, SIGCONT);
    ASSERT_TRUE(lost);
  }
  EXPECT_TRUE(eventually(sees_theirs));
}

TEST_F(Stalls, OfOursLeaveUsWholeToOthers) {
  ParticipantConfig ours = config();
  ours.lease = short_lease;
  Participant participant{ours};
  const Writer writer = participant.create_writer("rt/ours", "Type", {});
  const std::jthread busy{[&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const Writer one = participant.create_writer("rt/busy", "Type", {});
      std::this_thread::sleep_for(20ms);
    }
  }};
  const PeerProcess peer{command(long_lease)};
  for (int round = 0; round < rounds; ++round) {
    ASSERT_TRUE(eventually([&] { return said().size() >= 2 && said().back() == "+"; }))
        << "in round " << round;
    std::this_thread::sleep_for(until_acknowledged);
    const std::size_t before = said().size();
    // Until the other one has noticed, and no longer than this test has patience.
    const std::string seconds = std::to_string(std::chrono::duration<double>(stall).count());
    const std::string noticed = "test $(wc -l <" + output_ + ") -gt " + std::to_string(before);
    ASSERT_EQ(std::system(("kill -STOP $PPID; sleep " + seconds + "; i=0; until " + noticed +
                           " || test $i -ge 300; do sleep 0.1; i=$((i + 1)); done; " + noticed +
                           "; noticed=$?; kill -CONT $PPID; exit $noticed")
                              .c_str()),
              0)
        << "it has not noticed in round " << round;
    ASSERT_TRUE(says(before + 2));
  }
  EXPECT_TRUE(eventually([&] { return said().back() == "+"; }));
}

}  // namespace
}  // namespace trestle::dds::stall_test
