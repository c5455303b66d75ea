#pragma once
#include <string>

namespace trestle::test {

/// A configuration that uses every key, for tests that change or damage it.
inline const std::string good_config = R"(someip:
  address: 192.0.2.1
  interface: eth0
  sd:
    multicast: 239.1.2.3
    port: 30491
    initial_delay_min: 20 ms
    initial_delay_max: 0.2 s
    repetitions_base_delay: 40 ms
    repetitions_max: 4
    cyclic_offer_delay: 2 s
    request_response_delay_min: 5 ms
    request_response_delay_max: 15 ms
    ttl: 10 s
dds:
  domain: 7
  interfaces: [127.0.0.1, 192.0.2.7]
  shared_memory: true
  node: /front/trestle
  ros_distro: humble
types:
  paths: [/usr, .]
routes:
  - topic: /points
    type: sensor_msgs/msg/PointCloud2
    direction: dds_to_someip
    service: 0x1111
    instance: 0x0022
    eventgroup: 0x0033
    event: 0x8044
    major: 5
    minor: 6
    transport: udp
    port: 40001
    tp:
      segment_bytes: 1024
      burst: 16
      separation: 250 us
      max_message: 8 MiB
    wire:
      profile: commonapi
      byte_order: little
      length_order: big
      array_length: 16
      fixed_array_length: 8
      string_length: 8
      struct_length: 32
      union_length: 16
      union_type: 8
      union_order: type_first
      string_encoding: utf16be
      string_bom: false
      string_terminator: false
      alignment: 64
      union_null: true
      tagged_length: 16
      tagged_lengths: smallest
      longer_arrays: refuse
      missing_fields: default
      types:
        sensor_msgs/msg/PointField: {tags: {name: 0, offset: 0xfff}, fixed_strings: {name: 32}, byte_orders: {offset: big}, itself: {union_length: 8, union_type: 16, union_order: type_first, union_bytes: 9, selectors: [3, 5], struct_length: 32}, fields: {name: {string_length: 8, string_encoding: utf16le, string_bom: true, string_terminator: false}, count: {bits: 3}, offset: {array_length: 0, rules: builtin_interfaces/msg/Time#2}}}
        std_msgs/msg/Header: {form: union}
    qos:
      reliability: reliable
      durability: transient_local
      depth: 3
      history: keep_all
      deadline: 250 ms
      lifespan: 2 s
      liveliness: manual_by_topic
      liveliness_lease: 0.5 s
    multicast:
      address: 239.1.2.4
      port: 40100
      threshold: 3
  - topic: /target
    type: geometry_msgs/msg/Point
    direction: someip_to_dds
    service: 8738
    instance: 1
    eventgroup: 1
    event: 32769
)";

/// `text` with the first `from` replaced.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  return at == std::string::npos ? "there is no " + from : text.replace(at, from.size(), to);
}

}  // namespace trestle::test
