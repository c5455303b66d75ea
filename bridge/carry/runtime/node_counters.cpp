#include "bridge/carry/runtime/node_counters.hpp"

#include <utility>

namespace trestle::carry {

void append_counters(std::vector<CounterGroup>& groups, const sd::Node& node) {
  using enum Counter::Kind;
  const sd::NodeCounters all = node.counters();
  const auto sender = node.sender_counters();
  groups.push_back({"SOME/IP",
                    {{"datagrams_received", all.datagrams},
                     {"events_received", all.events},
                     {"datagrams_sent", sender.datagrams},
                     {"messages_sent", sender.messages},
                     {"calls_answered_with_an_error", all.requests_answered},
                     {"answers_refused", all.answers_refused, loss},
                     {"answers_to_silent", all.answers_to_silent, loss},
                     {"repeated_values_refused", all.repeated_values_refused, loss},
                     {"unreachable_ignored", all.unreachable_ignored},
                     {"malformed", all.malformed, loss},
                     {"wrong_version", all.wrong_version, loss},
                     {"unexpected", all.unexpected, loss},
                     {"unknown_sender", all.unknown_sender, loss},
                     {"queue_full", sender.queue_full, loss},
                     {"slow_subscriber", sender.overtaken, loss},
                     {"refused_by_system", sender.refused, loss},
                     {"abandoned", sender.abandoned, loss},
                     {"bad_return_code", all.bad_return_code, loss},
                     {"e2e_not_protected", all.e2e_not_protected, loss},
                     {"receive_buffer_full", all.overflowed, loss}}});
  const auto server = node.tcp_server_counters();
  const auto client = node.tcp_client_counters();
  auto streams = server.streams;
  streams += client.streams;
  groups.push_back({"SOME/IP over TCP",
                    {{"messages_received", streams.received.messages},
                     {"messages_sent", streams.messages_sent},
                     {"accepted", server.accepted},
                     {"connected", client.connections},
                     {"failed_attempts", client.failed_attempts},
                     {"closed_as_idle", server.idle},
                     {"refused", server.refused, loss},
                     {"not_accepted", server.not_accepted, loss},
                     {"gave_way", server.gave_way, loss},
                     {"no_memory", streams.no_memory, loss},
                     {"bad_framing", server.bad_framing, loss},
                     {"timed_out", streams.timed_out, loss},
                     {"queue_full", streams.queue_full, loss},
                     {"slow_subscriber", streams.overtaken, loss},
                     {"not_connected", client.not_connected, loss}}});
  const someip::TpCounters tp = node.reassembly_counters();
  CounterGroup segments{"SOME/IP-TP",
                        {{"segments_received", tp.segments}, {"messages_received", tp.messages}}};
  for (std::size_t i = 0; i < someip::tp_drop_count; ++i) {
    segments.counters.push_back({to_string(static_cast<someip::TpDrop>(i)), tp.drops[i], loss});
  }
  groups.push_back(std::move(segments));
  const sd::SdCounters& sd = node.discovery_counters();
  groups.push_back({"SOME/IP-SD",
                    {{"datagrams_received", sd.datagrams_received},
                     {"datagrams_sent", sd.datagrams_sent},
                     {"entries_sent", sd.entries_sent},
                     {"nacks_sent", sd.nacks_sent},
                     {"reboots_detected", sd.reboots_detected},
                     {"down", sd.dropped_down, loss},
                     {"own_echoes", sd.dropped_own},
                     {"source", sd.dropped_source, loss},
                     {"not_sd", sd.dropped_not_sd, loss},
                     {"malformed", sd.dropped_malformed, loss},
                     {"no_room", sd.ignored_no_room, loss},
                     {"too_many", sd.ignored_too_many, loss},
                     {"too_many_reboots", sd.dropped_reboots, loss},
                     {"duplicates", sd.dropped_duplicates},
                     {"displaced", sd.displaced, loss},
                     {"unknown_type", sd.ignored_unknown_type, loss},
                     {"wrong_transport", sd.ignored_wrong_transport, loss},
                     {"unknown_subscriptions", sd.ignored_unknown_subscriptions, loss},
                     {"bad_options", sd.ignored_bad_options, loss},
                     {"foreign_endpoints", sd.ignored_foreign_endpoints, loss},
                     {"configurations_cut", sd.configurations_cut, loss},
                     {"lost_events", sd.lost_events, loss},
                     {"subscribed_anew", sd.silences},
                     {"offered_twice", all.offered_twice, loss},
                     {"conflicting_offer", sd.ignored_conflicting_offer, loss},
                     {"unexpected_ack", sd.ignored_unexpected_ack, loss},
                     {"unsendable", sd.unsendable_entries, loss},
                     {"not_sent", all.discovery_not_sent, loss},
                     {"waited_to_be_sent", all.discovery_waited},
                     {"not_sent_no_room", all.discovery_no_room, loss},
                     {"not_sent_in_time", all.discovery_outdated, loss}}});
}

}  // namespace trestle::carry
