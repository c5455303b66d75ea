// Profiles, discovery servers and security: what large ROS 2 systems are configured with.
#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>

#include "test/dds_adapter/dds_test.hpp"
#include "test/dds_adapter/keystore.hpp"

namespace trestle::test::big_systems_test {
namespace {

using namespace dds;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Bytes = std::vector<std::byte>;

constexpr const char* type = "std_msgs::msg::dds_::String_";

class BigSystems : public DdsTest {
 protected:
  BigSystems() { std::filesystem::create_directories(folder_); }
  ~BigSystems() override {
    std::filesystem::remove_all(folder_);
    std::filesystem::remove(folder_ + ".log");
  }

  /// Why the rest of a test is skipped; empty: it is not.
  [[nodiscard]] virtual std::string hindrance() { return ""; }

  /// What one writes the other gets.
  void expect_carried(Participant& from, Participant& to, const std::string& topic) {
    if (IsSkipped()) {
      return;
    }
    Inbox<Bytes> inbox;
    Writer writer = from.create_writer(topic, type, {});
    const Reader reader =
        to.create_reader(topic, type, {}, [&](const Sample& one) { inbox.put(copy(one.cdr())); });
    const auto matched = [&] { return writer.matched() == 1 && reader.matched() == 1; };
    ASSERT_TRUE(eventually([&] { return matched() || !hindrance().empty(); }));
    if (!matched()) {
      GTEST_SKIP() << hindrance();
    }
    ASSERT_TRUE(writer.write(make_sample(1000, 1)));
    ASSERT_TRUE(inbox.wait_for_count(1));
    EXPECT_EQ(inbox.take().back(), make_sample(1000, 1));
  }
  [[nodiscard]] static std::string fault(const ParticipantConfig& config) {
    try {
      const Participant participant{config};
    } catch (const DdsError& error) {
      return error.what();
    }
    return "";
  }

  const std::string folder_ = testing::TempDir() + "trestle-big-" + std::to_string(getpid());
};

/// A UDP port of all addresses that nobody has at the moment, and no other test for as long as this process
/// lives. None of those that the system gives to whoever asks for any.
std::uint16_t free_port() {
  constexpr unsigned first = 20'000;
  constexpr unsigned count = 10'000;
  static unsigned tries = static_cast<unsigned>(getpid()) * 8;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  while (true) {
    const auto port = static_cast<std::uint16_t>(first + ++tries % count);
    // Of the 250 ports of each DDS domain, participants have those below. (RTPS 9.6.1.1)
    if (constexpr unsigned of_participants = 100; (port - 7400U) % 250 < of_participants) {
      continue;
    }
    const std::string lock = fmt::format("{}trestle-port-{}.lock", testing::TempDir(), port);
    const int file = open(lock.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);  // never closed
    if (file < 0 || flock(file, LOCK_EX | LOCK_NB) != 0) {
      close(file);
      continue;
    }
    address.sin_port = htons(port);
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);
    const bool free =
        bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;  // NOLINT(*-cast)
    close(fd);
    if (free) {
      return port;
    }
    close(file);
  }
}

bool is_taken(std::uint16_t port) {
  std::ifstream sockets{"/proc/net/udp"};
  const std::string wanted = fmt::format(":{:04X} ", port);
  for (std::string line; std::getline(sockets, line);) {
    if (line.find(wanted) != std::string::npos && line.find(wanted) < 20) {
      return true;
    }
  }
  return false;
}

TEST_F(BigSystems, StartFromAProfile) {
  const std::uint16_t port = free_port();
  const std::string file = folder_ + "/profiles.xml";
  std::ofstream{file} << fmt::format(R"(<?xml version="1.0" encoding="UTF-8" ?>
<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles"><profiles>
  <participant profile_name="vehicle"><rtps>
    <builtin><metatrafficUnicastLocatorList><locator><udpv4>
      <address>127.0.0.1</address><port>{}</port>
    </udpv4></locator></metatrafficUnicastLocatorList></builtin>
  </rtps></participant>
</profiles></dds>)",
                                     port);
  ParticipantConfig profiled = config();
  profiled.profiles_file = file;
  profiled.profile = "vehicle";
  ASSERT_FALSE(is_taken(port));
  {
    const Participant participant{profiled};
    EXPECT_TRUE(is_taken(port));
  }

  profiled.profile = "trestle";
  EXPECT_EQ(fault(profiled), file + " has no participant profile 'trestle'");
  profiled.profiles_file = folder_ + "/none.xml";
  EXPECT_EQ(fault(profiled), "the file of DDS profiles, " + folder_ + "/none.xml, cannot be read");
  profiled.profiles_file = folder_ + "/broken.xml";
  std::ofstream{profiled.profiles_file} << "<dds><no_such_thing/></dds>";
  EXPECT_THAT(fault(profiled),
              HasSubstr("does not take " + profiled.profiles_file + " for a file of profiles"));
}

