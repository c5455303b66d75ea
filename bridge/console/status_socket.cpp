#include "bridge/console/status_socket.hpp"

#include <unistd.h>

#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <utility>

#include "bridge/console/fresh_text.hpp"
#include "bridge/console/private_socket.hpp"
#include "bridge/console/status_place.hpp"

namespace trestle::console {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;
using Protocol = asio::local::stream_protocol;
using Text = std::shared_ptr<const std::string>;

}  // namespace

class StatusSocket::Implementation : public std::enable_shared_from_this<Implementation> {
 public:
  Implementation(asio::io_context& io, const std::filesystem::path& folder, std::function<std::string()> text)
      : io_{io},
        path_{folder / socket_name(::getpid())},
        acceptor_{listen_for_user(io, path_, most_clients)},
        wait_{io},
        text_{std::move(text)} {}
  ~Implementation() { ::unlink(path_.c_str()); }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  void accept() {
    if (accepting_ || clients_ >= most_clients || !acceptor_.is_open()) {
      return;
    }
    accepting_ = true;
    acceptor_.async_accept([weak = weak_from_this()](error_code error, Protocol::socket client) {
      const auto self = weak.lock();
      if (!self || !self->acceptor_.is_open()) {
        return;
      }
      self->accepting_ = false;
      if (error) {
        self->accept_later();
        return;
      }
      ++self->clients_;
      std::make_shared<Client>(std::move(client), self, self->text_.now())->answer();
      self->accept();
    });
  }
  void stop() {
    error_code ignored;
    acceptor_.close(ignored);
    wait_.cancel();
  }
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  /// Who has connected.
  class Client : public std::enable_shared_from_this<Client> {
   public:
    Client(Protocol::socket socket, const std::shared_ptr<Implementation>& owner, Text text)
        : socket_{std::move(socket)},
          patience_{socket_.get_executor()},
          owner_{owner},
          text_{std::move(text)} {}
    ~Client() {
      if (const auto owner = owner_.lock()) {
        --owner->clients_;
        asio::post(owner->io_, [owner] { owner->accept(); });
      }
    }
    Client(const Client&) = delete;
    Client& operator=(const Client&) = delete;

    void answer() {
      patience_.expires_after(patience);
      patience_.async_wait([weak = weak_from_this()](error_code) {
        if (const auto self = weak.lock()) {
          error_code ignored;
          self->socket_.close(ignored);
        }
      });
      asio::async_write(socket_, asio::buffer(*text_),
                        [self = shared_from_this()](error_code, std::size_t) { self->patience_.cancel(); });
    }

   private:
    Protocol::socket socket_;
    asio::steady_timer patience_;
    std::weak_ptr<Implementation> owner_;
    Text text_;
  };

  // No descriptor is free, for instance.
  void accept_later() {
    wait_.expires_after(std::chrono::milliseconds{100});
    wait_.async_wait([weak = weak_from_this()](error_code error) {
      const auto self = weak.lock();
      if (self && !error) {
        self->accept();
      }
    });
  }

  asio::io_context& io_;
  const std::filesystem::path path_;
  Protocol::acceptor acceptor_;
  asio::steady_timer wait_;
  FreshText text_;
  std::size_t clients_ = 0;
  bool accepting_ = false;
};

StatusSocket::StatusSocket(boost::asio::io_context& io, const std::filesystem::path& folder,
                           std::function<std::string()> text)
    : implementation_{std::make_shared<Implementation>(io, folder, std::move(text))} {
  implementation_->accept();
}

StatusSocket::~StatusSocket() {
  implementation_->stop();
}

const std::filesystem::path& StatusSocket::path() const noexcept {
  return implementation_->path();
}

}  // namespace trestle::console
