#include "bridge/console/status_socket.hpp"

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <boost/asio/local/stream_protocol.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <thread>
#include <vector>

#include "bridge/console/fresh_text.hpp"
#include "bridge/console/status_place.hpp"

namespace trestle::console {
namespace {

namespace fs = std::filesystem;
using Protocol = boost::asio::local::stream_protocol;
using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr auto patience = 100s;

class Status : public testing::Test {
 protected:
  Status() {
    std::string name = "/tmp/status_test_XXXXXX";
    folder_ = ::mkdtemp(name.data());
  }
  ~Status() override {
    socket_.reset();
    fs::remove_all(folder_);
  }
  void open(std::string text = "hello") {
    socket_.emplace(io_, folder_, [this, text = std::move(text)] {
      ++made_;
      return text;
    });
  }
  /// What somebody is answered while the bridge runs.
  tl::expected<std::string, AskError> asked(std::chrono::milliseconds limit = patience) {
    tl::expected<std::string, AskError> answer;
    std::thread asker{[&] {
      answer = ask(socket_->path(), limit);
      io_.stop();
    }};
    io_.restart();
    const auto work = boost::asio::make_work_guard(io_);
    io_.run();
    asker.join();
    return answer;
  }
  /// Runs until this is so.
  template <typename Condition>
  [[nodiscard]] bool until(Condition condition) {
    const auto end = std::chrono::steady_clock::now() + patience;
    while (!condition() && std::chrono::steady_clock::now() < end) {
      io_.restart();
      io_.run_one_for(10ms);
    }
    return condition();
  }

  boost::asio::io_context io_;
  fs::path folder_;
  std::optional<StatusSocket> socket_;
  int made_ = 0;
};

TEST_F(Status, AnswersWithTheWholeText) {
  open(std::string(3'000'000, 'x'));
  const auto answer = asked();
  ASSERT_TRUE(answer);
  EXPECT_EQ(*answer, std::string(3'000'000, 'x'));
}

TEST_F(Status, IsForThisUserAlone) {
  open();
  EXPECT_EQ(socket_->path(), folder_ / socket_name(::getpid()));
  struct stat there {};
  ASSERT_EQ(::stat(socket_->path().c_str(), &there), 0);
  EXPECT_EQ(there.st_mode & 0777U, 0600U);
}

TEST_F(Status, LeavesNothingBehind) {
  open();
  EXPECT_THAT(status_sockets({folder_}), ElementsAre(socket_->path()));
  socket_.reset();
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(Status, MakesTheTextOnceForWhoComesTogether) {
  open();
  const Protocol::endpoint at{socket_->path().string()};
  std::vector<Protocol::socket> clients;
  for (int i = 0; i < 3; ++i) {
    clients.emplace_back(io_);
    clients.back().connect(at);
  }
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(until([&] { return clients.back().available() > 0; }));
  if (std::chrono::steady_clock::now() - begin < FreshText::least) {
    EXPECT_EQ(made_, 1);
  }
}

TEST(FreshText, TakesATwentiethOfTheTime) {
  int made = 0;
  FreshText slow{[&] {
    std::this_thread::sleep_for(20ms);
    return std::to_string(++made);
  }};
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(*slow.now(), "1");
  const auto first = std::chrono::steady_clock::now();
  do {
    std::this_thread::sleep_for(5ms);
  } while (*slow.now() == "1");
  EXPECT_GE(std::chrono::steady_clock::now() - first, FreshText::share * 20ms);
  EXPECT_GE(first - begin, 20ms);
}

TEST_F(Status, LeavesWhoDoesNotRead) {
  open(std::string(8'000'000, 'x'));
  const Protocol::endpoint at{socket_->path().string()};
  std::vector<Protocol::socket> deaf;
  for (std::size_t i = 0; i < StatusSocket::most_clients; ++i) {
    deaf.emplace_back(io_);
    deaf.back().connect(at);
  }
  ASSERT_TRUE(until([&] { return deaf.back().available() > 0; }));
  // All places are taken; the next one is served when their time is over.
  const auto answer = asked();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->size(), 8'000'000U);
  EXPECT_LT(deaf.front().available(), 8'000'000U) << "it got what the system holds, and no more";
}

TEST_F(Status, EndsWhileSomebodyIsServed) {
  open(std::string(8'000'000, 'x'));
  Protocol::socket deaf{io_};
  deaf.connect(Protocol::endpoint{socket_->path().string()});
  ASSERT_TRUE(until([&] { return deaf.available() > 0; }));
  socket_.reset();
  io_.restart();
  io_.poll();
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(Status, RemovesASocketThatWasLeftBehind) {
  const fs::path left = folder_ / socket_name(1);
  {
    boost::asio::io_context io;
    Protocol::acceptor dead{io, Protocol::endpoint{left.string()}};
  }
  ASSERT_THAT(status_sockets({folder_}), ElementsAre(left));
  const auto answer = ask(left, 1s);
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error(), AskError::gone);
  EXPECT_THAT(status_sockets({folder_}), IsEmpty());
  const auto again = ask(left, 1s);
  EXPECT_EQ(again.error(), AskError::gone);
}

TEST_F(Status, DoesNotWaitLongForABridgeThatIsStuck) {
  open();
  const auto answer = ask(socket_->path(), 1ms);  // nobody runs the io_context
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error(), AskError::no_answer);
  EXPECT_THAT(status_sockets({folder_}), ElementsAre(socket_->path())) << "it is not removed";
}

TEST_F(Status, TakesNoMoreThanItIsWorth) {
  open(std::string(100'000, 'x'));
  std::optional<tl::expected<std::string, AskError>> answer;
  std::thread asker{[&] {
    answer = ask(socket_->path(), patience, 99'999);
    io_.stop();
  }};
  io_.run();
  asker.join();
  EXPECT_EQ(answer->error(), AskError::no_answer);
}

TEST_F(Status, PassesOverWhatIsNoSocket) {
  std::ofstream{folder_ / "2.sock"} << "text";
  std::ofstream{folder_ / "other"} << "text";
  EXPECT_THAT(status_sockets({folder_, folder_ / "gone"}), IsEmpty());
}

TEST_F(Status, HasItsFolderWhereTheUserHasIt) {
  ASSERT_EQ(::setenv("XDG_RUNTIME_DIR", folder_.c_str(), 1), 0);
  const auto folder = status_folder();
  ASSERT_TRUE(folder);
  EXPECT_EQ(*folder, folder_ / "trestle");
  struct stat there {};
  ASSERT_EQ(::stat(folder->c_str(), &there), 0);
  EXPECT_EQ(there.st_mode & 0777U, 0700U);
  EXPECT_THAT(status_folders(), testing::Contains(*folder));
  // One that others may write to is not used.
  ASSERT_EQ(::chmod(folder->c_str(), 0777), 0);
  const auto other = status_folder();
  EXPECT_TRUE(!other || *other != *folder);
  ::unsetenv("XDG_RUNTIME_DIR");
}

}  // namespace
}  // namespace trestle::console
