// Property: whatever is called, answered, cancelled or lost, and whenever, each call ends exactly once, and
// never before its time without an answer; two calls that wait never have one Session ID; awaits() says what
// on_answer() does; and every number is counted once. A server answers a message at most once, to whom it
// came from, and never an answer or an event.
//
// Input: steps of a byte that says what happens, and its arguments.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>

#include "someip/core/call_table.hpp"
#include "someip/core/request_check.hpp"
#include "someip/wire/bytes.hpp"

using namespace trestle;
using namespace trestle::someip;
using namespace std::chrono_literals;

namespace {

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

class Client {
 public:
  explicit Client(ByteView input)
      : in_{input}, table_{slots_, ClientId{0x17}, SessionId{static_cast<std::uint16_t>(in_.u16() | 1U)}} {}

  void run() {
    while (!in_.rest().empty() && !in_.failed()) {
      step(in_.u8());
      require(table_.size() == waiting_.size() && table_.size() <= slots_.size());
      require(table_.deadline().has_value() == !waiting_.empty());
      const CallCounters& counted = table_.counters();
      require(counted.started == counted.answered + counted.timed_out + counted.cancelled + table_.size());
    }
    now_ += 1h;
    table_.on_time(now_, [this](CallHandle call) { ended(call, true); });
    require(waiting_.empty() && !table_.deadline());
  }

 private:
  struct Waiting {
    CallHandle call;
    CallTarget target;
    TimePoint deadline;
  };

  void step(std::uint8_t what) {
    switch (what % 8) {
      case 0:
      case 1:
        return start(in_.u8());
      case 2:
      case 3:
      case 4:
        return answer(in_.u8());
      case 5:
        now_ += std::chrono::milliseconds{in_.u16()};
        return table_.on_time(now_, [this](CallHandle call) { ended(call, true); });
      case 6:
        return table_.connection_lost(target(in_.u8()), [this](CallHandle call) { ended(call, false); });
      default:
        return cancel(in_.u8());
    }
  }

  static CallTarget target(std::uint8_t which) {
    return {.server = {IpAddress::v4(10, 0, 0, which & 1U), 30509},
            .transport = (which & 2U) != 0 ? Transport::tcp : Transport::udp};
  }

  void start(std::uint8_t which) {
    const Duration timeout = std::chrono::milliseconds{in_.u16()} + 1ms;
    const auto started = table_.start(target(which), ServiceId{0x1234}, MethodId{which}, 1, timeout, now_);
    require(started.has_value() == (waiting_.size() < slots_.size()));
    if (!started) {
      return;
    }
    require(value(started->header.session) != 0 && started->header.client == ClientId{0x17});
    require(!waiting_.contains(started->header.session));
    waiting_[started->header.session] = {started->call, target(which), now_ + timeout};
    sent_[sent_count_++ % sent_.size()] = started->header;
  }

  /// To one of the last calls, or nearly so.
  void answer(std::uint8_t which) {
    Header header = sent_[which % sent_.size()];
    header.type = MessageType{in_.u8()};
    header.return_code = ReturnCode{in_.u8()};
    const std::uint8_t from = in_.u8();
    const std::uint8_t flaw = in_.u8();
    if (flaw < 8) {
      header.session = SessionId{static_cast<std::uint16_t>(value(header.session) + flaw)};
    } else if (flaw == 8) {
      header.interface_version ^= 1U;
    } else if (flaw == 9) {
      header.client = ClientId{0x18};
    } else if (flaw == 10) {
      header.protocol = 2;
    }
    const bool awaited = table_.awaits(target(from), header);
    const auto ends = table_.on_answer(target(from), header);
    const bool is_answer = header.type == MessageType::response || header.type == MessageType::error;
    // Of segments it says that they are awaited; only the whole message ends the call.
    require(awaited == ends.has_value() || is_tp(header.type));
    require(!ends || is_answer);
    if (ends) {
      const auto known = waiting_.find(header.session);
      require(known != waiting_.end() && known->second.call == ends->call &&
              known->second.target == target(from));
      require(header.type != MessageType::error || ends->code != ReturnCode::ok);
      waiting_.erase(known);
    }
  }

  void cancel(std::uint8_t which) {
    const auto known =
        std::ranges::find_if(waiting_, [&](const auto& one) { return value(one.first) % 4 == which % 4; });
    if (known == waiting_.end()) {
      require(!table_.cancel({}));
      return;
    }
    const CallHandle call = known->second.call;
    require(table_.cancel(call) && !table_.cancel(call));
    waiting_.erase(known);
  }

  void ended(CallHandle call, bool by_time) {
    const auto known =
        std::ranges::find_if(waiting_, [&](const auto& one) { return one.second.call == call; });
    require(known != waiting_.end() && (!by_time || known->second.deadline <= now_));
    waiting_.erase(known);
  }

  ByteReader in_;
  std::array<CallSlot, 6> slots_{};
  CallTable table_;
  TimePoint now_{1000s};
  std::map<SessionId, Waiting> waiting_;
  std::array<Header, 8> sent_{};
  std::size_t sent_count_ = 0;
};

/// What a server makes of a header.
void serve(ByteReader in) {
  const Header received{.service = ServiceId{in.u16()},
                        .method = MethodId{in.u16()},
                        .client = ClientId{in.u16()},
                        .session = SessionId{in.u16()},
                        .protocol = in.u8(),
                        .interface_version = in.u8(),
                        .type = MessageType{in.u8()},
                        .return_code = ReturnCode{in.u8()}};
  const std::uint8_t known = in.u8();
  const std::uint8_t how = in.u8();
  const RequestTarget target{.service = (known & 1U) != 0,
                             .interface_version = (known & 2U) != 0,
                             .method = MethodKind{static_cast<std::uint8_t>(known >> 2U & 3U)}};
  const AnswerRules rules{.error_type = (how & 1U) != 0 ? MessageType::error : MessageType::response,
                          .answer_unknown_service = (how & 2U) != 0,
                          .answer_unknown_method = (how & 4U) != 0,
                          .answer_wrong_interface_version = (how & 8U) != 0,
                          .answer_wrong_protocol_version = (how & 16U) != 0,
                          .process_request_with_return_code = (how & 32U) != 0};
  const RequestCheck check = check_request(received, target, rules);
  const bool wants_answer = received.type == MessageType::request;
  require(!check.answer || (check.fault && without_tp(received.type) == MessageType::request));
  require(check.fault || (target.service && target.interface_version &&
                          target.method != MethodKind::unknown && received.protocol == protocol_version &&
                          (wants_answer || received.type == MessageType::request_no_return)));
  if (check.answer) {
    const Header& answer = *check.answer;
    require(answer.service == received.service && answer.method == received.method &&
            answer.client == received.client && answer.session == received.session);
    require(answer.protocol == protocol_version && answer.type == rules.error_type &&
            answer.return_code == *check.fault && answer.return_code != ReturnCode::ok);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const ByteView input = std::as_bytes(std::span{data, size});
  serve(ByteReader{input});
  Client{input}.run();
  return 0;
}
