#include "bridge/measure/demo/demo.hpp"

#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <thread>

#include "bridge/carry/config/load.hpp"
#include "bridge/measure/demo/child.hpp"

/// The orchestrator with a shell script in the place of the program: no DDS, no SOME/IP.
namespace trestle::test::demo_test {
namespace {

using namespace measure::demo;
using namespace std::chrono_literals;
using testing::HasSubstr;

/// Reports what the four processes would for clouds that all arrive, until it is asked to end. SPECIAL comes
/// first: it can do otherwise for one of them.
const std::string script = R"(#!/usr/bin/python3 -IS
import os, signal, sys, time
command = sys.argv[1]
with open('HERE/pids', 'a') as pids:
    pids.write(f'{os.getpid()}\n')

def report(**event):
    fields = ('"%s":%s' % (name, ('"%s"' % value if type(value) is str else str(value).lower())) for name, value in event.items())
    os.write(3, ('{' + ','.join(fields) + '}\n').encode())

def end(*_):
    sys.exit(0)

signal.signal(signal.SIGINT, end)
SPECIAL
if command == 'bridge':
    if 'bridge_a' in sys.argv[5] and not os.path.exists(sys.argv[5]):
        sys.exit(9)
    report(event='carried', route='/points', direction='dds_to_someip', session=1, before_ns=1, after_ns=2, bytes=3)
    while True:
        signal.pause()
report(event='matched', count=1)
if command == 'demo-publisher':
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])  # not between what it reports and what it sends
    stamp = 0
    while True:
        stamp += 1
        report(event='published', stamp_ns=stamp, checksum=7 * stamp, bytes=1000, time_ns=time.monotonic_ns())
        with open('HERE/sent', 'a') as sent:
            sent.write(f'{stamp}\n')
        if signal.sigtimedwait([signal.SIGINT], 0.02):
            end()
with open('HERE/sent', 'a+') as sent:
    sent.seek(0)
    partial = ''
    while True:
        partial += sent.readline()
        if not partial.endswith('\n'):
            time.sleep(0.005)
            continue
        stamp = int(partial)
        partial = ''
        report(event='received', stamp_ns=stamp, checksum=7 * stamp if INTACT else 5, bytes=1000,
               time_ns=time.monotonic_ns())
)";

class DemoProcesses : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path{testing::TempDir()} /
              ("demo_test_" + std::to_string(getpid()));  // that nobody has who runs the same beside it
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  struct Outcome {
    int status = -1;
    std::string output;
    nlohmann::json figures;
  };

  /// Runs the demo in a process of its own, as it wants to be alone with signals and threads.
  Outcome run(const std::string& special, const char* intact = "True", int signal = 0) {
    std::string text = script;
    for (const auto& [name, value] :
         {std::pair{"SPECIAL", special}, {"INTACT", intact}, {"HERE", folder_.string()}}) {
      for (std::size_t at = 0; (at = text.find(name)) != std::string::npos;) {
        text.replace(at, std::string_view{name}.size(), value);
      }
    }
    const std::filesystem::path program = folder_ / "program";
    std::ofstream{program} << text;
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    DemoOptions options;
    options.program = program;
    options.json_file = folder_ / "figures.json";
    options.discovery_limit = discovery_limit_;
    options.stop_limit = stop_limit_;
    if (signal == 0) {
      options.duration = 1s;
    }
    const pid_t demo = fork();
    if (demo == 0) {
      if (std::freopen((folder_ / "output").c_str(), "w", stdout) == nullptr) {
        _exit(99);
      }
      const int status = run_demo(options);
      std::fflush(stdout);
      _exit(status);
    }
    if (signal != 0) {
      wait_for_clouds();
      kill(demo, signal);
    }
    int status = 0;
    waitpid(demo, &status, 0);
    Outcome outcome;
    outcome.status = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
    std::ifstream output{folder_ / "output"};
    outcome.output.assign(std::istreambuf_iterator<char>{output}, {});
    std::ifstream figures{folder_ / "figures.json"};
    outcome.figures = nlohmann::json::parse(figures, nullptr, false);
    return outcome;
  }

  /// Until the demo says, in one of the lines that it prints every two seconds, that it has sent some.
  void wait_for_clouds() {
    for (int i = 0; i < 1500; ++i) {
      std::ifstream output{folder_ / "output"};
      const std::string text{std::istreambuf_iterator<char>{output}, {}};
      constexpr std::string_view sent = " s  sent ";
      for (auto at = text.find(sent); at != std::string::npos; at = text.find(sent, at + 1)) {
        if (text.find_first_of("123456789", at + sent.size()) == at + sent.size()) {
          return;
        }
      }
      std::this_thread::sleep_for(20ms);
    }
    ADD_FAILURE() << "no cloud was sent";
  }

  /// How many clouds the publisher has noted.
  int sent() {
    std::ifstream lines{folder_ / "sent"};
    int count = 0;
    for (std::string line; std::getline(lines, line);) {
      ++count;
    }
    return count;
  }

  /// How many of those of the four processes that came so far are there still, zombies included.
  int left_over() {
    std::ifstream pids{folder_ / "pids"};
    int count = 0;
    for (pid_t pid = 0; pids >> pid;) {
      count += kill(pid, 0) == 0 ? 1 : 0;
    }
    return count;
  }

  std::filesystem::path folder_;
  std::chrono::milliseconds discovery_limit_{30s};  // ample: sanitizers and a busy machine make all this slow
  std::chrono::milliseconds stop_limit_{30s};
};