TEST_F(BigSystems, SayWhichBuffersTheSystemDoesNotGrant) {
  const std::string file = folder_ + "/buffers.xml";
  std::ofstream{file} << R"(<?xml version="1.0" encoding="UTF-8" ?>
<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles"><profiles>
  <participant profile_name="modest"><rtps>
    <sendSocketBufferSize>131072</sendSocketBufferSize>
    <listenSocketBufferSize>131072</listenSocketBufferSize>
  </rtps></participant>
  <participant profile_name="greedy"><rtps>
    <sendSocketBufferSize>131072</sendSocketBufferSize>
    <listenSocketBufferSize>2147483647</listenSocketBufferSize>
  </rtps></participant>
</profiles></dds>)";
  const auto not_granted = [&](const char* profile) {
    ParticipantConfig profiled = config();
    profiled.profiles_file = file;
    profiled.profile = profile;
    return Participant{profiled}.buffers_not_granted();
  };
  EXPECT_THAT(not_granted("modest"), IsEmpty());
  EXPECT_THAT(not_granted("greedy"),
              ElementsAre(AllOf(HasSubstr("UDP receive buffers"), HasSubstr("KB only, not 2097151:"),
                                HasSubstr("sysctl -w net.core.rmem_max=2147483647"))));
}

TEST_F(BigSystems, SayThatTheSendBufferIsSmallWithTheFirstLargeSampleAndOnce) {
  const std::string file = folder_ + "/send_buffer.xml";
  std::ofstream{file} << R"(<?xml version="1.0" encoding="UTF-8" ?>
<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles"><profiles>
  <participant profile_name="generous"><rtps>
    <sendSocketBufferSize>2147483647</sendSocketBufferSize>
    <listenSocketBufferSize>131072</listenSocketBufferSize>
  </rtps></participant>
</profiles></dds>)";
  std::mutex guard;
  std::vector<std::string> lines;
  ParticipantConfig profiled = config();
  profiled.profiles_file = file;
  profiled.profile = "generous";
  profiled.on_event = [&](const Happening& event) {
    const std::lock_guard lock{guard};
    if (event.kind == Happening::Kind::small_send_buffer) {
      lines.push_back(event.detail);
    }
  };
  Participant participant{profiled};
  EXPECT_THAT(participant.buffers_not_granted(), IsEmpty());
  Writer writer = participant.create_writer("rt/large", "std_msgs::msg::dds_::ByteMultiArray_", {});
  const auto write = [&](std::size_t bytes) {
    std::vector<std::byte> sample(bytes);
    sample[1] = std::byte{1};  // CDR, little endian
    return writer.write(sample).has_value();
  };
  ASSERT_TRUE(write(60'000));
  {
    const std::lock_guard lock{guard};
    EXPECT_THAT(lines, IsEmpty()) << "it needs none";
  }
  ASSERT_TRUE(write((1 << 20) + 4));
  ASSERT_TRUE(write((1 << 20) + 4));
  const std::lock_guard lock{guard};
  EXPECT_THAT(lines, ElementsAre(AllOf(HasSubstr("UDP send buffers"), HasSubstr("KB only, not 2097151:"),
                                       HasSubstr("sysctl -w net.core.wmem_max=2147483647"))));
}

/// Whether Fast DDS's shared memory is part of this process.
bool has_shared_memory() {
  std::ifstream maps{"/proc/self/maps"};
  for (std::string line; std::getline(maps, line);) {
    if (line.find("/dev/shm/fast") != std::string::npos) {
      return true;
    }
  }
  return false;
}

TEST_F(BigSystems, HaveSharedMemoryOnlyIfItIsAskedFor) {
  // They find nobody, so that all interfaces may be theirs.
  const std::string file = folder_ + "/transports.xml";
  const std::string alone =
      "<builtin><discovery_config><discoveryProtocol>NONE</discoveryProtocol></discovery_config></builtin>";
  const std::string shared =
      "<userTransports><transport_id>shared</transport_id></userTransports>"
      "<useBuiltinTransports>false</useBuiltinTransports>";
  std::ofstream{file} << fmt::format(R"(<?xml version="1.0" encoding="UTF-8" ?>
<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles"><profiles>
  <transport_descriptors><transport_descriptor>
    <transport_id>shared</transport_id><type>SHM</type>
  </transport_descriptor></transport_descriptors>
  <participant profile_name="plain"><rtps>{0}</rtps></participant>
  <participant profile_name="builtin"><rtps>
    <useBuiltinTransports>true</useBuiltinTransports>{0}
  </rtps></participant>
  <participant profile_name="none"><rtps>
    <useBuiltinTransports>false</useBuiltinTransports>{0}
  </rtps></participant>
  <participant profile_name="shared"><rtps>{1}{0}</rtps></participant>
</profiles></dds>)",
                                     alone, shared);
  struct Case {
    const char* profile;
    std::optional<bool> configured;
    bool expected;
  };
  for (const Case& one : {Case{"plain", {}, false}, Case{"plain", false, false}, Case{"plain", true, true},
                          Case{"builtin", {}, false}, Case{"none", {}, false}, Case{"shared", {}, true},
                          Case{"shared", false, false}, Case{"shared", true, true}}) {
    const testing::ScopedTrace trace{__FILE__, __LINE__, one.profile};
    ParticipantConfig profiled = config();
    profiled.interfaces = {};
    profiled.profiles_file = file;
    profiled.profile = one.profile;
    profiled.shared_memory = one.configured;
    const Participant participant{profiled};
    EXPECT_EQ(has_shared_memory(), one.expected);
    EXPECT_EQ(participant.shares_memory(), one.expected);
  }
}

