#pragma once
#include <boost/asio/steady_timer.hpp>
#include <functional>

#include "bridge/measure/perf/perf_service.hpp"
#include "bridge/measure/perf/result.hpp"
#include "sd/net/node.hpp"

namespace trestle::measure::perf {

struct ClientOptions {
  someip::ServiceId service{};
  someip::InstanceId instance{};
  bool events = false;          ///< else calls
  EventPlan plan{};             ///< of events; of calls, `tcp`, `bytes` and the pacing of requests
  std::uint32_t in_flight = 1;  ///< calls at a time
  Duration warm_up{};
  Duration measured{};
  Duration patience{};  ///< for finding the service, and for whatever it is asked
};

/// Measures a service that a Server offers.
class Client {
 public:
  /// What has been seen so far, once a second.
  using Progress = std::function<void(const Result& result)>;
  /// Called once, with an empty `fault` when all went well.
  using Done = std::function<void(const std::string& fault)>;

  /// The Node outlives it.
  Client(sd::Node& node, const ClientOptions& options, Progress progress, Done done);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Complete when done, and without a fault.
  [[nodiscard]] const Result& result() const noexcept { return result_; }

 private:
  enum class Phase : std::uint8_t { finding, preparing, warming_up, measuring, stopping, over };
  using StatusHandler = void (Client::*)(const Status& status);

  void on_service(const sd::RemoteService& service, bool available);
  /// Asks for the server's status, again and again for as long as is left.
  void ask(someip::MethodId method, StatusHandler handler, Duration left);
  void compare_clocks();
  void on_clock(const Status& status);
  void begin();
  void start_events();
  void call();
  void on_answer(std::int64_t called_ns, const sd::CallResult& answer);
  void on_event(const someip::Message& message);
  void start_measuring(const Status& status);
  void stop_measuring();
  void finish(const Status& status);
  void end(const std::string& fault);
  void after(Duration delay, void (Client::*what)());
  void tick();
  void update_counts();

  sd::Node& node_;
  ClientOptions options_;
  Progress progress_;
  Done done_;
  Phase phase_ = Phase::finding;
  sd::RequirementId service_{};
  std::optional<sd::SubscriptionId> subscription_;
  boost::asio::steady_timer timer_;
  boost::asio::steady_timer limit_;
  Result result_;
  std::vector<std::byte> request_;

  // Clocks.
  unsigned samples_ = 0;
  std::int64_t asked_ns_ = 0;
  std::int64_t best_trip_ns_ = 0;
  std::int64_t offset_ns_ = 0;  ///< the server's clock less ours

  // The measured time.
  std::int64_t began_ns_ = 0;
  std::int64_t ended_ns_ = 0;
  Status server_before_;
  Status client_before_;
  Status client_after_;
  std::uint64_t first_event_ = 0;
  std::uint64_t last_event_ = 0;
  std::uint64_t since_acknowledged_ = 0;
};

}  // namespace trestle::measure::perf
