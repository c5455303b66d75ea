#include "bridge/console/viewers.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <deque>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "bridge/console/acknowledged.hpp"
#include "bridge/console/foxglove.hpp"
#include "bridge/console/give_way.hpp"
#include "bridge/console/inbox.hpp"
#include "bridge/console/viewer.hpp"
#include "bridge/web/server.hpp"

namespace trestle::console {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

/// How often it is asked which routes there are, while somebody looks.
constexpr std::chrono::seconds refresh_every{1};
/// So many routes are begun or ended to be followed in one turn of the bridge, and so much time lies between
/// two of these: a viewer that changes its mind all the time costs the bridge little.
constexpr std::size_t changed_at_once = 32;
constexpr std::chrono::milliseconds change_every{20};
/// What it took the bridge some time to tell of routes is kept so long after the last viewer has gone: those
/// that come again and again cost it little.
constexpr std::chrono::seconds remember_for{60};
/// A viewer has gone that answers no ping for so long, and takes nothing either: on a slow link a large
/// message takes longer, and the ping comes after it.
constexpr std::chrono::seconds patience{30};

/// A new one each time.
std::string session_name() {
  return fmt::format("{}-{}", ::getpid(),
                     std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds{1});
}

}  // namespace

/// What lies on the thread of the bridge.
struct Viewers::Feed {
  ViewerSources sources;
  std::map<std::uint64_t, std::shared_ptr<void>> followed{};  ///< by route
};