/// A process that ends with the object.
class Process {
 public:
  explicit Process(const std::vector<std::string>& command) : pid_{fork()} {
    if (pid_ == 0) {
      std::vector<char*> arguments;
      for (const std::string& word : command) {
        arguments.push_back(
            const_cast<char*>(word.c_str()));  // NOLINT(*-const-cast): execvp's type is older than const
      }
      arguments.push_back(nullptr);
      execvp(arguments[0], arguments.data());
      _exit(127);
    }
  }
  ~Process() {
    if (!status_) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// Whether abort() has ended it, as assertions that fail do.
  [[nodiscard]] bool has_aborted() {
    int status = 0;
    if (!status_ && waitpid(pid_, &status, WNOHANG) == pid_) {
      status_ = status;
    }
    return status_ && WIFSIGNALED(*status_) && WTERMSIG(*status_) == SIGABRT;
  }

 private:
  pid_t pid_;
  std::optional<int> status_;  ///< once it has ended
};

class ServedSystems : public BigSystems {
 protected:
  void SetUp() override {
    // NOLINTNEXTLINE(*-env33-c): of our own text only
    if (system("command -v fast-discovery-server >/dev/null") != 0) {
      GTEST_SKIP() << "fast-discovery-server, of Debian's fastdds-tools, is not installed";
    }
    server_.emplace(server_command(0, port_));
  }
  ~ServedSystems() override { unsetenv(of_ros); }

  static std::vector<std::string> server_command(unsigned number, std::uint16_t port) {
    return {"fast-discovery-server", "-i", std::to_string(number), "-l", "127.0.0.1", "-p",
            std::to_string(port)};
  }
  [[nodiscard]] ParticipantConfig client() const {
    ParticipantConfig result = config();
    result.discovery_servers = {{"127.0.0.1", port_}};
    return result;
  }

  [[nodiscard]] std::string hindrance() override {
    return server_ && server_->has_aborted()
               ? "fast-discovery-server has ended itself: an assertion of Fast DDS's own failed, above"
               : "";
  }

