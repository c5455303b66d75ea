#include "bridge/measure/demo/demo.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <system_error>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/signals.hpp"
#include "bridge/measure/demo/browser.hpp"
#include "bridge/measure/demo/child.hpp"
#include "bridge/measure/demo/figures.hpp"
#include "bridge/measure/demo/screen.hpp"
#include "bridge/measure/report.hpp"

namespace trestle::measure::demo {
namespace {

using namespace std::chrono_literals;

/// A socket, of UDP unless told otherwise, that is bound only to see whether it can be.
class ProbeSocket {
 public:
  /// @param port  0: the system chooses.
  explicit ProbeSocket(std::uint16_t port, const char* address = "0.0.0.0", int type = SOCK_DGRAM)
      : fd_{socket(AF_INET, type | SOCK_CLOEXEC, 0)} {
    sockaddr_in endpoint{};
    endpoint.sin_family = AF_INET;
    endpoint.sin_port = htons(port);
    inet_pton(AF_INET, address, &endpoint.sin_addr);
    socklen_t size = sizeof endpoint;
    // The sockets interface of POSIX is made of this cast.
    auto* generic = reinterpret_cast<sockaddr*>(&endpoint);
    if (bind(fd_, generic, size) == 0 && getsockname(fd_, generic, &size) == 0) {
      port_ = ntohs(endpoint.sin_port);
    }
  }
  ~ProbeSocket() { close(fd_); }
  ProbeSocket(const ProbeSocket&) = delete;
  ProbeSocket& operator=(const ProbeSocket&) = delete;

  /// 0 if the port is taken.
  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }

 private:
  int fd_;
  std::uint16_t port_ = 0;
};

/// A DDS domain that nobody on this host uses; the search begins at `first`.
std::uint32_t free_domain(std::uint32_t first) {
  // Above the domains that people choose by hand, and low enough for DDS's ports to stay below the system's
  // ephemeral ports.
  constexpr std::uint32_t lowest = 40;
  constexpr std::uint32_t count = 60;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t domain = lowest + (first + i) % count;
    // The port for multicast discovery, which the participants of a domain share.
    if (ProbeSocket{static_cast<std::uint16_t>(7400 + 250 * domain)}.port() != 0) {
      return domain;
    }
  }
  throw std::runtime_error{"every DDS domain from 40 to 99 is in use on this host"};
}

/// The first loopback addresses from 127.0.0.1 on without a SOME/IP stack. If there seem to be none,
/// 127.0.0.1 and 127.0.0.2, so that the bridges report what is wrong.
void choose_addresses(DemoNetwork& network) {
  constexpr std::uint16_t discovery_port = 30490;
  std::vector<std::string> free;
  for (int last = 1; last < 32 && free.size() < 2; ++last) {
    const std::string address = fmt::format("127.0.0.{}", last);
    if (ProbeSocket{discovery_port, address.c_str()}.port() != 0) {
      free.push_back(address);
    }
  }
  if (free.size() == 2) {
    network.address_a = free[0];
    network.address_b = free[1];
  }
}

/// The port that consoles have, or another one where that is taken.
std::uint16_t console_port() {
  constexpr std::uint16_t usual = 9464;
  const std::uint16_t port = ProbeSocket{usual, "127.0.0.1", SOCK_STREAM}.port();
  return port != 0 ? port : ProbeSocket{0, "127.0.0.1", SOCK_STREAM}.port();
}

DemoNetwork choose_network() {
  DemoNetwork network;
  // Two demos that start at once should not try the same domains in the same order, nor offer the same
  // instance.
  const auto own = static_cast<std::uint32_t>(getpid());
  network.domain_a = free_domain(own);
  network.domain_b = free_domain(network.domain_a + 1);
  network.instance = static_cast<std::uint16_t>(1 + own % 0xfffe);
  network.port = ProbeSocket{0}.port();
  network.console = console_port();
  choose_addresses(network);
  if (network.domain_a == network.domain_b || network.port == 0) {
    throw std::runtime_error{"no two free DDS domains, or no free UDP port, on this host"};
  }
  return network;
}

/// A folder that is removed at the end of the demo.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = std::filesystem::temp_directory_path() / "trestle-demo-XXXXXX";
    if (mkdtemp(pattern.data()) == nullptr) {
      throw std::system_error{errno, std::generic_category(), "cannot make the folder " + pattern};
    }
    path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  [[nodiscard]] std::string write(const char* name, const std::string& text) const {
    const std::filesystem::path file = path_ / name;
    std::ofstream out{file};
    out << text;
    if (!out.flush()) {
      throw std::runtime_error{"cannot write " + file.string()};
    }
    return file;
  }

 private:
  std::filesystem::path path_;
};

