#include "someip/core/call_table.hpp"

#include <algorithm>
#include <cassert>

#include "someip/wire/enumerator_name.hpp"

namespace trestle::someip {

const char* to_string(AnswerDrop reason) noexcept {
  static constexpr std::array names{"not_an_answer", "wrong_version", "unknown",       "late",
                                    "after_cancel",  "duplicate",     "foreign_sender"};
  return enumerator_name<AnswerDrop::foreign_sender>(names, reason, "unknown reason");
}

CallTable::CallTable(std::span<CallSlot> slots, ClientId client, SessionId first) noexcept
    : slots_{slots}, client_{client}, sessions_{first} {
  // With slots for more than half of the Session IDs, the wrap to 1 could leave one that no session leads to.
  assert(!slots.empty() && slots.size() <= 0x8000);
}

std::optional<StartedCall> CallTable::start(const CallTarget& target, ServiceId service, MethodId method,
                                            std::uint8_t interface_version, Duration timeout,
                                            TimePoint now) noexcept {
  if (outstanding_ == slots_.size()) {
    ++counters_.refused;
    return std::nullopt;
  }
  // Some slot is free and the sessions lead to all of them, after at most one round and the wrap in it.
  SessionId session = sessions_.next();
  while (slot_of(session).state_ == CallSlot::State::outstanding) {
    session = sessions_.next();
  }
  CallSlot& slot = slot_of(session);
  slot.target_ = target;
  slot.header_ = {.service = service,
                  .method = method,
                  .client = client_,
                  .session = session,
                  .interface_version = interface_version,
                  .type = MessageType::request};
  slot.deadline_ = timeout < TimePoint::max() - now ? now + timeout : TimePoint::max();
  slot.generation_ = static_cast<std::uint16_t>(slot.generation_ == 0xffff ? 1 : slot.generation_ + 1);
  slot.state_ = CallSlot::State::outstanding;
  earliest_ = std::min(earliest_, slot.deadline_);
  ++outstanding_;
  slot.number_ = ++counters_.started;
  return StartedCall{handle_of(slot), slot.header_};
}

bool CallTable::awaits(const CallTarget& from, const Header& header) const noexcept {
  const MessageType type = without_tp(header.type);
  const CallSlot& slot = slot_of(header.session);
  return header.protocol == protocol_version &&
         (type == MessageType::response || type == MessageType::error) &&
         slot.state_ == CallSlot::State::outstanding && is_of(slot, header) && slot.target_ == from &&
         slot.header_.interface_version == header.interface_version;
}

bool CallTable::is_of(const CallSlot& slot, const Header& header) noexcept {
  return slot.header_.session == header.session && slot.header_.client == header.client &&
         slot.header_.service == header.service && slot.header_.method == header.method;
}

Result<CallAnswer, AnswerDrop> CallTable::on_answer(const CallTarget& from, const Header& header) noexcept {
  const auto drop = [this](AnswerDrop reason) {
    ++counters_.drops[static_cast<std::size_t>(reason)];
    return tl::unexpected{reason};
  };
  if (header.protocol != protocol_version) {
    return drop(AnswerDrop::wrong_version);
  }
  if (header.type != MessageType::response && header.type != MessageType::error) {
    return drop(AnswerDrop::not_an_answer);
  }
  // The flow chart checks versions before the session, but only the call knows them.  [feat_req_someip_718]
  CallSlot& slot = slot_of(header.session);
  if (slot.state_ == CallSlot::State::unused || !is_of(slot, header)) {
    return drop(AnswerDrop::unknown);
  }
  if (slot.target_ != from) {
    return drop(AnswerDrop::foreign_sender);
  }
  switch (slot.state_) {
    case CallSlot::State::answered:
      return drop(AnswerDrop::duplicate);
    case CallSlot::State::timed_out:
      return drop(AnswerDrop::late);
    case CallSlot::State::cancelled:
      return drop(AnswerDrop::after_cancel);
    case CallSlot::State::unused:
    case CallSlot::State::outstanding:
      break;
  }
  if (slot.header_.interface_version != header.interface_version) {
    return drop(AnswerDrop::wrong_version);
  }
  end(slot, CallSlot::State::answered);
  ++counters_.answered;
  // An ERROR with E_OK contradicts itself; it is certainly not a success.  [feat_req_someip_683]
  const bool contradicts = header.type == MessageType::error && header.return_code == ReturnCode::ok;
  const ReturnCode code = contradicts ? ReturnCode::not_ok : header.return_code;
  counters_.errors += code == ReturnCode::ok ? 0 : 1;
  return CallAnswer{handle_of(slot), code};
}

bool CallTable::cancel(CallHandle call) noexcept {
  if (call.index >= slots_.size()) {
    return false;
  }
  CallSlot& slot = slots_[call.index];
  if (slot.state_ != CallSlot::State::outstanding || slot.generation_ != call.generation) {
    return false;
  }
  end(slot, CallSlot::State::cancelled);
  ++counters_.cancelled;
  return true;
}

std::optional<TimePoint> CallTable::deadline() const noexcept {
  return outstanding_ == 0 || earliest_ == TimePoint::max() ? std::nullopt : std::optional{earliest_};
}

CallHandle CallTable::handle_of(const CallSlot& slot) const noexcept {
  return {static_cast<std::uint16_t>(&slot - slots_.data()), slot.generation_};
}

void CallTable::end(CallSlot& slot, CallSlot::State how) noexcept {
  slot.state_ = how;
  --outstanding_;
}

}  // namespace trestle::someip