  static constexpr const char* of_ros = "ROS_DISCOVERY_SERVER";
  const std::uint16_t port_ = free_port();
  std::optional<Process> server_;
};

TEST_F(ServedSystems, FindEachOtherByADiscoveryServer) {
  Inbox<Happening> events;
  Participant alone{config([&](const Happening& event) { events.put(event); })};
  Participant from{client()};
  Participant to{client()};
  expect_carried(from, to, "rt/a");
  // Who has no server does not see them: they say nothing to the multicast group.
  EXPECT_EQ(events.size(), 0U);
}

TEST_F(ServedSystems, FindTheServerByNameAndNumber) {
  const std::uint16_t port = free_port();
  const Process second{server_command(1, port)};
  server_.reset();  // the number 0 is not among them
  ParticipantConfig named = config();
  named.discovery_servers = {{}, {"localhost", port}};
  Participant from{named};
  Participant to{named};
  expect_carried(from, to, "rt/a");
  named.discovery_servers = {{"no-such-host.invalid", port}};
  EXPECT_EQ(fault(named), "the discovery server no-such-host.invalid is not known: no host has this name");
}

TEST_F(ServedSystems, FindTheServerByIPv6) {
  if (std::ifstream{"/proc/net/if_inet6"}.peek() == std::ifstream::traits_type::eof()) {
    GTEST_SKIP() << "this host has no IPv6";
  }
  const std::uint16_t port = free_port();
  const Process second{{"fast-discovery-server", "-i", "0", "-l", "::1", "-p", std::to_string(port)}};
  ParticipantConfig six = config();
  six.discovery_servers = {{"::1", port}};
  Participant from{six};
  Participant to{six};
  expect_carried(from, to, "rt/a");
}

TEST_F(ServedSystems, SeeTopicsThatTheyHaveNoEndpointsOf) {
  const Participant observer{client()};
  Participant from{client()};
  const Writer writer = from.create_writer("rt/a", type, {});
  const auto sees = [&] {
    const std::vector<FoundWriter> found = observer.writers();
    return std::ranges::any_of(found, [](const FoundWriter& one) { return one.topic == "rt/a"; });
  };
  ASSERT_TRUE(eventually([&] { return sees() || !hindrance().empty(); }));
  if (!sees()) {
    GTEST_SKIP() << hindrance();
  }
}

TEST_F(ServedSystems, TakeTheServerFromTheEnvironmentOfROS) {
  Inbox<Happening> events;
  Participant alone{config([&](const Happening& event) { events.put(event); })};
  setenv(of_ros, ("127.0.0.1:" + std::to_string(port_)).c_str(), 1);
  Participant from{config()};
  Participant to{config()};
  expect_carried(from, to, "rt/a");
  // One that is told the same server by its configuration is among them.
  unsetenv(of_ros);
  Participant third{client()};
  expect_carried(from, third, "rt/b");
  expect_carried(third, to, "rt/c");
  EXPECT_EQ(events.size(), 0U);
}

TEST_F(ServedSystems, OutliveOneOfTwoServers) {
  const std::uint16_t other_port = free_port();
  const Process other{server_command(1, other_port)};
  ParticipantConfig client_of_both = client();
  client_of_both.discovery_servers.push_back({"127.0.0.1", other_port});
  Participant from{client_of_both};
  Participant to{client_of_both};
  Inbox<Bytes> inbox;
  Writer writer = from.create_writer("rt/a", type, {});
  const Reader reader =
      to.create_reader("rt/a", type, {}, [&](const Sample& one) { inbox.put(copy(one.cdr())); });
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));
  server_.reset();
  // Those who have found each other need it no more, and new ones are found by the other.
  ASSERT_TRUE(writer.write(make_sample(1000, 1)));
  ASSERT_TRUE(inbox.wait_for_count(1));
  Participant third{client_of_both};
  expect_carried(from, third, "rt/b");
  expect_carried(third, to, "rt/c");
}

class SecureSystems : public BigSystems {
 protected:
  void SetUp() override { make_keystore(folder_); }
  [[nodiscard]] ParticipantConfig secure(const std::string& enclave,
                                         Inbox<Happening>* events = nullptr) const {
    ParticipantConfig result =
        events == nullptr ? config() : config([=](const Happening& event) { events->put(event); });
    result.node = "/trestle";
    result.enclave = enclave;
    result.security_folder = folder_ + "/enclaves" + enclave;
    return result;
  }
};

TEST_F(SecureSystems, TalkAmongThemselvesOnly) {
  Inbox<Happening> seen;
  Participant outsider{config([&](const Happening& event) { seen.put(event); })};
  const Reader eavesdropper = outsider.create_reader("rt/allowed", type, {}, [](const Sample&) {});
  Participant from{secure("/vehicle/trestle")};
  Participant to{secure("/lidar")};
  expect_carried(from, to, "rt/allowed");
  expect_carried(to, from, "rt/allowed");
  EXPECT_EQ(eavesdropper.matched(), 0U);
  for (const Happening& event : seen.take()) {
    EXPECT_TRUE(event.kind == Happening::Kind::peer_found || event.kind == Happening::Kind::peer_lost)
        << to_string(event.kind);
  }
}

TEST_F(SecureSystems, RefuseWhatTheEnclaveMayNotDo) {
  Participant participant{secure("/lidar")};
  EXPECT_THROW(std::ignore = participant.create_writer("rt/forbidden", type, {}), DdsError);
  EXPECT_THROW(std::ignore = participant.create_reader("rt/forbidden", type, {}, [](const Sample&) {}),
               DdsError);
}

TEST_F(SecureSystems, SayWhichFileIsMissing) {
  EXPECT_EQ(fault(secure("/none")),
            "DDS security needs " + folder_ + "/enclaves/none/identity_ca.cert.pem, which cannot be read");
  std::filesystem::remove(folder_ + "/enclaves/lidar/permissions.p7s");
  EXPECT_EQ(fault(secure("/lidar")),
            "DDS security needs " + folder_ + "/enclaves/lidar/permissions.p7s, which cannot be read");
}

}  // namespace
}  // namespace trestle::test::big_systems_test