class Demo {
 public:
  Demo(const DemoOptions& options, const DemoNetwork& network)
      : screen_{title(options, network), cli::is_terminal(STDOUT_FILENO), cli::colours_for(STDOUT_FILENO)} {
    const std::string domain_a = std::to_string(network.domain_a);
    const std::string domain_b = std::to_string(network.domain_b);
    const std::string fd = std::to_string(Child::report_fd);
    std::vector<std::string> bridge_a{"bridge", "--quiet", "--report-fd", fd,
                                      folder_->write("bridge_a.yaml", bridge_a_yaml(network))};
    if (options.console) {
      console_ = console_url(network);
      bridge_a.insert(bridge_a.end(), {"--console", fmt::format("127.0.0.1:{}", network.console)});
    }
    start(Process::bridge_a, options.program, bridge_a);
    start(Process::bridge_b, options.program,
          {"bridge", "--quiet", "--report-fd", fd, folder_->write("bridge_b.yaml", bridge_b_yaml(network))});
    start(Process::subscriber, options.program, {"demo-subscriber", "--domain", domain_b, "--report-fd", fd});
    std::vector<std::string> publisher{"demo-publisher",
                                       "--domain",
                                       domain_a,
                                       "--report-fd",
                                       fd,
                                       "--rate",
                                       fmt::format("{}", options.rate_hz)};
    for (const std::string& input : options.inputs) {
      publisher.insert(publisher.end(), {"--input", input});
    }
    start(Process::publisher, options.program, publisher);
  }

  void run(const DemoOptions& options) {
    wait(options.discovery_limit, [&] { return figures_.discovered(); });
    if (figures_.discovered() && fault_.empty()) {
      folder_.reset();  // the bridges have read their configurations by now
      if (!console_.empty()) {
        open_in_browser(console_);
      }
      if (options.duration) {
        wait(*options.duration, [] { return false; });
      } else {
        while (fault_.empty() && stops_ == 0) {
          wait(1h, [] { return false; });
        }
      }
    }
    finish(options.stop_limit);
  }

  /// Empty if there was no fault.
  [[nodiscard]] std::string fault() const { return fault_.empty() ? figures_.fault() : fault_; }
  [[nodiscard]] const Figures& figures() const noexcept { return figures_; }

  void show_end() {
    screen_.finish(figures_, fault());
    if (!fault().empty()) {
      for (const auto& child : children_) {
        if (const std::string output = child->last_output(); !output.empty()) {
          std::printf("\nlast output of %s:\n%s", child->name().c_str(), output.c_str());
        }
      }
    }
  }

 private:
  static std::string title(const DemoOptions& options, const DemoNetwork& network) {
    return fmt::format(
               "Live lidar clouds ({}), {:g} a second:\n"
               "  publisher --DDS domain {}--> bridge A {} --SOME/IP--> bridge B {} --DDS domain "
               "{}--> subscriber\n",
               options.inputs.empty() ? "synthetic scene" : fmt::format("{} files", options.inputs.size()),
               options.rate_hz, network.domain_a, network.address_a, network.address_b, network.domain_b) +
           (options.console ? fmt::format("  console of bridge A: {}\n", console_url(network)) : "");
  }
  static std::string console_url(const DemoNetwork& network) {
    return fmt::format("http://127.0.0.1:{}/", network.console);
  }

  void start(Process process, const std::string& program, const std::vector<std::string>& arguments) {
    children_[static_cast<std::size_t>(process)] =
        std::make_unique<Child>(to_string(process), program, arguments);
  }
  [[nodiscard]] Child& child(Process process) { return *children_[static_cast<std::size_t>(process)]; }

  /// Serves all processes until `done`, a fault, a request to stop, or the end of the time.
  void wait(std::chrono::nanoseconds limit, const std::function<bool()>& done) {
    const std::int64_t until = monotonic_ns() + limit.count();
    const int stops = stops_;
    while (!done() && fault_.empty() && stops_ == stops) {
      const std::int64_t now = monotonic_ns();
      if (now >= until) {
        return;
      }
      serve(std::min<std::int64_t>(until - now, std::chrono::nanoseconds{100ms}.count()));
    }
  }

