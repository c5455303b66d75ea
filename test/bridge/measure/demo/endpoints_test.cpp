#include <gmock/gmock.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "bridge/measure/demo/endpoints.hpp"
#include "bridge/measure/report.hpp"
#include "test/dds_adapter/dds_test.hpp"

namespace trestle::measure::demo::endpoints_test {
namespace {

using nlohmann::json;
using test::TestDomain;
using testing::HasSubstr;

/// A process that runs `body` with the writing end of a pipe; its lines come out of next().
class Process {
 public:
  explicit Process(const std::function<void(int)>& body) {
    std::array<int, 2> ends{};
    if (pipe(ends.data()) != 0) {
      throw std::runtime_error{"pipe"};
    }
    out_ = ends[0];
    pid_ = fork();
    if (pid_ == 0) {
      close(ends[0]);
      int status = 0;
      try {
        body(ends[1]);
      } catch (const std::exception&) {
        status = 1;
      }
      _exit(status);
    }
    close(ends[1]);
  }
  ~Process() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      wait();
    }
    close(out_);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// The next event; null at the end, or when none comes.
  json next() {
    while (buffer_.find('\n') == std::string::npos) {
      pollfd file{out_, POLLIN, 0};
      std::array<char, 4096> part{};
      const auto patience = std::chrono::milliseconds{test::patience};
      if (poll(&file, 1, static_cast<int>(patience.count())) <= 0) {
        return nullptr;
      }
      const ssize_t size = read(out_, part.data(), part.size());
      if (size <= 0) {
        return nullptr;
      }
      buffer_.append(part.data(), static_cast<std::size_t>(size));
    }
    const std::size_t end = buffer_.find('\n');
    json event = json::parse(buffer_.substr(0, end));
    buffer_.erase(0, end + 1);
    return event;
  }
  /// The next event of this name; null when there is none.
  json next(const std::string& name) {
    json event = next();
    while (!event.is_null() && event.at("event") != name) {
      event = next();
    }
    return event;
  }
  void stop() const { kill(pid_, SIGTERM); }
  int wait() {
    int status = -1;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  pid_t pid_ = -1;
  int out_ = -1;
  std::string buffer_;
};

EndpointOptions subscriber_options(const TestDomain& domain, int report_fd) {
  EndpointOptions options;
  options.domain = domain.id();
  options.report_fd = report_fd;
  return options;
}

PublisherOptions publisher_options(const TestDomain& domain, int report_fd) {
  PublisherOptions options;
  options.domain = domain.id();
  options.report_fd = report_fd;
  options.rate_hz = 20;
  return options;
}

TEST(DemoEndpoints, CarryTheSceneAndFindItIntact) {
  const TestDomain domain;
  Process subscriber{[&](int out) { run_subscriber(subscriber_options(domain, out)); }};
  ASSERT_FALSE(subscriber.next("ready").is_null());
  Process publisher{[&](int out) { run_publisher(publisher_options(domain, out)); }};
  ASSERT_FALSE(publisher.next("ready").is_null());
  EXPECT_EQ(subscriber.next("matched")["count"], 1);

  json sent;
  for (int i = 0; i < 6; ++i) {
    const json received = subscriber.next("received");
    ASSERT_FALSE(received.is_null());
    do {  // what a slow machine overwrites does not come
      sent = publisher.next("published");
      ASSERT_FALSE(sent.is_null());
    } while (sent["stamp_ns"] < received["stamp_ns"]);
    EXPECT_EQ(received["stamp_ns"], sent["stamp_ns"]);
    EXPECT_EQ(received["checksum"], sent["checksum"]);
    // Three bytes of padding may be received with it.
    EXPECT_GE(received["bytes"].get<int>(), sent["bytes"].get<int>());
    EXPECT_LE(received["bytes"].get<int>(), sent["bytes"].get<int>() + 3);
    EXPECT_GT(sent["bytes"], 3'145'728);
    EXPECT_NEAR(sent["stamp_ns"].get<double>(), static_cast<double>(realtime_ns()), 60e9);
    EXPECT_GT(received["time_ns"], sent["time_ns"]);
  }
  publisher.stop();
  const json published = publisher.next("finished");
  EXPECT_GE(published["published"], 6);
  EXPECT_EQ(publisher.wait(), 0);
  EXPECT_EQ(subscriber.next("matched")["count"], 0);
  subscriber.stop();
  const json finished = subscriber.next("finished");
  EXPECT_GE(finished["received"], 6);
  EXPECT_EQ(finished["overrun"], 0);
  EXPECT_EQ(subscriber.wait(), 0);
}

TEST(DemoEndpoints, CarryRecordedCloudsInTurn) {
  const TestDomain domain;
  const auto file =
      std::filesystem::temp_directory_path() / ("trestle_demo_" + std::to_string(getpid()) + ".pcd");
  std::ofstream{file} << "FIELDS x\nSIZE 4\nTYPE F\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n1\n2\n";
  Process subscriber{[&](int out) { run_subscriber(subscriber_options(domain, out)); }};
  ASSERT_FALSE(subscriber.next("ready").is_null());
  Process publisher{[&](int out) {
    PublisherOptions options = publisher_options(domain, out);
    options.inputs = {file};
    run_publisher(options);
  }};
  json sent = publisher.next("published");
  for (int i = 0; i < 3; ++i) {
    const json received = subscriber.next("received");
    ASSERT_FALSE(received.is_null());
    while (sent["stamp_ns"] < received["stamp_ns"]) {
      sent = publisher.next("published");
    }
    EXPECT_EQ(received["stamp_ns"], sent["stamp_ns"]);
    EXPECT_EQ(received["checksum"], sent["checksum"]);
    EXPECT_LT(received["bytes"], 200);
  }
  std::filesystem::remove(file);
}

TEST(DemoEndpoints, EndWhenTheirTimeIsOver) {
  const TestDomain domain;
  Process publisher{[&](int out) {
    PublisherOptions options = publisher_options(domain, out);
    options.duration = std::chrono::seconds{1};
    run_publisher(options);
  }};
  Process subscriber{[&](int out) {
    EndpointOptions options = subscriber_options(domain, out);
    options.duration = std::chrono::seconds{1};
    run_subscriber(options);
  }};
  const json published = publisher.next("finished");
  ASSERT_FALSE(published.is_null());
  EXPECT_LE(published["published"], 21);
  EXPECT_EQ(publisher.wait(), 0);
  EXPECT_FALSE(subscriber.next("finished").is_null());
  EXPECT_EQ(subscriber.wait(), 0);
}

TEST(DemoEndpoints, RefuseAnInputThatIsNone) {
  PublisherOptions options;
  options.inputs = {"/nowhere/cloud.pcd"};
  try {
    run_publisher(options);
    FAIL() << "it ran";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("/nowhere/cloud.pcd: No such file or directory"));
  }
}

}  // namespace
}  // namespace trestle::measure::demo::endpoints_test
