#include <fmt/format.h>

#include "bridge/conform/replay/replay.hpp"
#include "someip/net/address_text.hpp"

/// TCP: Magic Cookies, and how many connections there are.
namespace trestle::conform {
namespace {

using someip::MessageType;
using namespace std::chrono_literals;

/// Of streams and connections.
constexpr std::size_t most_known = 50'000;
/// Between two cookies of one sender. The second is for those that come late.
constexpr auto longest_gap = 10s + 1s;

/// Whether the ids are those of a Magic Cookie.  [feat_req_someipids_530]
bool is_cookie(const someip::Header& header) {
  return value(header.service) == 0xffff && (value(header.method) == 0 || value(header.method) == 0x8000);
}

}  // namespace

void Replay::judge_cookie(const At& at) {
  const someip::Header& header = at.message.header;
  if (is_cookie(header)) {
    const bool of_client = value(header.method) == 0;
    const bool kept = at.message.payload.empty() && value(header.client) == 0xdead &&
                      value(header.session) == 0xbeef && header.protocol == 1 &&
                      header.interface_version == 1 && header.return_code == someip::ReturnCode::ok &&
                      header.type == (of_client ? MessageType::request_no_return : MessageType::notification);
    check(Rule::tcp_cookie, at, kept, "Magic Cookie",
          of_client ? "ff ff 00 00 00 00 00 08 de ad be ef 01 01 01 00"
                    : "ff ff 80 00 00 00 00 08 de ad be ef 01 01 02 00",
          "something else");
    if (last_cookie_.size() < most_known) {
      last_cookie_[at.place.flow] = at.place.time;
    }
  } else if (const auto last = last_cookie_.find(at.place.flow); last != last_cookie_.end()) {
    const auto since = at.place.time - last->second;
    check(Rule::tcp_cookie_interval, at, since <= longest_gap, "time since the last Magic Cookie",
          "10 s at most", fmt::format("{:.1f} s", std::chrono::duration<double>(since).count()));
  }
}

void Replay::judge_connection(const At& at) {
  const MessageType type = someip::without_tp(at.message.header.type);
  if (at.place.transport != Transport::tcp ||
      (type != MessageType::request && type != MessageType::request_no_return) ||
      connections_.size() >= most_known) {
    return;
  }
  const auto& [from, to] = at.place.flow;
  Ports& all = connections_[{from.address, to}];
  if (from.port != all.current) {
    check(Rule::tcp_one_connection, at, !all.takes_turns(from.port),
          "connections to " + someip::to_string(to), "1 at a time", "2 or more");
  }
}

}  // namespace trestle::conform