  void serve(std::int64_t timeout_ns) {
    std::vector<pollfd> files{{signals_.fd(), POLLIN, 0}};
    for (const auto& each : children_) {
      files.push_back({each->reports(), POLLIN, 0});  // poll() ignores -1
      files.push_back({each->output(), POLLIN, 0});
    }
    poll(files.data(), files.size(), static_cast<int>((timeout_ns + 999'999) / 1'000'000));
    while (const auto signal = signals_.next()) {
      stops_ += *signal == SIGCHLD ? 0 : 1;
    }
    read_all();
    for (const auto& each : children_) {
      if (each->ended()) {
        read(*each);  // its last output
        if (fault_.empty()) {
          fault_ = each->fault();
        }
      }
    }
    screen_.update(figures_, monotonic_ns());
  }

  void read(Child& child) {
    child.read_output([&](std::string_view line) {
      if (!finishing_) {  // at the end the bridges print their counters
        screen_.log(fmt::format("{}: {}", child.name(), line));
      }
    });
  }

  void read_all() {
    const std::int64_t now = monotonic_ns();
    for (std::size_t i = 0; i < children_.size(); ++i) {
      children_[i]->read_reports(
          [&](std::string_view line) { figures_.on_line(static_cast<Process>(i), line, now); });
      read(*children_[i]);
    }
    for (const std::string& line : figures_.take_log()) {
      screen_.log(line);
    }
  }

  /// Ends the processes in the order of the data flow, so that nothing is lost on the way.
  void finish(std::chrono::milliseconds limit) {
    finishing_ = true;
    const bool was_well = fault_.empty();
    child(Process::publisher).stop();
    wait(limit, [&] { return child(Process::publisher).ended(); });
    wait(std::min<std::chrono::milliseconds>(limit, 2s),
         [&] { return figures_.outstanding() == figures_.counts().refused; });
    child(Process::subscriber).stop();
    wait(limit, [&] { return child(Process::subscriber).ended(); });
    child(Process::bridge_b).stop();
    child(Process::bridge_a).stop();
    const auto all_ended = [&] {
      return std::ranges::all_of(children_, [](const auto& each) { return each->ended(); });
    };
    wait(limit, all_ended);
    read_all();
    for (const auto& each : children_) {
      if (!each->ended()) {
        each->kill();
        if (was_well && fault_.empty() && stops_ < 2) {
          fault_ = each->name() + " did not end when it was asked to";
        }
      }
    }
  }

  std::optional<TemporaryFolder> folder_{std::in_place};
  cli::Signals signals_{SIGINT, SIGTERM, SIGCHLD};
  Screen screen_;
  Figures figures_;
  std::array<std::unique_ptr<Child>, process_count> children_;
  std::string console_;  ///< its address; empty: there is none
  std::string fault_;    ///< of a process
  int stops_ = 0;        ///< how often somebody has asked to end
  bool finishing_ = false;
};

std::string bridge_yaml(const char* which, const std::string& address, std::uint32_t domain,
                        const char* direction, std::uint16_t instance) {
  return fmt::format(R"(# Bridge {}.
someip: {{address: {}}}
dds: {{domain: {}, interfaces: [127.0.0.1]}}
routes:
  - topic: /points
    type: sensor_msgs/msg/PointCloud2
    direction: {}
    service: 0x1111
    instance: {}
    eventgroup: 0x0001
    event: 0x8001
)",
                     which, address, domain, direction, instance);
}

}  // namespace

std::string bridge_a_yaml(const DemoNetwork& network) {
  return bridge_yaml("A of the demo: clouds from DDS to SOME/IP", network.address_a, network.domain_a,
                     "dds_to_someip", network.instance) +
         fmt::format("    port: {}\n", network.port);
}

std::string bridge_b_yaml(const DemoNetwork& network) {
  return bridge_yaml("B of the demo: clouds from SOME/IP to DDS", network.address_b, network.domain_b,
                     "someip_to_dds", network.instance);
}

int run_demo(const DemoOptions& options) {
  // Opened first: a file that cannot be written should not cost a whole run.
  std::ofstream json;
  if (!options.json_file.empty()) {
    json.open(options.json_file);
    if (!json) {
      throw std::system_error{errno, std::generic_category(), "cannot write " + options.json_file};
    }
  }
  Demo demo{options, choose_network()};
  demo.run(options);
  demo.show_end();
  const std::string fault = demo.fault();
  if (json.is_open()) {
    nlohmann::ordered_json figures = demo.figures().to_json();
    figures["ok"] = fault.empty();
    figures["fault"] = fault;
    json << figures.dump(2) << "\n";
    if (!json.flush()) {
      throw std::runtime_error{"cannot write " + options.json_file};
    }
  }
  return fault.empty() ? cli::exit_ok : cli::exit_failure;
}

}  // namespace trestle::measure::demo