/// What lies on the thread of the viewers, but for what says something else.
class Viewers::State {
 public:
  State(asio::io_context& bridge, std::weak_ptr<Feed> feed) : bridge_{bridge}, feed_{std::move(feed)} {}
  ~State() {
    io_.stop();
    if (thread_.joinable()) {
      thread_.join();
    }
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  /// On the bridge's thread.
  void take(web::Upgrade upgrade) {
    tcp::socket socket{io_};
    error_code error;
    socket.assign(upgrade.is_v6 ? tcp::v6() : tcp::v4(), upgrade.descriptor, error);
    if (error) {
      ::close(upgrade.descriptor);
      return;
    }
    if (!thread_.joinable()) {
      try {
        thread_ = std::thread{[this] {
          give_way();
          io_.run();
        }};
      } catch (const std::system_error&) {
        return;  // the system grants no more of them: this viewer is disconnected, and the bridge goes on
      }
    }
    ++open_;
    asio::post(io_, [this, upgrade = std::move(upgrade), socket = std::move(socket)]() mutable {
      begin(upgrade, std::move(socket));
    });
  }
  /// From any thread.
  [[nodiscard]] ViewerCounters counters() const noexcept {
    return {.viewers = open_,
            .sent = sent_,
            .slow = lost_[static_cast<std::size_t>(ViewerLoss::slow)],
            .too_large = lost_[static_cast<std::size_t>(ViewerLoss::too_large)],
            .unreadable = lost_[static_cast<std::size_t>(ViewerLoss::unreadable)],
            .malformed = malformed_};
  }

 private:
  /// The connection of one viewer.
  class Session : public std::enable_shared_from_this<Session> {
   public:
    Session(State& state, tcp::socket socket)
        : state_{state},
          stream_{std::move(socket)},
          alive_{stream_.get_executor()},
          viewer{foxglove::server_info("trestle bridge", state.session_name_)} {}

    void start(const web::Upgrade& upgrade) {
      stream_.set_option(websocket::stream_base::timeout{.handshake_timeout = patience,
                                                         .idle_timeout = websocket::stream_base::none(),
                                                         .keep_alive_pings = false});
      stream_.control_callback([this](auto&&...) { has_spoken_ = true; });
      stream_.set_option(websocket::stream_base::decorator(
          [protocol = std::string{foxglove::chosen_of(upgrade.request.protocols)}](
              websocket::response_type& response) {
            response.set(beast::http::field::sec_websocket_protocol, protocol);
          }));
      stream_.read_message_max(most_text_bytes);
      stream_.auto_fragment(false);  // else large messages leave in pieces of 4 KB
      received_ = upgrade.received;
      stream_.async_accept(asio::buffer(received_), [self = shared_from_this()](error_code error) {
        if (error) {
          return self->fail(error);
        }
        self->is_open_ = true;
        self->watch();
        self->read();
        self->flush();
      });
    }

    /// Sends what waits, a message at a time.
    void flush() {
      if (!is_open_ || is_writing_) {
        return;
      }
      auto next = viewer.next();
      if (!next) {
        return;
      }
      state_.count(*this);
      frame_ = std::move(*next);
      is_writing_ = true;
      stream_.text(frame_.is_text);
      std::array<asio::const_buffer, 2> buffers{asio::buffer(frame_.head), asio::const_buffer{}};
      if (frame_.bytes) {
        buffers[1] = asio::buffer(*frame_.bytes);
      }
      stream_.async_write(buffers, [self = shared_from_this()](error_code error, std::size_t) {
        self->is_writing_ = false;
        self->frame_ = {};
        if (error) {
          return self->fail(error);
        }
        self->flush();
      });
    }

    /// Ends the connection, and says why.
    void close(websocket::close_code code, const std::string& why) {
      if (!std::exchange(is_closing_, true)) {
        is_open_ = false;
        viewer.give_up();
        state_.follow_what_is_wanted();
        websocket::close_reason reason{code};
        reason.reason = why.substr(0, reason.reason.max_size());
        stream_.async_close(reason, [self = shared_from_this()](error_code) { self->end(); });
      }
    }

   private:
    /// Asks whether it is still there when it has neither said nor taken anything, and gives it up when there
    /// is no answer.
    void watch() {
      alive_.expires_after(patience / 2);
      alive_.async_wait([self = shared_from_this()](error_code error) {
        if (error || !self->is_open_) {
          return;
        }
        const auto taken =
            acknowledged_bytes(beast::get_lowest_layer(self->stream_).socket().native_handle());
        const bool has_taken = std::exchange(self->taken_, taken) != taken;
        if (std::exchange(self->has_spoken_, false) || has_taken) {
          self->is_asked_ = false;
        } else if (std::exchange(self->is_asked_, true)) {
          return self->end();
        } else if (!std::exchange(self->is_pinging_, true)) {
          self->stream_.async_ping({}, [self](error_code) { self->is_pinging_ = false; });
        }
        self->watch();
      });
    }

    void read() {
      stream_.async_read(
          in_, [self = shared_from_this()](error_code error, std::size_t) { self->on_read(error); });
    }
    void on_read(error_code error) {
      if (error) {
        return fail(error);
      }
      has_spoken_ = true;
      const auto data = in_.cdata();
      const std::string_view message{static_cast<const char*>(data.data()), data.size()};
      const auto result = stream_.got_text() ? viewer.on_text(message) : viewer.on_bytes(message);
      in_.consume(in_.size());
      if (!result) {
        ++state_.malformed_;
        return close(websocket::close_code::policy_error, result.error());
      }
      state_.follow_what_is_wanted();
      state_.push(*this);
      if (is_open_) {
        read();
      }
    }
    void fail(error_code error) {
      const bool is_theirs = error == websocket::condition::protocol_violation ||
                             error == websocket::error::message_too_big ||
                             error == websocket::error::buffer_overflow;
      state_.malformed_ += is_theirs ? 1 : 0;
      end();
    }
    void end() {
      is_open_ = false;
      alive_.cancel();
      state_.end(shared_from_this());
      beast::get_lowest_layer(stream_).close();  // last: who sees it knows that there is room for another
    }

    State& state_;
    websocket::stream<beast::tcp_stream> stream_;
    std::string received_{};
    beast::flat_buffer in_{};
    Viewer::Frame frame_{};
    asio::steady_timer alive_;
    std::uint64_t taken_ = 0;  ///< bytes, when it was last looked at
    bool has_spoken_ = true;   ///< since then
    bool is_asked_ = false;    ///< by a ping
    bool is_pinging_ = false;
    bool is_open_ = false;
    bool is_writing_ = false;
    bool is_closing_ = false;

   public:
    Viewer viewer;
    bool knows_channels = false;          ///< it has been told of those that there are
    std::uint64_t sent = 0;               ///< that were counted
    std::array<std::uint64_t, 3> lost{};  ///< likewise
  };

  /// A route, and its channels.
  struct Route {
    RouteForms forms;
    foxglove::Channel cdr;
    foxglove::Channel json;
  };

  void begin(const web::Upgrade& upgrade, tcp::socket socket) {
    error_code ignored;
    socket.set_option(tcp::no_delay{true}, ignored);
    auto session = std::make_shared<Session>(*this, std::move(socket));
    sessions_.insert(session);
    session->start(upgrade);
    refresh();
  }

  void end(const std::shared_ptr<Session>& session) {
    if (sessions_.erase(session) > 0) {
      count(*session);
      --open_;
      follow_what_is_wanted();
    }
    if (sessions_.empty()) {
      again_.expires_after(remember_for);
      again_.async_wait([this](error_code error) {
        if (!error && sessions_.empty()) {
          forget();
        }
      });
    }
  }

  /// Nobody looks: what is known of routes would only take memory. Numbers of channels are not used again.
  void forget() {
    routes_.clear();
    by_channel_.clear();
    topics_.clear();
    without_view_.clear();
    new_.clear();
  }

  /// Something waits for it.
  void push(Session& session) {
    count(session);
    session.flush();
    if (session.viewer.is_lost()) {
      session.close(websocket::close_code::try_again_later, "too much waits for you");
    }
  }

  void count(Session& session) {
    sent_ += session.viewer.sent() - std::exchange(session.sent, session.viewer.sent());
    for (std::size_t i = 0; i < lost_.size(); ++i) {
      lost_[i] += session.viewer.lost()[i] - std::exchange(session.lost[i], session.viewer.lost()[i]);
    }
  }

  // --- Which routes there are ---

  /// Has the bridge say it, unless it is doing so, or nobody wants to know.
  void refresh() {
    if (sessions_.empty() || std::exchange(is_refreshing_, true)) {
      return;
    }
    on_bridge(
        [this](Feed& feed) { asio::post(io_, [this, titles = feed.sources.titles()] { compare(titles); }); });
  }

  void compare(const std::vector<carry::RouteTitle>& titles) {
    std::set<std::uint64_t> there;
    std::ranges::transform(titles, std::inserter(there, there.end()), &carry::RouteTitle::id);
    std::vector<std::uint32_t> gone;
    std::erase_if(routes_, [&](const auto& one) {
      const bool is_gone = !there.contains(one.first);
      if (is_gone) {
        gone.insert(gone.end(), {one.second.cdr.id, one.second.json.id});
        topics_.erase(one.second.cdr.topic);
        topics_.erase(one.second.json.topic);
      }
      return is_gone;
    });
    std::erase_if(without_view_, [&](std::uint64_t one) { return !there.contains(one); });
    for (const carry::RouteTitle& one : titles) {
      if (!routes_.contains(one.id) && !without_view_.contains(one.id)) {
        unseen_.push_back(one);
      }
    }
    if (!gone.empty()) {
      for (const auto& session : sessions_) {
        if (session->knows_channels) {
          session->viewer.withdraw(gone);
          push(*session);
        }
      }
      follow_what_is_wanted();
    }
    for (const std::uint32_t channel : gone) {
      by_channel_.erase(channel);
    }
    look_at_the_next();
  }

  /// One after another: in between the bridge has other things to do.
  void look_at_the_next() {
    if (sessions_.empty()) {
      unseen_.clear();
    }
    if (unseen_.empty()) {
      return tell();
    }
    const carry::RouteTitle title = std::move(unseen_.front());
    unseen_.pop_front();
    on_bridge([this, title](Feed& feed) {
      // Made there, and given to this thread: what is compiled of types is copied nowhere.
      auto view = std::make_shared<std::optional<RouteView>>(feed.sources.view(title));
      asio::post(io_, [this, id = title.id, view] {
        if (*view) {
          add(id, std::move(**view));
        } else {
          without_view_.insert(id);
        }
        look_at_the_next();
      });
    });
  }

  void add(std::uint64_t id, RouteView view) {
    Route route{RouteForms{std::move(view)}, {}, {}};
    const carry::RouteTitle& title = route.forms.title();
    const std::string event = fmt::format("0x{:04x}/0x{:04x}", title.service, title.event);
    route.cdr = {.id = ++last_channel_,
                 .topic = unused(title.topic, fmt::format(" {}", event)),
                 .encoding = "cdr",
                 .schema_name = title.type,
                 .schema_encoding = "ros2msg",
                 .schema = route.forms.ros_schema()};
    route.json = {.id = ++last_channel_,
                  .topic = unused("/someip/" + event, fmt::format("/0x{:04x}", title.instance)),
                  .encoding = "json",
                  .schema_name = route.forms.payload_type(),
                  .schema_encoding = "jsonschema",
                  .schema = route.forms.json_schema()};
    by_channel_[route.cdr.id] = by_channel_[route.json.id] = id;
    new_.insert(new_.end(), {route.cdr, route.json});
    routes_.emplace(id, std::move(route));
  }

  /// Viewers show one channel of a name.
  std::string unused(const std::string& topic, const std::string& otherwise) {
    std::string name = topic;
    for (std::size_t number = 1; !topics_.insert(name).second; ++number) {
      name = topic + otherwise + (number == 1 ? "" : fmt::format(" ({})", number));
    }
    return name;
  }

  /// All that is new; to those who know of nothing yet, all.
  void tell() {
    std::vector<foxglove::Channel> all;
    for (const auto& [id, route] : routes_) {
      all.insert(all.end(), {route.cdr, route.json});
    }
    for (const auto& session : sessions_) {
      if (!session->knows_channels) {
        session->knows_channels = true;
        session->viewer.offer(all);
      } else if (!new_.empty()) {
        session->viewer.offer(new_);
      }
      push(*session);
    }
    new_.clear();
    is_refreshing_ = false;
    if (!sessions_.empty()) {
      again_.expires_after(refresh_every);
      again_.async_wait([this](error_code error) {
        if (!error) {
          refresh();
        }
      });
    }
  }

  // --- Their messages ---

  /// With one question to the bridge at a time, however often a viewer changes its mind, and of a few routes:
  /// in between the bridge has other things to do.
  void follow_what_is_wanted() {
    if (is_asking_) {
      return;
    }
    std::set<std::uint64_t> wanted;
    for (const auto& session : sessions_) {
      for (const std::uint32_t channel : session->viewer.wanted()) {
        if (const auto route = by_channel_.find(channel); route != by_channel_.end()) {
          wanted.insert(route->second);
        }
      }
    }
    std::vector<std::uint64_t> ended;
    std::ranges::set_difference(followed_, wanted, std::back_inserter(ended));
    ended.resize(std::min(ended.size(), changed_at_once));
    std::vector<std::uint64_t> begun;
    std::ranges::set_difference(wanted, followed_, std::back_inserter(begun));
    begun.resize(std::min(begun.size(), changed_at_once - ended.size()));
    if (ended.empty() && begun.empty()) {
      return;
    }
    for (const std::uint64_t id : ended) {
      followed_.erase(id);
    }
    followed_.insert(begun.begin(), begun.end());
    is_asking_ = true;
    on_bridge([this, ended = std::move(ended), begun = std::move(begun)](Feed& feed) {
      for (const std::uint64_t id : ended) {
        feed.followed.erase(id);
      }
      for (const std::uint64_t id : begun) {
        feed.followed[id] = feed.sources.follow(id, [this, id](const auto& message) {
          if (inbox_.add({id, message})) {
            asio::post(io_, [this] { distribute(); });
          }
        });
      }
      asio::post(io_, [this] {
        pause_.expires_after(change_every);
        pause_.async_wait([this](error_code) {
          is_asking_ = false;
          follow_what_is_wanted();
        });
      });
    });
  }

  void distribute() {
    Inbox::Content content = inbox_.take();
    for (const auto& [id, count] : content.lost) {
      if (const auto route = routes_.find(id); route != routes_.end()) {
        lose(route->second.cdr.id, ViewerLoss::slow, count);
        lose(route->second.json.id, ViewerLoss::slow, count);
      }
    }
    for (const Inbox::Message& message : content.messages) {
      if (const auto route = routes_.find(message.route); route != routes_.end()) {
        distribute(route->second, message.seen);
      }
    }
    for (const auto& session : sessions_) {
      push(*session);
    }
  }

  void distribute(Route& route, const std::shared_ptr<const carry::SeenMessage>& message) {
    if (is_wanted(route.cdr.id)) {
      send(route.cdr.id, *message, [&] { return route.forms.cdr(message); });
    }
    if (is_wanted(route.json.id)) {
      send(route.json.id, *message, [&] { return route.forms.json(*message); });
    }
  }

  template <typename Make>
  void send(std::uint32_t channel, const carry::SeenMessage& message, const Make& make) {
    if (message.bytes.size() != message.size) {
      return lose(channel, ViewerLoss::too_large, 1);
    }
    const auto bytes = make();
    if (!bytes) {
      return lose(channel, ViewerLoss::unreadable, 1, bytes.error());
    }
    for (const auto& session : sessions_) {
      session->viewer.add(channel, message.at_ns, *bytes);
    }
  }

  [[nodiscard]] bool is_wanted(std::uint32_t channel) const {
    return std::ranges::any_of(sessions_, [&](const auto& one) { return one->viewer.wants(channel); });
  }
  void lose(std::uint32_t channel, ViewerLoss reason, std::uint64_t count, const std::string& why = {}) {
    for (const auto& session : sessions_) {
      session->viewer.lose(channel, reason, count, why);
    }
  }

  /// Has something done on the thread of the bridge; not if this has ended meanwhile.
  template <typename Do>
  void on_bridge(Do what) {
    asio::post(bridge_, [feed = feed_, what = std::move(what)] {
      if (const auto still = feed.lock()) {
        what(*still);
      }
    });
  }

  asio::io_context& bridge_;
  const std::weak_ptr<Feed> feed_;
  const std::string session_name_ = session_name();
  std::atomic<std::size_t> open_ = 0;
  std::atomic<std::uint64_t> sent_ = 0;
  std::array<std::atomic<std::uint64_t>, 3> lost_{};
  std::atomic<std::uint64_t> malformed_ = 0;
  Inbox inbox_;
  asio::io_context io_{1};
  const asio::executor_work_guard<asio::io_context::executor_type> work_ = asio::make_work_guard(io_);
  asio::steady_timer again_{io_};  ///< asks for routes; or forgets them
  asio::steady_timer pause_{io_};  ///< between two changes of what is followed
  std::set<std::shared_ptr<Session>> sessions_;
  bool is_refreshing_ = false;
  bool is_asking_ = false;                ///< the bridge to follow something else
  std::deque<carry::RouteTitle> unseen_;  ///< routes of which only the title is known
  std::set<std::uint64_t> without_view_;  ///< routes that cannot be shown
  std::map<std::uint64_t, Route> routes_;
  std::map<std::uint32_t, std::uint64_t> by_channel_;
  std::set<std::string> topics_;        ///< of channels
  std::vector<foxglove::Channel> new_;  ///< of which nobody has been told
  std::uint32_t last_channel_ = 0;
  std::set<std::uint64_t> followed_;  ///< routes that the bridge was asked to show
  std::thread thread_;
};

Viewers::Viewers(asio::io_context& bridge, ViewerSources sources)
    : feed_{std::make_shared<Feed>(Feed{std::move(sources)})},
      state_{std::make_unique<State>(bridge, feed_)} {}

Viewers::~Viewers() {
  feed_.reset();  // first: nothing comes from the bridge any more
}

void Viewers::take(web::Upgrade upgrade) {
  state_->take(std::move(upgrade));
}

ViewerCounters Viewers::counters() const noexcept {
  return state_->counters();
}

}  // namespace trestle::console