TEST_F(DemoProcesses, EndByThemselvesAndWell) {
  const Outcome outcome = run("");
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("good: "));
  EXPECT_EQ(outcome.figures["ok"], true);
  EXPECT_GE(outcome.figures["clouds"]["sent"], 1);
  EXPECT_LE(outcome.figures["clouds"]["sent"], sent());  // the last may come too late to count
  EXPECT_EQ(outcome.figures["clouds"]["corrupt"], 0);
  EXPECT_EQ(outcome.figures["clouds"]["lost"], 0);
  EXPECT_EQ(left_over(), 0);
}

TEST_F(DemoProcesses, EndWellOnCtrlC) {
  const Outcome outcome = run("", "True", SIGINT);
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("good: "));
  EXPECT_EQ(left_over(), 0);
}

TEST_F(DemoProcesses, FailWhenACloudIsDamaged) {
  const Outcome outcome = run("", "False");
  EXPECT_EQ(outcome.status, 1) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("failed: "));
  EXPECT_THAT(outcome.output, HasSubstr("were not what was sent"));
  EXPECT_EQ(outcome.figures["ok"], false);
  EXPECT_EQ(left_over(), 0);
}

TEST_F(DemoProcesses, FailWithTheWordsOfTheOneThatDies) {
  const Outcome outcome = run(R"(if command == 'demo-subscriber':
    sys.exit('error: no memory for DDS'))");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.output, HasSubstr("failed: subscriber ended with exit status 1"));
  EXPECT_THAT(outcome.output, HasSubstr("error: no memory for DDS"));
  EXPECT_EQ(outcome.figures["fault"], "subscriber ended with exit status 1");
  EXPECT_EQ(left_over(), 0);
}

TEST_F(DemoProcesses, FailWhenOneIsKilled) {
  const Outcome outcome = run(R"(if command == 'bridge':
    os.kill(os.getpid(), signal.SIGSEGV))");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.output, HasSubstr("was ended by signal 11"));
  EXPECT_EQ(left_over(), 0);
}

TEST_F(DemoProcesses, FailWhenOneEndsTooEarlyThoughWell) {
  const Outcome outcome = run(R"(if command == 'demo-publisher':
    report(event='matched', count=1)
    sys.exit(0))");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.output, HasSubstr("failed: publisher ended by itself"));
  EXPECT_EQ(left_over(), 0);
}

TEST_F(DemoProcesses, FailWhenOneDoesNotEnd) {
  stop_limit_ = 200ms;
  const Outcome outcome = run(R"(if command == 'bridge':
    signal.signal(signal.SIGINT, signal.SIG_IGN))");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.output, HasSubstr("did not end when it was asked to"));
  EXPECT_EQ(left_over(), 0);
}

TEST_F(DemoProcesses, FailWhenDiscoveryTakesTooLong) {
  discovery_limit_ = 6s;  // in which the others have found each other
  const Outcome outcome = run(R"(if command == 'demo-subscriber':
    signal.pause())");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.output,
              HasSubstr("failed: discovery did not complete: subscriber and bridge B have not found "
                        "each other over DDS"));
  EXPECT_EQ(left_over(), 0);
}

TEST_F(DemoProcesses, DoNotOutliveADemoThatIsKilled) {
  const Outcome outcome = run("", "True", SIGKILL);
  EXPECT_EQ(outcome.status, 1000 + SIGKILL);
  for (int i = 0; i < 3000 && left_over() > 0; ++i) {
    std::this_thread::sleep_for(20ms);  // init takes them over and buries them
  }
  EXPECT_EQ(left_over(), 0);
}

TEST(DemoChild, SaysWhenItsProgramIsNotThere) {
  Child child{"publisher", "/no/such/program", {"x"}};
  for (int i = 0; i < 6000 && !child.ended(); ++i) {
    std::this_thread::sleep_for(10ms);
  }
  child.read_output({});
  EXPECT_EQ(child.fault(), "publisher ended with exit status 127");
  EXPECT_EQ(child.last_output(), "  No such file or directory\n");
}

TEST(DemoConfigurations, AreGood) {
  const DemoNetwork network{.domain_a = 41, .domain_b = 42, .port = 40001};
  for (const std::string& text : {bridge_a_yaml(network), bridge_b_yaml(network)}) {
    const auto loaded = carry::parse_config(text, "demo.yaml");
    ASSERT_TRUE(loaded.has_value()) << to_string(loaded.error().front());
    EXPECT_TRUE(loaded->warnings.empty());
  }
}

}  // namespace
}  // namespace trestle::test::demo_test
