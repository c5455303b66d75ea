// Property: someip::decode(), decode_tp() and sd::decode() find in a datagram what a plain decoder finds that
// was written from the specification alone: the same messages, segments, entries, references and options, and
// the same faults.
#include <algorithm>
#include <cstdlib>

#include "fuzz/plain_decoder.hpp"
#include "sd/wire/message.hpp"
#include "sd/wire/offer_options.hpp"
#include "someip/wire/header.hpp"
#include "someip/wire/tp.hpp"

using namespace trestle;
namespace plain = trestle::fuzz::plain;

namespace {

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

bool same(ByteView ours, const plain::Octets& theirs) {
  return std::ranges::equal(ours, std::as_bytes(std::span{theirs}));
}

void compare_header(const someip::Header& ours, const plain::PlainMessage& theirs) {
  require(value(ours.service) == theirs.service && value(ours.method) == theirs.method &&
          value(ours.client) == theirs.client && value(ours.session) == theirs.session);
  require(ours.protocol == theirs.protocol && ours.interface_version == theirs.interface_version &&
          static_cast<std::uint8_t>(ours.type) == theirs.type &&
          static_cast<std::uint8_t>(ours.return_code) == theirs.return_code);
}

void compare_segment(const someip::Message& ours, const plain::PlainMessage& theirs) {
  const auto segment = plain::read_segment(theirs);
  if (!someip::is_tp(ours.header.type)) {
    require(!segment);
    return;
  }
  const auto decoded = someip::decode_tp(ours);
  require(decoded.has_value() == segment.has_value());
  if (decoded) {
    require(decoded->header.offset == segment->offset && decoded->header.more == segment->more &&
            same(decoded->slice, segment->slice));
  }
}

void compare_endpoint(const sd::Option& ours, const plain::PlainOption& theirs) {
  const auto endpoint = sd::EndpointOption::decode(ours);
  const auto read = plain::read_endpoint(theirs);
  require(endpoint.has_value() == read.has_value());
  if (!endpoint) {
    return;
  }
  const IpAddress& address = endpoint->endpoint.address;
  require(address.v6 == (read->address.size() == 16) &&
          std::ranges::equal(std::span{address.bytes}.first(read->address.size()), read->address));
  const char role = endpoint->role == sd::EndpointRole::unicast     ? 'u'
                    : endpoint->role == sd::EndpointRole::multicast ? 'm'
                                                                    : 's';
  require(role == read->role && endpoint->endpoint.port == read->port &&
          static_cast<std::uint8_t>(endpoint->transport) == read->protocol);
}

void compare_configuration(const sd::Option& ours, const plain::PlainOption& theirs) {
  const auto items = plain::read_configuration(theirs.body);
  sd::ConfigurationCursor cursor{ours};
  std::size_t at = 0;
  while (const auto item = cursor.next()) {
    if (items) {
      require(at < items->size() && item->key == items->at(at).first && item->value == items->at(at).second);
    }
    ++at;
  }
  require(cursor.error().has_value() != items.has_value() && (!items || at == items->size()));
}

void compare_option(const sd::Option& ours, const plain::PlainOption& theirs) {
  require(static_cast<std::uint8_t>(ours.type) == theirs.type && same(ours.body, theirs.body));
  compare_endpoint(ours, theirs);
  require(find_fault(ours).has_value() != plain::is_good(theirs));
  if (ours.type == sd::OptionType::configuration) {
    compare_configuration(ours, theirs);
  }
  if (const auto balancing = sd::LoadBalancingOption::decode(ours)) {
    require(balancing->priority == plain::number(theirs.body, 1, 2) &&
            balancing->weight == plain::number(theirs.body, 3, 2));
  }
}

void compare_entry(const sd::SdMessage& message, const sd::Entry& ours, const plain::PlainEntry& theirs,
                   std::size_t options) {
  require(static_cast<std::uint8_t>(ours.type) == theirs.type && value(ours.service) == theirs.service &&
          value(ours.instance) == theirs.instance && ours.major == theirs.major && ours.ttl_s == theirs.ttl &&
          ours.tail == theirs.tail);
  const auto references = plain::references(theirs);
  require(ours.option_count() == references.size());
  for (std::size_t i = 0; i < references.size(); ++i) {
    const auto option = message.option_of(ours, i);
    require(option.has_value() == references[i] < options);
    if (option) {
      require(*option == message.option(references[i]));
    }
  }
}

void compare_discovery(const someip::Message& ours, const plain::PlainMessage& theirs) {
  require(sd::is_sd(ours.header) == plain::is_sd(theirs));
  const auto message = sd::decode(ours.payload);
  const auto read = plain::read_discovery(theirs.payload);
  require(message.has_value() == read.has_value());
  if (!message) {
    return;
  }
  require(message->flags() == read->flags && message->reserved() == read->reserved &&
          message->entry_count() == read->entries.size() && same(message->trailing(), read->trailing));
  for (std::size_t i = 0; i < read->entries.size(); ++i) {
    compare_entry(*message, message->entry(i), read->entries[i], read->options.size());
  }
  sd::OptionCursor cursor = message->options();
  std::size_t at = 0;
  while (const auto option = cursor.next()) {
    require(at < read->options.size());
    compare_option(*option, read->options[at++]);
  }
  require(at == read->options.size() && cursor.error().has_value() != read->options_are_whole);
  require(find_fault(*message).has_value() != plain::is_flawless(*read));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const plain::Octets octets(data, data + size);
  const plain::PlainDatagram read = plain::read_datagram(octets);
  someip::MessageCursor cursor{std::as_bytes(std::span{data, size})};
  std::size_t at = 0;
  while (const auto message = cursor.next()) {
    require(at < read.messages.size());
    const plain::PlainMessage& theirs = read.messages[at++];
    compare_header(message->header, theirs);
    require(same(message->payload, theirs.payload));
    compare_segment(*message, theirs);
    compare_discovery(*message, theirs);
  }
  require(at == read.messages.size() && cursor.offset() == read.end &&
          cursor.error().has_value() == (read.end != size));
  return 0;
}
