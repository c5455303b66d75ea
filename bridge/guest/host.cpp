#include "bridge/guest/host.hpp"

#include <unistd.h>

#include <algorithm>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/steady_timer.hpp>
#include <utility>
#include <vector>

#include "bridge/console/private_socket.hpp"
#include "bridge/console/status_place.hpp"
#include "bridge/guest/visit.hpp"

namespace trestle::guest {

namespace asio = boost::asio;
using boost::system::error_code;

class Host::Implementation : public std::enable_shared_from_this<Implementation> {
 public:
  Implementation(asio::io_context& io, const std::filesystem::path& folder)
      : path_{folder / console::guest_socket_name(::getpid())},
        acceptor_{console::listen_for_user(io, path_, most_guests)},
        wait_{io} {}
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  void accept();
  void open(sd::Node& node, const Endpoint& at, std::string configuration, Judge judge) {
    node_ = &node;
    household_->judge = std::move(judge);
    hello_ = {.process = static_cast<std::uint32_t>(::getpid()),
              .at = at,
              .configuration = std::move(configuration)};
  }
  void close();
  void stop() {
    close();
    error_code ignored;
    acceptor_.close(ignored);
    wait_.cancel();
    ::unlink(path_.c_str());
  }
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  [[nodiscard]] const HostCounters& counters() const noexcept { return household_->counters; }

 private:
  void accept_later() {
    wait_.expires_after(spacing);
    wait_.async_wait([weak = weak_from_this()](error_code error) {
      const auto self = weak.lock();
      if (self && !error) {
        self->accept();
      }
    });
  }
  void let_in(asio::local::stream_protocol::socket client);

  const std::filesystem::path path_;
  asio::local::stream_protocol::acceptor acceptor_;
  asio::steady_timer wait_;
  sd::Node* node_ = nullptr;
  Hello hello_;
  const std::shared_ptr<Household> household_ = std::make_shared<Household>();
  std::vector<std::weak_ptr<Visit>> visits_;
};

void Host::Implementation::accept() {
  if (!acceptor_.is_open()) {
    return;
  }
  acceptor_.async_accept(
      [weak = weak_from_this()](error_code error, asio::local::stream_protocol::socket client) {
        const auto self = weak.lock();
        if (!self || !self->acceptor_.is_open()) {
          return;
        }
        self->accept_later();
        if (!error && self->node_ != nullptr) {
          self->let_in(std::move(client));
        }
      });
}

void Host::Implementation::let_in(asio::local::stream_protocol::socket client) {
  std::vector<std::shared_ptr<Visit>> there;
  for (const std::weak_ptr<Visit>& one : visits_) {
    if (auto visit = one.lock(); visit && visit->is_connected()) {
      there.push_back(std::move(visit));
    }
  }
  visits_.assign(there.begin(), there.end());
  ++household_->counters.guests;
  if (visits_.size() >= most_connections) {  // of guests that do not even read why they are left
    ++household_->counters.guests_refused;
    return;
  }
  const auto visit = std::make_shared<Visit>(std::move(client), household_, *node_);
  visits_.push_back(visit);
  visit->begin(hello_,
               std::ranges::count_if(there, &Visit::is_served) < static_cast<std::ptrdiff_t>(most_guests));
}

void Host::Implementation::close() {
  for (const auto& one : std::exchange(visits_, {})) {
    if (const auto visit = one.lock()) {
      visit->end();
    }
  }
  node_ = nullptr;
}

Host::Host(asio::io_context& io, const std::filesystem::path& folder)
    : implementation_{std::make_shared<Implementation>(io, folder)} {
  implementation_->accept();
}

Host::~Host() {
  implementation_->stop();
}

void Host::open(sd::Node& node, const Endpoint& at, std::string configuration, Judge judge) {
  implementation_->open(node, at, std::move(configuration), std::move(judge));
}

void Host::close() {
  implementation_->close();
}

const std::filesystem::path& Host::path() const noexcept {
  return implementation_->path();
}

const HostCounters& Host::counters() const noexcept {
  return implementation_->counters();
}

}  // namespace trestle::guest
